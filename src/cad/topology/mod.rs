//! Topology: joins the sides of faces into edges and vertices by position, within a tolerance. A side with a corner of
//! another face on it is split there, so that an edge use is always an entire edge.

mod corners;
mod piece;
mod spurs;

use std::cell::OnceCell;

use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

pub(super) use self::piece::Piece;

use self::corners::Corners;
use self::piece::SHARED_EDGE_TOLERANCE_REL;
use super::model::{Edge, EdgeUse, Face, Model};
use super::{Diagnostic, Severity};
use kanagata_geometry::box_tree::BoxTree;
use kanagata_geometry::nurbs::{Curve2, Curve3, CurveProjector, Surface};
use kanagata_geometry::{Aabb, Vec3};

/// A side, or a part of one between two corners, with its sample points.
struct Part {
    piece: Piece,
    ends: [Vec3; 2],
    probes: Probes,
}

/// Points at [`PROBE_PARAMETERS`].
type Probes = [Vec3; PROBE_PARAMETERS.len()];
/// Location of a side, and the parts into which it is split.
type Cut = ([usize; 3], Vec<Part>);

/// Number of samples of a side in the search for corners on it.
const CORNER_SAMPLES: usize = 17;
/// Relative parameters of the points at which a side must lie on an edge, the most selective first.
const PROBE_PARAMETERS: [f64; 7] = [0.5, 0.23, 0.81, 0.07, 0.36, 0.66, 0.94];
/// Probe points allowed to deviate by up to twice the tolerance: a local deviation does not detach a side.
const DEVIATING_PROBES_MAX: usize = 1;

/// Splits allowed per model, in addition to [`SPLITS_PER_CORNER`]. A corner lies on one or two sides of neighbours, and
/// on more only where faces coincide. There the number of parts would grow with the square of the number of sides.
const SPLITS_BASE: usize = 4096;
const SPLITS_PER_CORNER: usize = 4;
/// Smallest and largest number of sides split before the split limit is checked; smaller after sides with many splits.
const BLOCK_SIZES: [usize; 2] = [8, 1024];
/// Comparisons of sides with edges of equal ends allowed per model, in addition to [`COMPARISONS_PER_SIDE`].
const COMPARISONS_BASE: usize = 65_536;
const COMPARISONS_PER_SIDE: usize = 64;

/// Computes the model's vertices and edges, and the edge indices of its loops. Returns a warning when faces coincide so
/// often that a limit was reached; some sides then remain unsplit or free.
pub(super) fn join(model: &mut Model, pieces: Vec<Piece>, tolerance: f64) -> Option<Diagnostic> {
    let tip = |p: &Piece| ends(&model.faces[p.at[0]].surface, &p.pcurve);
    let tips: Vec<[Vec3; 2]> = pieces.par_iter().map(tip).collect();
    let (mut corners, shared) = Corners::of_sides(&pieces, &tips, tolerance);
    let comparisons = COMPARISONS_BASE + COMPARISONS_PER_SIDE * pieces.len();
    let (mut split, all_cut) = split_all(&model.faces, pieces, (&corners, &shared), tolerance);
    let mut joined = Joined {
        edges: Vec::new(),
        ids: Vec::new(),
        searches: Vec::new(),
        by_ends: FxHashMap::default(),
        tolerance,
        comparisons,
    };
    // Process later sides of a loop first, so that the positions of earlier ones remain valid.
    split.sort_by_key(|(at, _)| std::cmp::Reverse(*at));
    for (at, parts) in split {
        let [face, l, k] = at;
        let surface = &model.faces[face].surface;
        let uses: Vec<EdgeUse> =
            parts.into_iter().map(|p| joined.edge_use(surface, p, &mut corners)).collect();
        model.faces[face].loops[l].uses.splice(k..=k, uses);
    }
    model.edges = joined.edges;
    spurs::remove(model);
    number_vertices(model, &corners);
    number_uses(model);
    (!all_cut || joined.comparisons == 0).then(|| Diagnostic {
        severity: Severity::Warning,
        code: "faces-overlap",
        place: String::new(),
        text: "too many coincident faces, or edges with the same two end points: not all sides were joined".into(),
    })
}

