//! Defects of a joined model: free edges and gaps, inverted, tiny and duplicate faces.

mod free_edges;
#[cfg(test)]
mod tests;
mod text;

use rayon::prelude::*;

use super::area::Measured;
use super::model::{Edge, Face, Model};
use super::raw::LostFace;
use super::topology::{Piece, join, lies_along};
use kanagata_geometry::nurbs::CurveProjector;
use kanagata_geometry::{Aabb, Vec3};

/// Number of sample points per edge for the gap measurement.
const GAP_SAMPLES: usize = 17;
/// Largest gap between free edges relative to the diagonal of the model. Edges farther apart have no gap.
const GAP_MAX_REL: f64 = 1e-2;
/// Largest distance of a free edge from those of other faces, over its length, at which both are sides of one joint.
/// Doubled: slots as wide as a tenth of their length count as open joints.
const OPEN_JOINT_MAX_REL: f64 = 0.05;
/// Point projections allowed for the gaps of all free edges, and at least per edge; some tens are needed where few
/// edges are close; edges beside others are measured twice. Doubled: twice the longest time of `--health`, about a second.
const GAP_PROJECTIONS_TOTAL: usize = 400_000;
const GAP_PROJECTIONS_MIN: usize = 512;
/// Maximum number of faces of about equal area with which a face is compared; a die has fewer equal holes. Doubled: ten
/// thousand equal faces take 0.1 s longer.
const COMPARISONS_MAX: usize = 10_000;
/// Largest area of a face relative to the squared diagonal of its bounding box. A sphere has 1.05, a deep pleat about
/// 10.
const AREA_MAX_REL: f64 = 100.0;

/// Defects of a joined model. Faces and edges are indices into the model.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
pub struct Health {
    /// Distance within which edges were joined [mm].
    pub join_tolerance_mm: f64,
    /// Edges used by one face only, longest first.
    pub free_edges: Vec<FreeEdge>,
    /// Total length of free edges [mm].
    pub free_edge_length_mm: f64,
    /// Edges used more than twice.
    pub crowded_edges: Vec<usize>,
    /// Largest distance of a joined side from its edge [mm].
    pub largest_gap_mm: f64,
    /// Connected parts and their orientation.
    pub parts: Vec<Part>,
    /// Faces that traverse a shared edge in the same direction as their neighbour.
    pub disagreeing_faces: Vec<usize>,
    /// Faces with a mean width (twice the area over the perimeter) below the joining tolerance.
    pub tiny_faces: Vec<usize>,
    /// Pairs of coincident faces.
    pub duplicate_faces: Vec<[usize; 2]>,
    /// Faces of the file that are not in the model, with the reason.
    pub lost_faces: Vec<LostFace>,
    /// Faces of area 0 or below, or larger than any surface in their bounding box: their boundary or parameters were
    /// misinterpreted.
    pub impossible_faces: Vec<usize>,
    /// Faces whose area did not converge within the evaluation budget: the area and all quantities derived from it are
    /// estimates.
    pub unmeasured_faces: Vec<usize>,
    /// False when so many faces have equal area that not all of them were compared.
    pub duplicates_searched: bool,
}

/// An edge used by a single face.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct FreeEdge {
    /// Index of the edge.
    pub edge: usize,
    /// The face.
    pub face: usize,
    /// Length [mm].
    pub length_mm: f64,
    /// Joining tolerance that would close it [mm]: the largest distance of its points from the nearest other free edge.
    /// `None` above 1 % of the diagonal of the model.
    pub gap_mm: Option<f64>,
    /// False when the projection budget was exhausted by many close free edges.
    pub gap_measured: bool,
    /// Largest distance of its points from the nearest free edge of another face [mm], where it is at most a twentieth
    /// of the length: both faces end here and are not joined.
    pub open_joint_mm: Option<f64>,
    /// The point with that distance [mm].
    #[serde(skip)]
    pub open_joint_at: Option<Vec3>,
}

/// Free edges that run beside those of other faces, which are not joined there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpenJoints {
    /// Number of such edges.
    pub edges: usize,
    /// Largest distance of their points from the nearest free edge of another face [mm].
    pub widest_mm: f64,
    /// The face of the edge with that distance.
    pub face: usize,
    /// The point with that distance [mm].
    pub at: Vec3,
    /// Distance within which edges are joined [mm].
    pub join_tolerance_mm: f64,
}

/// Faces connected across edges.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Part {
    /// Faces.
    pub faces: Vec<usize>,
    /// Every edge has two uses.
    pub closed: bool,
    /// Enclosed volume [mm3] by the orientation of the faces; 0 for an open part.
    pub volume_mm3: f64,
    /// A closed part with inward normals that is not a void of another part.
    pub inverted: bool,
}

