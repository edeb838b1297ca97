//! Independent borders: every face has the divisions that its own error requires, and border curves of its own.
//!
//! Where the gap between two borders exceeds the allowed one, one of the faces is made again with its sides closer to
//! the CAD edge. The face with the largest reduction of the distance per added patch is chosen.

use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

use super::budget::Budget;
use super::error::ToleranceError;
use super::face_error::FaceEvaluator;
use super::faults::{faces_above_tolerance, folded_faces};
use super::goal::{Borders, Goal, Refined};
use super::scope::Scope;
use super::single_face::SingleFace;
use crate::conversion::{crease_count, faces_away};
use crate::{ConvertOptions, ConvertReport};
use kanagata_audit::{AuditOptions, audit, open_sides};
use kanagata_mesh::mapped::plan::Plan;
use kanagata_mesh::mapped::{MappedOptions, mesh};
use kanagata_tool::build::{EdgeChoice, StraightEdge, build};
use kanagata_tool::{GivenCurve, ToolModel};

/// Maximum rounds of refinement of borders with too large a gap.
const ROUNDS_MAX: usize = 60;
/// Allowed gap over the model size without a length tolerance.
const GAP_DEFAULT_REL: f64 = 1e-3;
/// Maximum allowed gap over the model size for any tolerance, just below the limit of tool files.
const GAP_MAX_REL: f64 = 0.99 * kanagata_tool::file::BORDER_GAP_MAX_REL;
/// Minimum distance of a side from its edge, over the allowed gap, for this side to be a cause of the gap.
const CAUSE_RATIO_MIN: f64 = 0.1;

/// Requirements on a face besides the goal.
#[derive(Clone)]
struct FaceRequest {
    /// Allowed distance of patch sides from each edge [mm].
    borders: Vec<f64>,
    /// True when its vertices stay on the CAD.
    on_cad: bool,
}

/// Refined model of a face.
struct FaceModel {
    refined: Refined,
    /// Measured edges, each with the maximum distance of the patch sides on it, before the vertex motion [mm].
    edge_deviations: Vec<(usize, f64)>,
}

impl FaceModel {
    /// Maximum distance of the patch sides on an edge from it, before the vertex motion [mm].
    fn edge_deviation(&self, edge: usize) -> f64 {
        self.edge_deviations.iter().find(|o| o.0 == edge).map_or(0.0, |o| o.1)
    }
}

/// All faces of a scope, each with a scope and an evaluator of its own.
pub(super) struct IndependentFaces<'a> {
    whole: &'a Scope<'a>,
    faces: &'a [SingleFace],
    scopes: &'a [Scope<'a>],
    evaluators: &'a [FaceEvaluator<'a>],
    /// True when the complete model is reversed to face the sheet.
    turned: bool,
}

/// Separates the model of a scope into its faces and returns the result of `then` on them.
///
/// # Errors
/// [`ToleranceError::Mesh`] when the complete model or a face cannot be meshed.
pub(super) fn with_independent_faces<R>(
    whole: &Scope<'_>,
    then: impl FnOnce(&IndependentFaces<'_>) -> R,
) -> Result<R, ToleranceError> {
    let model = whole.plan.model();
    let coarse = mesh(model, &MappedOptions { arc_divisions: 2, ..whole.mesh })?;
    let turned = faces_away(&coarse, whole.options.sheet_side);
    let flip = turned ^ whole.options.flip;
    let options = ConvertOptions { sheet_side: None, flip, ..whole.options.clone() };
    let face = |f| SingleFace::new(model, &whole.free_edges, f);
    let faces: Vec<SingleFace> = (0..model.faces.len()).map(face).collect();
    let scopes = faces.iter().enumerate().map(|(f, face)| scope_of_face(whole, face, f, &options));
    let scopes: Vec<Scope<'_>> = scopes.collect::<Result<_, _>>()?;
    let evaluators: Vec<FaceEvaluator<'_>> = scopes
        .iter()
        .zip(&faces)
        .map(|(scope, face)| FaceEvaluator::new(scope, &face.measured_edges, false))
        .collect();
    let (faces, scopes, evaluators) = (&faces[..], &scopes[..], &evaluators[..]);
    Ok(then(&IndependentFaces { whole, faces, scopes, evaluators, turned }))
}

/// Scope of face `number` of the complete model.
fn scope_of_face<'a>(
    whole: &'a Scope<'_>,
    face: &'a SingleFace,
    number: usize,
    options: &'a ConvertOptions,
) -> Result<Scope<'a>, ToleranceError> {
    let plan = Plan::new(&face.model, &whole.mesh)?;
    let faces = whole.plan.model().faces.len();
    Ok(Scope {
        plan,
        reference: whole.reference,
        first: number as u32,
        mesh: whole.mesh,
        options,
        free_edges: face.free_edges.clone(),
        normals: whole.normals,
        budget: Arc::new(Budget::of_single_face(faces).in_time_of(&whole.budget)),
        neighbours: None,
        evaluations: Arc::default(),
        closest: Arc::default(),
        models: Arc::default(),
    })
}

