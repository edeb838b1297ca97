//! State of a run between two increments, as stored in a checkpoint. A run restarts from it bit-identically.

use serde::{Deserialize, Serialize};

use crate::contact::candidate::SavedContact;
use crate::error::SimulationError;
use crate::increment::attempt::restore;
use crate::report::{Energies, RunSummary};
use crate::stage::state::{Committed, Simulation, UnderWay};

/// All quantities that change during a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SimulationState {
    stage: usize,
    under_way: Option<UnderWay>,
    time: f64,
    committed: Committed,
    energies: Energies,
    summary: RunSummary,
    contact: Vec<SavedContact>,
    /// History of the material points as little-endian numbers; stored separately.
    #[serde(skip)]
    pub material: Vec<u8>,
}

impl SimulationState {
    /// Last equilibrium.
    pub(crate) fn committed(&self) -> &Committed {
        &self.committed
    }

    /// Number of increments done.
    pub(crate) fn increments(&self) -> usize {
        self.summary.increments
    }

    /// Work since the start of the run.
    pub(crate) fn energies(&self) -> &Energies {
        &self.energies
    }
}

impl Simulation {
    /// The state after the last converged increment.
    #[must_use]
    pub fn state(&self) -> SimulationState {
        let material = self.sys.body.export_state();
        SimulationState { material, ..self.state_without_history() }
    }

    /// As [`Self::state`], without the history of the material points.
    pub(crate) fn state_without_history(&self) -> SimulationState {
        SimulationState {
            stage: self.stage,
            under_way: self.under_way.clone(),
            time: self.time,
            committed: self.committed.clone(),
            energies: self.energies,
            summary: self.summary.clone(),
            contact: self.sys.contact.saved().to_vec(),
            material: Vec::new(),
        }
    }

    /// Continues from a state of the same model.
    ///
    /// # Errors
    /// [`SimulationError::Setup`] if the state is of another model.
    pub fn resume(&mut self, state: SimulationState) -> Result<(), SimulationError> {
        let other = |what: String| {
            Err(SimulationError::Setup(format!("the saved state is of another set-up: {what}")))
        };
        let (found, expected) = (state.committed.u.len(), self.sys.u.len());
        if found != expected {
            return other(format!("{found} unknowns, not {expected}"));
        }
        if state.stage > self.stages.len() || !state.committed.fits(self.sys.tools.len(), expected)
        {
            return other("its stages or tools".into());
        }
        let tools = self.sys.tools.len();
        let fits = |now: &UnderWay| now.fits(state.stage, self.stages.len(), tools, expected);
        if !state.under_way.as_ref().is_none_or(fits) {
            return other("the stage under way".into());
        }
        if !state.summary.is_sound() {
            return other("its counts".into());
        }
        let spent = state.summary.timings;
        if let Err(what) = self.go_back(state) {
            return other(what);
        }
        self.sys.timings = spent;
        let solver = &mut self.sys.solver;
        (solver.factor_s, solver.update_s, solver.solve_s) =
            (spent.factor, spent.update, spent.solve);
        (solver.factorisations, solver.updates) = (spent.factorisations, spent.updates);
        Ok(())
    }

    /// Restores a state of this model, except for the timings.
    pub(crate) fn go_back(&mut self, state: SimulationState) -> Result<(), String> {
        self.sys.body.import_state(&state.material).map_err(|error| error.to_string())?;
        self.go_back_within(state)
    }

    /// As [`Self::go_back`], if the history of the material points has not been committed since.
    pub(crate) fn go_back_within(&mut self, state: SimulationState) -> Result<(), String> {
        if !self.sys.contact.resume(&state.contact) {
            return Err(format!("{} contact candidates", state.contact.len()));
        }
        self.stage = state.stage;
        self.under_way = state.under_way;
        self.time = state.time;
        self.committed = state.committed;
        self.energies = state.energies;
        self.summary = state.summary;
        restore(self);
        Ok(())
    }
}
