//! Closed-form point projection onto the planes, quadrics and tori of faces, in the parameters of the face's B-spline.

use std::f64::consts::{PI, TAU};

use super::raw::RawSurface;
use kanagata_geometry::nurbs::Surface;
use kanagata_geometry::{Vec2, Vec3};

/// Distance from an axis or centre, relative to the radius, below which a point lies on it and its azimuth is
/// undefined.
const ON_AXIS_REL: f64 = 1e-12;
/// Tolerance on the ends of an angular range [rad]. Doubled: no visible effect, it only absorbs rounding.
const ANGLE_TOLERANCE_RAD: f64 = 1e-12;

/// The plane, quadric or torus of which a face's B-spline is an exact patch.
#[derive(Debug, Clone)]
pub struct Analytic {
    surface: RawSurface,
    /// Range of the angles along u and v; `None` where the parameter is a length.
    angles: [Option<[f64; 2]>; 2],
}

/// A foot point: squared distance [mm^2] and parameters of the face's B-spline.
pub(super) type Foot = (f64, Vec2);

impl Analytic {
    /// `angles` is the result of `Native::to_nurbs`. `None` for swept surfaces, splines and offsets.
    pub(super) fn new(surface: &RawSurface, angles: [Option<[f64; 2]>; 2]) -> Option<Self> {
        use RawSurface::{Cone, Cylinder, Plane, Sphere, Torus};
        let closed = matches!(
            surface,
            Plane(_) | Cylinder { .. } | Cone { .. } | Sphere { .. } | Torus { .. }
        );
        closed.then(|| Self { surface: surface.clone(), angles })
    }

    /// The plane, quadric or torus.
    pub(super) fn surface(&self) -> &RawSurface {
        &self.surface
    }

    /// Local minima of the distance over the unbounded surface that lie within the angular ranges and within the
    /// squared distance `limit` [mm^2]. Any other local minimum of a face lies on its boundary.
    pub(super) fn feet(&self, p: &Vec3, limit: f64) -> [Option<Foot>; 2] {
        match &self.surface {
            RawSurface::Plane(f) => {
                let l = f.local(p);
                [self.foot(l.z * l.z, limit, &|| Vec2::new(l.x, l.y)), None]
            }
            RawSurface::Cylinder { frame, radius } => {
                let l = frame.local(p);
                let r = l.x.hypot(l.y);
                let at = || Vec2::new(self.azimuth(&l, r, *radius), l.z);
                [self.foot((r - radius).powi(2), limit, &at), None]
            }
            RawSurface::Sphere { frame, radius } => {
                let l = frame.local(p);
                let r = l.x.hypot(l.y);
                let at = || {
                    let inside = l.norm() > ON_AXIS_REL * radius;
                    let v = if inside { l.z.atan2(r) } else { self.middle(1) };
                    Vec2::new(self.azimuth(&l, r, *radius), v)
                };
                [self.foot((l.norm() - radius).powi(2), limit, &at), None]
            }
            RawSurface::Cone { frame, radius, semi_angle } => {
                self.feet_on_cone(&frame.local(p), limit, *radius, *semi_angle)
            }
            RawSurface::Torus { frame, major, minor, .. } => {
                self.feet_on_torus(&frame.local(p), limit, *major, *minor)
            }
            _ => [None, None],
        }
    }

    /// The foot point at the given squared distance [mm^2] if that is at most `limit`; `at` supplies its angles and
    /// lengths.
    fn foot(&self, distance: f64, limit: f64, at: &dyn Fn() -> Vec2) -> Option<Foot> {
        let uv = (distance <= limit).then(|| self.parameters(at()))?;
        Some((distance, uv?))
    }

    /// Foot points of the local point `l` [mm] on the generators on both sides of a cone's axis.
    fn feet_on_cone(
        &self,
        l: &Vec3,
        limit: f64,
        radius: f64,
        semi_angle: f64,
    ) -> [Option<Foot>; 2] {
        let t = semi_angle.tan();
        let r = l.x.hypot(l.y);
        let u = self.azimuth(l, r, radius.abs() + l.z.abs());
        [(r, 0.0), (-r, PI)].map(|(r, half)| {
            // Foot point on the generator, restricted to its own nappe or the apex.
            let mut v = ((r - radius) * t + l.z) / (1.0 + t * t);
            if (radius + v * t) * (1.0 - half) < 0.0 {
                v = -radius / t;
            }
            let distance = (radius + v * t - r).powi(2) + (v - l.z).powi(2);
            self.foot(distance, limit, &|| Vec2::new(u + half, v))
        })
    }

    /// Foot points of the local point `l` [mm] on the meridian circles on both sides of a torus' axis.
    fn feet_on_torus(&self, l: &Vec3, limit: f64, major: f64, minor: f64) -> [Option<Foot>; 2] {
        let r = l.x.hypot(l.y);
        let u = self.azimuth(l, r, major);
        let spindle = minor > major;
        [(r, 0.0), (-r, PI)].map(|(r, half)| {
            if half > 0.0 && !spindle {
                return None;
            }
            let (x, z) = (r - major, l.z);
            let centre = x.hypot(z) <= ON_AXIS_REL * minor;
            let mut v = if centre { self.middle(1) } else { z.atan2(x) };
            let mut distance = (x.hypot(z) - minor).powi(2);
            if spindle && (major + minor * v.cos()) * (1.0 - half) < 0.0 {
                // Beyond the axis: the closer cusp of the spindle torus.
                v = (-major / minor).acos().copysign(z);
                distance = r * r + (minor * v.sin() - z).powi(2);
            }
            self.foot(distance, limit, &|| Vec2::new(u + half, v))
        })
    }

