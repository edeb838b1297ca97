//! A face's surface in the parameters of its file: evaluation, inversion, periods, and exact conversion to a rational
//! B-spline on a given range.

use std::borrow::Cow;
use std::cell::OnceCell;
use std::f64::consts::{FRAC_PI_2, TAU};

use super::model::SurfaceKind;
use super::raw::RawSurface;
use kanagata_geometry::nurbs::{Curve2, Curve3, Surface, SurfaceDerivs};
use kanagata_geometry::{Frame, Vec2, Vec3};

/// Distance between opposite boundaries relative to the size of the surface below which they form a seam.
const SEAM_TOLERANCE_REL: f64 = 1e-7;
/// Excess of a parameter over its range, relative to the range, that is attributed to rounding.
const ROUNDING_REL: f64 = 1e-9;

/// A surface in native parameters, prepared for evaluation. An offset is represented by its base; `build` replaces
/// offsets beforehand.
pub(super) struct Native<'a> {
    raw: &'a RawSurface,
    /// Whole surface where it has a natural range (swept surfaces, splines), in (angle, curve) or spline parameters.
    whole: Option<Cow<'a, Surface>>,
    /// Period along u and v (internal order); `None` where the surface is not closed.
    periods: [Option<f64>; 2],
    samples: OnceCell<Vec<(Vec2, Vec3)>>,
}

impl<'a> Native<'a> {
    pub fn new(mut raw: &'a RawSurface) -> Self {
        while let RawSurface::Offset { base, .. } = raw {
            raw = base;
        }
        let whole = match raw {
            RawSurface::Nurbs(s) => Some(Cow::Borrowed(s)),
            RawSurface::Revolution { generatrix, origin, axis, angles, .. } => {
                let angles = angles.unwrap_or([0.0, TAU]);
                Some(Cow::Owned(Surface::revolution(generatrix, *origin, *axis, angles)))
            }
            RawSurface::Extrusion { directrix, direction, range } => {
                let range = range.unwrap_or([0.0, 1.0]);
                Some(Cow::Owned(Surface::extrusion(directrix, *direction, range)))
            }
            _ => None,
        };
        let periods = periods_of(raw, whole.as_deref());
        Self { raw, whole, periods, samples: OnceCell::new() }
    }

