//! Foot points near known parameters: Newton steps completed with the Taylor polynomial of the surface.

use super::bezier::BezierPiece;
use super::derivs::SurfaceDerivs;
use super::newton::{Bounds, newton_step};
use super::surface::Surface;
use crate::{Vec2, Vec3};

/// A foot point near known parameters.
#[derive(Debug, Clone, Copy)]
pub struct NearFoot {
    /// Parameters; up to [`OUTSIDE_MAX_REL`] of a knot span outside the domain.
    pub uv: Vec2,
    /// Point [mm].
    pub point: Vec3,
    /// First derivative with respect to u, at the nearest parameters of the domain.
    pub su: Vec3,
    /// First derivative with respect to v, as `su`.
    pub sv: Vec3,
}

/// Maximum number of evaluations of the surface. Parameters that need more are no good start. Doubled: a failed search
/// costs twice as much before the search of the whole surface.
const EVALUATIONS_MAX: usize = 5;
/// Error of the foot point over its distance from the point at which the iteration ends. Doubled: shape errors with an
/// error of up to 0.2 %.
const DISTANCE_ERROR_REL: f64 = 1e-3;
/// Largest change of a tangent, over its length, in a step completed with the Taylor polynomial: normals are then within
/// half its square, 0.3 degrees. The tangent at a pole or apex is zero: beside it, steps are short.
const TANGENT_CHANGE_MAX: f64 = 0.1;
/// Longest step completed with the Taylor polynomial, over the knot span. Terms of third order over those of second
/// order are about as large.
const STEP_MAX_REL: f64 = 0.25;
/// Largest distance outside the knot span at which its Taylor polynomial holds, over the width of the span.
const OUTSIDE_MAX_REL: f64 = 0.05;
/// As [`OUTSIDE_MAX_REL`], at a knot inside the domain, where derivatives may jump.
const ACROSS_KNOT_MAX_REL: f64 = 1e-3;

impl Surface {
    /// The foot point of `p` that Newton's method reaches from `start` (clamped to the domain), on the surface or its
    /// continuation over the border of the domain. The last step is not evaluated: with the step `h` from the
    /// parameters x, `S(x + h) = S + S_i h_i + S_ij h_i h_j / 2`. The iteration ends when the estimate of its
    /// error is below `accuracy_mm` or 1e-3 of the distance. It is an estimate and no bound: audits of results evaluate the
    /// foot point.
    ///
    /// `None` where the distance is not convex or the iteration does not end.
    pub fn foot_near(&self, p: &Vec3, start: Vec2, accuracy_mm: f64) -> Option<NearFoot> {
        let (bounds, pieces) = (self.bounds(), self.projector());
        let mut x = start;
        for _ in 0..EVALUATIONS_MAX {
            x = bounds.clamp(x);
            let piece = pieces.piece_at(x)?;
            let d = piece.derivs_at(x);
            let r = d.s - p;
            let hessian = [
                d.su.norm_squared() + r.dot(&d.suu),
                d.su.dot(&d.sv) + r.dot(&d.suv),
                d.sv.norm_squared() + r.dot(&d.svv),
            ];
            let step = newton_step(hessian, Vec2::new(r.dot(&d.su), r.dot(&d.sv)), [false; 2])?;
            let (foot, error) = taylor(&d, x, step, &bounds);
            let allowed = accuracy_mm.max(DISTANCE_ERROR_REL * (foot.point - p).norm());
            if error <= allowed && holds_at(piece, &bounds, x, step) {
                return Some(foot);
            }
            x += step;
        }
        None
    }

    /// The domain.
    pub(super) fn bounds(&self) -> Bounds {
        let [u, v] = self.domain();
        Bounds { low: Vec2::new(u[0], v[0]), high: Vec2::new(u[1], v[1]) }
    }
}

/// True when the Taylor polynomial at `x` of a Bezier patch holds after `step`.
fn holds_at(piece: &BezierPiece, domain: &Bounds, x: Vec2, step: Vec2) -> bool {
    (0..2).all(|k| {
        let (low, high) = (piece.low[k], piece.high[k]);
        let room = |inside: bool| {
            (if inside { ACROSS_KNOT_MAX_REL } else { OUTSIDE_MAX_REL }) * (high - low)
        };
        let to = x[k] + step[k];
        step[k].abs() <= STEP_MAX_REL * (high - low)
            && to >= low - room(low > domain.low[k])
            && to <= high + room(high < domain.high[k])
    })
}

