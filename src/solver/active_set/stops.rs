//! Stops of tools that are moved by a force or a spring: distance blocks, the end of a cylinder. Such a tool goes no
//! farther than its stop, which from there on takes what the sheet does not carry.
//!
//! `travel <= stop`, `push <= wanted`, one of them equal: which one is part of the active set, found in the same iteration
//! as the nodes that touch.

use super::update::StoppedTool;
use crate::solver::system::system::System;
use crate::solver::tools::stop::Stop;

impl System {
    /// Force with which a tool is to push whose travel is unknown and that does not rest on its stop [N].
    pub(in crate::solver) fn wanted(&self, tool: usize) -> Option<f64> {
        let push = self.roles[tool].push(self.tools[tool].travel)?;
        (!self.stops[tool].reached).then_some(push)
    }

    /// Travel that a tool lacks that rests on its stop [mm].
    pub(in crate::solver) fn short_of_stop(&self, tool: usize) -> Option<f64> {
        let stop = self.stops[tool];
        stop.reached.then_some(stop.at - self.tools[tool].travel)
    }

    /// Sets where a tool is held up in this increment, no farther back than where the stage found it, and leaves it no
    /// farther than there.
    pub(in crate::solver) fn set_stop(&mut self, tool: usize, start: f64) {
        let stop = self.tools[tool].setup.stop.filter(|_| self.roles[tool].push(0.0).is_some());
        let reached = stop.is_some() && self.stops[tool].reached;
        let at = stop.map_or(f64::INFINITY, |stop| stop.max(start));
        self.stops[tool] = Stop { at, reached };
        self.tools[tool].travel = self.tools[tool].travel.min(at);
    }

    /// The tools with a stop, with the travel [mm] and push [N] that `of` predicts.
    pub(in crate::solver) fn stopped_tools(
        &self,
        of: impl Fn(&Self, usize) -> (f64, f64),
    ) -> Vec<StoppedTool> {
        let stopped = (0..self.tools.len()).filter(|&tool| self.stops[tool].at.is_finite());
        let stopped = stopped.map(|tool| {
            let stop = self.stops[tool];
            let (travel, push) = of(self, tool);
            let required = self.roles[tool].push(stop.at).unwrap_or(0.0);
            StoppedTool { tool, stop, travel, push, required }
        });
        stopped.collect()
    }

    /// Force of a tool on the sheet along its direction [N].
    pub(in crate::solver) fn push_of(&self, tool: usize) -> f64 {
        self.tool_force(tool).dot(&self.tools[tool].setup.direction)
    }
}
