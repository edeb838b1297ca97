//! Offsets: curves in a plane (130) and surfaces (140).

use super::curves::{Piece, Shape};
use super::edges::EdgeDraft;
use super::file::Fault;
use super::reader::{POINTER_DEPTH_MAX, Reader, similarity};
use super::surface::BasisSurface;
use super::uv::point_on;
use crate::native::Native;
use crate::raw::RawSurface;
use kanagata_geometry::frame::unit;
use kanagata_geometry::nurbs::Curve3;
use kanagata_geometry::{Affine, Vec2, Vec3};

/// Accuracy of fitted offset curves relative to the size of the curve.
const FIT_TOLERANCE_REL: f64 = 1e-8;
/// Maximum number of cubic segments of a fitted offset curve.
const SEGMENTS_MAX: usize = 2048;

impl Reader<'_, '_> {
    /// Offset curve (130): DE1 base, FLAG 1 constant 2 linear 3 function, DE2, NDIM, PTYPE 1 arc length 2
    /// parameter, D1, TD1, D2, TD2, normal VX VY VZ, TT1, TT2. `O(t) = C(t) + d(t) (V x T)`.
    ///
    /// # Errors
    /// A distance by a function, or one that varies with the arc length of the base.
    pub(super) fn offset_curve(&self, entity: usize, depth: usize) -> Result<Piece, Fault> {
        if depth > POINTER_DEPTH_MAX {
            return Err(self.file.fault(
                entity,
                "offset-depth",
                "offsets of offsets are too deeply nested",
                "a base that ends",
            ));
        }
        let mut p = self.file.params(entity)?;
        let base = p.pointer("base curve")?;
        let flag = p.integer_or("FLAG", 1)?;
        p.pointer_or_none("distance function")?;
        p.integer_or("NDIM", 0)?;
        let by_length = p.integer_or("PTYPE", 2)? == 1;
        let [d1, t1, d2, t2] = [p.real("D1")?, p.real("TD1")?, p.real("D2")?, p.real("TD2")?];
        let normal = p.vec3("normal")?;
        let range = [p.real_or("TT1", f64::NAN)?, p.real_or("TT2", f64::NAN)?];
        let Some(normal) = unit(normal) else {
            return Err(p.fault("normal 0, 0, 0", "a unit vector"));
        };
        if let Some((found, allowed)) = unsupported_law(flag, by_length && d1 != d2) {
            return Err(p.fault(found, allowed));
        }
        if self.file.entry(base).kind == 130 && (base == entity || depth + 1 > 4) {
            return Err(p.fault("an offset of itself", "a base curve of another kind"));
        }
        let curve = self.offset_base(base, depth)?;
        let distance = distance_law(flag, [d1, d2], [t1, t2]);
        let range = common_range(range, curve.domain());
        let curve = fit(&curve, &normal, &distance, range).ok_or_else(|| {
            self.file.fault(
                entity,
                "offset-failed",
                "no smooth offset of the base curve",
                "a curve without cusps",
            )
        })?;
        Ok(Piece { curve, shape: Shape::Free })
    }

    /// Base curve of an offset curve. Members of a composite are joined; the nesting depth of offsets is limited.
    fn offset_base(&self, base: usize, depth: usize) -> Result<Curve3, Fault> {
        match self.file.entry(base).kind {
            130 => {
                Ok(self.offset_curve(base, depth + 1)?.curve.transformed(&self.placement(base)?))
            }
            102 if depth > 4 => Err(self.file.fault(
                base,
                "offset-depth",
                "offsets of composites of offsets",
                "at most 4 levels",
            )),
            102 => Ok(self.joined_at(base, &Affine::identity(), depth + 1)?.curve),
            _ => Ok(self.joined(base, &Affine::identity())?.curve),
        }
    }