/// Foot point after `step` from `x` by the Taylor polynomial of second order, and an estimate of its error [mm].
/// The derivatives are those within the domain: beyond a pole they are reversed.
fn taylor(d: &SurfaceDerivs, x: Vec2, step: Vec2, domain: &Bounds) -> (NearFoot, f64) {
    let after = |step: Vec2| [d.suu * step.x + d.suv * step.y, d.suv * step.x + d.svv * step.y];
    let (du, dv, along) = (step.x, step.y, after(step));
    let inner = after(domain.clamp(x + step) - x);
    let (first, second) = (d.su * du + d.sv * dv, (along[0] * du + along[1] * dv) * 0.5);
    let point = d.s + first + second;
    let foot = NearFoot { uv: x + step, point, su: d.su + inner[0], sv: d.sv + inner[1] };
    (foot, truncation(d, step))
}

/// Estimated terms of third and higher order of the Taylor polynomial after `step` [mm]: `q rho` for the sum q of the lengths
/// of the terms of second order and the relative change `rho` of the tangents over the step. It is three times that of an
/// arc. Infinite above [`TANGENT_CHANGE_MAX`].
fn truncation(d: &SurfaceDerivs, step: Vec2) -> f64 {
    let (hu, hv) = (step.x.abs(), step.y.abs());
    let (uu, uv, vv) = (d.suu.norm(), d.suv.norm(), d.svv.norm());
    let change_u = (uu * hu + uv * hv) / d.su.norm();
    let change_v = (uv * hu + vv * hv) / d.sv.norm();
    let change = change_u.max(change_v);
    if change <= TANGENT_CHANGE_MAX {
        change * (0.5 * uu * hu * hu + uv * hu * hv + 0.5 * vv * hv * hv)
    } else {
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Frame;
    use crate::nurbs::Curve3;

    /// Points 0.05 mm off a fillet, with starts up to 10 degrees away: the foot point is within 1e-3 of that distance.
    #[test]
    fn the_distance_of_a_fillet_is_within_its_relative_error() {
        let tube = Frame { origin: Vec3::x() * 40.0, x: Vec3::x(), y: Vec3::z(), z: -Vec3::y() };
        let arc = Curve3::ellipse_arc(&tube, 7.0, 7.0, 0.0, 1.5);
        let torus = Surface::revolution(&arc, Vec3::zeros(), Vec3::z(), [0.0, 1.5]);
        let mut found = 0;
        for k in 0..400 {
            let at = Vec2::new(0.1 + 0.13 * f64::from(k % 10), 0.1 + 0.03 * f64::from(k / 10));
            let d = torus.derivs(at);
            let normal = d.su.cross(&d.sv).normalize();
            let p = d.s + normal * 0.05;
            let turn = f64::from(k);
            let start = at + Vec2::new(turn.sin(), turn.cos()) * 0.17;
            let Some(foot) = torus.foot_near(&p, start, 1e-9) else { continue };
            found += 1;
            let distance = (p - foot.point).dot(&foot.su.cross(&foot.sv).normalize());
            assert!((distance - 0.05).abs() < 1e-4, "{k}: {distance}");
            // Along the surface the error is that of the terms of second order.
            assert!((foot.point - d.s).norm() < 5e-3, "{k}: {}", (foot.point - d.s).norm());
        }
        assert!(found > 380, "{found}");
    }

    #[test]
    fn a_point_beyond_the_border_is_compared_with_the_continuation() {
        let arc = Curve3::ellipse_arc(&Frame::world(), 5.0, 5.0, 0.0, 1.2);
        let cylinder = Surface::extrusion(&arc, Vec3::z(), [0.0, 3.0]);
        let p = Vec3::new((-0.01f64).cos(), (-0.01f64).sin(), 0.0) * 5.02 + Vec3::z();
        let foot = cylinder.foot_near(&p, Vec2::new(0.02, 1.0), 1e-9).unwrap();
        assert!(foot.uv.x < 0.0 && ((foot.point - p).norm() - 0.02).abs() < 2e-5, "{foot:?}");
        let far = Vec3::new((-0.5f64).cos(), (-0.5f64).sin(), 0.0) * 5.02 + Vec3::z();
        assert!(cylinder.foot_near(&far, Vec2::new(0.02, 1.0), 1e-9).is_none());
    }
}
