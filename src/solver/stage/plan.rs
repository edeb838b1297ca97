//! Quantities fixed at the start of a stage.

use serde::{Deserialize, Serialize};

use super::description::Stage;
use crate::numbers::tolerances::NEAR_EQUILIBRIUM_REL;
use crate::tools::motion::Motion;

/// Quantities fixed at the start of a stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Plan {
    pub(crate) stage: usize,
    pub(crate) start_travels: Vec<f64>,
    /// Force of each tool along its direction [N], of the complete process.
    pub(crate) start_forces: Vec<f64>,
    /// Fraction of the stage at which tools are released, and whether they have been.
    pub(crate) at: f64,
    pub(crate) gone: bool,
    /// A released tool that stays in place until then, as no other tool does, and the displacements at the start of
    /// the stage.
    pub(crate) kept: Option<(usize, Vec<f64>)>,
    /// Contact forces of the released tools (three for each node).
    pub(crate) released: Vec<f64>,
    /// Displacements at the start of a stage in which no tool holds the sheet; empty otherwise.
    pub(crate) unsupported: Vec<f64>,
    /// Tools clear of a sheet that is released; they are excluded, so that an unconstrained sheet does not move out
    /// of their path.
    pub(crate) clear: Vec<usize>,
}

impl Plan {
    /// Whether the plan fits a model with these numbers of stages, tools and unknowns.
    pub(crate) fn fits(&self, stages: usize, tools: usize, unknowns: usize) -> bool {
        let of_nodes = |v: &Vec<f64>| v.is_empty() || v.len() == unknowns;
        let kept = self.kept.as_ref();
        self.stage < stages
            && [self.start_travels.len(), self.start_forces.len()] == [tools; 2]
            && self.released.len() == unknowns
            && of_nodes(&self.unsupported)
            && self.clear.iter().all(|&tool| tool < tools)
            && kept.is_none_or(|(tool, u)| *tool < tools && u.len() == unknowns)
            && (0.0..=1.0).contains(&self.at)
    }

    /// Whether no tool holds the sheet.
    pub(crate) fn is_free(&self) -> bool {
        !self.unsupported.is_empty()
    }

    /// Whether the stage releases the sheet.
    pub(crate) fn lets_go(&self, stages: &[Stage]) -> bool {
        self.is_free() && stages[self.stage].motions.contains(&Motion::Release)
    }

    /// Remaining fraction at `share` of the forces of released tools.
    pub(crate) fn remaining(&self, share: f64) -> f64 {
        if self.gone { (1.0 - share) / (1.0 - self.at) } else { 0.0 }
    }

    /// Fraction of the stage at which tools are released that move back with the sheet until then.
    pub(crate) fn lets_go_at(&self) -> Option<f64> {
        (!self.gone).then_some(self.at)
    }

    /// Force of a tool that moves back with the sheet before its release [N], of the complete process.
    pub(crate) fn going_back(&self, tool: usize, share: f64) -> Option<f64> {
        let force = self.start_forces[tool];
        let left = 1.0 - (1.0 - NEAR_EQUILIBRIUM_REL) * share / self.at;
        let stays = self.kept.as_ref().is_some_and(|(kept, _)| *kept == tool);
        (!self.gone).then_some(if stays { 0.0 } else { force * left })
    }

    /// Whether all tools that hold the sheet will be released.
    pub(crate) fn lets_all_go(&self) -> bool {
        !self.gone && self.kept.is_some()
    }
}