    /// The surface of the file.
    pub fn raw(&self) -> &'a RawSurface {
        self.raw
    }

    /// The whole surface where it has a natural range (swept surfaces, splines).
    pub fn whole(&self) -> Option<&Surface> {
        self.whole.as_deref()
    }

    /// Sample points of the whole surface, cached.
    pub fn samples(&self) -> &[(Vec2, Vec3)] {
        self.samples.get_or_init(|| self.sampled())
    }

    /// Range of the directrix of an extrusion.
    pub fn curve_range(&self) -> Option<[f64; 2]> {
        match self.raw {
            RawSurface::Extrusion { directrix, .. } => Some(directrix.domain()),
            _ => None,
        }
    }

    /// True when the file's parameters are (curve, angle): exchanging them reverses the normal.
    pub fn swapped(&self) -> bool {
        matches!(self.raw, RawSurface::Revolution { curve_first: true, .. })
    }

    /// A parameter curve of the file in internal order. On a sphere it is shifted by whole turns to lie between the
    /// poles.
    pub fn normalised(&self, path: &Curve2) -> Curve2 {
        let path = path.mapped(|uv| self.order(uv));
        if !matches!(self.raw, RawSurface::Sphere { .. }) {
            return path;
        }
        let [a, b] = path.domain();
        let turns = (path.point(0.5 * (a + b)).y / TAU).round() * TAU;
        path.mapped(|uv| uv - Vec2::new(0.0, turns))
    }

    /// Converts the file's parameters to internal order: (angle, curve) for surfaces of revolution.
    pub fn order(&self, uv: Vec2) -> Vec2 {
        if self.swapped() { Vec2::new(uv.y, uv.x) } else { uv }
    }

    /// Period along u and v (internal order); `None` where the surface is not closed.
    pub fn periods(&self) -> [Option<f64>; 2] {
        self.periods
    }

    /// Point and derivatives at native parameters (internal order) of swept surfaces and splines; zeros for others.
    pub fn derivs(&self, uv: Vec2) -> SurfaceDerivs {
        match self.raw {
            RawSurface::Revolution { generatrix, origin, axis, .. } => {
                let g = generatrix.derivs(self.wrap(uv).y);
                let center = origin + axis * axis.dot(&(g.c - origin));
                let (sin, cos) = uv.x.sin_cos();
                let turn = |x: &Vec3| {
                    let along = axis * axis.dot(x);
                    along + (x - along) * cos + axis.cross(x) * sin
                };
                let x = turn(&(g.c - center));
                let (sv, svv) = (turn(&g.d1), turn(&g.d2));
                let (su, suv) = (axis.cross(&x), axis.cross(&sv));
                SurfaceDerivs { s: center + x, su, sv, suu: axis.cross(&su), suv, svv }
            }
            RawSurface::Extrusion { directrix, direction, .. } => {
                let c = directrix.derivs(self.wrap(uv).x);
                let zero = Vec3::zeros();
                let s = c.c + direction * uv.y;
                SurfaceDerivs { s, su: c.d1, sv: *direction, suu: c.d2, suv: zero, svv: zero }
            }
            RawSurface::Nurbs(s) => s.derivs(self.wrap(uv)),
            _ => {
                let zero = Vec3::zeros();
                SurfaceDerivs {
                    s: self.point(uv),
                    su: zero,
                    sv: zero,
                    suu: zero,
                    suv: zero,
                    svv: zero,
                }
            }
        }
    }

    /// Point at native parameters (internal order), which may lie outside the base period.
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
                let p = generatrix.point(self.wrap(uv).y);
                let center = origin + axis * axis.dot(&(p - origin));
                let x = p - center;
                center + x * u.cos() + axis.cross(&x) * u.sin()
            }
            RawSurface::Extrusion { directrix, direction, .. } => {
                directrix.point(self.wrap(uv).x) + direction * v
            }
            RawSurface::Nurbs(s) => s.point(self.wrap(uv)),
            RawSurface::Offset { .. } => Vec3::zeros(),
        }
    }

    /// Shifts spline parameters by whole periods into the domain.
    fn wrap(&self, uv: Vec2) -> Vec2 {
        let Some(s) = &self.whole else { return uv };
        let mut out = uv;
        for (k, (range, period)) in s.domain().into_iter().zip(self.periods()).enumerate() {
            if let Some(p) = period {
                let slack = 1e-9 * p;
                if out[k] > range[1] + slack || out[k] < range[0] - slack {
                    out[k] -= p * ((out[k] - range[0]) / p).floor();
                }
            }
        }
        out
    }

    /// Isoparametric lines that degenerate to a point: (parameter index, value).
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
            _ => self.whole().map_or_else(Vec::new, collapsed_sides),
        }
    }

    /// Points in space of the degenerate isoparametric lines.
    pub fn pole_points(&self) -> Vec<Vec3> {
        let at = |(k, t): (usize, f64)| {
            let mut uv = self.whole.as_ref().map_or_else(Vec2::zeros, |s| {
                let [u, v] = s.domain();
                Vec2::new(u[0], v[0])
            });
            uv[k] = t;
            self.point(uv)
        };
        self.poles().into_iter().map(at).collect()
    }

    /// True for a surface without boundary: a loop on it divides it into two regions.
    pub fn has_no_boundary(&self) -> bool {
        match self.raw {
            RawSurface::Sphere { .. } => true,
            RawSurface::Torus { major, minor, .. } => major > minor,
            _ => false,
        }
    }

    /// Natural parameter ranges (internal order); `None` for an unbounded surface.
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
            _ => self.whole().map(Surface::domain),
        }
    }

    /// Rational B-spline on the native range (internal order), and the angular ranges of u and v where its parameter
    /// differs from the angle inside a span.
    pub fn to_nurbs(&self, range: [[f64; 2]; 2]) -> (Surface, [Option<[f64; 2]>; 2]) {
        let (mut surface, angles) = self.on_range(range);
        for k in 0..2 {
            // Loops across the seam of a closed spline: move the seam.
            let ([low, high], Some(period)) = (surface.domain()[k], self.periods[k]) else {
                continue;
            };
            let slack = 1e-9 * period;
            let over = range[k][0] < low - slack || range[k][1] > high + slack;
            if angles[k].is_none() && over && (high - low - period).abs() <= slack {
                surface = surface.with_seam_at(k, range[k][0]).unwrap_or(surface);
            }
        }
        (surface, angles)
    }

    fn on_range(&self, range: [[f64; 2]; 2]) -> (Surface, [Option<[f64; 2]>; 2]) {
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
                let turned = |profile: &Curve3| Surface::revolution(profile, *origin, *axis, u);
                let surface = within(generatrix.domain(), v)
                    .and_then(|[from, to]| generatrix.trimmed(from, to).ok())
                    .map(|piece| turned(&piece))
                    .or_else(|| over_seam(&turned(generatrix), v));
                (surface.unwrap_or_else(|| turned(generatrix)), [Some(u), None])
            }
            RawSurface::Extrusion { directrix, direction, .. } => {
                (Surface::extrusion(directrix, *direction, v), [None, None])
            }
            RawSurface::Nurbs(s) => (s.clone(), [None, None]),
            RawSurface::Offset { base, .. } => Native::new(base).on_range(range),
        }
    }
}