/// Splits sides at corners of others that lie on them, each with its location. Edges shared in the file (`shared`) are
/// not split. False when the split limit was reached and the last sides were left unsplit.
fn split_all(
    faces: &[Face],
    pieces: Vec<Piece>,
    (corners, shared): (&Corners, &FxHashSet<usize>),
    tolerance: f64,
) -> (Vec<Cut>, bool) {
    let places: Vec<Aabb> = corners.points.iter().map(|p| Aabb::of_points([p])).collect();
    let tree = BoxTree::build(&places);
    let cut = |piece: Piece, all_whole: bool| {
        let whole = all_whole || piece.edge_id.is_some_and(|id| shared.contains(&id));
        let (at, surface) = (piece.at, &faces[piece.at[0]].surface);
        let pieces = if whole {
            vec![piece]
        } else {
            cut_at_corners(surface, piece, (corners, &tree), tolerance)
        };
        let parts: Vec<Part> = pieces.into_iter().map(|p| Part::new(surface, p)).collect();
        (at, parts)
    };
    let mut cuts = SPLITS_BASE + SPLITS_PER_CORNER * corners.points.len();
    let mut split: Vec<Cut> = Vec::with_capacity(pieces.len());
    let mut pieces = pieces.into_iter();
    let mut size = BLOCK_SIZES[0];
    while pieces.len() > 0 {
        let block: Vec<Piece> = pieces.by_ref().take(size).collect();
        let from = split.len();
        split.par_extend(block.into_par_iter().map(|p| cut(p, cuts == 0)));
        let more = || split[from..].iter().map(|(_, parts)| parts.len().saturating_sub(1));
        cuts = cuts.saturating_sub(more().sum());
        let each = more().max().unwrap_or(0);
        size = if cuts == 0 {
            BLOCK_SIZES[1]
        } else {
            (cuts / (8 + 8 * each)).clamp(BLOCK_SIZES[0], BLOCK_SIZES[1])
        };
    }
    (split, cuts > 0)
}

impl Part {
    fn new(surface: &Surface, piece: Piece) -> Self {
        let [low, high] = piece.pcurve.domain();
        let at = |s: f64| surface.point(piece.pcurve.point(low + (high - low) * s));
        Self { ends: ends(surface, &piece.pcurve), probes: PROBE_PARAMETERS.map(at), piece }
    }
}

/// Keeps the corners that are ends of edges, and numbers them.
fn number_vertices(model: &mut Model, corners: &Corners) {
    let mut numbers = vec![usize::MAX; corners.points.len()];
    model.vertices.clear();
    for end in model.edges.iter_mut().flat_map(|e| &mut e.vertices) {
        let root = corners.root(*end);
        if numbers[root] == usize::MAX {
            numbers[root] = model.vertices.len();
            model.vertices.push(corners.points[root]);
        }
        *end = numbers[root];
    }
}

/// Lists the uses of every edge.
fn number_uses(model: &mut Model) {
    for (f, face) in model.faces.iter().enumerate() {
        for (l, trim) in face.loops.iter().enumerate() {
            for (k, used) in trim.uses.iter().enumerate() {
                if let Some(edge) = used.edge {
                    model.edges[edge].uses.push([f, l, k]);
                }
            }
        }
    }
}

fn ends(surface: &Surface, pcurve: &Curve2) -> [Vec3; 2] {
    let [a, b] = pcurve.domain();
    [surface.point(pcurve.point(a)), surface.point(pcurve.point(b))]
}

/// Splits a side at the corners of other faces on it.
fn cut_at_corners(
    surface: &Surface,
    piece: Piece,
    (corners, tree): (&Corners, &BoxTree),
    tolerance: f64,
) -> Vec<Piece> {
    let [a, b] = piece.pcurve.domain();
    let t = |k: usize| a + (b - a) * k as f64 / (CORNER_SAMPLES - 1) as f64;
    let samples: Vec<Vec3> =
        (0..CORNER_SAMPLES).map(|k| surface.point(piece.pcurve.point(t(k)))).collect();
    let steps = samples.windows(2).map(|w| (w[1] - w[0]).norm());
    let widest = steps.fold(0.0, f64::max);
    let reach = Aabb::of_points(&samples).widened(widest);
    let mut cuts: Vec<f64> = Vec::new();
    let own = [corners.find(&samples[0]), corners.find(&samples[CORNER_SAMPLES - 1])];
    tree.overlapping(&reach, |id| {
        let (id, corner) = (id as usize, &corners.points[id as usize]);
        if own.contains(&Some(corners.root(id))) || reach.distance_squared(corner) > 0.0 {
            return;
        }
        let near = |p: &Vec3| (p - corner).norm();
        if [&samples[0], &samples[CORNER_SAMPLES - 1]].iter().any(|p| near(p) <= 2.0 * tolerance) {
            return;
        }
        let distance = |t: f64| (surface.point(piece.pcurve.point(t)) - corner).norm();
        let k = (0..CORNER_SAMPLES)
            .min_by(|&i, &j| near(&samples[i]).total_cmp(&near(&samples[j])))
            .unwrap_or(0);
        if near(&samples[k]) > 2.0 * widest {
            return;
        }
        // The parameter speed hardly ever exceeds three times that of the chords on average.
        let speed = 3.0 * widest * (CORNER_SAMPLES - 1) as f64 / (b - a);
        let bracket = [t(k.saturating_sub(1)), t((k + 1).min(CORNER_SAMPLES - 1))];
        cuts.extend(first_within(distance, bracket, tolerance, speed));
    });
    cut_at(surface, piece, cuts)
}

