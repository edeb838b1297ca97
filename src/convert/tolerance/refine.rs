//! Refinement of a scope to a goal.
//!
//! 1. Search divisions so that each face alone is within `tolerance factor * tolerance`.
//! 2. Make the complete model, move its vertices and audit it.
//! 3. Reduce the factors of faces above the tolerance, and repeat.

use std::sync::Arc;

use super::balance::balance_errors;
use super::error::ToleranceError;
use super::face_error::FaceEvaluator;
use super::faults::{Faults, faces_above_tolerance, folded_faces, worst_point};
use super::goal::{Borders, Goal, Refined};
use super::results::CompleteModel;
use super::scope::{Scope, shift_face_numbers};
use super::search::Search;
use super::starts::patch_starts;
use super::state::State;
use crate::{ConvertOptions, ConvertReport, convert};
use kanagata_audit::{Audit, AuditOptions, AuditReport, audit, audit_from};
use kanagata_geometry::Vec3;
use kanagata_mesh::{MeshFeet, SurfaceMesh};
use kanagata_tool::ToolModel;

/// Tolerance factor above which a search is made only while the budget is cheap.
const FACTOR_MAX_UNLESS_CHEAP: f64 = 2.0;
/// Minimum ratio of the error of a face alone to its error in the complete model for the face itself to be the cause.
const OWN_ERROR_RATIO_MIN: f64 = 0.3;
/// Ratio of error to tolerance above which looser tolerance factors are not tried: the vertex motion removes less.
const HOPELESS_ERROR_RATIO: f64 = 5.0;
/// Smallest and largest divisor of a tolerance factor in one round. The error of a face in the complete model is about
/// proportional to its error alone: the factor is divided by the ratio of error to tolerance.
const FACTOR_REDUCTION: [f64; 2] = [1.01, 1.5];
/// Maximum rounds of reducing the factors of faces above the tolerance in the complete model.
const ROUNDS_MAX: usize = 12;

/// Number of complete models kept for searches that meet them again.
const MODELS_KEPT_MAX: usize = 8;

/// True when no looser tolerance factor can succeed: the error is far above the tolerance, or of another kind.
fn is_hopeless(error: &ToleranceError) -> bool {
    match error {
        ToleranceError::NotReached { found, allowed, .. } => {
            *found > HOPELESS_ERROR_RATIO * allowed
        }
        _ => true,
    }
}

