//! A face's surface with the parameters its file uses: evaluation, inverse, periods, and the exact step to a
//! rational B-spline on the range the loops need.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::model::SurfaceKind;
use super::raw::RawSurface;
use crate::geometry::nurbs::{Curve2, Curve3, Surface};
use crate::geometry::{Frame, Vec2, Vec3};

/// A surface in native parameters, ready for evaluation.
pub(super) struct Native<'a> {
    raw: &'a RawSurface,
    /// Whole surface where it has a natural range (sweeps, splines), in (angle, curve) or spline parameters.
    whole: Option<Surface>,
    /// Angle range of `whole`, for revolutions.
    angles: [f64; 2],
}

impl<'a> Native<'a> {
    pub fn new(raw: &'a RawSurface) -> Self {
        let mut angles = [0.0, TAU];
        let whole = match raw {
            RawSurface::Nurbs(s) => Some(s.clone()),
            RawSurface::Revolution { generatrix, origin, axis, angles: given, .. } => {
                angles = given.unwrap_or(angles);
                Some(Surface::revolution(generatrix, *origin, *axis, angles))
            }
            RawSurface::Extrusion { directrix, direction, range } => {
                Some(Surface::extrusion(directrix, *direction, range.unwrap_or([0.0, 1.0])))
            }
            _ => None,
        };
        Self { raw, whole, angles }
    }

    pub fn kind(&self) -> SurfaceKind {
        match self.raw {
            RawSurface::Plane(_) => SurfaceKind::Plane,
            RawSurface::Cylinder { .. } => SurfaceKind::Cylinder,
            RawSurface::Cone { .. } => SurfaceKind::Cone,
            RawSurface::Sphere { .. } => SurfaceKind::Sphere,
            RawSurface::Torus { .. } => SurfaceKind::Torus,
            RawSurface::Revolution { .. } => SurfaceKind::Revolution,
            RawSurface::Extrusion { .. } => SurfaceKind::Extrusion,
            RawSurface::Nurbs(_) => SurfaceKind::Nurbs,
            RawSurface::Offset { .. } => SurfaceKind::Offset,
        }
    }

    /// The native parameters are (curve, angle): ours exchanged, so the normal turns round.
    pub fn swapped(&self) -> bool {
        matches!(self.raw, RawSurface::Revolution { curve_first: true, .. })
    }

    /// A parameter curve of the file in our order, on a sphere moved by whole turns between the poles.
    pub fn normalised(&self, path: &Curve2) -> Curve2 {
        let path = path.mapped(|uv| self.order(uv));
        if !matches!(self.raw, RawSurface::Sphere { .. }) {
            return path;
        }
        let [a, b] = path.domain();
        let turns = (path.point(0.5 * (a + b)).y / TAU).round() * TAU;
        path.mapped(|uv| uv - Vec2::new(0.0, turns))
    }

    /// Native parameters of the file in our order: (angle, curve) for revolutions.
    pub fn order(&self, uv: Vec2) -> Vec2 {
        if self.swapped() { Vec2::new(uv.y, uv.x) } else { uv }
    }

    /// Period along u and v (in our order); `None` where the surface does not close.
    pub fn periods(&self) -> [Option<f64>; 2] {
        match self.raw {
            RawSurface::Cylinder { .. } | RawSurface::Cone { .. } | RawSurface::Sphere { .. } => {
                [Some(TAU), None]
            }
            RawSurface::Torus { .. } => [Some(TAU), Some(TAU)],
            RawSurface::Plane(_) | RawSurface::Offset { .. } => [None, None],
            RawSurface::Revolution { .. } | RawSurface::Extrusion { .. } | RawSurface::Nurbs(_) => {
                self.whole.as_ref().map_or([None, None], |s| {
                    let closed = closed_directions(s);
                    let [u, v] = s.domain();
                    let mut periods =
                        [closed[0].then_some(u[1] - u[0]), closed[1].then_some(v[1] - v[0])];
                    if matches!(self.raw, RawSurface::Revolution { .. }) {
                        periods[0] = Some(TAU);
                    }
                    periods
                })
            }
        }
    }

