//! The model closest to the goal, for files whose tolerance is not reached.
//!
//! Every complete model without folds that a search makes is a candidate. A search that ends above the tolerance gives
//! one more, that of its last state. Models of uniform divisions, in which folds are repaired, are the last.

use std::sync::Arc;

use super::error::ToleranceError;
use super::faults::{faces_above_tolerance, folded_faces};
use super::goal::{Goal, Refined};
use super::scope::Scope;
use super::state::State;
use crate::unfolded::mesh_and_convert;
use kanagata_mesh::MeshFeet;
use kanagata_mesh::mapped::MappedOptions;

/// Patches of all uniform models together. Doubled: twice the time of files that no divisions bring within the tolerance
/// (20 s for 100 faces).
const UNIFORM_WORK_MAX: f64 = 20_000.0;
/// Order in which the error of a patch falls with the divisions, to estimate the next ones: smooth regions have 4, and
/// regions at lines of discontinuous curvature 2.
const PATCH_ORDER: f64 = 3.0;
/// Smallest and largest growth of the divisions from one uniform model to the next.
const DIVISIONS_GROWTH: [f64; 2] = [1.2, 2.5];

/// Maximum ratio of error to tolerance over the faces above the tolerance; zero within the goal.
pub(super) fn goal_ratio(found: &Refined, goal: &Goal) -> f64 {
    faces_above_tolerance(&found.audit, goal).iter().fold(0.0, |most, face| most.max(face.1))
}

/// True when no patch is folded and every sample has a closest point.
pub(super) fn is_valid(found: &Refined) -> bool {
    folded_faces(found).is_empty() && found.audit.points_lost == 0
}

impl Scope<'_> {
    /// Keeps a model as candidate if it has no folds and a smaller error than the candidate before.
    pub(super) fn keep_candidate(&self, found: &Refined, goal: &Goal) {
        let ratio = goal_ratio(found, goal);
        if !self.is_whole() || !is_valid(found) {
            return;
        }
        if let Ok(mut closest) = self.closest.lock()
            && closest.model.as_ref().is_none_or(|kept| ratio < kept.0)
        {
            closest.model = Some((ratio, Arc::new(found.clone())));
        }
    }

    /// Keeps a state above the tolerance as candidate if its largest error is smaller than that of the one before.
    pub(super) fn keep_state(&self, state: &State) {
        let ratio = state.error_ratios.iter().fold(0.0, |most: f64, r| most.max(*r));
        if !self.is_whole() || !ratio.is_finite() {
            return;
        }
        if let Ok(mut closest) = self.closest.lock()
            && closest.state.as_ref().is_none_or(|kept| ratio < kept.0)
        {
            closest.state = Some((ratio, state.clone(), !self.mesh.fewest));
        }
    }

    /// Makes the complete model of the kept state, unless a model has a smaller error.
    fn complete_state(&self, goal: &Goal) {
        let Ok(mut closest) = self.closest.lock() else { return };
        let least = closest.model.as_ref().map_or(f64::INFINITY, |kept| kept.0);
        let state = closest.state.take().filter(|kept| kept.0 < least);
        drop(closest);
        let Some((_, state, has_interior_nodes)) = state else { return };
        let _ = match has_interior_nodes {
            true => self.with_interior_nodes().map(|scope| scope.complete_model(&state, goal)).ok(),
            false => Some(self.complete_model(&state, goal)),
        };
    }

    /// Makes models of uniform divisions candidates: the default divisions, and finer ones until one is within the goal.
    /// Ends when they have [`UNIFORM_WORK_MAX`] patches together, or when half of the time of the search is over.
    /// `after_first` is called once the first one is made.
    pub(super) fn keep_uniform_models(&self, goal: &Goal, mut after_first: impl FnMut()) {
        let mut divisions = MappedOptions::default().arc_divisions;
        let mut work = 0;
        while let Some(found) = self.uniform_model(divisions, goal) {
            if work == 0 {
                after_first();
            }
            self.keep_candidate(&found, goal);
            work += found.tool.patches.len();
            let ratio = goal_ratio(&found, goal);
            let [low, high] = DIVISIONS_GROWTH;
            let growth = ratio.powf(1.0 / PATCH_ORDER).clamp(low, high);
            let next = found.tool.patches.len() as f64 * growth.powi(2);
            let is_within = ratio <= 1.0 && is_valid(&found);
            if is_within || work as f64 + next > UNIFORM_WORK_MAX || self.budget.is_late_to_save() {
                return;
            }
            divisions = (divisions as f64 * growth).ceil() as usize;
        }
    }

    /// The model of uniform divisions of a quarter turn. Its vertices lie on the CAD, and faces with folds are finer.
    pub(super) fn uniform_model(&self, arc_divisions: usize, goal: &Goal) -> Option<Refined> {
        let options = MappedOptions { arc_divisions, by_turn: false, fewest: false, ..self.mesh };
        let made = mesh_and_convert(self.plan.model(), &options, self.options).ok()?;
        Some(self.audited(made, &MeshFeet::default(), goal).ok()?.0)
    }

    /// The model closest to the goal, after a search that ended with the error `why`.
    ///
    /// # Errors
    /// [`ToleranceError::Above`] with the model; `why` if there is none, or for an error of another kind.
    pub(super) fn closest_or(
        &self,
        why: ToleranceError,
        goal: &Goal,
    ) -> Result<Refined, ToleranceError> {
        use ToleranceError::{NoPatches, NotReached};
        if !matches!(why, NotReached { .. } | NoPatches { .. }) {
            return Err(why);
        }
        if !self.budget.has_time_limit() {
            self.keep_uniform_models(goal, || {});
        }
        self.complete_state(goal);
        match self.closest_model() {
            Some(model) if goal_ratio(&model, goal) == 0.0 && is_valid(&model) => Ok(model),
            Some(model) => {
                Err(ToleranceError::Above { model: Box::new(model), why: Box::new(why) })
            }
            None => Err(why),
        }
    }

    /// The candidate with the smallest error, with its complete audit.
    fn closest_model(&self) -> Option<Refined> {
        let kept = self.closest.lock().ok()?.model.take()?.1;
        let found = self.with_full_audit(Arc::unwrap_or_clone(kept)).ok()?;
        Some(Refined { saved_all: self.budget.has_saved_all(), ..found })
    }
}