    /// Azimuth about the axis; the middle of the range for a point on the axis.
    fn azimuth(&self, l: &Vec3, r: f64, size: f64) -> f64 {
        if r > ON_AXIS_REL * size { l.y.atan2(l.x) } else { self.middle(0) }
    }

    fn middle(&self, k: usize) -> f64 {
        self.angles[k].map_or(0.0, |[a, b]| 0.5 * (a + b))
    }

    /// Maps angles and lengths to parameters of the B-spline; `None` outside the angular ranges.
    fn parameters(&self, mut uv: Vec2) -> Option<Vec2> {
        for k in 0..2 {
            let Some([low, high]) = self.angles[k] else { continue };
            let mut angle = uv[k] + TAU * ((low - ANGLE_TOLERANCE_RAD - uv[k]) / TAU).ceil();
            if angle > high + ANGLE_TOLERANCE_RAD {
                return None;
            }
            angle = angle.clamp(low, high);
            uv[k] = Surface::arc_parameter_of_angle([low, high], angle);
        }
        Some(uv)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::native::Native;
    use kanagata_geometry::Frame;

    fn frame() -> Frame {
        Frame::from_z_x(Vec3::new(1.0, -2.0, 0.5), Vec3::new(0.3, 0.4, 1.0), Vec3::x()).unwrap()
    }

    /// Smallest squared distance of the foot points in the range, and of a dense grid on the B-spline.
    fn smallest_distances(surface: &RawSurface, range: [[f64; 2]; 2], p: &Vec3) -> [f64; 2] {
        let native = Native::new(surface);
        let (spline, angles) = native.to_nurbs(range);
        let analytic = Analytic::new(surface, angles).unwrap();
        let feet = analytic.feet(p, f64::INFINITY);
        let inside = |f: &Foot| {
            (0..2).all(|k| angles[k].is_some() || (f.1[k] >= range[k][0] && f.1[k] <= range[k][1]))
        };
        let mut best = f64::INFINITY;
        for foot in feet.iter().flatten().filter(|f| inside(f)) {
            let off = (spline.point(foot.1) - p).norm() - foot.0.sqrt();
            assert!(off.abs() < 1e-12, "the foot is where it says: {off:e}");
            best = best.min(foot.0);
        }
        let at =
            |k: usize, i: u32| range[k][0] + (range[k][1] - range[k][0]) * f64::from(i) / 240.0;
        let mut dense = f64::INFINITY;
        for (i, j) in (0..=240).flat_map(|i| (0..=240).map(move |j| (i, j))) {
            let q = native.point(Vec2::new(at(0, i), at(1, j)));
            dense = dense.min((q - p).norm_squared());
        }
        [best.sqrt(), dense.sqrt()]
    }

    #[test]
    fn feet_of_whole_surfaces_are_the_nearest_points() {
        let (frame, full) = (frame(), [0.0, TAU]);
        let half = [-0.5 * PI, 0.5 * PI];
        let torus =
            |major: f64, minor: f64| RawSurface::Torus { frame, major, minor, keep_outer: None };
        let cases = [
            (RawSurface::Plane(frame), [[-9.0, 9.0]; 2]),
            (RawSurface::Cylinder { frame, radius: 2.0 }, [full, [-9.0, 9.0]]),
            (RawSurface::Cone { frame, radius: 1.0, semi_angle: 0.6 }, [full, [-9.0, 9.0]]),
            (RawSurface::Cone { frame, radius: 0.0, semi_angle: -0.3 }, [full, [-9.0, 9.0]]),
            (RawSurface::Sphere { frame, radius: 2.5 }, [full, half]),
            (torus(3.0, 1.0), [full, full]),
            (torus(1.0, 2.0), [full, full]),
        ];
        let mut seed = 3u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            8.0 * ((seed >> 33) as f64 / (1u64 << 31) as f64) - 4.0
        };
        for (surface, range) in cases {
            for _ in 0..12 {
                let p = Vec3::new(random(), random(), random());
                let [found, dense] = smallest_distances(&surface, range, &p);
                assert!(
                    found <= dense + 1e-12 && dense <= found + 0.2,
                    "{surface:?} {p}: {found} {dense}"
                );
            }
            // On the axis and at the centre, where the foot point is not unique.
            for z in [0.0, 1.0] {
                let [found, dense] =
                    smallest_distances(&surface, range, &frame.point(&Vec3::new(0.0, 0.0, z)));
                assert!(
                    found <= dense + 1e-12 && dense <= found + 0.2,
                    "{surface:?}: {found} {dense}"
                );
            }
        }
    }

    #[test]
    fn parts_of_a_spindle_torus_have_their_own_feet() {
        let torus = RawSurface::Torus { frame: frame(), major: 1.0, minor: 2.0, keep_outer: None };
        let cusp = (-0.5f64).acos();
        let mut seed = 11u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            6.0 * ((seed >> 33) as f64 / (1u64 << 31) as f64) - 3.0
        };
        for range in [[-cusp, cusp], [cusp, TAU - cusp]] {
            for _ in 0..20 {
                let p = Vec3::new(random(), random(), random());
                let [found, dense] = smallest_distances(&torus, [[0.0, TAU], range], &p);
                assert!(
                    found <= dense + 1e-12 && dense <= found + 0.1,
                    "{range:?} {p}: {found} {dense}"
                );
            }
        }
    }
}
