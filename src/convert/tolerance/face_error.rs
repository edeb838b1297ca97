//! Evaluation of one face alone: errors of its patches for given divisions of its edges, by the audit. Results are
//! cached.

use std::collections::BTreeMap;
use std::sync::Mutex;

use rustc_hash::FxHashMap;

use super::budget::Budget;
use super::face_result::FaceResult;
use super::scope::{Scope, shift_face_numbers};
use super::slide_estimate::Neighbours;
use crate::audit::{AuditOptions, CadReference, audit};
use crate::cad::model::Edge;
use crate::convert::{ConvertOptions, convert};
use crate::geometry::{Aabb, Vec3};
use crate::mesh::SurfaceMesh;
use crate::mesh::mapped::is_crease;
use crate::mesh::mapped::plan::{Divisions, Plan};
use crate::tool::side::{SideCurve, sides_used_once};
use crate::tool::{Patch, ToolModel};

/// Tolerance factors for faces evaluated alone, largest first: the vertex motion of the complete model reduces the
/// errors.
const TOLERANCE_FACTORS: [f64; 9] = [5.0, 3.5, 2.5, 2.0, 1.8, 1.6, 1.4, 1.2, 1.0];
/// Tolerance factors where the reduction by the vertex motion is estimated. They exceed 1 because adjacent faces share
/// vertices, so that the estimate is not exact.
const TOLERANCE_FACTORS_ESTIMATED: [f64; 3] = [1.6, 1.3, 1.0];

/// Key of a result: face, divisions of its edges in loop order, density, mapped.
type Key = (usize, Vec<usize>, usize, bool);

/// Evaluates the faces of a plan.
pub(super) struct FaceEvaluator<'a> {
    plan: &'a Plan<'a>,
    reference: &'a CadReference<'a>,
    options: ConvertOptions,
    /// Number of the first face of the plan in the reference.
    first: u32,
    /// True when normals have a tolerance.
    normals: bool,
    /// Adjacent faces, if errors are estimated after the vertex motion.
    neighbours: Option<&'a Neighbours>,
    /// For each edge of the plan, true when the distance of patch sides from it is measured. These are the edges at
    /// free borders and those that adjacent faces divide independently.
    measured_edges: &'a [bool],
    /// For each edge, true at a free border.
    free_edges: &'a [bool],
    /// For each edge, true when its faces meet at an angle.
    creases: Vec<bool>,
    /// Bounding boxes of the edges, widened by the tolerance of vertices on edges.
    boxes: Vec<Aabb>,
    cache: Mutex<FxHashMap<Key, FaceResult>>,
    budget: &'a Budget,
}

impl<'a> FaceEvaluator<'a> {
    /// Prepares the evaluation of the faces of `scope` and starts a search of its budget. With `neighbours`, errors are
    /// estimated after the vertex motion.
    pub fn new(
        scope: &'a Scope<'_>,
        measured_edges: &'a [bool],
        neighbours: Option<&'a Neighbours>,
    ) -> Self {
        scope.budget.start_search();
        let options = ConvertOptions { sheet_side: None, flip: false, ..scope.options.clone() };
        let &Scope { ref plan, reference, first, normals, .. } = scope;
        let model = plan.model();
        let margin = 1e-6 * model.bbox().diagonal() + 2.0 * model.join_tolerance;
        let hull = |e: &Edge| Aabb::of_points(e.curve.points()).widened(margin);
        Self {
            plan,
            reference,
            options,
            first,
            normals,
            neighbours,
            measured_edges,
            free_edges: &scope.free_edges,
            creases: model.edges.iter().map(|e| is_crease(model, e)).collect(),
            boxes: model.edges.iter().map(hull).collect(),
            cache: Mutex::default(),
            budget: &scope.budget,
        }
    }

    /// Result of face `f` with these divisions of its edges and, inside, `density` divisions per quarter turn.
    pub fn evaluate(&self, f: usize, divisions: &Divisions, density: usize) -> FaceResult {
        let counts = self.edges(f).map(|e| divisions.counts[e]).collect();
        let key: Key = (f, counts, density, divisions.mapped[f]);
        let cached = |k: &Key| self.cache.lock().ok()?.get(k).cloned();
        if let Some(found) = cached(&key) {
            return found;
        }
        let mesh = self.plan.face(f, divisions, density).ok();
        let count = mesh.as_ref().map_or(0, |mesh| mesh.elements.len());
        let without_area = |mesh: &SurfaceMesh| {
            mesh.elements.is_empty().then_some(FaceResult::without_patches(0.0))
        };
        let found = mesh
            .and_then(|mesh| without_area(&mesh).or_else(|| self.evaluate_mesh(f, &mesh)))
            .unwrap_or(FaceResult::without_patches(f64::INFINITY));
        if let Ok(mut cache) = self.cache.lock()
            && cache.insert(key, found.clone()).is_none()
        {
            self.budget.add_evaluated(1 + count as u64);
        }
        found
    }

    /// Work done and its limits.
    pub fn budget(&self) -> &Budget {
        self.budget
    }