impl Health {
    /// True without defects. A part that is open by design has free edges and is not sound.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.lost_faces.is_empty()
            && self.free_edges.is_empty()
            && self.crowded_edges.is_empty()
            && self.disagreeing_faces.is_empty()
            && self.tiny_faces.is_empty()
            && self.duplicate_faces.is_empty()
            && self.impossible_faces.is_empty()
            && self.unmeasured_faces.is_empty()
            && self.duplicates_searched
            && self.parts.iter().all(|p| !p.inverted)
    }
}

impl Model {
    /// The model with edges rejoined within `tolerance` [mm]; faces and parameter curves are unchanged.
    #[must_use]
    pub fn joined_within(&self, tolerance: f64) -> Self {
        let mut out = self.clone();
        let mut pieces = Vec::new();
        for (f, face) in self.faces.iter().enumerate() {
            for (l, trim) in face.loops.iter().enumerate() {
                for (k, used) in trim.uses.iter().enumerate() {
                    let Some(edge) = used.edge else { continue };
                    let curve = &self.edges[edge].curve;
                    let curve = if used.reversed { curve.reversed() } else { curve.clone() };
                    let pcurve = used.pcurve.clone();
                    // The edge may stem from another side that is farther away than `tolerance`.
                    let own = lies_along(&face.surface, &pcurve, &curve, tolerance);
                    let curve = own.then_some(curve);
                    pieces.push(Piece { at: [f, l, k], pcurve, curve, edge_id: None });
                }
            }
        }
        out.join_tolerance = tolerance;
        out.left_out.clear();
        join(&mut out, pieces, tolerance);
        out
    }

    /// Examines the joined model for defects.
    #[must_use]
    pub fn health(&self) -> Health {
        let free_edges = self.free_edges(|_| true);
        let crowded = |k: &usize| self.edges[*k].uses.len() > 2;
        let gaps: Vec<f64> =
            self.edges.par_iter().filter(|e| e.uses.len() > 1).map(|e| self.gap(e)).collect();
        let facts: Vec<FaceMeasures> = self.faces.par_iter().map(FaceMeasures::of).collect();
        let those = |is: &dyn Fn(usize) -> bool| (0..facts.len()).filter(|&f| is(f)).collect();
        let (duplicate_faces, duplicates_searched) =
            duplicate_faces(&facts, 4.0 * self.join_tolerance);
        Health {
            join_tolerance_mm: self.join_tolerance,
            free_edge_length_mm: free_edges.iter().map(|e| e.length_mm).fold(0.0, |a, b| a + b),
            free_edges,
            crowded_edges: (0..self.edges.len()).filter(crowded).collect(),
            largest_gap_mm: gaps.into_iter().fold(0.0, f64::max),
            parts: self.parts(),
            disagreeing_faces: self.disagreeing_faces(),
            tiny_faces: those(&|f| self.is_narrow(f, facts[f].measured.area_mm2)),
            duplicate_faces,
            lost_faces: self.lost.clone(),
            impossible_faces: those(&|f| facts[f].is_impossible()),
            unmeasured_faces: those(&|f| !facts[f].measured.is_within),
            duplicates_searched,
        }
    }

    /// Largest distance of the sides of an edge from its curve [mm].
    fn gap(&self, edge: &Edge) -> f64 {
        let curve = CurveProjector::new(&edge.curve);
        let mut worst: f64 = 0.0;
        for &[f, l, k] in &edge.uses {
            let face = &self.faces[f];
            let pcurve = &face.loops[l].uses[k].pcurve;
            let [a, b] = pcurve.domain();
            for i in 0..GAP_SAMPLES {
                let t = a + (b - a) * i as f64 / (GAP_SAMPLES - 1) as f64;
                worst = worst.max(curve.closest(&face.surface.point(pcurve.point(t))).1);
            }
        }
        worst.sqrt()
    }

    /// Connected parts, ordered by their first faces.
    fn parts(&self) -> Vec<Part> {
        let mut neighbours: Vec<Vec<usize>> = vec![Vec::new(); self.faces.len()];
        let mut closed = vec![true; self.faces.len()];
        for edge in &self.edges {
            for used in &edge.uses {
                closed[used[0]] &= edge.uses.len() == 2;
                // Linking all uses to the first one suffices for connectivity.
                let first = edge.uses[0][0];
                neighbours[used[0]].push(first);
                neighbours[first].push(used[0]);
            }
        }
        let mut seen = vec![false; self.faces.len()];
        let mut out = Vec::new();
        for first in 0..self.faces.len() {
            if seen[first] {
                continue;
            }
            seen[first] = true;
            let (mut faces, mut at) = (vec![first], 0);
            while let Some(&face) = faces.get(at) {
                at += 1;
                for &other in &neighbours[face] {
                    if !std::mem::replace(&mut seen[other], true) {
                        faces.push(other);
                    }
                }
            }
            faces.sort_unstable();
            let whole = faces.iter().all(|&f| closed[f]);
            let volume_mm3 = if whole { self.volume_of(&faces) } else { 0.0 };
            out.push(Part { faces, closed: whole, volume_mm3, inverted: false });
        }
        self.mark_inverted(&mut out);
        out
    }

