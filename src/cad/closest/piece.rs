//! Small rectangles of a surface with oriented bounding boxes and local point projection.

use std::sync::OnceLock;
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering::Relaxed;

use super::best::Best;
use crate::model::Face;
use crate::trim_region::TrimRegion;
use kanagata_geometry::frame::unit;
use kanagata_geometry::nurbs::newton::{Bounds, bounded_step, descend};
use kanagata_geometry::nurbs::{Surface, SurfaceDerivs};
use kanagata_geometry::{Aabb, Vec2, Vec3};

/// Largest turning angle of the control polygons across a rectangle [rad]. Doubled: half the rectangles per direction,
/// more subdivision per query.
const TURNING_MAX_RAD: f64 = 0.4;
/// Maximum number of rectangles per span and direction.
const RECTANGLES_PER_SPAN_MAX: usize = 16;
/// Second derivatives of the squared distance, over those for a flat surface, from which on it counts as strongly convex. A point
/// is then nearer than half of a radius of curvature, as those on a patch are. With 0 rectangles near a centre of curvature
/// count too, where curvature between the samples decides.
pub(super) const CONVEXITY_MIN: f64 = 0.5;
/// Maximum subdivision depth of a rectangle that may contain several local minima.
const SUBDIVISION_DEPTH_MAX: u32 = 4;

/// Memory for cached sub-rectangles [bytes], and the factor added per byte of the initial rectangles. A folded surface
/// has several minima almost everywhere, with 340 sub-rectangles per rectangle. Those without memory are rebuilt in
/// each search.
const CACHE_BYTES_MIN: usize = 16 << 20;
const CACHE_BYTES_FACTOR: usize = 4;

/// Remaining memory for cached sub-rectangles.
pub(super) struct MemoryBudget(AtomicUsize);

impl MemoryBudget {
    /// Budget of a model whose rectangles occupy `bytes`.
    pub fn of_pieces(bytes: usize) -> Self {
        Self(AtomicUsize::new(
            CACHE_BYTES_MIN.saturating_add(CACHE_BYTES_FACTOR.saturating_mul(bytes)),
        ))
    }

    fn take(&self, bytes: usize) -> bool {
        self.0.fetch_update(Relaxed, Relaxed, |left| left.checked_sub(bytes)).is_ok()
    }
}

/// A rectangle in the parameter plane of a face.
pub(super) struct Piece {
    pub face: u32,
    low: Vec2,
    high: Vec2,
    /// Bezier patch over the rectangle.
    piece: Surface,
    /// The rectangle touches a trimming loop, so that a foot point must be tested against the trimmed region.
    pub crosses: bool,
    /// Oriented bounding box of the control points: centre, axes (rows), half widths.
    center: Vec3,
    axes: [Vec3; 3],
    half: Vec3,
    /// Point and derivatives at the centre and the four corners.
    samples: [SurfaceDerivs; 5],
    quarters: OnceLock<Vec<Piece>>,
}

impl Piece {
    fn new(face: u32, piece: Surface, crosses: bool) -> Self {
        let [u, v] = piece.domain();
        let (low, high) = (Vec2::new(u[0], v[0]), Vec2::new(u[1], v[1]));
        let corners = [(0.5, 0.5), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
        let samples =
            corners.map(|(a, b)| piece.derivs(low + (high - low).component_mul(&Vec2::new(a, b))));
        let middle = &samples[0];
        let axes = match (unit(middle.su), unit(middle.su.cross(&middle.sv))) {
            (Some(x), Some(z)) => [x, z.cross(&x), z],
            _ => [Vec3::x(), Vec3::y(), Vec3::z()],
        };
        let local = |p: &Vec3| Vec3::new(axes[0].dot(p), axes[1].dot(p), axes[2].dot(p));
        let control: Vec<Vec3> = piece.points().iter().map(local).collect();
        let bounds = Aabb::of_points(&control);
        let (c, half) = (bounds.center(), 0.5 * (bounds.max - bounds.min));
        let center = axes[0] * c.x + axes[1] * c.y + axes[2] * c.z;
        let quarters = OnceLock::new();
        Self { face, low, high, piece, crosses, center, axes, half, samples, quarters }
    }

    /// Axis-aligned bounding box of the control points.
    pub fn bounds(&self) -> Aabb {
        Aabb::of_points(self.piece.points())
    }

    /// Lower bound of the squared distance, from the oriented bounding box.
    fn lower_bound(&self, p: &Vec3) -> f64 {
        let r = p - self.center;
        (0..3).map(|k| (self.axes[k].dot(&r).abs() - self.half[k]).max(0.0).powi(2)).sum()
    }

    /// Memory without sub-rectangles [bytes].
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + size_of_val(self.piece.points())
    }

