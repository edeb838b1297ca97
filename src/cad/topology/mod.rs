//! Joins the sides of faces into edges and vertices: by place, within a tolerance. A side on which another
//! face has a corner is split there, so that an edge use is always a whole edge.

mod corners;
mod piece;
mod spurs;

use std::cell::OnceCell;

use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

pub(super) use self::piece::Piece;

use self::corners::Corners;
use self::piece::OWN_EDGE;
use super::model::{Edge, EdgeUse, Face, Model};
use super::{Diagnostic, Severity};
use crate::geometry::box_tree::BoxTree;
use crate::geometry::nurbs::{Curve2, Curve3, CurveProjector, Surface};
use crate::geometry::{Aabb, Vec3};

/// A whole side, or what is left of one between two corners, with the points that stand for it.
struct Part {
    piece: Piece,
    ends: [Vec3; 2],
    /// Points at [`PROBES`].
    probes: [Vec3; PROBES.len()],
}

/// A side's place, and what it was cut into.
type Cut = ([usize; 3], Vec<Part>);

/// Points of a side among which corners are looked for.
const SAMPLES: usize = 17;
/// Shares of a side's parameter range at which it must lie on an edge; the middle tells most.
const PROBES: [f64; 7] = [0.5, 0.23, 0.81, 0.07, 0.36, 0.66, 0.94];
/// So many of these may lie off by up to twice the tolerance: a curve that swings out at one place still is the other's.
const ASTRAY: usize = 1;

/// Cuts a model may take, besides [`CUTS_A_CORNER`]: a corner lies on one or two sides of neighbours, and on more only
/// where faces lie on each other, which would make parts with the square of their number.
const CUTS: usize = 4096;
const CUTS_A_CORNER: usize = 4;
/// Fewest and most sides cut before it is seen whether there are too many: few where the last ones took many cuts.
const BLOCK: [usize; 2] = [8, 1024];
/// Edges with the same ends that sides may be compared with, besides [`COMPARED_A_SIDE`].
const COMPARED: usize = 65_536;
const COMPARED_A_SIDE: usize = 64;

/// Fills the model's vertices and edges, and the edge ids of its loops. Says so where faces lie on each other beyond
/// measure: the sides of some are then left whole or free.
pub(super) fn join(model: &mut Model, pieces: Vec<Piece>, tolerance: f64) -> Option<Diagnostic> {
    let tip = |p: &Piece| ends(&model.faces[p.at[0]].surface, &p.pcurve);
    let tips: Vec<[Vec3; 2]> = pieces.par_iter().map(tip).collect();
    let (mut corners, shared) = Corners::of_sides(&pieces, &tips, tolerance);
    let compared = COMPARED + COMPARED_A_SIDE * pieces.len();
    let (mut split, all_cut) = cut_all(&model.faces, pieces, (&corners, &shared), tolerance);
    let mut joined = Joined {
        edges: Vec::new(),
        ids: Vec::new(),
        searches: Vec::new(),
        by_ends: FxHashMap::default(),
        tolerance,
        compared,
    };
    // Later sides of a loop first, so that earlier positions stay right while one becomes several.
    split.sort_by_key(|(at, _)| std::cmp::Reverse(*at));
    for (at, parts) in split {
        let [face, l, k] = at;
        let surface = &model.faces[face].surface;
        let uses: Vec<EdgeUse> =
            parts.into_iter().map(|p| joined.take(surface, p, &mut corners)).collect();
        model.faces[face].loops[l].uses.splice(k..=k, uses);
    }
    model.edges = joined.edges;
    spurs::remove(model);
    number_vertices(model, &corners);
    number_uses(model);
    (!all_cut || joined.compared == 0).then(|| Diagnostic {
        severity: Severity::Warning,
        code: "faces-overlap",
        place: String::new(),
        text: "so many faces lie on each other or end in the same two points that not all sides were joined".into(),
    })
}

/// Sides cut where corners of others lie on them, each with its place; what the file itself joins (`shared`) stays
/// whole. False when so many cuts were due that the last sides were left whole.
fn cut_all(
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
    let mut cuts = CUTS + CUTS_A_CORNER * corners.points.len();
    let mut split: Vec<Cut> = Vec::with_capacity(pieces.len());
    let mut pieces = pieces.into_iter();
    let mut size = BLOCK[0];
    while pieces.len() > 0 {
        let block: Vec<Piece> = pieces.by_ref().take(size).collect();
        let from = split.len();
        split.par_extend(block.into_par_iter().map(|p| cut(p, cuts == 0)));
        let more = || split[from..].iter().map(|(_, parts)| parts.len().saturating_sub(1));
        cuts = cuts.saturating_sub(more().sum());
        let each = more().max().unwrap_or(0);
        size = if cuts == 0 { BLOCK[1] } else { (cuts / (8 + 8 * each)).clamp(BLOCK[0], BLOCK[1]) };
    }
    (split, cuts > 0)
}