    fn mark_inverted(&self, parts: &mut [Part]) {
        let negative: Vec<usize> =
            (0..parts.len()).filter(|&k| parts[k].volume_mm3 < 0.0).collect();
        if negative.is_empty() {
            return;
        }
        let boxes: Vec<Aabb> = parts
            .iter()
            .map(|p| p.faces.iter().fold(Aabb::EMPTY, |b, &f| b.union(&self.faces[f].bbox())))
            .collect();
        for &k in &negative {
            let around = |j: usize| {
                j != k
                    && parts[j].volume_mm3 > -parts[k].volume_mm3
                    && boxes[j].distance_squared(&boxes[k].min) == 0.0
                    && boxes[j].distance_squared(&boxes[k].max) == 0.0
            };
            let void = (0..parts.len()).any(around);
            parts[k].inverted = !void;
        }
    }

    fn disagreeing_faces(&self) -> Vec<usize> {
        let mut out = Vec::new();
        for edge in &self.edges {
            let [a, b] = edge.uses[..] else { continue };
            let same = super::orient::runs_against(self, a) == super::orient::runs_against(self, b);
            if a[0] != b[0] && same {
                out.extend([a[0], b[0]]);
            }
        }
        out.sort_unstable();
        out.dedup();
        out
    }

    /// True when the mean width of face `f` (twice the area over the perimeter) is at most the joining tolerance.
    #[must_use]
    pub fn is_tiny(&self, f: usize) -> bool {
        self.is_narrow(f, self.faces[f].area(1e-9))
    }

    fn is_narrow(&self, f: usize, area: f64) -> bool {
        let uses = self.faces[f].loops.iter().flat_map(|l| &l.uses);
        let edges = uses.filter_map(|u| u.edge);
        let border: f64 = edges.map(|e| self.edges[e].curve.length()).sum();
        let tolerance = self.join_tolerance;
        2.0 * area <= tolerance * (border + tolerance)
    }
}

/// Quantities by which faces are compared.
struct FaceMeasures {
    measured: Measured,
    bounds: Aabb,
}

impl FaceMeasures {
    fn of(face: &Face) -> Self {
        Self { measured: face.measured(1e-9), bounds: face.bbox() }
    }

    /// True when the area is not positive, not finite or above [`AREA_MAX_REL`].
    fn is_impossible(&self) -> bool {
        let area = self.measured.area_mm2;
        !area.is_finite() || area <= 0.0 || area > AREA_MAX_REL * self.bounds.diagonal().powi(2)
    }

    fn is_same(&self, other: &Self, near: f64) -> bool {
        let near = |a: &Vec3, b: &Vec3| (a - b).norm() <= near;
        near(&self.measured.centroid, &other.measured.centroid)
            && near(&self.bounds.min, &other.bounds.min)
            && near(&self.bounds.max, &other.bounds.max)
    }
}

/// Pairs of faces with equal area, centroid and bounding box within `near` [mm], and whether the search was complete.
/// Each face is compared with at most [`COMPARISONS_MAX`] successors in the order of areas.
fn duplicate_faces(facts: &[FaceMeasures], near: f64) -> (Vec<[usize; 2]>, bool) {
    let area = |f: usize| facts[f].measured.area_mm2;
    let mut order: Vec<usize> = (0..facts.len()).collect();
    // Faces of equal area are ordered by position, so that copies become neighbours.
    let place = |f: usize| facts[f].bounds.min;
    order.sort_by(|&a, &b| {
        let [p, q] = [place(a), place(b)];
        let by_place = || p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z));
        area(a).total_cmp(&area(b)).then_with(by_place)
    });
    let (mut out, mut searched) = (Vec::new(), true);
    for (i, &a) in order.iter().enumerate() {
        let reach = area(a) * (1.0 + 1e-4) + (0.25 * near).powi(2);
        let alike = order[i + 1..].iter().take_while(|&&b| area(b) <= reach);
        for (k, &b) in alike.enumerate() {
            if k == COMPARISONS_MAX {
                searched = false;
                break;
            }
            if facts[a].is_same(&facts[b], near) {
                out.push([a.min(b), a.max(b)]);
            }
        }
    }
    out.sort_unstable();
    (out, searched)
}

fn samples(edge: &Edge) -> Vec<Vec3> {
    let [a, b] = edge.curve.domain();
    let at = |k: usize| edge.curve.point(a + (b - a) * k as f64 / (GAP_SAMPLES - 1) as f64);
    (0..GAP_SAMPLES).map(at).collect()
}
