//! Surface normals, including singular points where the first derivatives vanish or are parallel.

use super::derivs::SurfaceDerivs;
use super::surface::Surface;
use crate::frame::unit;
use crate::{Vec2, Vec3};

/// Sine of the angle between the first derivatives below which a point may be a degenerate corner. 0.05 is about three
/// degrees.
const DEGENERATE_SINE_MAX: f64 = 0.05;
/// Ratio of that sine to the sine at 1 % of the domain away, below which the corner is degenerate.
const DEGENERATE_SINE_RATIO: f64 = 0.15;

/// Sine of the angle between the first derivatives below which the surface has degenerated to a curve.
const SINGULAR_SINE: f64 = 1e-9;
/// Relative rounding error of coordinates after several operations.
const COORDINATE_ROUNDING_REL: f64 = 1e-13;

impl Surface {
    /// Unit normal `su x sv / |su x sv|`.
    ///
    /// At a pole, a collapsed edge or a degenerate corner ([`Surface::has_degenerate_corner`]) the limit along the
    /// surface is returned. If the surface is degenerate over a range of parameters, the normal is taken on the
    /// straight line towards the middle of the domain. `None` where the whole surface degenerates to a curve.
    #[must_use]
    pub fn normal(&self, uv: Vec2) -> Option<Vec3> {
        let inside = |fraction: f64| {
            let [u, v] = self.domain();
            self.limit_normal(uv + (Vec2::new(u[0] + u[1], v[0] + v[1]) * 0.5 - uv) * fraction)
        };
        self.limit_normal(uv).or_else(|| (-26..=0).find_map(|k| inside(2f64.powi(k))))
    }

    /// The normal at `uv`, or its limit towards the interior.
    fn limit_normal(&self, uv: Vec2) -> Option<Vec3> {
        let d = self.derivs(uv);
        let n = d.su.cross(&d.sv);
        if let Some(limit) = self.degenerate_normal(uv, &d) {
            return unit(limit);
        }
        let [u, v] = self.domain();
        let (reach_u, reach_v) = (d.su.norm() * (u[1] - u[0]), d.sv.norm() * (v[1] - v[0]));
        // Rounding error of derivatives and their products due to the coordinates.
        let rounding = COORDINATE_ROUNDING_REL * d.s.abs().max();
        let [per_u, per_v] = [u, v].map(|range| range[1] - range[0]);
        let [per_u, per_v] = [self.count()[0] as f64 / per_u, self.count()[1] as f64 / per_v];
        let noise = rounding * (per_u * d.sv.norm() + per_v * d.su.norm());
        if n.norm() > noise.max(SINGULAR_SINE * d.su.norm() * d.sv.norm())
            && reach_u.min(reach_v) > 1e-9 * reach_u.max(reach_v)
        {
            return unit(n);
        }
        // Collapsed edge: the first non-vanishing term of the Taylor expansion of su x sv towards the interior.
        let inward =
            |t: f64, range: [f64; 2]| if 2.0 * t > range[0] + range[1] { -1.0 } else { 1.0 };
        let (there, limit) = if reach_u < reach_v {
            (d.sv, d.suv.cross(&d.sv) * inward(uv.y, v))
        } else {
            (d.su, d.su.cross(&d.suv) * inward(uv.x, u))
        };
        // No normal where the surface degenerates to a curve over a range of parameters.
        let noise = (rounding * per_u * per_v).max(SINGULAR_SINE * d.suv.norm()) * there.norm();
        (limit.norm() > noise).then(|| unit(limit)).flatten()
    }

    /// True where su and sv are parallel to within three degrees at `uv`, but not 1 % of the domain away. This happens
    /// where two boundary curves join tangentially (a ship's keel and stem). The remaining `su x sv` may be noise.
    #[must_use]
    pub fn has_degenerate_corner(&self, uv: Vec2) -> bool {
        self.degenerate_normal(uv, &self.derivs(uv)).is_some()
    }

    /// Direction of `su x sv` at a degenerate corner, taken on the line towards the middle of the domain.
    fn degenerate_normal(&self, uv: Vec2, d: &SurfaceDerivs) -> Option<Vec3> {
        let sine = |d: &SurfaceDerivs| d.su.cross(&d.sv).norm() / (d.su.norm() * d.sv.norm());
        let [u, v] = self.domain();
        let (reach_u, reach_v) = (d.su.norm() * (u[1] - u[0]), d.sv.norm() * (v[1] - v[0]));
        let here = sine(d);
        if here >= DEGENERATE_SINE_MAX || reach_u.min(reach_v) <= 1e-3 * reach_u.max(reach_v) {
            return None;
        }
        let towards_middle = Vec2::new(0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1])) - uv;
        let at = |fraction: f64| self.derivs(uv + towards_middle * fraction);
        let beside = sine(&at(0.01));
        if here > DEGENERATE_SINE_RATIO * beside || beside <= SINGULAR_SINE {
            return None;
        }
        let near = at(1e-4);
        Some(near.su.cross(&near.sv) - d.su.cross(&d.sv))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter of a paraboloid `z = (x^2 + y^2) / 20` with a smooth boundary through the corner of the parameter
    /// domain, except for the deviation `off` from the paraboloid.
    fn bow(off: f64) -> Surface {
        let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
        let plane = [
            [[0.0, 0.0], [-1.0, 0.0], [-2.0, 2.0]],
            [[1.0, 0.0], [0.0, 2.0], [-1.0, 3.0]],
            [[2.0, 2.0], [1.0, 3.0], [0.0, 4.0]],
        ];
        let mut points: Vec<Vec3> = Vec::new();
        for [x, y] in plane.into_iter().flatten() {
            points.push(Vec3::new(x, y, (x * x + y * y) / 20.0));
        }
        points[3].z = 0.0;
        points[1] = Vec3::new(-1.0, 0.0, off);
        Surface::try_new([2, 2], [knots.clone(), knots], points, None).unwrap()
    }

    #[test]
    fn a_pinched_corner_faces_where_its_surroundings_do() {
        let surface = bow(1e-3);
        let corner = Vec2::zeros();
        assert!(surface.has_degenerate_corner(corner));
        let d = surface.derivs(corner);
        // The remaining product is normal to the paraboloid.
        let noise = d.su.cross(&d.sv).normalize();
        let normal = surface.normal(corner).unwrap();
        assert!(noise.z.abs() < 1e-9 && normal.z > 0.95, "{noise:?} {normal:?}");
        let beside = surface.normal(Vec2::repeat(0.05)).unwrap();
        assert!(normal.dot(&beside) > 0.97, "{normal:?} {beside:?}");
        // A surface with oblique derivatives everywhere has the normal given by its derivatives.
        let corner = [[0.0, 0.0, 0.0], [10.0, 0.1, 0.0], [10.0, 0.0, 0.0], [20.0, 0.1, 0.0]];
        let points = corner.into_iter().map(Vec3::from).collect();
        let knots = vec![0.0, 0.0, 1.0, 1.0];
        let flat = Surface::try_new([1, 1], [knots.clone(), knots], points, None).unwrap();
        assert!(!flat.has_degenerate_corner(Vec2::zeros()));
    }
}