impl Part {
    fn new(surface: &Surface, piece: Piece) -> Self {
        let [low, high] = piece.pcurve.domain();
        let at = |s: f64| surface.point(piece.pcurve.point(low + (high - low) * s));
        Self { ends: ends(surface, &piece.pcurve), probes: PROBES.map(at), piece }
    }
}

/// Keeps the corners at which edges end.
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

/// Lists at every edge the uses that name it.
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

/// Cuts a side at the corners of other faces that lie on it.
fn cut_at_corners(
    surface: &Surface,
    piece: Piece,
    (corners, tree): (&Corners, &BoxTree),
    tolerance: f64,
) -> Vec<Piece> {
    let [a, b] = piece.pcurve.domain();
    let t = |k: usize| a + (b - a) * k as f64 / (SAMPLES - 1) as f64;
    let samples: Vec<Vec3> =
        (0..SAMPLES).map(|k| surface.point(piece.pcurve.point(t(k)))).collect();
    let steps = samples.windows(2).map(|w| (w[1] - w[0]).norm());
    let widest = steps.fold(0.0, f64::max);
    let reach = Aabb::of_points(&samples).widened(widest);
    let mut cuts: Vec<f64> = Vec::new();
    let own = [corners.find(&samples[0]), corners.find(&samples[SAMPLES - 1])];
    tree.overlapping(&reach, |id| {
        let (id, corner) = (id as usize, &corners.points[id as usize]);
        if own.contains(&Some(corners.root(id))) || reach.distance_squared(corner) > 0.0 {
            return;
        }
        let near = |p: &Vec3| (p - corner).norm();
        if near(&samples[0]) <= 2.0 * tolerance || near(&samples[SAMPLES - 1]) <= 2.0 * tolerance {
            return;
        }
        let distance = |t: f64| (surface.point(piece.pcurve.point(t)) - corner).norm();
        let k = (0..SAMPLES)
            .min_by(|&i, &j| near(&samples[i]).total_cmp(&near(&samples[j])))
            .unwrap_or(0);
        if near(&samples[k]) > 2.0 * widest {
            return;
        }
        // A curve is hardly ever three times as fast as its chords are on average.
        let speed = 3.0 * widest * (SAMPLES - 1) as f64 / (b - a);
        let bracket = [t(k.saturating_sub(1)), t((k + 1).min(SAMPLES - 1))];
        cuts.extend(first_within(distance, bracket, tolerance, speed));
    });
    cut_at(surface, piece, cuts)
}

/// Cuts a side at parameters of its curve.
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

/// Where a distance is least in a bracket, by golden sections, if that is within the tolerance; given up where the
/// distance, changing no faster than `speed`, cannot fall that far.
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

/// The curve in space of a side: exact along one parameter, else fitted to a small share of the tolerance.
fn image(surface: &Surface, pcurve: &Curve2, tolerance: f64) -> Curve3 {
    if let Some(line) = surface.isoparametric_curve(pcurve) {
        return line;
    }
    let mut breaks: Vec<f64> = pcurve.knots().to_vec();
    breaks.dedup();
    Curve3::fitted(|t| surface.point(pcurve.point(t)), &breaks, 1e-4 * tolerance)
}

/// Points of a curve at [`PROBES`].
fn probes_of(curve: &Curve3) -> [Vec3; PROBES.len()] {
    let [a, b] = curve.domain();
    PROBES.map(|s| curve.point(a + (b - a) * s))
}

/// A side's image is nowhere farther than `most` from a curve that runs the same way.
pub(super) fn lies_along(surface: &Surface, pcurve: &Curve2, curve: &Curve3, most: f64) -> bool {
    let ([a, b], [c, d]) = (pcurve.domain(), curve.domain());
    PROBES.iter().all(|&s| {
        let p = surface.point(pcurve.point(a + (b - a) * s));
        curve.closest_near(&p, c + (d - c) * s, most * most).1 <= most * most
    })
}

struct Joined {
    edges: Vec<Edge>,
    /// The file's own edges.
    ids: Vec<Option<usize>>,
    /// Edges made ready for searches.
    searches: Vec<Search>,
    by_ends: FxHashMap<[usize; 2], Vec<usize>>,
    tolerance: f64,
    /// Comparisons left.
    compared: usize,
}