    /// Offset surface (140): direction indicator NX, NY, NZ, distance D, base DE.
    pub(super) fn offset_surface(
        &self,
        entity: usize,
        map: &Affine,
        depth: usize,
    ) -> Result<BasisSurface, Fault> {
        let mut p = self.file.params(entity)?;
        let side = p.vec3("direction indicator")?;
        let distance = p.real("distance")?;
        let base = p.pointer("base surface")?;
        let placed = self.placed(entity, map)?;
        let Some(scale) = similarity(&placed) else {
            return Err(p.fault("a matrix that is no similarity", "a rotation or uniform scale"));
        };
        let mut basis = self.surface_at(base, &placed, depth + 1)?;
        let side = placed.vector(&side);
        let normal = normal_in_middle(&basis);
        let same = normal.is_none_or(|n| side.norm() == 0.0 || n.dot(&side) >= 0.0);
        let sign = if same { 1.0 } else { -1.0 };
        basis.surface =
            RawSurface::Offset { base: Box::new(basis.surface), distance: sign * distance * scale };
        Ok(basis)
    }
}

/// Reverses the side of an offset surface when the space curves of all edges lie on the other side, contrary to its
/// indicator. Returns true if reversed.
pub(super) fn use_side_of_edges(surface: &mut RawSurface, loops: &[Vec<EdgeDraft>]) -> bool {
    /// Largest deviation of the curves from the other side, relative to the offset distance.
    const SIDE_TOLERANCE_REL: f64 = 0.05;
    let RawSurface::Offset { base, distance } = surface else { return false };
    if matches!(**base, RawSurface::Offset { .. }) {
        return false;
    }
    let native = Native::new(base);
    let height = |p: Vec3| {
        let uv = native.inverse(&p, None);
        let d = native.derivs(uv);
        // Planes and quadrics have no B-spline derivatives here and no domain ends: use differences.
        let beside = |u: f64, v: f64| point_on(base, uv + Vec2::new(u, v));
        let normal = unit(d.su.cross(&d.sv)).or_else(|| {
            let s = beside(0.0, 0.0)?;
            unit((beside(1e-4, 0.0)? - s).cross(&(beside(0.0, 1e-4)? - s)))
        })?;
        Some((p - point_on(base, uv)?).dot(&normal))
    };
    let curves = loops.iter().flatten().filter_map(|draft| draft.edge.curve.as_ref());
    let points = curves.flat_map(|curve| {
        let [a, b] = curve.domain();
        [0.25, 0.5, 0.75].map(|fraction| curve.point(a + (b - a) * fraction))
    });
    let heights: Vec<f64> = points.filter_map(height).collect();
    let is_beyond = |h: &f64| (h + *distance).abs() <= SIDE_TOLERANCE_REL * distance.abs();
    let other = !heights.is_empty() && heights.iter().all(is_beyond);
    if other {
        *distance = -*distance;
    }
    other
}

/// Normal at the middle of the domain, in the orientation of the surface's own parameters: the point to which the
/// indicator refers.
fn normal_in_middle(basis: &BasisSurface) -> Option<Vec3> {
    let [[u0, u1], [v0, v1]] = basis.domain.unwrap_or([[0.0, 1e-3], [0.0, 1e-3]]);
    let (du, dv) = (1e-4 * (u1 - u0), 1e-4 * (v1 - v0));
    let at = |i: f64, j: f64| {
        point_on(&basis.surface, Vec2::new(0.5 * (u0 + u1) + i * du, 0.5 * (v0 + v1) + j * dv))
    };
    let (s, su, sv) = (at(0.0, 0.0)?, at(1.0, 0.0)?, at(0.0, 1.0)?);
    unit((su - s).cross(&(sv - s)))
}

/// What makes a distance law unsupported, and what is supported instead; `by_length`: the distance varies with the arc
/// length.
fn unsupported_law(flag: i64, by_length: bool) -> Option<(&'static str, &'static str)> {
    match flag {
        3 => Some(("FLAG = 3, distance by a function", "1 (constant) or 2 (linear)")),
        2 if by_length => Some(("PTYPE = 1, distance linear in the arc length", "2 (parameter)")),
        _ => None,
    }
}