/// Splits a side at parameters of its curve.
fn cut_at(surface: &Surface, piece: Piece, mut cuts: Vec<f64>) -> Vec<Piece> {
    let [a, b] = piece.pcurve.domain();
    cuts.sort_by(f64::total_cmp);
    cuts.dedup_by(|x, y| *x - *y <= 1e-9 * (b - a));
    if cuts.is_empty() {
        return vec![piece];
    }
    let bounds: Vec<f64> = [vec![a], cuts, vec![b]].concat();
    bounds.windows(2).filter_map(|w| part(surface, &piece, w[0], w[1])).collect()
}

fn part(surface: &Surface, piece: &Piece, from: f64, to: f64) -> Option<Piece> {
    let pcurve = piece.pcurve.trimmed(from, to).ok()?;
    let curve = piece.curve.as_ref().and_then(|c| {
        let [a, b] = ends(surface, &pcurve);
        c.trimmed(c.closest(&a).0, c.closest(&b).0).ok()
    });
    Some(Piece { at: piece.at, pcurve, curve, edge_id: piece.edge_id })
}

/// Golden-section search for the minimum of a distance in a bracket, returned if it is within the tolerance. Aborts
/// when a distance with a slope of at most `speed` cannot decrease that far.
fn first_within(
    f: impl Fn(f64) -> f64,
    [mut a, mut b]: [f64; 2],
    tolerance: f64,
    speed: f64,
) -> Option<f64> {
    const RATIO: f64 = 0.618_033_988_749_894_9;
    let (mut c, mut d) = (b - RATIO * (b - a), a + RATIO * (b - a));
    let (mut fc, mut fd) = (f(c), f(d));
    for _ in 0..80 {
        if fc.min(fd) > tolerance + speed * (b - a) {
            return None;
        }
        if fc < fd {
            (b, d, fd) = (d, c, fc);
            c = b - RATIO * (b - a);
            fc = f(c);
        } else {
            (a, c, fc) = (c, d, fd);
            d = a + RATIO * (b - a);
            fd = f(d);
        }
    }
    let at = 0.5 * (a + b);
    (f(at) <= tolerance).then_some(at)
}

/// Space curve of a side: exact for isoparametric lines, otherwise fitted to a fraction of the tolerance.
pub(super) fn space_curve(surface: &Surface, pcurve: &Curve2, tolerance: f64) -> Curve3 {
    if let Some(line) = surface.isoparametric_curve(pcurve) {
        return line;
    }
    let mut breaks: Vec<f64> = pcurve.knots().to_vec();
    breaks.dedup();
    Curve3::fitted(|t| surface.point(pcurve.point(t)), &breaks, 1e-4 * tolerance)
}

/// Probe points of a curve.
fn probes_of(curve: &Curve3) -> Probes {
    let [a, b] = curve.domain();
    PROBE_PARAMETERS.map(|s| curve.point(a + (b - a) * s))
}

/// True when the image of a side is within `limit` [mm] of a curve in the same direction.
pub(super) fn lies_along(surface: &Surface, pcurve: &Curve2, curve: &Curve3, limit: f64) -> bool {
    let ([a, b], [c, d]) = (pcurve.domain(), curve.domain());
    PROBE_PARAMETERS.iter().all(|&s| {
        let p = surface.point(pcurve.point(a + (b - a) * s));
        curve.closest_near(&p, c + (d - c) * s, limit * limit).1 <= limit * limit
    })
}

struct Joined {
    edges: Vec<Edge>,
    /// Edge identities in the file.
    ids: Vec<Option<usize>>,
    /// Search structures of the edges.
    searches: Vec<Search>,
    by_ends: FxHashMap<[usize; 2], Vec<usize>>,
    tolerance: f64,
    /// Remaining comparisons.
    comparisons: usize,
}

/// Bounding box and length of an edge; the projector is built on demand.
struct Search {
    bounds: Aabb,
    length: f64,
    projector: OnceCell<CurveProjector>,
}

impl Search {
    fn new(curve: &Curve3) -> Self {
        let [a, b] = curve.domain();
        let at = |k: u32| curve.point(a + (b - a) * f64::from(k) / 16.0);
        let length = (0..16).map(|k| (at(k + 1) - at(k)).norm()).sum();
        Self { bounds: Aabb::of_points(curve.points()), length, projector: OnceCell::new() }
    }

