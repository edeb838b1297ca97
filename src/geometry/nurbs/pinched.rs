//! Which way a surface faces, also where its derivatives vanish or have one direction.

use super::derivs::SurfaceDerivs;
use super::surface::Surface;
use crate::geometry::frame::unit;
use crate::geometry::{Vec2, Vec3};

/// Sine of the angle between the first derivatives below which a point may be pinched.
const PINCHED: f64 = 0.05;
/// It is where that sine is below this share of what it is a hundredth of the domain away.
const NOISE: f64 = 0.15;

/// Sine of the angle between the first derivatives of a surface that is a line there.
const LINE: f64 = 1e-9;
/// Rounding of coordinates, relative to their size, several operations on.
const COORDINATES: f64 = 1e-13;

impl Surface {
    /// Unit normal `su x sv / |.|`; at a pole, a collapsed edge or a pinched corner ([`Surface::is_pinched`]) its limit
    /// along the surface; where that is a line over a stretch of its parameters, what it has on the way to the middle of its
    /// domain. `None` where there is nothing but a line.
    #[must_use]
    pub fn normal(&self, uv: Vec2) -> Option<Vec3> {
        let inside = |share: f64| {
            let [u, v] = self.domain();
            self.limit_normal(uv + (Vec2::new(u[0] + u[1], v[0] + v[1]) * 0.5 - uv) * share)
        };
        self.limit_normal(uv).or_else(|| (-26..=0).find_map(|k| inside(2f64.powi(k))))
    }

    /// The normal there, or its limit on the way inwards.
    fn limit_normal(&self, uv: Vec2) -> Option<Vec3> {
        let d = self.derivs(uv);
        let n = d.su.cross(&d.sv);
        if let Some(limit) = self.pinched(uv, &d) {
            return unit(limit);
        }
        let [u, v] = self.domain();
        let (reach_u, reach_v) = (d.su.norm() * (u[1] - u[0]), d.sv.norm() * (v[1] - v[0]));
        // What the rounding of coordinates alone can make of derivatives and their products.
        let rounding = COORDINATES * d.s.abs().max();
        let [per_u, per_v] = [u, v].map(|range| range[1] - range[0]);
        let [per_u, per_v] = [self.count()[0] as f64 / per_u, self.count()[1] as f64 / per_v];
        let noise = rounding * (per_u * d.sv.norm() + per_v * d.su.norm());
        if n.norm() > noise.max(LINE * d.su.norm() * d.sv.norm())
            && reach_u.min(reach_v) > 1e-9 * reach_u.max(reach_v)
        {
            return unit(n);
        }
        // A collapsed side: the first term of su x sv that does not vanish on the way inwards.
        let inward =
            |t: f64, range: [f64; 2]| if 2.0 * t > range[0] + range[1] { -1.0 } else { 1.0 };
        let (there, limit) = if reach_u < reach_v {
            (d.sv, d.suv.cross(&d.sv) * inward(uv.y, v))
        } else {
            (d.su, d.su.cross(&d.suv) * inward(uv.x, u))
        };
        // Where the surface is a line over a stretch of its parameters, there is none.
        let noise = (rounding * per_u * per_v).max(LINE * d.suv.norm()) * there.norm();
        (limit.norm() > noise).then(|| unit(limit)).flatten()
    }

    /// Whether su and sv have one direction at `uv`, but for less than three degrees, and not a hundredth of the domain
    /// away: where two borders of a surface run smoothly on into each other (a ship's keel into its stem). What of
    /// `su x sv` is left there may be noise.
    #[must_use]
    pub fn is_pinched(&self, uv: Vec2) -> bool {
        self.pinched(uv, &self.derivs(uv)).is_some()
    }

    /// At a pinched point the direction of `su x sv` on the way from there to the middle of the domain.
    fn pinched(&self, uv: Vec2, d: &SurfaceDerivs) -> Option<Vec3> {
        let sine = |d: &SurfaceDerivs| d.su.cross(&d.sv).norm() / (d.su.norm() * d.sv.norm());
        let [u, v] = self.domain();
        let (reach_u, reach_v) = (d.su.norm() * (u[1] - u[0]), d.sv.norm() * (v[1] - v[0]));
        let here = sine(d);
        if here >= PINCHED || reach_u.min(reach_v) <= 1e-3 * reach_u.max(reach_v) {
            return None;
        }
        let way = Vec2::new(0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1])) - uv;
        let at = |share: f64| self.derivs(uv + way * share);
        let beside = sine(&at(0.01));
        if here > NOISE * beside || beside <= LINE {
            return None;
        }
        let near = at(1e-4);
        Some(near.su.cross(&near.sv) - d.su.cross(&d.sv))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter of a bowl `z = (x^2 + y^2) / 20` whose border runs through the corner of the parameters without a corner
    /// in space, but for `off`, which stands out of the bowl.
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
        assert!(surface.is_pinched(corner));
        let d = surface.derivs(corner);
        // What is left of the product is square to the bowl.
        let noise = d.su.cross(&d.sv).normalize();
        let normal = surface.normal(corner).unwrap();
        assert!(noise.z.abs() < 1e-9 && normal.z > 0.95, "{noise:?} {normal:?}");
        let beside = surface.normal(Vec2::repeat(0.05)).unwrap();
        assert!(normal.dot(&beside) > 0.97, "{normal:?} {beside:?}");
        // A surface that is slanted all over faces where its derivatives say.
        let corner = [[0.0, 0.0, 0.0], [10.0, 0.1, 0.0], [10.0, 0.0, 0.0], [20.0, 0.1, 0.0]];
        let points = corner.into_iter().map(Vec3::from).collect();
        let knots = vec![0.0, 0.0, 1.0, 1.0];
        let flat = Surface::try_new([1, 1], [knots.clone(), knots], points, None).unwrap();
        assert!(!flat.is_pinched(Vec2::zeros()));
    }
}