    /// Point at native parameters (our order), which may lie beyond a period.
    pub fn point(&self, uv: Vec2) -> Vec3 {
        let (u, v) = (uv.x, uv.y);
        let ring = |f: &Frame, r: f64, z: f64| f.point(&Vec3::new(r * u.cos(), r * u.sin(), z));
        match self.raw {
            RawSurface::Plane(f) => f.point(&Vec3::new(u, v, 0.0)),
            RawSurface::Cylinder { frame, radius } => ring(frame, *radius, v),
            RawSurface::Cone { frame, radius, semi_angle } => {
                ring(frame, radius + v * semi_angle.tan(), v)
            }
            RawSurface::Sphere { frame, radius } => ring(frame, radius * v.cos(), radius * v.sin()),
            RawSurface::Torus { frame, major, minor, .. } => {
                ring(frame, major + minor * v.cos(), minor * v.sin())
            }
            RawSurface::Revolution { generatrix, origin, axis, .. } => {
                let p = generatrix.point(v);
                let center = origin + axis * axis.dot(&(p - origin));
                let x = p - center;
                center + x * u.cos() + axis.cross(&x) * u.sin()
            }
            RawSurface::Extrusion { directrix, direction, .. } => {
                directrix.point(self.wrap(uv).x) + direction * v
            }
            RawSurface::Nurbs(s) => s.point(self.wrap(uv)),
            RawSurface::Offset { base, distance } => offset_point(base, *distance, uv),
        }
    }

    /// Moves spline parameters by whole periods into the domain.
    fn wrap(&self, uv: Vec2) -> Vec2 {
        let Some(s) = &self.whole else { return uv };
        let mut out = uv;
        for (k, (range, period)) in s.domain().into_iter().zip(self.periods()).enumerate() {
            if let Some(p) = period {
                let slack = 1e-9 * p;
                while out[k] > range[1] + slack {
                    out[k] -= p;
                }
                while out[k] < range[0] - slack {
                    out[k] += p;
                }
            }
        }
        out
    }

    /// Parameters (our order) of the point of the surface nearest to `p`, chosen nearest to `hint` among
    /// equivalent ones.
    pub fn inverse(&self, p: &Vec3, hint: Option<Vec2>) -> Vec2 {
        let mut uv = self.inverse_once(p, hint);
        if let Some(h) = hint {
            for (k, period) in self.periods().into_iter().enumerate() {
                if let Some(period) = period {
                    uv[k] += period * ((h[k] - uv[k]) / period).round();
                }
            }
        }
        uv
    }

    fn inverse_once(&self, p: &Vec3, hint: Option<Vec2>) -> Vec2 {
        let hint_u = hint.map_or(0.0, |h| h.x);
        // The angle about an axis; on the axis itself, the hint's.
        let turn = |x: f64, y: f64, size: f64| {
            if x.hypot(y) > 1e-9 * size { y.atan2(x) } else { hint_u }
        };
        match self.raw {
            RawSurface::Plane(f) => {
                let l = f.local(p);
                Vec2::new(l.x, l.y)
            }
            RawSurface::Cylinder { frame, radius } => {
                let l = frame.local(p);
                Vec2::new(turn(l.x, l.y, *radius), l.z)
            }
            RawSurface::Cone { frame, radius, semi_angle } => {
                let l = frame.local(p);
                let t = semi_angle.tan();
                let r = l.x.hypot(l.y);
                // Foot on the generator in the half plane of the point.
                let v = ((r - radius) * t + l.z) / (1.0 + t * t);
                Vec2::new(turn(l.x, l.y, radius.abs() + l.z.abs()), v)
            }
            RawSurface::Sphere { frame, radius } => {
                let l = frame.local(p);
                Vec2::new(turn(l.x, l.y, *radius), l.z.atan2(l.x.hypot(l.y)))
            }
            RawSurface::Torus { frame, major, minor, .. } => {
                torus_inverse(&frame.local(p), *major, *minor, hint)
            }
            RawSurface::Revolution { generatrix, origin, axis, .. } => {
                revolution_inverse(p, (generatrix, origin, axis), hint, self)
            }
            RawSurface::Extrusion { directrix, direction, .. } => {
                extrusion_inverse(p, directrix, direction)
            }
            RawSurface::Nurbs(s) => match hint {
                Some(h) => s.closest_near(p, self.wrap(h)).0,
                None => s.closest(p).0,
            },
            RawSurface::Offset { base, .. } => Native::new(base).inverse(p, hint),
        }
    }

    /// Native v (u) lines that shrink to a point: (parameter index, value).
    pub fn poles(&self) -> Vec<(usize, f64)> {
        match self.raw {
            RawSurface::Sphere { .. } => vec![(1, -FRAC_PI_2), (1, FRAC_PI_2)],
            RawSurface::Cone { radius, semi_angle, .. } => vec![(1, -radius / semi_angle.tan())],
            RawSurface::Plane(_) | RawSurface::Cylinder { .. } | RawSurface::Offset { .. } => {
                vec![]
            }
            RawSurface::Torus { major, minor, .. } => {
                if minor > major {
                    let a = (-major / minor).acos();
                    vec![(1, a), (1, -a), (1, TAU - a)]
                } else {
                    vec![]
                }
            }
            _ => self.whole.as_ref().map_or_else(Vec::new, collapsed_sides),
        }
    }