impl Scope<'_> {
    /// Model within the goal with the fewest patches over all tolerance factors.
    ///
    /// # Errors
    /// [`ToleranceError::NotReached`], [`ToleranceError::NoPatches`], or an error of mesher, conversion or audit.
    pub(super) fn refine(
        &self,
        evaluator: &FaceEvaluator<'_>,
        goal: &Goal,
    ) -> Result<Refined, ToleranceError> {
        self.refine_within(evaluator, goal, &self.border_tolerances(goal)).map(|found| found.0)
    }

    /// As [`Self::refine`], with the allowed distance of patch sides from each edge in `borders` [mm]; also returns the
    /// state.
    pub(super) fn refine_within(
        &self,
        evaluator: &FaceEvaluator<'_>,
        goal: &Goal,
        borders: &[f64],
    ) -> Result<(Refined, State), ToleranceError> {
        match self.refine_below(evaluator, goal, borders, usize::MAX)? {
            Some(found) => Ok(found),
            None => unreachable!("every tolerance factor gives a model or an error"),
        }
    }

    /// As [`Self::refine_within`], for a model with fewer than `limit` patches; `None` if there is none. States with more
    /// are not made into complete models.
    pub(super) fn refine_below(
        &self,
        evaluator: &FaceEvaluator<'_>,
        goal: &Goal,
        borders: &[f64],
        limit: usize,
    ) -> Result<Option<(Refined, State)>, ToleranceError> {
        let factors: &[f64] = if goal.two_sided { evaluator.tolerance_factors() } else { &[1.0] };
        let mut best: Option<(Refined, State)> = None;
        let mut last = None;
        for &factor in factors.iter().rev() {
            let is_loose = factor > FACTOR_MAX_UNLESS_CHEAP;
            let allowed =
                if is_loose { self.budget.is_cheap() } else { self.budget.allows_other_models() };
            if (best.is_some() || limit < usize::MAX) && !allowed {
                break;
            }
            let limit = best.as_ref().map_or(limit, |b| b.0.tool.patches.len());
            match self.refine_at_factor(evaluator, goal, (factor, borders), limit) {
                Ok(Some(found)) => best = Some(found),
                Ok(None) => {}
                Err(ToleranceError::NotReached { .. }) if best.is_some() => {}
                Err(error) => {
                    let hopeless = is_hopeless(&error);
                    last = Some(error);
                    if hopeless {
                        break;
                    }
                }
            }
        }
        match (best, last) {
            (None, Some(error)) => Err(error),
            (best, _) => Ok(best),
        }
    }

    /// Refines with the initial tolerance factor `factor` for all faces. `None` when the model has at least `limit`
    /// patches.
    fn refine_at_factor(
        &self,
        evaluator: &FaceEvaluator<'_>,
        goal: &Goal,
        (factor, borders): (f64, &[f64]),
        limit: usize,
    ) -> Result<Option<(Refined, State)>, ToleranceError> {
        let mut factors = vec![factor; self.plan.model().faces.len()];
        let mut state: Option<State> = None;
        let mut last = None;
        for _ in 0..ROUNDS_MAX {
            let search = Search { plan: &self.plan, evaluator, goal, factors: &factors, borders };
            let next = state.take().map_or_else(|| search.minimise_patches(), |s| search.grow(s));
            if next.patches() >= limit {
                return Ok(None);
            }
            if !search.is_within_goal(&next) {
                self.keep_state(&next);
                return Err(last.unwrap_or_else(|| self.error_context().search_failed(goal, &next)));
            }
            let complete = self.complete_model(&next, goal)?;
            if complete.faults.is_empty() {
                return Ok(Some((complete.refined.clone(), next)));
            }
            last = Some(self.error_context().model_failed(goal, &complete.refined));
            let (after, reduced) = self.tighten(&search, next, &complete.faults);
            if self.budget.is_exhausted() {
                break;
            }
            state = Some(after);
            reduced.into_iter().for_each(|(face, factor)| factors[face] = factor);
        }
        last.map_or(Ok(None), Err)
    }

    /// The state from which to continue after a complete model with violations, and the faces with reduced tolerance
    /// factors.
    fn tighten(
        &self,
        search: &Search<'_>,
        state: State,
        faults: &Faults,
    ) -> (State, Vec<(usize, f64)>) {
        // Sides on a crease also depend on the normals of the adjacent face, which the evaluation of one face ignores.
        let is_foreign = |f: usize, ratio: f64| state.error_ratio(f) < OWN_ERROR_RATIO_MIN * ratio;
        let foreign = |f: usize| faults.on_cad.iter().find(|o| o.0 == f && is_foreign(f, o.1));
        let at_border = faults.exceeding.iter().filter_map(|e| foreign(e.0));
        let places: Vec<(usize, Vec3, f64)> =
            at_border.filter_map(|o| Some((o.0, o.2?, o.1))).collect();
        let own = faults.exceeding.iter().filter(|e| foreign(e.0).is_none());
        let reduced = |&e| self.reduced_factor(&state, search.factors, e);
        let factors = own.map(reduced).collect();
        let unchanged = faults.folded.is_empty() && places.is_empty();
        let state =
            if unchanged { state } else { search.refine_at(&state, &faults.folded, &places) };
        (state, factors)
    }

    /// The face that causes the error of face `f`, and its new tolerance factor. `ratio` is the error of face `f` over
    /// the tolerance.
    fn reduced_factor(
        &self,
        state: &State,
        factors: &[f64],
        (f, ratio): (usize, f64),
    ) -> (usize, f64) {
        let face = self.cause(state, f, ratio);
        let ratio = ratio.clamp(FACTOR_REDUCTION[0], FACTOR_REDUCTION[1]);
        (face, factors[face].min(state.error_ratio(face)) / ratio)
    }

    /// The face that causes an error of `ratio` times the tolerance on face `f`. It is `f` itself, or else the worst of
    /// it and the adjacent faces, for which the common vertices were moved.
    fn cause(&self, state: &State, f: usize, ratio: f64) -> usize {
        if state.error_ratio(f) >= OWN_ERROR_RATIO_MIN * ratio {
            return f;
        }
        let model = self.plan.model();
        let edges = model.faces[f].loops.iter().flat_map(|l| &l.uses).filter_map(|u| u.edge);
        let adjacent = edges.flat_map(|e| &model.edges[e].uses).map(|u| u[0]);
        let worse = |a: &usize, b: &usize| state.error_ratio(*a).total_cmp(&state.error_ratio(*b));
        adjacent.chain([f]).max_by(worse).unwrap_or(f)
    }

    /// The complete model of a state, with moved vertices if two-sided, and its violations of the goal.
    pub(super) fn complete_model(
        &self,
        state: &State,
        goal: &Goal,
    ) -> Result<Arc<CompleteModel>, ToleranceError> {
        let mesh = self.plan.mesh(&state.minima, &state.density)?;
        let same = |m: &&Arc<CompleteModel>| m.goal == *goal && m.mesh == mesh;
        let known = self.models.lock().ok().and_then(|all| all.iter().find(same).cloned());
        if let Some(known) = known {
            return Ok(known);
        }
        self.budget.add_complete(mesh.elements.len() as u64);
        let (refined, faults) = self.model_of_mesh(&mesh, goal)?;
        if !faults.is_empty() {
            self.keep_candidate(&refined, goal);
        }
        let made = Arc::new(CompleteModel { goal: *goal, mesh, refined, faults });
        if let Ok(mut all) = self.models.lock() {
            if all.len() == MODELS_KEPT_MAX {
                all.remove(0);
            }
            all.push(Arc::clone(&made));
        }
        Ok(made)
    }

    /// The model of a mesh, with moved vertices if two-sided, and its violations of the goal. Only a model without
    /// estimated violations is compared with the trimmed CAD in full.
    fn model_of_mesh(
        &self,
        mesh: &SurfaceMesh,
        goal: &Goal,
    ) -> Result<(Refined, Faults), ToleranceError> {
        let (plain, found) =
            self.audited(convert(self.plan.model(), mesh, self.options)?, &mesh.feet, goal)?;
        let own = |face: usize| face - self.first as usize;
        let faults = |on_cad: &Refined, refined: &Refined| {
            let above = |report: &AuditReport| faces_above_tolerance(report, goal).into_iter();
            let place = |f: usize| worst_point(&on_cad.audit, f).map(Vec3::from);
            Faults {
                exceeding: above(&refined.audit).map(|(f, ratio)| (own(f), ratio)).collect(),
                on_cad: above(&on_cad.audit).map(|(f, r)| (own(f), r, place(f))).collect(),
                folded: folded_faces(refined).into_iter().map(own).collect(),
            }
        };
        let moved = if goal.two_sided {
            self.two_sided(plain.clone(), found, self.options)?
        } else {
            plain.clone()
        };
        let estimated = faults(&plain, &moved);
        if !estimated.is_empty() {
            return Ok((moved, estimated));
        }
        let moved = self.with_decisive_audit(moved)?;
        let found = faults(&plain, &moved);
        if found.is_empty() {
            return Ok((moved, found));
        }
        // Moved vertices may fold a patch between the points of the estimate.
        let plain = self.with_decisive_audit(plain)?;
        let unmoved = faults(&plain, &plain);
        if unmoved.is_empty() {
            return Ok((plain, unmoved));
        }
        let found = faults(&plain, &moved);
        Ok((moved, found))
    }

    /// A converted model of the scope, with the face numbers of the reference, and the errors of its patches on the
    /// grid of the audit, against the fast reference of the search. `feet` are those of its mesh.
    pub(super) fn audited(
        &self,
        (mut tool, report): (ToolModel, ConvertReport),
        feet: &MeshFeet,
        goal: &Goal,
    ) -> Result<(Refined, Audit), ToleranceError> {
        let starts = patch_starts(&tool, (self.plan.model(), 0), feet);
        shift_face_numbers(&mut tool, self.first);
        let audit_options = AuditOptions {
            tolerance_mm: goal.tol_mm.is_finite().then_some(goal.tol_mm),
            normal_tolerance_deg: goal.normal_deg.is_finite().then_some(goal.normal_deg),
            ..self.estimate()
        };
        let found = audit_from(&tool, &self.local_reference(), &audit_options, &starts)?;
        let (audit, borders) = (found.report.clone(), Borders::Conforming);
        let (moved_mm, slid_mm) = (0.0, 0.0);
        let saved_all = self.budget.has_saved_all();
        Ok((Refined { tool, report, audit, moved_mm, slid_mm, borders, saved_all }, found))
    }

    /// Audit of a complete model during the search: points of a grid and one more of each patch, or a search between them
    /// where normals have a tolerance.
    fn estimate(&self) -> AuditOptions {
        let full = AuditOptions::default();
        let refine = if self.normals { full.refine } else { 0 };
        AuditOptions { refine, areas: false, borders: false, ..full }
    }

    /// A model with the complete audit of its patches and borders against the trimmed CAD.
    pub(super) fn with_full_audit(&self, found: Refined) -> Result<Refined, ToleranceError> {
        let progress = self.budget.progress.clone();
        self.with_audit(found, AuditOptions { progress, ..AuditOptions::default() })
    }

    /// As [`Self::with_full_audit`], without what no tolerance limits: areas, and the extremes of normal errors where
    /// normals have no tolerance.
    pub(super) fn with_decisive_audit(&self, found: Refined) -> Result<Refined, ToleranceError> {
        let full = AuditOptions::default();
        self.with_audit(found, AuditOptions { refine_normals: self.normals, areas: false, ..full })
    }

    fn with_audit(&self, found: Refined, options: AuditOptions) -> Result<Refined, ToleranceError> {
        let options = AuditOptions {
            tolerance_mm: found.audit.tolerance_mm,
            normal_tolerance_deg: found.audit.normal_tolerance_deg,
            borders: self.is_whole(),
            ..options
        };
        let audit = audit(&found.tool, self.reference, &options)?.report;
        Ok(Refined { audit, ..found })
    }

    /// The model `plain`, whose audit is `found`, with moved vertices ([`balance_errors`]).
    pub(super) fn two_sided(
        &self,
        plain: Refined,
        found: Audit,
        options: &ConvertOptions,
    ) -> Result<Refined, ToleranceError> {
        let audit_options = AuditOptions {
            tolerance_mm: plain.audit.tolerance_mm,
            normal_tolerance_deg: plain.audit.normal_tolerance_deg,
            ..self.estimate()
        };
        let (model, reference) = (self.plan.model(), self.local_reference());
        balance_errors((plain, found), (model, self.first), &reference, (options, &audit_options))
    }
}
