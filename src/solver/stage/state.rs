//! State of a run: last increment and active stage.

use serde::{Deserialize, Serialize};

use super::branch::Doubt;
use super::description::Stage;
use super::plan::Plan;
use super::step_size::{Endurance, Pace};
use crate::limits::Limits;
use crate::newton::outcome::Patience;
use crate::newton::record::IterationRecord;
use crate::report::{Energies, RunSummary};
use crate::system::system::System;

/// Last converged state, and the increment before it for the predictor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Committed {
    pub(crate) u: Vec<f64>,
    pub(crate) travels: Vec<f64>,
    /// Whether each tool is at its stop.
    pub(crate) on_stop: Vec<bool>,
    pub(crate) internal_force: Vec<f64>,
    pub(crate) applied: Vec<f64>,
    /// Force of each tool along its direction [N].
    pub(crate) pushes: Vec<f64>,
    /// A tool that pushed the sheet was removed without forces that replace it: the state is no longer in
    /// equilibrium.
    pub(crate) dropped: bool,
    /// Step (fraction of the stage), displacements and travels of the last increment of this stage.
    pub(crate) last: Option<(f64, Vec<f64>, Vec<f64>)>,
}

impl Committed {
    pub(crate) fn of(sys: &System) -> Self {
        Self {
            u: sys.u.clone(),
            travels: sys.tools.iter().map(|t| t.travel).collect(),
            on_stop: sys.stops.iter().map(|stop| stop.reached).collect(),
            internal_force: sys.eval.internal_force.clone(),
            applied: sys.applied.clone(),
            pushes: (0..sys.tools.len()).map(|t| sys.push_of(t)).collect(),
            dropped: false,
            last: None,
        }
    }

    /// Disables the prediction of the next increment, at the start of a stage or when the path is not continued.
    pub(crate) fn forget_last(&mut self) {
        self.last = None;
    }

    /// Whether the state fits a model with these numbers of tools and unknowns.
    pub(crate) fn fits(&self, tools: usize, unknowns: usize) -> bool {
        let of_tools = |v: &Vec<f64>| v.len() == tools;
        let of_nodes = |v: &Vec<f64>| v.len() == unknowns;
        self.on_stop.len() == tools
            && [&self.travels, &self.pushes].into_iter().all(of_tools)
            && [&self.u, &self.internal_force, &self.applied].into_iter().all(of_nodes)
            && self.last.as_ref().is_none_or(|(_, u, t)| of_nodes(u) && of_tools(t))
    }
}

/// An active stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct UnderWay {
    pub(crate) plan: Plan,
    pub(crate) pace: Pace,
    pub(crate) endurance: Endurance,
    pub(crate) doubt: Doubt,
    /// Completed fraction of the stage.
    pub(crate) share: f64,
    pub(crate) start_time: f64,
}

impl UnderWay {
    /// Whether the state fits a stage of a model with these numbers of stages, tools and unknowns.
    pub(crate) fn fits(&self, stage: usize, stages: usize, tools: usize, unknowns: usize) -> bool {
        self.plan.stage == stage
            && self.plan.fits(stages, tools, unknowns)
            && self.pace.is_sound()
            && self.endurance.is_sound()
            && self.doubt.is_sound()
            && (0.0..1.0).contains(&self.share)
    }

    /// Next fraction at which an increment must end: corner of a curve, or release of tools.
    pub(crate) fn next_corner(&self, stages: &[Stage]) -> f64 {
        let corner = stages[self.plan.stage].next_corner(self.share);
        self.plan.lets_go_at().map_or(corner, |at| corner.min(at))
    }

    /// End of the next increment, and its limit of iterations. Prescribed increments are tried in full and with all
    /// iterations, since the earlier run may have reached them by step cuts.
    pub(crate) fn next(&self, stages: &[Stage]) -> (f64, Patience) {
        let (share, step) = (self.share, self.pace.step);
        let none = self.plan.lets_go(stages);
        let ends: &[f64] = if none { &[] } else { &stages[self.plan.stage].ends };
        let at = ends.partition_point(|&end| end <= share);
        let corner = self.next_corner(stages);
        let end = ends.get(at).copied().unwrap_or(corner).min(corner);
        let met = share == 0.0 || at.checked_sub(1).is_some_and(|last| ends[last] == share);
        if at < ends.len() && met && !self.pace.has_failed() {
            return (end, Patience::All);
        }
        let target = if share + 1.001 * step >= end { end } else { share + step };
        (target, self.pace.patience())
    }
}

/// A run.
pub struct Simulation {
    pub(crate) sys: System,
    pub(crate) stages: Vec<Stage>,
    pub(crate) loads: Vec<f64>,
    pub(crate) limits: Limits,
    pub(crate) share: f64,
    /// Work of travelling tools while the sheet is followed, including work against dampers [N mm].
    pub(crate) dragged: f64,
    pub(crate) committed: Committed,
    /// Index of the active or the next stage.
    pub(crate) stage: usize,
    pub(crate) under_way: Option<UnderWay>,
    pub(crate) energies: Energies,
    pub(crate) history: Vec<IterationRecord>,
    pub(crate) summary: RunSummary,
    pub(crate) time: f64,
}
