//! Stops of tools driven by a force or a spring: distance blocks, end of a cylinder. At its stop such a tool does not
//! advance, and the stop carries the difference to the force of the sheet.
//!
//! `travel <= stop`, `push <= wanted`, one of them with equality. The state is part of the active set and is
//! determined in the same iteration as contact.

use super::update::StoppedTool;
use crate::system::system::System;
use crate::tools::stop::Stop;

impl System {
    /// Prescribed force of a tool with unknown travel that is not at its stop [N].
    pub(crate) fn wanted(&self, tool: usize) -> Option<f64> {
        let push = self.roles[tool].push(self.tools[tool].travel)?;
        (!self.stops[tool].reached).then_some(push)
    }

    /// Travel to the stop of a tool that is at its stop [mm].
    pub(crate) fn short_of_stop(&self, tool: usize) -> Option<f64> {
        let stop = self.stops[tool];
        stop.reached.then_some(stop.at - self.tools[tool].travel)
    }

    /// Sets the stop of a tool for this increment, not behind its position at the start of the stage, and limits the
    /// travel to it.
    pub(crate) fn set_stop(&mut self, tool: usize, start: f64) {
        let stop = self.tools[tool].setup.stop.filter(|_| self.roles[tool].push(0.0).is_some());
        let reached = stop.is_some() && self.stops[tool].reached;
        let at = stop.map_or(f64::INFINITY, |stop| stop.max(start));
        self.stops[tool] = Stop { at, reached };
        self.tools[tool].travel = self.tools[tool].travel.min(at);
    }

    /// Tools with a stop, with the travel [mm] and push [N] predicted by `of`.
    pub(crate) fn stopped_tools(
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
    pub(crate) fn push_of(&self, tool: usize) -> f64 {
        self.tool_force(tool).dot(&self.tools[tool].setup.direction)
    }
}