    /// Natural ranges of a whole surface (our order); `None` for an unbounded one.
    pub fn natural_range(&self) -> Option<[[f64; 2]; 2]> {
        match self.raw {
            RawSurface::Sphere { .. } => Some([[0.0, TAU], [-FRAC_PI_2, FRAC_PI_2]]),
            RawSurface::Torus { major, minor, keep_outer, .. } if minor > major => {
                let a = (-major / minor).acos();
                match keep_outer {
                    Some(false) => Some([[0.0, TAU], [a, TAU - a]]),
                    Some(true) => Some([[0.0, TAU], [-a, a]]),
                    None => Some([[0.0, TAU], [0.0, TAU]]),
                }
            }
            RawSurface::Torus { .. } => Some([[0.0, TAU], [0.0, TAU]]),
            RawSurface::Extrusion { range: None, .. } => None,
            _ => self.whole.as_ref().map(Surface::domain),
        }
    }

    /// Rational B-spline on the native range (our order), and the angle ranges of u and v where the parameter
    /// of that B-spline differs from the angle inside a span.
    pub fn to_nurbs(&self, range: [[f64; 2]; 2]) -> (Surface, [Option<[f64; 2]>; 2]) {
        let [u, v] = range;
        let plane_of = |f: &Frame| Frame { origin: f.origin, x: f.x, y: f.z, z: -f.y };
        match self.raw {
            RawSurface::Plane(f) => (Surface::plane(f, u, v), [None, None]),
            RawSurface::Cylinder { frame, radius } => {
                let at = |z: f64| frame.point(&Vec3::new(*radius, 0.0, z));
                (revolve(&line(at, v), frame, u), [Some(u), None])
            }
            RawSurface::Cone { frame, radius, semi_angle } => {
                let at = |z: f64| frame.point(&Vec3::new(radius + z * semi_angle.tan(), 0.0, z));
                (revolve(&line(at, v), frame, u), [Some(u), None])
            }
            RawSurface::Sphere { frame, radius } => {
                let arc = Curve3::ellipse_arc(&plane_of(frame), *radius, *radius, v[0], v[1]);
                (revolve(&arc, frame, u), [Some(u), Some(v)])
            }
            RawSurface::Torus { frame, major, minor, .. } => {
                let mut tube = plane_of(frame);
                tube.origin += frame.x * *major;
                let arc = Curve3::ellipse_arc(&tube, *minor, *minor, v[0], v[1]);
                (revolve(&arc, frame, u), [Some(u), Some(v)])
            }
            RawSurface::Revolution { generatrix, origin, axis, .. } => {
                let piece = generatrix.trimmed(v[0], v[1]).unwrap_or_else(|_| generatrix.clone());
                (Surface::revolution(&piece, *origin, *axis, u), [Some(u), None])
            }
            RawSurface::Extrusion { directrix, direction, .. } => {
                (Surface::extrusion(directrix, *direction, v), [None, None])
            }
            RawSurface::Nurbs(s) => (s.clone(), [None, None]),
            RawSurface::Offset { .. } => {
                let frame = Frame::world();
                (Surface::plane(&frame, u, v), [None, None])
            }
        }
    }
}

fn line(at: impl Fn(f64) -> Vec3, v: [f64; 2]) -> Curve3 {
    Curve3::line(at(v[0]), at(v[1])).on_domain(v[0], v[1])
}

fn revolve(generatrix: &Curve3, frame: &Frame, u: [f64; 2]) -> Surface {
    Surface::revolution(generatrix, frame.origin, frame.z, u)
}

fn offset_point(base: &RawSurface, distance: f64, uv: Vec2) -> Vec3 {
    let native = Native::new(base);
    let h = 1e-6;
    let (du, dv) = (Vec2::new(h, 0.0), Vec2::new(0.0, h));
    let su = native.point(uv + du) - native.point(uv - du);
    let sv = native.point(uv + dv) - native.point(uv - dv);
    let normal = crate::geometry::frame::unit(su.cross(&sv)).unwrap_or_else(Vec3::zeros);
    native.point(uv) + normal * distance
}

/// Which directions of a surface close on themselves in space.
fn closed_directions(s: &Surface) -> [bool; 2] {
    let [nu, nv] = s.count();
    let size = crate::geometry::Aabb::of_points(s.points()).diagonal();
    let near = |a: usize, b: usize| (s.points()[a] - s.points()[b]).norm() <= 1e-9 * size;
    let clamped = |k: usize| {
        let (knots, p) = (s.knots()[k], s.degrees()[k]);
        knots[0] == knots[p] && knots[knots.len() - 1] == knots[knots.len() - 1 - p]
    };
    let u = clamped(0) && (0..nv).all(|j| near(j, (nu - 1) * nv + j));
    let v = clamped(1) && (0..nu).all(|i| near(i * nv, i * nv + nv - 1));
    [u, v]
}