    /// Updates `best` with the points of the rectangle inside the trimming loops. Where the distance may have several
    /// minima the four sub-rectangles are searched, while `left` permits.
    pub fn search(
        &self,
        p: &Vec3,
        region: &TrimRegion,
        best: &mut Best,
        (left, memory): (&mut u32, &MemoryBudget),
    ) {
        *left = left.saturating_sub(1);
        if best.known.is_some_and(|known| self.has_no_other(p, known)) {
            return;
        }
        if self.visit(p, region, best) {
            self.search_quarters(p, region, best, (left, memory), SUBDIVISION_DEPTH_MAX);
        }
    }

    fn search_quarters(
        &self,
        p: &Vec3,
        region: &TrimRegion,
        best: &mut Best,
        (left, memory): (&mut u32, &MemoryBudget),
        depth: u32,
    ) {
        let made;
        let quarters = if let Some(kept) = self.cached_quarters(memory) {
            kept
        } else {
            made = self.quarters();
            &made
        };
        for part in quarters.iter().rev() {
            if *left == 0 {
                return;
            }
            *left -= 1;
            if part.visit(p, region, best) && depth > 1 {
                part.search_quarters(p, region, best, (left, memory), depth - 1);
            }
        }
    }

    /// The four sub-rectangles, cached while the memory budget permits: most searches revisit the same ones.
    fn cached_quarters(&self, memory: &MemoryBudget) -> Option<&[Self]> {
        if self.quarters.get().is_none() && !memory.take(4 * self.bytes()) {
            return None;
        }
        Some(self.quarters.get_or_init(|| self.quarters()))
    }

    /// Computes the local minimum; true when the rectangle may contain another one.
    fn visit(&self, p: &Vec3, region: &TrimRegion, best: &mut Best) -> bool {
        if self.lower_bound(p) > best.distance {
            return false;
        }
        let slopes = self.slopes(p);
        let strongly = self.is_convex(p, CONVEXITY_MIN);
        let corner = if strongly { self.lowest_corner(p, &slopes) } else { None };
        let (uv, distance) = corner.unwrap_or_else(|| self.descend(p));
        best.take(self.face, uv, distance, || !self.crosses || region.contains(uv));
        let convex = strongly || self.is_convex(p, 0.0);
        !convex && !self.has_single_minimum(p, distance, &slopes)
    }

    /// True when the foot point `known` lies in the rectangle and the squared distance is convex over it: no other point in it
    /// is closer.
    fn has_no_other(&self, p: &Vec3, (face, uv): (u32, Vec2)) -> bool {
        let inside = (0..2).all(|k| self.low[k] <= uv[k] && uv[k] <= self.high[k]);
        face == self.face && inside && self.is_convex(p, CONVEXITY_MIN)
    }

    /// True when the squared distance is convex over the rectangle, judged at the centre and the corners: its second derivatives
    /// exceed `least` times those for a flat surface.
    fn is_convex(&self, p: &Vec3, least: f64) -> bool {
        let flat = 1.0 - least;
        self.samples.iter().all(|d| {
            let r = d.s - p;
            let (a, b, c) = (
                flat * d.su.norm_squared() + r.dot(&d.suu),
                flat * d.su.dot(&d.sv) + r.dot(&d.suv),
                flat * d.sv.norm_squared() + r.dot(&d.svv),
            );
            a > 0.0 && a * c > b * b
        })
    }

    /// Derivatives of half the squared distance at the centre and the corners.
    fn slopes(&self, p: &Vec3) -> [Vec2; 5] {
        self.samples.map(|d| {
            let r = d.s - p;
            Vec2::new(r.dot(&d.su), r.dot(&d.sv))
        })
    }

    /// The corner at which a convex distance rises into the rectangle: its parameters and the squared distance.
    fn lowest_corner(&self, p: &Vec3, slopes: &[Vec2; 5]) -> Option<(Vec2, f64)> {
        let at = |corner: usize, k: usize| {
            if (corner >> k) & 1 == 0 { self.low[k] } else { self.high[k] }
        };
        let rises = |corner: usize, k: usize| {
            let slope = slopes[corner + 1][k];
            if (corner >> k) & 1 == 0 { slope >= 0.0 } else { slope <= 0.0 }
        };
        let corner = (0..4).find(|&corner| rises(corner, 0) && rises(corner, 1))?;
        let uv = Vec2::new(at(corner, 0), at(corner, 1));
        Some((uv, (self.samples[corner + 1].s - p).norm_squared()))
    }