    /// Result of a mesh of face `f`; `None` when its patches fold or cannot be made.
    fn evaluate_mesh(&self, f: usize, mesh: &SurfaceMesh) -> Option<FaceResult> {
        let (mut tool, made) = convert(self.plan.model(), mesh, &self.options).ok()?;
        let edge_deviations = self.edge_deviations(f, &tool);
        shift_face_numbers(&mut tool, self.first);
        if !made.folded.is_empty() {
            return None;
        }
        let options = AuditOptions {
            samples: 4,
            refine: 4,
            refine_normals: self.normals,
            borders: false,
            ..AuditOptions::default()
        };
        let found = audit(&tool, self.reference, &options).ok()?;
        let report = &found.report;
        if !report.folded.is_empty() {
            return None;
        }
        let edge = |side: &SideCurve<'_>| self.edge_of_side(f, side);
        let error_mm = match self.neighbours {
            Some(n) => n.estimate_error(f, (&tool, &found), &self.options, edge).ok()?,
            None => report.worst_mm(),
        };
        let (crease_deviation_mm, at) = self.crease_deviation(f, &tool, &made.redone);
        let worst = report.worst.first().map(|w| w.point.into());
        Some(FaceResult {
            patches: tool.patches.len(),
            error_mm,
            normal_deg: report.normal_max_deg,
            worst_point: if crease_deviation_mm > error_mm { at } else { worst },
            crease_deviation_mm,
            edge_deviations,
        })
    }

    /// Measured edges of face `f`, each with the maximum distance of the patch sides on it [mm], at 7 interior points
    /// of a side.
    fn edge_deviations(&self, f: usize, tool: &ToolModel) -> Vec<(usize, f64)> {
        const STEPS: usize = 8;
        let mut deviations: BTreeMap<usize, f64> =
            self.edges(f).filter(|&e| self.measured_edges[e]).map(|e| (e, 0.0)).collect();
        if deviations.is_empty() {
            return Vec::new();
        }
        let rings: Vec<&[u32]> = tool.corners.iter().map(|c| &c.vertices[..]).collect();
        for (sides, p) in sides_used_once(&rings).iter().zip(&tool.patches) {
            for curve in sides.iter().map(|&side| SideCurve::new(p, side)) {
                let Some(e) = self.edge_of_side(f, &curve) else { continue };
                let Some(most) = deviations.get_mut(&e) else { continue };
                let steps = (1..STEPS).map(|k| curve.parameters(k as f64 / STEPS as f64));
                *most = steps.map(|at| self.edge_deviation(e, p, at)).fold(*most, f64::max);
            }
        }
        deviations.into_iter().collect()
    }

    /// Distance of a point of a patch, given by its parameters, from an edge [mm]. At a free border only the component
    /// within the tangent plane of the patch counts.
    fn edge_deviation(&self, e: usize, patch: &Patch, (eta, zeta): (f64, f64)) -> f64 {
        let at = patch.derivs(eta, zeta);
        let curve = &self.plan.model().edges[e].curve;
        let vector = curve.point(curve.closest(&at.s).0) - at.s;
        let normal = at.normal(eta, zeta).filter(|_| self.free_edges[e]);
        normal.map_or(vector, |n| vector - n * n.dot(&vector)).norm()
    }

    /// Maximum distance from their creases of sides that lost their curves [mm], and its position. `redone` lists the
    /// patches whose curves were replaced. Smooth edges are not considered: there the shape error is of second order in
    /// this distance.
    fn crease_deviation(&self, f: usize, tool: &ToolModel, redone: &[u32]) -> (f64, Option<Vec3>) {
        let none = (0.0, None);
        if redone.is_empty() {
            return none;
        }
        let rings: Vec<&[u32]> = tool.corners.iter().map(|c| &c.vertices[..]).collect();
        let once = sides_used_once(&rings);
        let sides =
            redone.iter().flat_map(|&k| once[k as usize].iter().map(move |&side| (k, side)));
        let curves = sides.map(|(k, side)| SideCurve::new(&tool.patches[k as usize], side));
        let deviation = |side: SideCurve<'_>| {
            let middle = side.point(0.5);
            let edge = self.edge_of_side(f, &side).filter(|&e| self.creases[e])?;
            Some((self.distance_to_edge(edge, &middle), Some(middle)))
        };
        curves
            .filter_map(deviation)
            .fold(none, |most, next| if next.0 > most.0 { next } else { most })
    }

    /// Distance of a point from an edge of the plan [mm].
    fn distance_to_edge(&self, e: usize, p: &Vec3) -> f64 {
        let curve = &self.plan.model().edges[e].curve;
        (curve.point(curve.closest(p).0) - p).norm()
    }

    /// Tolerance factors to try, largest first.
    pub fn tolerance_factors(&self) -> &'static [f64] {
        if self.neighbours.is_some() { &TOLERANCE_FACTORS_ESTIMATED } else { &TOLERANCE_FACTORS }
    }

    /// Edges of a face.
    fn edges(&self, f: usize) -> impl Iterator<Item = usize> + '_ {
        self.plan.model().faces[f].loops.iter().flat_map(|l| &l.uses).filter_map(|u| u.edge)
    }

    /// Edge of face `f` that contains both ends of a side; of several, the one closest to its middle.
    fn edge_of_side(&self, f: usize, side: &SideCurve<'_>) -> Option<usize> {
        let [from, middle, to] = [0.0, 0.5, 1.0].map(|t| side.point(t));
        let reached =
            |e: &usize| [from, to].iter().all(|p| self.boxes[*e].distance_squared(p) == 0.0);
        // The middle decides between edges with the same ends.
        let distance = |e: usize, p: &Vec3| self.distance_to_edge(e, p);
        let score = |e: usize| distance(e, &from) + distance(e, &to) + 1e-3 * distance(e, &middle);
        let found = self.edges(f).filter(reached).map(|e| (score(e), e));
        found.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map(|f| f.1)
    }
}