/// Sides of a surface that are one point in space.
fn collapsed_sides(s: &Surface) -> Vec<(usize, f64)> {
    let [u, v] = s.domain();
    let size = crate::geometry::Aabb::of_points(s.points()).diagonal();
    let collapsed = |at: &dyn Fn(f64) -> Vec2| {
        let first = s.point(at(0.0));
        (1..=8).all(|k| (s.point(at(f64::from(k) / 8.0)) - first).norm() <= 1e-9 * size)
    };
    let along = |r: [f64; 2], t: f64| r[0] + (r[1] - r[0]) * t;
    let mut sides = Vec::new();
    for end in [0, 1] {
        if collapsed(&|t| Vec2::new(u[end], along(v, t))) {
            sides.push((0, u[end]));
        }
        if collapsed(&|t| Vec2::new(along(u, t), v[end])) {
            sides.push((1, v[end]));
        }
    }
    sides
}

/// Nearest point of a torus; a spindle torus has feet on both half circles of the plane through the point, and
/// the hint says which is meant.
fn torus_inverse(l: &Vec3, major: f64, minor: f64, hint: Option<Vec2>) -> Vec2 {
    let r = l.x.hypot(l.y);
    let u = if r > 1e-9 * major.max(minor) { l.y.atan2(l.x) } else { hint.map_or(0.0, |h| h.x) };
    let near = Vec2::new(u, l.z.atan2(r - major));
    if minor <= major {
        return near;
    }
    let far = Vec2::new(u + std::f64::consts::PI, l.z.atan2(-r - major));
    let miss = |uv: &Vec2, r: f64| ((r - major).hypot(l.z) - minor).abs() + 0.0 * uv.x;
    let (near_miss, far_miss) = (miss(&near, r), miss(&far, -r));
    if far_miss < near_miss - 1e-9 * minor { far } else { near }
}

fn revolution_inverse(
    p: &Vec3,
    (generatrix, origin, axis): (&Curve3, &Vec3, &Vec3),
    hint: Option<Vec2>,
    native: &Native<'_>,
) -> Vec2 {
    // Turn the point into the half plane of the generatrix by the angle between their radii, refined with
    // the curve's own foot because the generatrix need not lie in one half plane.
    let radius = |q: &Vec3| q - (origin + axis * axis.dot(&(q - origin)));
    let target = radius(p);
    let size = target.norm();
    let mut v = hint.map(|h| h.y);
    let mut u = hint.map_or(0.0, |h| h.x);
    for _ in 0..50 {
        let start = v.unwrap_or_else(|| {
            let reference = radius(
                &generatrix.point(generatrix.closest(&(origin + axis * axis.dot(&(p - origin)))).0),
            );
            let _ = reference;
            generatrix.domain()[0]
        });
        let x = radius(&generatrix.point(start));
        if size > 1e-12 && x.norm() > 1e-9 * size.max(1e-300) {
            u = axis.dot(&x.cross(&target)).atan2(x.dot(&target));
        }
        let turned = turn_about(p, origin, axis, -u);
        let next = generatrix.closest(&turned).0;
        let done = v.is_some_and(|old| (old - next).abs() <= 1e-14 * (1.0 + next.abs()));
        v = Some(next);
        if done {
            break;
        }
    }
    let range = native.angles;
    let v = v.unwrap_or(generatrix.domain()[0]);
    if hint.is_none() {
        while u < range[0] - 1e-9 {
            u += TAU;
        }
        while u > range[1] + 1e-9 && u - TAU >= range[0] - 1e-9 {
            u -= TAU;
        }
    }
    Vec2::new(u, v)
}

fn turn_about(p: &Vec3, origin: &Vec3, axis: &Vec3, angle: f64) -> Vec3 {
    let center = origin + axis * axis.dot(&(p - origin));
    let x = p - center;
    center + x * angle.cos() + axis.cross(&x) * angle.sin()
}

/// Foot on the cylinder over the directrix: the directrix is projected along the direction first.
fn extrusion_inverse(p: &Vec3, directrix: &Curve3, direction: &Vec3) -> Vec2 {
    let d2 = direction.norm_squared();
    let flatten = crate::geometry::Affine {
        linear: crate::geometry::Mat3::identity() - direction * direction.transpose() / d2,
        shift: Vec3::zeros(),
    };
    let flat = directrix.transformed(&flatten);
    let u = flat.closest(&flatten.point(p)).0;
    let v = direction.dot(&(p - directrix.point(u))) / d2;
    Vec2::new(u, v)
}