/// A new model of a face, for an edge with too large a gap.
struct Trial {
    face: usize,
    request: FaceRequest,
    model: FaceModel,
    /// Reduction of the distance of its sides from the edge per added patch [mm].
    gain: f64,
}

impl IndependentFaces<'_> {
    /// Refines every face alone and then its borders, until all gaps are within the allowed one.
    ///
    /// # Errors
    /// [`ToleranceError::NotReached`] names a face that cannot be brought within the tolerance,
    /// [`ToleranceError::Apart`] the position of a gap that cannot.
    pub(super) fn refined(&self, goal: &Goal) -> Result<Refined, ToleranceError> {
        let initial = |scope: &Scope<'_>| {
            let borders = scope.border_tolerances(goal);
            FaceRequest { borders, on_cad: false }
        };
        let mut requests: Vec<FaceRequest> = self.scopes.iter().map(initial).collect();
        let mut models = self.refine_faces(goal, &requests)?;
        let size = self.whole.plan.model().bbox().diagonal();
        let allowed = if goal.tol_mm.is_finite() {
            goal.tol_mm.min(GAP_MAX_REL * size)
        } else {
            GAP_DEFAULT_REL * size
        };
        let mut widest = None;
        for _ in 0..ROUNDS_MAX {
            let tool = join_tools(&models, self.whole.options)?;
            let open = open_sides(&tool, self.whole.reference, AuditOptions::default().samples);
            let gap = open.iter().max_by(|a, b| a.gap_mm.total_cmp(&b.gap_mm));
            if gap.is_none_or(|g| g.gap_mm <= allowed) {
                return self.audited_model(goal, tool, &models);
            }
            widest = gap.cloned();
            let mut wide: Vec<usize> =
                open.iter().filter(|o| o.gap_mm > allowed).map(|o| o.edge).collect();
            wide.sort_unstable();
            wide.dedup();
            let trials = self.tighten(goal, (&wide, allowed), &models, &requests);
            if trials.is_empty() {
                break;
            }
            for trial in self.merge_trials(goal, trials) {
                (requests[trial.face], models[trial.face]) = (trial.request, trial.model);
            }
        }
        let (found, at) = widest.map_or((f64::INFINITY, [0.0; 3]), |g| (g.gap_mm, g.at.into()));
        Err(ToleranceError::Apart { found, allowed, at })
    }

    /// Refines all faces, each alone.
    fn refine_faces(
        &self,
        goal: &Goal,
        requests: &[FaceRequest],
    ) -> Result<Vec<FaceModel>, ToleranceError> {
        let count = requests.len() as u64;
        let stage = self.whole.budget.progress.stage("faces one by one", "faces", count);
        let refined = |(f, request)| {
            let model = self.refine_face(goal, f, request);
            stage.add(1);
            model
        };
        requests.par_iter().enumerate().map(refined).collect()
    }

    /// Refines one face alone.
    fn refine_face(
        &self,
        goal: &Goal,
        f: usize,
        request: &FaceRequest,
    ) -> Result<FaceModel, ToleranceError> {
        let goal = Goal { two_sided: goal.two_sided && !request.on_cad, ..*goal };
        let (scope, evaluator) = (&self.scopes[f], &self.evaluators[f]);
        let (refined, state) = scope.refine_within(evaluator, &goal, &request.borders)?;
        Ok(FaceModel { refined, edge_deviations: state.edge_deviations(0).to_vec() })
    }

    /// For each edge in `wide` a new model of one of its faces. Among the faces whose sides are a cause of the gap, it
    /// is the one with the largest gain. If there is none, the face with the largest vertex motion is made with its
    /// vertices on the CAD.
    fn tighten(
        &self,
        goal: &Goal,
        (wide, allowed): (&[usize], f64),
        models: &[FaceModel],
        requests: &[FaceRequest],
    ) -> Vec<Trial> {
        // Parallel over faces: the count of the budget of a face must not depend on the order of threads.
        let by_face: Vec<Vec<(usize, Trial)>> = (0..self.faces.len())
            .into_par_iter()
            .map(|f| {
                let edges = &self.faces[f].edges;
                let at = |edge: &usize| edges.iter().position(|e| e == edge).map(|e| (*edge, e));
                let is_cause = |e: usize| models[f].edge_deviation(e) > CAUSE_RATIO_MIN * allowed;
                let far = wide.iter().filter_map(at).filter(|&(_, e)| is_cause(e));
                let trial =
                    |(edge, e)| Some((edge, self.trial_closer(goal, (f, e), models, requests)?));
                far.filter_map(trial).collect()
            })
            .collect();
        let mut best: BTreeMap<usize, Trial> = BTreeMap::new();
        for (edge, trial) in by_face.into_iter().flatten() {
            if best.get(&edge).is_none_or(|b| b.gain < trial.gain) {
                best.insert(edge, trial);
            }
        }
        let left = wide.iter().filter(|edge| !best.contains_key(edge));
        let on_cad: Vec<Trial> =
            left.filter_map(|&edge| self.trial_on_cad(goal, edge, models, requests)).collect();
        best.into_values().chain(on_cad).collect()
    }

    /// Merges the trials of each face to one that meets all their requests. If it fails, the trial with the largest
    /// gain is used.
    fn merge_trials(&self, goal: &Goal, mut trials: Vec<Trial>) -> Vec<Trial> {
        trials.sort_by(|a, b| a.face.cmp(&b.face).then(b.gain.total_cmp(&a.gain)));
        let mut by_face: Vec<Vec<Trial>> = Vec::new();
        for trial in trials {
            match by_face.last_mut().filter(|group| group[0].face == trial.face) {
                Some(group) => group.push(trial),
                None => by_face.push(vec![trial]),
            }
        }
        let merge = |mut group: Vec<Trial>| {
            let mut request = group[0].request.clone();
            for other in &group[1..] {
                let borders = request.borders.iter_mut().zip(&other.request.borders);
                borders.for_each(|(own, requested)| *own = own.min(*requested));
                request.on_cad |= other.request.on_cad;
            }
            let best = group.swap_remove(0);
            if group.is_empty() {
                return best;
            }
            match self.refine_face(goal, best.face, &request) {
                Ok(model) => Trial { request, model, ..best },
                Err(_) => best,
            }
        };
        by_face.into_par_iter().map(merge).collect()
    }

    /// A new model of a face with its sides closer to its edge `e`.
    fn trial_closer(
        &self,
        goal: &Goal,
        (face, e): (usize, usize),
        models: &[FaceModel],
        requests: &[FaceRequest],
    ) -> Option<Trial> {
        let distance = |m: &FaceModel| m.edge_deviation(e);
        let before = &models[face];
        let mut request = requests[face].clone();
        request.borders[e] = request.borders[e].min(0.99 * distance(before));
        let after = self.refine_face(goal, face, &request).ok()?;
        let [more, fewer] = [&after, before].map(|m| m.refined.tool.patches.len() as f64);
        let gain = (distance(before) - distance(&after)) / (more - fewer).max(0.5);
        Some(Trial { face, request, model: after, gain })
    }

    /// A new model, with its vertices on the CAD, of the face with the largest vertex motion at an edge.
    fn trial_on_cad(
        &self,
        goal: &Goal,
        edge: usize,
        models: &[FaceModel],
        requests: &[FaceRequest],
    ) -> Option<Trial> {
        let moved = |f: usize| models[f].refined.moved_mm;
        let at = |f: &usize| self.faces[*f].edges.contains(&edge);
        let movable = (0..self.faces.len()).filter(at);
        let movable = movable.filter(|&f| !requests[f].on_cad && moved(f) > 0.0);
        let face = movable.max_by(|&a, &b| moved(a).total_cmp(&moved(b)).then(b.cmp(&a)))?;
        let request = FaceRequest { on_cad: true, ..requests[face].clone() };
        let model = self.refine_face(goal, face, &request).ok()?;
        Some(Trial { face, request, model, gain: 0.0 })
    }

    /// The complete model with its audit and the reports of all faces.
    ///
    /// # Errors
    /// [`ToleranceError::NotReached`] or [`ToleranceError::NoPatches`] when it violates the goal.
    fn audited_model(
        &self,
        goal: &Goal,
        mut tool: ToolModel,
        models: &[FaceModel],
    ) -> Result<Refined, ToleranceError> {
        let (whole, turned) = (self.whole, self.turned);
        let audit_options = AuditOptions {
            tolerance_mm: goal.tol_mm.is_finite().then_some(goal.tol_mm),
            normal_tolerance_deg: goal.normal_deg.is_finite().then_some(goal.normal_deg),
            ..AuditOptions::default()
        };
        let audit = audit(&tool, whole.reference, &audit_options)?.report;
        // The margin covers the gap between the sampled points.
        tool.border_gap_mm = 1.01 * audit.jumps.border_gap_mm;
        let report = ConvertReport { turned, creases: crease_count(&tool), ..join_reports(models) };
        let moved_mm = models.iter().fold(0.0f64, |m, f| m.max(f.refined.moved_mm));
        let slid_mm = models.iter().fold(0.0f64, |m, f| m.max(f.refined.slid_mm));
        let borders = Borders::Independent;
        let saved_all = models.iter().all(|f| f.refined.saved_all);
        let found = Refined { tool, report, audit, moved_mm, slid_mm, borders, saved_all };
        let above = faces_above_tolerance(&found.audit, goal);
        if above.is_empty() && folded_faces(&found).is_empty() {
            Ok(found)
        } else {
            Err(whole.error_context().model_failed(goal, &found))
        }
    }
}

