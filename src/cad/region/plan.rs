//! A closed curve in plan.

use super::chain::{chained, end, start};
use super::error::RegionError;
use kanagata_geometry::nurbs::{Curve2, Curve3};
use kanagata_geometry::{Aabb, Vec2, Vec3};

/// Spans of a curve at most.
const SPANS_MAX: usize = 5_000;
/// Samples that share a box in the search for the closest one.
const CHUNK: usize = 32;
/// Pairs of segments compared for crossings of a curve with itself.
const CROSSINGS_COMPARED_MAX: usize = 4_000_000;
/// Samples between the ends of a span of a curve that is no line.
const SAMPLES_PER_SPAN: usize = 16;
/// Pieces at least, so that both neighbours of a piece differ.
const PIECES_MIN: usize = 3;
/// Turn of the tangent in a knot above which the curve has a corner there [rad].
const CORNER_ANGLE_MIN: f64 = 1e-3;

/// A point of the curve.
#[derive(Debug, Clone, Copy)]
struct Sample {
    point: Vec2,
    piece: usize,
}

/// The point of the curve closest to another.
#[derive(Debug, Clone, Copy)]
pub(super) struct Near {
    /// Distance [mm], positive inside.
    pub signed: f64,
    /// Piece and parameter of the closest point.
    pub piece: usize,
    pub t: f64,
}

/// A closed curve in plan, counter-clockwise, without corners inside its pieces [mm].
#[derive(Debug, Clone)]
pub struct PlanCurve {
    pieces: Vec<Curve2>,
    /// Points in order; the segment from each to the next belongs to its piece.
    samples: Vec<Sample>,
    /// Boxes around runs of [`CHUNK`] segments.
    boxes: Vec<[Vec2; 2]>,
}

impl PlanCurve {
    /// A polygon of these corners; the last may repeat the first.
    ///
    /// # Errors
    /// [`RegionError::Curve`] for fewer than three corners, no area, or sides that cross.
    pub fn polygon(corners: &[[f64; 2]]) -> Result<Self, RegionError> {
        let mut points: Vec<Vec2> = corners.iter().map(|&[x, y]| Vec2::new(x, y)).collect();
        if points.iter().any(|p| !(p.x.abs() < 1e12 && p.y.abs() < 1e12)) {
            return Err(RegionError::curve("a coordinate that is not finite"));
        }
        points.dedup();
        if points.len() > 1 && points.first() == points.last() {
            points.pop();
        }
        if points.len() < 3 {
            return Err(RegionError::curve(format!("{} different points", points.len())));
        }
        let next = points.iter().cycle().skip(1);
        Self::of_pieces(points.iter().zip(next).map(|(a, b)| Curve2::line(*a, *b)).collect())
    }

    /// The closed curve of these curves in any order, seen along z; ends within `gap` [mm] meet.
    ///
    /// # Errors
    /// [`RegionError::Curve`] when they are not one closed curve.
    pub fn of_curves(curves: &[Curve3], gap: f64) -> Result<Self, RegionError> {
        let flat = |c: &Curve3| {
            let points = c.points().iter().map(|p| p.xy()).collect();
            Curve2::try_new(c.degree(), c.knots().to_vec(), points, Some(c.weights().to_vec()))
        };
        let flat: Result<Vec<Curve2>, _> = curves.iter().map(|c| flat(&c.clamped())).collect();
        let flat = flat.map_err(|e| RegionError::curve(e.to_string()))?;
        Self::of_pieces(chained(flat, gap)?.iter().flat_map(without_corners).collect())
    }

    /// A curve of pieces that follow each other.
    ///
    /// # Errors
    /// [`RegionError::Curve`] when the curve is open, has no area, or crosses itself.
    pub fn of_pieces(mut pieces: Vec<Curve2>) -> Result<Self, RegionError> {
        let spans = |c: &Curve2| c.knots().windows(2).filter(|w| w[0] < w[1]).count();
        let all: usize = pieces.iter().map(spans).sum();
        if all > SPANS_MAX || pieces.is_empty() {
            return Err(RegionError::curve(format!(
                "a curve of {all} spans, of at most {SPANS_MAX}"
            )));
        }
        let finite = |c: &Curve2| c.points().iter().all(|p| p.x.abs() < 1e12 && p.y.abs() < 1e12);
        if !pieces.iter().all(finite) {
            return Err(RegionError::curve("a coordinate that is not finite"));
        }
        if !pieces.iter().all(has_sound_domain) {
            return Err(RegionError::curve("knots without a range"));
        }
        let samples = samples_of(&pieces);
        let mut curve = Self { samples, pieces: Vec::new(), boxes: Vec::new() };
        if curve.doubled_area() < 0.0 {
            pieces.reverse();
            pieces.iter_mut().for_each(|c| *c = c.reversed());
            curve.samples = samples_of(&pieces);
        }
        if pieces.len() < PIECES_MIN {
            pieces = pieces.iter().flat_map(in_parts).collect();
            curve.samples = samples_of(&pieces);
        }
        curve.pieces = pieces;
        curve.boxes = boxes_of(&curve.samples);
        curve.check()?;
        Ok(curve)
    }