/// Clips a range to a domain if it exceeds it by rounding only.
fn within([low, high]: [f64; 2], [from, to]: [f64; 2]) -> Option<[f64; 2]> {
    let slack = ROUNDING_REL * (high - low);
    let inside = from >= low - slack && to <= high + slack;
    inside.then_some([from.max(low), to.min(high)])
}

/// The part of a surface closed along v whose range crosses the seam.
fn over_seam(whole: &Surface, v: [f64; 2]) -> Option<Surface> {
    let [_, [low, high]] = whole.domain();
    let to = v[1].min(v[0] + (high - low));
    let shifted = whole.with_seam_at(1, v[0]).ok()?;
    let [u, domain] = shifted.domain();
    shifted.trimmed(u, within(domain, [v[0], to])?).ok()
}

fn line(at: impl Fn(f64) -> Vec3, v: [f64; 2]) -> Curve3 {
    Curve3::line(at(v[0]), at(v[1])).on_domain(v[0], v[1])
}

fn revolve(generatrix: &Curve3, frame: &Frame, u: [f64; 2]) -> Surface {
    Surface::revolution(generatrix, frame.origin, frame.z, u)
}

/// Surface type of a raw surface.
pub(super) fn kind_of(raw: &RawSurface) -> SurfaceKind {
    match raw {
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

fn periods_of(raw: &RawSurface, whole: Option<&Surface>) -> [Option<f64>; 2] {
    match raw {
        RawSurface::Cylinder { .. } | RawSurface::Cone { .. } | RawSurface::Sphere { .. } => {
            [Some(TAU), None]
        }
        RawSurface::Torus { .. } => [Some(TAU), Some(TAU)],
        _ => {
            let Some(s) = whole else { return [None, None] };
            let closed = closed_directions(s);
            let [u, v] = s.domain();
            let mut periods = [closed[0].then_some(u[1] - u[0]), closed[1].then_some(v[1] - v[0])];
            if matches!(raw, RawSurface::Revolution { .. }) {
                periods[0] = Some(TAU);
            }
            periods
        }
    }
}

/// Directions in which a surface is closed in space.
fn closed_directions(s: &Surface) -> [bool; 2] {
    let size = kanagata_geometry::Aabb::of_points(s.points()).diagonal();
    let [u, v] = s.domain();
    // The boundaries are splines with a limited number of spans, so that as many samples distinguish them.
    let closed = |k: usize| {
        let n = (4 * s.count()[1 - k]).min(400);
        (0..=n).all(|i| {
            let t = i as f64 / n as f64;
            let (a, b) = match k {
                0 => {
                    let y = v[0] + (v[1] - v[0]) * t;
                    (Vec2::new(u[0], y), Vec2::new(u[1], y))
                }
                _ => {
                    let x = u[0] + (u[1] - u[0]) * t;
                    (Vec2::new(x, v[0]), Vec2::new(x, v[1]))
                }
            };
            (s.point(a) - s.point(b)).norm() <= SEAM_TOLERANCE_REL * size
        })
    };
    [closed(0), closed(1)]
}

/// Sides of a surface that degenerate to a point in space.
fn collapsed_sides(s: &Surface) -> Vec<(usize, f64)> {
    let [u, v] = s.domain();
    let size = kanagata_geometry::Aabb::of_points(s.points()).diagonal();
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
