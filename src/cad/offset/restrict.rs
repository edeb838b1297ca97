//! The part of a spline under an offset surface that the loops of a face enter.
//!
//! A point of the offset and its base have the same parameters, and the base point is the foot of the perpendicular
//! from the offset. The loops' points, projected onto the base, therefore give the rectangle that the face needs. Many
//! faces on one large spline are then as cheap as one.

use super::budget::breaks_of;
use super::surface::spline_below;
use crate::loops::Side;
use crate::native::Native;
use crate::raw::{RawEdge, RawFace, RawSurface};
use kanagata_geometry::nurbs::{Curve3, Surface};
use kanagata_geometry::{Vec2, Vec3};

/// Samples per span of an edge, and their limits per edge. The span beyond the samples on each side covers what bulges
/// between them.
const SAMPLES_PER_SPAN: usize = 4;
const SAMPLES: [usize; 2] = [8, 200];
/// Deviation of the distance of a loop's point from its base, relative to the offset, above which the foot point is
/// not trusted. Edges of files deviate by a few thousandths. Doubled: no difference in the files of the corpus.
const FOOT_DISTANCE_REL: f64 = 1e-2;
/// Distance from a cut, relative to the width of the domain, at which a loop touches it.
const CUT_TOLERANCE_REL: f64 = 1e-9;

/// An offset surface with a restricted base.
#[derive(Debug, Clone)]
pub(crate) struct Restricted {
    /// The surface.
    pub surface: RawSurface,
    domain: [[f64; 2]; 2],
    /// Ends of the domain that are not ends of the whole spline.
    cut: [[bool; 2]; 2],
}

impl Restricted {
    /// True when no loop reaches an end of the domain at which the spline was cut.
    pub fn holds<'s>(&self, sides: impl Iterator<Item = &'s Side>) -> bool {
        let inside = |p: &Vec2| {
            (0..2).all(|k| {
                let [low, high] = self.domain[k];
                let margin = CUT_TOLERANCE_REL * (high - low);
                !(self.cut[k][0] && p[k] <= low + margin || self.cut[k][1] && p[k] >= high - margin)
            })
        };
        let mut points = sides.flat_map(|s| s.path.points());
        points.all(inside)
    }
}

/// The offset surface of a face with its spline restricted to the spans that the loops enter, and one more on each
/// side. `None` for other surfaces, where all spans are needed, where the spline is closed, and where points of the
/// loops are not at the distance of the offset within `tolerance` [mm].
pub(crate) fn restricted(face: &RawFace, tolerance: f64) -> Option<Restricted> {
    let (base, distance) = spline_below(&face.surface)?;
    if face.loops.is_empty() || face.loops.iter().any(|l| l.edges.is_empty()) {
        return None;
    }
    if Native::new(&face.surface).periods().iter().any(Option::is_some) {
        return None;
    }
    let limit = tolerance.max(FOOT_DISTANCE_REL * distance.abs());
    let (mut low, mut high) = (Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY));
    for edge in face.loops.iter().flat_map(|l| &l.edges) {
        for uv in parameters_of(base, edge, (distance.abs(), limit))? {
            (low, high) = (low.inf(&uv), high.sup(&uv));
        }
    }
    let domain = base.domain();
    let needed = [0, 1].map(|k| with_neighbours(base, k, [low[k], high[k]]));
    if needed == domain {
        return None;
    }
    let part = base.trimmed(needed[0], needed[1]).ok()?;
    let cut = [0, 1].map(|k| [0, 1].map(|end| needed[k][end] != domain[k][end]));
    let (domain, surface) = (part.domain(), on_base(&face.surface, part));
    Some(Restricted { surface, domain, cut })
}

/// Parameters of points of an edge on the base; `None` when one is not within `limit` [mm] of the `distance` [mm].
fn parameters_of(
    base: &Surface,
    edge: &RawEdge,
    (distance, limit): (f64, f64),
) -> Option<Vec<Vec2>> {
    let Some(curve) = &edge.curve else {
        return edge.pcurve.as_ref().map(|p| p.points().to_vec());
    };
    let mut start: Option<Vec2> = None;
    let mut found = Vec::new();
    for p in samples_of(curve) {
        let first = || nearest_control_point(base, &p);
        let foot = |uv: Vec2| {
            let (uv, d) = base.closest_locally(&p, uv);
            let off = ((d.s - p).norm() - distance).abs();
            (off <= limit).then_some(uv)
        };
        let uv = start.and_then(foot).or_else(|| foot(first()))?;
        start = Some(uv);
        found.push(uv);
    }
    Some(found)
}

/// Points of a curve, both ends included.
fn samples_of(curve: &Curve3) -> Vec<Vec3> {
    let [a, b] = curve.domain();
    let spans = breaks_of(curve.knots(), [a, b]).len() - 1;
    let n = (SAMPLES_PER_SPAN * spans).clamp(SAMPLES[0], SAMPLES[1]);
    (0..=n).map(|k| curve.point(a + (b - a) * k as f64 / n as f64)).collect()
}

/// Parameters (Greville abscissae) of the control point closest to `p`.
fn nearest_control_point(base: &Surface, p: &Vec3) -> Vec2 {
    let distance = |q: &Vec3| (q - p).norm_squared();
    let all = base.points().iter().enumerate();
    let nearest = all.min_by(|a, b| distance(a.1).total_cmp(&distance(b.1))).map_or(0, |(k, _)| k);
    let count = base.count()[1];
    let greville = |k: usize, i: usize| {
        let degree = base.degrees()[k];
        base.knots()[k][i + 1..=i + degree].iter().sum::<f64>() / degree as f64
    };
    Vec2::new(greville(0, nearest / count), greville(1, nearest % count))
}

/// A range of parameter `k` widened to the knots beyond it, and by one span more; at most the domain.
fn with_neighbours(base: &Surface, k: usize, [low, high]: [f64; 2]) -> [f64; 2] {
    let breaks = breaks_of(base.knots()[k], base.domain()[k]);
    let below = breaks.iter().filter(|t| **t < low).count();
    let above = breaks.iter().filter(|t| **t > high).count();
    [breaks[below.saturating_sub(2)], breaks[breaks.len() - 1 - above.saturating_sub(2)]]
}

/// The same nested offsets on another spline.
fn on_base(surface: &RawSurface, spline: Surface) -> RawSurface {
    match surface {
        RawSurface::Offset { base, distance } => {
            RawSurface::Offset { base: Box::new(on_base(base, spline)), distance: *distance }
        }
        _ => RawSurface::Nurbs(spline),
    }
}