    /// Its pieces in order, counter-clockwise.
    #[must_use]
    pub fn pieces(&self) -> &[Curve2] {
        &self.pieces
    }

    /// Box around the curve; z is 0.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        let points = self.pieces.iter().flat_map(|c| c.points());
        Aabb::of_points(&points.map(|p| p.push(0.0)).collect::<Vec<Vec3>>())
    }

    fn doubled_area(&self) -> f64 {
        let origin = self.samples.first().map_or_else(Vec2::zeros, |s| s.point);
        let next = self.samples.iter().cycle().skip(1);
        let cross = |(a, b): (&Sample, &Sample)| (a.point - origin).perp(&(b.point - origin));
        self.samples.iter().zip(next).map(cross).sum()
    }

    /// A point where the curve crosses itself.
    fn crossing(&self) -> Result<Option<Vec2>, RegionError> {
        let n = self.samples.len();
        let at = |k: usize| self.samples[k % n].point;
        let boxes: Vec<Aabb> =
            (0..n).map(|k| Aabb::of_points(&[at(k).push(0.0), at(k + 1).push(0.0)])).collect();
        let tree = kanagata_geometry::box_tree::BoxTree::build(&boxes);
        let (mut compared, mut crossing) = (0, None);
        for (k, bounds) in boxes.iter().enumerate() {
            tree.overlapping(bounds, |other| {
                let j = other as usize;
                let adjacent = j == k || (j + 1) % n == k || (k + 1) % n == j;
                compared += 1;
                if !adjacent && crossing.is_none() && compared < CROSSINGS_COMPARED_MAX {
                    crossing = cross([at(k), at(k + 1)], [at(j), at(j + 1)]).then(|| at(k));
                }
            });
            if compared >= CROSSINGS_COMPARED_MAX {
                return Err(RegionError::curve("a curve that is wound up too closely"));
            }
        }
        Ok(crossing)
    }

    fn check(&self) -> Result<(), RegionError> {
        if self.pieces.len() < PIECES_MIN || self.samples.is_empty() {
            return Err(RegionError::curve("a curve of no length"));
        }
        let size = self.bounds().diagonal();
        for (k, piece) in self.pieces.iter().enumerate() {
            let next = &self.pieces[(k + 1) % self.pieces.len()];
            let gap = (end(piece) - start(next)).norm();
            if gap > 1e-9 * size {
                return Err(RegionError::curve(format!(
                    "an open curve with a gap of {gap:.3e} mm"
                )));
            }
        }
        if self.doubled_area() <= 1e-9 * size * size {
            return Err(RegionError::curve("a curve without area"));
        }
        match self.crossing()? {
            Some(p) => {
                let found = format!("a curve that crosses itself near ({:.3}, {:.3}) mm", p.x, p.y);
                Err(RegionError::curve(found))
            }
            None => Ok(()),
        }
    }

    /// The closest point of the curve.
    pub(super) fn near(&self, p: Vec2) -> Near {
        let n = self.samples.len();
        let distance = |k: usize| {
            let (a, b) = (self.samples[k].point, self.samples[(k + 1) % n].point);
            let d = b - a;
            let t = ((p - a).dot(&d) / d.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            (a + d * t - p).norm_squared()
        };
        let mut nearest = (f64::INFINITY, 0);
        for (chunk, [low, high]) in self.boxes.iter().enumerate() {
            let off = (low - p).sup(&(p - high)).sup(&Vec2::zeros());
            if off.norm_squared() < nearest.0 {
                for k in chunk * CHUNK..n.min((chunk + 1) * CHUNK) {
                    let found = distance(k);
                    nearest = if found < nearest.0 { (found, k) } else { nearest };
                }
            }
        }
        let piece = self.samples[nearest.1].piece;
        let count = self.pieces.len();
        let around = [piece, (piece + 1) % count, (piece + count - 1) % count];
        let mut best = (f64::INFINITY, piece, 0.0);
        for k in around {
            let (t, squared) = closest(&self.pieces[k], p);
            if squared < best.0 {
                best = (squared, k, t);
            }
        }
        let (squared, piece, t) = best;
        let inside = self.is_left_of(p, piece, t);
        Near { signed: squared.sqrt() * if inside { 1.0 } else { -1.0 }, piece, t }
    }

    /// Whether `p` is on the left of the curve at its closest point.
    fn is_left_of(&self, p: Vec2, piece: usize, t: f64) -> bool {
        let count = self.pieces.len();
        let d = self.pieces[piece].derivs(t);
        let off = p - d.c;
        let [low, high] = self.pieces[piece].domain();
        let near_end = 1e-9 * (high - low);
        let (before, after) = if t <= low + near_end {
            let previous = &self.pieces[(piece + count - 1) % count];
            (previous.derivs(previous.domain()[1]).d1, d.d1)
        } else if t >= high - near_end {
            let next = &self.pieces[(piece + 1) % count];
            (d.d1, next.derivs(next.domain()[0]).d1)
        } else {
            return d.d1.perp(&off) > 0.0;
        };
        let left = [before.perp(&off) > 0.0, after.perp(&off) > 0.0];
        if before.perp(&after) >= 0.0 { left[0] && left[1] } else { left[0] || left[1] }
    }
}