/// An edge's box and chords; the projector when first asked.
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

    /// Whether a closed side runs against the closed edge it lies on; `None` where it is farther than `reach` from it.
    fn runs_back(&self, curve: &Curve3, probes: &[Vec3; PROBES.len()], reach: f64) -> Option<bool> {
        let [a, b] = curve.domain();
        let at = |s: f64| a + (b - a) * s;
        let [with, against] =
            [PROBES[4], 1.0 - PROBES[4]].map(|s| (curve.point(at(s)) - probes[4]).norm_squared());
        if with < 0.04 * against || against < 0.04 * with {
            return Some(against < with);
        }
        // Near enough to tell the two ways from each other.
        let enough = reach.min(0.02 * self.length).powi(2);
        let place = |k: usize| {
            let p = &probes[k];
            let near = [PROBES[k], 1.0 - PROBES[k]].map(|s| curve.closest_near(p, at(s), enough));
            let found = near.into_iter().find(|n| n.1 <= enough).map(|n| n.0);
            let projector = self.projector(curve);
            found.or_else(|| projector.is_within(p, enough).then(|| projector.closest(p).0))
        };
        Some(place(4)? > place(5)?)
    }

    /// The probes of a side lie on the edge, within `reach` [mm] but for [`ASTRAY`] of them.
    fn carries(
        &self,
        curve: &Curve3,
        probes: &[Vec3; PROBES.len()],
        reversed: bool,
        reach: f64,
    ) -> bool {
        let [from, to] = curve.domain();
        let expected = |s: f64| from + (to - from) * if reversed { 1.0 - s } else { s };
        let mut astray = 0;
        PROBES.iter().zip(probes).all(|(&s, p)| {
            let within = |reach: f64| self.within(curve, p, expected(s), reach);
            within(reach) || {
                astray += 1;
                astray <= ASTRAY && within(2.0 * reach)
            }
        })
    }

    /// No point of the edge is farther than `reach` from `p`; looked for about the parameter `t` first.
    fn within(&self, curve: &Curve3, p: &Vec3, t: f64, reach: f64) -> bool {
        let reach = reach * reach;
        self.bounds.distance_squared(p) <= reach
            && (curve.closest_near(p, t, reach).1 <= reach
                || self.projector(curve).is_within(p, reach))
    }
}

impl Joined {
    /// The use of the edge that this side lies on; a new edge when there is none yet.
    fn take(&mut self, surface: &Surface, part: Part, corners: &mut Corners) -> EdgeUse {
        let [a, b] = part.ends.map(|p| corners.id(&p));
        let piece = part.piece;
        let key = [a.min(b), a.max(b)];
        let candidates = self.by_ends.get(&key).map_or(&[][..], Vec::as_slice);
        for &edge in &candidates[..candidates.len().min(self.compared)] {
            self.compared -= 1;
            let (curve, search) = (&self.edges[edge].curve, &self.searches[edge]);
            let same = piece.edge_id.is_some() && self.ids[edge] == piece.edge_id;
            let own = OWN_EDGE * search.length;
            let reach = if same { own.max(2.0 * self.tolerance) } else { self.tolerance };
            let reversed = if a == b {
                let direction =
                    |of: &[Vec3; PROBES.len()]| search.runs_back(curve, of, 2.0 * reach);
                let own = || direction(&probes_of(piece.curve.as_ref()?));
                direction(&part.probes).or_else(own).unwrap_or(false)
            } else {
                self.edges[edge].vertices != [a, b]
            };
            let on = |points: &[Vec3; PROBES.len()]| search.carries(curve, points, reversed, reach);
            // The sides may meet though their surfaces lie off the file's curves: then their curves do.
            let joins = on(&part.probes) || piece.curve.as_ref().is_some_and(|c| on(&probes_of(c)));
            if joins {
                return EdgeUse { pcurve: piece.pcurve, edge: Some(edge), reversed };
            }
        }
        let curve = piece.curve.unwrap_or_else(|| image(surface, &piece.pcurve, self.tolerance));
        self.searches.push(Search::new(&curve));
        self.edges.push(Edge { curve, vertices: [a, b], uses: Vec::new() });
        self.ids.push(piece.edge_id);
        self.by_ends.entry(key).or_default().push(self.edges.len() - 1);
        EdgeUse { pcurve: piece.pcurve, edge: Some(self.edges.len() - 1), reversed: false }
    }
}