    /// True when a squared distance that is not convex has no stationary point in the rectangle, or is constant, judged at the
    /// centre and the corners.
    fn has_single_minimum(&self, p: &Vec3, found: f64, slopes: &[Vec2; 5]) -> bool {
        let off = |d: &SurfaceDerivs| ((d.s - p).norm_squared() - found).abs();
        let even = self.samples.iter().all(|d| off(d) <= 1e-12 * found);
        let clear = |k: usize| {
            let of = slopes.iter().map(|slope| slope[k]);
            let (low, high) =
                (of.clone().fold(f64::INFINITY, f64::min), of.fold(f64::NEG_INFINITY, f64::max));
            let margin = 0.25 * (high - low);
            low > margin || high < -margin
        };
        even || clear(0) || clear(1)
    }

    fn quarters(&self) -> Vec<Self> {
        let m = 0.5 * (self.low + self.high);
        let (us, vs) = ([self.low.x, m.x, self.high.x], [self.low.y, m.y, self.high.y]);
        let quarter = |k: usize| {
            let (i, j) = (k % 2, k / 2);
            let piece = self.piece.trimmed([us[i], us[i + 1]], [vs[j], vs[j + 1]]).ok()?;
            Some(Self::new(self.face, piece, self.crosses))
        };
        (0..4).filter_map(quarter).collect()
    }

    /// Local minimum in the rectangle, from the foot point on the tangent plane at the centre.
    fn descend(&self, p: &Vec3) -> (Vec2, f64) {
        let (middle, d) = (0.5 * (self.low + self.high), &self.samples[0]);
        let bounds = Bounds { low: self.low, high: self.high };
        let r = d.s - p;
        let gauss = [d.su.norm_squared(), d.su.dot(&d.sv), d.sv.norm_squared()];
        let slope = Vec2::new(r.dot(&d.su), r.dot(&d.sv));
        let step = bounded_step(gauss, slope, [self.low - middle, self.high - middle]);
        let from = |start: Vec2| descend(|uv| self.piece.derivs(uv), p, start, bounds);
        let found = from(middle + step.unwrap_or_default());
        if found.1 <= r.norm_squared() { found } else { from(middle) }
    }
}

/// Rectangles of a face that touch its trimmed region.
pub(super) fn pieces_of(id: u32, face: &Face, region: &TrimRegion) -> Vec<Piece> {
    let surface = &face.surface;
    let us = cuts(&surface.transposed(), region.low.x, region.high.x);
    let vs = cuts(surface, region.low.y, region.high.y);
    let mut leaves = Vec::new();
    for u in us.windows(2) {
        let Ok(strip) = surface.trimmed([u[0], u[1]], surface.domain()[1]) else { continue };
        for v in vs.windows(2) {
            let (low, high) = (Vec2::new(u[0], v[0]), Vec2::new(u[1], v[1]));
            let crosses = region.touches(low, high);
            if !crosses && !region.contains(0.5 * (low + high)) {
                continue;
            }
            if let Ok(piece) = strip.trimmed([u[0], u[1]], [v[0], v[1]]) {
                leaves.push(Piece::new(id, piece, crosses));
            }
        }
    }
    leaves
}

/// Subdivision parameters along v: knots, and equal steps by the turning angle of the control polygons.
fn cuts(surface: &Surface, low: f64, high: f64) -> Vec<f64> {
    let [u, _] = surface.domain();
    let mut breaks = vec![low];
    breaks.extend(surface.knots()[1].iter().copied().filter(|&t| t > low && t < high));
    breaks.push(high);
    breaks.dedup();
    let mut out = Vec::new();
    for w in breaks.windows(2) {
        let turn = surface.trimmed(u, [w[0], w[1]]).map_or(0.0, |s| turning(&s));
        let n = ((turn / TURNING_MAX_RAD).ceil() as usize).clamp(1, RECTANGLES_PER_SPAN_MAX);
        out.extend((0..n).map(|k| w[0] + (w[1] - w[0]) * k as f64 / n as f64));
    }
    out.push(high);
    out
}

/// Largest turning angle of the control polygons along v [rad].
fn turning(surface: &Surface) -> f64 {
    let rows = surface.points().chunks_exact(surface.count()[1]);
    rows.map(polygon_turning).fold(0.0, f64::max)
}

/// Sum of the angles between the legs of a polygon [rad].
pub(super) fn polygon_turning(points: &[Vec3]) -> f64 {
    let legs: Vec<Vec3> = points.windows(2).filter_map(|w| unit(w[1] - w[0])).collect();
    legs.windows(2).map(|w| w[0].cross(&w[1]).norm().atan2(w[0].dot(&w[1]))).sum()
}