/// Whether the parameter range of a curve is finite and wide enough for its parameters to differ.
fn has_sound_domain(c: &Curve2) -> bool {
    const WIDTH_MIN_REL: f64 = 1e-9;
    let [low, high] = c.domain();
    let width = high - low;
    width.is_finite() && width > WIDTH_MIN_REL * low.abs().max(high.abs())
}

/// Parameter and squared distance of the closest point.
fn closest(c: &Curve2, p: Vec2) -> (f64, f64) {
    if let ([a, b], [low, high]) = (c.points(), c.domain())
        && c.weights()[0] == c.weights()[1]
    {
        let d = b - a;
        let s = ((p - a).dot(&d) / d.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        return (low + (high - low) * s, (a + d * s - p).norm_squared());
    }
    c.closest(&p)
}

fn samples_of(pieces: &[Curve2]) -> Vec<Sample> {
    let mut out = Vec::new();
    for (piece, c) in pieces.iter().enumerate() {
        let straight = c.points().len() == 2;
        for w in c.knots().windows(2).filter(|w| w[0] < w[1]) {
            let n = if straight { 1 } else { SAMPLES_PER_SPAN };
            let at = |k: usize| c.point(w[0] + (w[1] - w[0]) * k as f64 / n as f64);
            out.extend((0..n).map(|k| Sample { point: at(k), piece }));
        }
    }
    out
}

/// Boxes around runs of segments.
fn boxes_of(samples: &[Sample]) -> Vec<[Vec2; 2]> {
    let n = samples.len();
    let of = |chunk: usize| {
        let points = (chunk * CHUNK..=n.min((chunk + 1) * CHUNK)).map(|k| samples[k % n].point);
        let none = [Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY)];
        points.fold(none, |[low, high], p| [low.inf(&p), high.sup(&p)])
    };
    (0..n.div_ceil(CHUNK)).map(of).collect()
}

/// True when two segments cross.
fn cross([a, b]: [Vec2; 2], [c, d]: [Vec2; 2]) -> bool {
    let side = |p: Vec2, q: Vec2, r: Vec2| (q - p).perp(&(r - p));
    side(a, b, c) * side(a, b, d) <= 0.0 && side(c, d, a) * side(c, d, b) <= 0.0
}

/// A curve in parts of equal parameter length.
fn in_parts(c: &Curve2) -> Vec<Curve2> {
    let [low, high] = c.domain();
    let at = |k: usize| {
        if k == PIECES_MIN { high } else { low + (high - low) * k as f64 / PIECES_MIN as f64 }
    };
    (0..PIECES_MIN).filter_map(|k| c.trimmed(at(k), at(k + 1)).ok()).collect()
}

/// A curve split at its corners.
fn without_corners(c: &Curve2) -> Vec<Curve2> {
    let [low, high] = c.domain();
    let mut inner: Vec<f64> = c.knots().iter().copied().filter(|k| *k > low && *k < high).collect();
    inner.dedup();
    let has_corner = |t: &f64| {
        let multiplicity = c.knots().iter().filter(|k| *k == t).count();
        let (a, b) = (c.derivs(t.next_down()).d1, c.derivs(*t).d1);
        multiplicity >= c.degree() && a.perp(&b).abs().atan2(a.dot(&b)) > CORNER_ANGLE_MIN
    };
    let corners: Vec<f64> = inner.into_iter().filter(has_corner).collect();
    let bounds = [vec![low], corners, vec![high]].concat();
    bounds.windows(2).filter_map(|w| c.trimmed(w[0], w[1]).ok()).collect()
}