    fn projector(&self, curve: &Curve3) -> &CurveProjector {
        self.projector.get_or_init(|| CurveProjector::new(curve))
    }

    /// True when a closed side is opposite to the closed edge on which it lies; `None` beyond the distance `reach`.
    fn is_reversed(&self, curve: &Curve3, probes: &Probes, reach: f64) -> Option<bool> {
        let [a, b] = curve.domain();
        let at = |s: f64| a + (b - a) * s;
        let [with, against] = [PROBE_PARAMETERS[4], 1.0 - PROBE_PARAMETERS[4]]
            .map(|s| (curve.point(at(s)) - probes[4]).norm_squared());
        if with < 0.04 * against || against < 0.04 * with {
            return Some(against < with);
        }
        // Close enough to distinguish both directions.
        let enough = reach.min(0.02 * self.length).powi(2);
        let place = |k: usize| {
            let p = &probes[k];
            let near = [PROBE_PARAMETERS[k], 1.0 - PROBE_PARAMETERS[k]]
                .map(|s| curve.closest_near(p, at(s), enough));
            let found = near.into_iter().find(|n| n.1 <= enough).map(|n| n.0);
            let projector = self.projector(curve);
            found.or_else(|| projector.is_within(p, enough).then(|| projector.closest(p).0))
        };
        Some(place(4)? > place(5)?)
    }

    /// True when the probe points lie within `reach` [mm] of the edge, except for [`DEVIATING_PROBES_MAX`] of them.
    fn contains_probes(&self, curve: &Curve3, probes: &Probes, reversed: bool, reach: f64) -> bool {
        let [from, to] = curve.domain();
        let expected = |s: f64| from + (to - from) * if reversed { 1.0 - s } else { s };
        let mut deviating = 0;
        PROBE_PARAMETERS.iter().zip(probes).all(|(&s, p)| {
            let within = |reach: f64| self.within(curve, p, expected(s), reach);
            within(reach) || {
                deviating += 1;
                deviating <= DEVIATING_PROBES_MAX && within(2.0 * reach)
            }
        })
    }

    /// True when the edge is within `reach` of `p`; searches near the parameter `t` first.
    fn within(&self, curve: &Curve3, p: &Vec3, t: f64, reach: f64) -> bool {
        let reach = reach * reach;
        self.bounds.distance_squared(p) <= reach
            && (curve.closest_near(p, t, reach).1 <= reach
                || self.projector(curve).is_within(p, reach))
    }
}

impl Joined {
    /// The edge use of a side: of the existing edge on which it lies, or of a new edge.
    fn edge_use(&mut self, surface: &Surface, part: Part, corners: &mut Corners) -> EdgeUse {
        let [a, b] = part.ends.map(|p| corners.id(&p));
        let piece = part.piece;
        let key = [a.min(b), a.max(b)];
        let candidates = self.by_ends.get(&key).map_or(&[][..], Vec::as_slice);
        for &edge in &candidates[..candidates.len().min(self.comparisons)] {
            self.comparisons -= 1;
            let (curve, search) = (&self.edges[edge].curve, &self.searches[edge]);
            let same = piece.edge_id.is_some() && self.ids[edge] == piece.edge_id;
            let own = SHARED_EDGE_TOLERANCE_REL * search.length;
            let reach = if same { own.max(2.0 * self.tolerance) } else { self.tolerance };
            let reversed = if a == b {
                let direction = |of: &Probes| search.is_reversed(curve, of, 2.0 * reach);
                let own = || direction(&probes_of(piece.curve.as_ref()?));
                direction(&part.probes).or_else(own).unwrap_or(false)
            } else {
                self.edges[edge].vertices != [a, b]
            };
            let on = |points: &Probes| search.contains_probes(curve, points, reversed, reach);
            // Sides may also match by their space curves when their surfaces deviate from them.
            let joins = on(&part.probes) || piece.curve.as_ref().is_some_and(|c| on(&probes_of(c)));
            if joins {
                return EdgeUse { pcurve: piece.pcurve, edge: Some(edge), reversed };
            }
        }
        let curve =
            piece.curve.unwrap_or_else(|| space_curve(surface, &piece.pcurve, self.tolerance));
        self.searches.push(Search::new(&curve));
        self.edges.push(Edge { curve, vertices: [a, b], uses: Vec::new() });
        self.ids.push(piece.edge_id);
        self.by_ends.entry(key).or_default().push(self.edges.len() - 1);
        EdgeUse { pcurve: piece.pcurve, edge: Some(self.edges.len() - 1), reversed: false }
    }
}