/// Offset distance [mm] and its derivative: linear (FLAG 2) from `d1` at `t1` to `d2` at `t2`, or constant.
fn distance_law(flag: i64, [d1, d2]: [f64; 2], [t1, t2]: [f64; 2]) -> impl Fn(f64) -> (f64, f64) {
    move |t: f64| match flag {
        2 if t2 != t1 => (d1 + (d2 - d1) * (t - t1) / (t2 - t1), (d2 - d1) / (t2 - t1)),
        _ => (d1, 0.0),
    }
}

/// Intersection of a domain with a range, or the entire domain when they are disjoint.
fn common_range(range: [f64; 2], [low, high]: [f64; 2]) -> [f64; 2] {
    let (from, to) = (range[0].max(low), range[1].min(high));
    if from < to { [from, to] } else { [low, high] }
}

/// Point and derivative of an offset curve.
fn offset_at(
    curve: &Curve3,
    normal: &Vec3,
    distance: &dyn Fn(f64) -> (f64, f64),
    t: f64,
) -> Option<(Vec3, Vec3)> {
    let c = curve.derivs(t);
    let speed = c.d1.norm();
    let tangent = unit(c.d1)?;
    let turn = (c.d2 - tangent * tangent.dot(&c.d2)) / speed;
    let (d, slope) = distance(t);
    let across = normal.cross(&tangent);
    Some((c.c + across * d, c.d1 + across * slope + normal.cross(&turn) * d))
}

/// Fits cubic Hermite segments, bisected until interior points lie on the offset curve.
fn fit(
    curve: &Curve3,
    normal: &Vec3,
    distance: &dyn Fn(f64) -> (f64, f64),
    [low, high]: [f64; 2],
) -> Option<Curve3> {
    let at = |t: f64| offset_at(curve, normal, distance, t);
    let size = curve.points().iter().map(|p| (p - curve.points()[0]).norm()).fold(0.0, f64::max);
    let tiny = 1e-9 * (high - low);
    let mut knots = vec![low; 4];
    let mut points: Vec<Vec3> = Vec::new();
    let mut todo: Vec<[f64; 2]> = spans_between(curve.knots(), [low, high]);
    todo.reverse();
    while let Some([a, b]) = todo.pop() {
        if points.len() > 3 * SEGMENTS_MAX || b - a <= tiny {
            return None;
        }
        let [pa, qa, qb, pb] = hermite_piece(&at, [a, b])?;
        let off = |s: f64| -> Option<f64> {
            let r = 1.0 - s;
            let inner = (qa * r + qb * s) * (3.0 * r * s);
            let fitted = pa * (r * r * r) + inner + pb * (s * s * s);
            Some((fitted - at(a + s * (b - a))?.0).norm())
        };
        if off(0.5)?.max(off(0.25)?).max(off(0.75)?) > FIT_TOLERANCE_REL * size {
            let middle = f64::midpoint(a, b);
            todo.push([middle, b]);
            todo.push([a, middle]);
            continue;
        }
        if points.is_empty() {
            points.push(pa);
        }
        points.extend([qa, qb, pb]);
        knots.extend([b; 3]);
    }
    knots.push(high);
    Curve3::try_new(3, knots, points, None).ok()
}

/// Spans between the knots in a range, in order.
fn spans_between(knots: &[f64], [low, high]: [f64; 2]) -> Vec<[f64; 2]> {
    let mut breaks: Vec<f64> = knots.iter().copied().filter(|k| *k > low && *k < high).collect();
    breaks.dedup();
    breaks.push(high);
    let mut from = low;
    let mut spans = Vec::new();
    for to in breaks {
        spans.push([from, to]);
        from = to;
    }
    spans
}

/// Bezier points [mm] of the cubic Hermite segment with points and derivatives of `at` just inside the ends of a span.
fn hermite_piece(at: &dyn Fn(f64) -> Option<(Vec3, Vec3)>, [a, b]: [f64; 2]) -> Option<[Vec3; 4]> {
    let (pa, da) = at(a + 1e-12 * (b - a))?;
    let (pb, db) = at(b - 1e-12 * (b - a))?;
    let h = (b - a) / 3.0;
    Some([pa, pa + da * h, pb - db * h, pb])
}