/// Reports of all faces, with the vertex and patch numbers of the joined tool.
fn join_reports(models: &[FaceModel]) -> ConvertReport {
    let mut report = ConvertReport::default();
    let (mut vertices, mut patches) = (0, 0);
    for FaceModel { refined: Refined { tool, report: own, .. }, .. } in models {
        let renumbered = |e: &StraightEdge| StraightEdge {
            patches: e.patches.iter().map(|k| k + patches).collect(),
            vertices: e.vertices.map(|k| k + vertices),
            fault: e.fault,
        };
        report.straight.extend(own.straight.iter().map(renumbered));
        report.bent.extend(own.bent.iter().map(renumbered));
        report.folded.extend(own.folded.iter().map(|k| k + patches));
        report.split += own.split;
        vertices += tool.vertices.len() as u32;
        patches += tool.patches.len() as u32;
    }
    report
}

/// The patches of all faces as one tool. Patches of different faces share no vertices.
fn join_tools(models: &[FaceModel], options: &ConvertOptions) -> Result<ToolModel, ToleranceError> {
    let (mut vertices, mut normals) = (Vec::new(), Vec::new());
    let (mut corners, mut given) = (Vec::new(), Vec::new());
    for tool in models.iter().map(|m| &m.refined.tool) {
        let (v, n) = (vertices.len() as u32, normals.len() as u32);
        vertices.extend(&tool.vertices);
        normals.extend(&tool.normals);
        for patch in &tool.corners {
            let mut patch = patch.clone();
            patch.vertices.iter_mut().for_each(|k| *k += v);
            patch.normals.iter_mut().for_each(|k| *k += n);
            corners.push(patch);
        }
        let shifted = |g: &GivenCurve| GivenCurve { vertices: g.vertices.map(|k| k + v), c: g.c };
        given.extend(tool.curves.iter().map(shifted));
    }
    let choice = EdgeChoice { rule: options.edges, given };
    let built = build(options.name.clone(), options.kind, vertices, normals, corners, choice);
    Ok(built.map_err(crate::ConvertError::from)?.0)
}
