//! Stops of tools that are moved by a force or a spring: distance blocks, the end of a cylinder. Such a tool goes no
//! farther than its stop, which from there on takes what the sheet does not carry.
//!
//! `travel <= stop`, `push <= wanted`, one of them equal: which one is part of the active set, found in the same iteration
//! as the nodes that touch.

use crate::solver::system::correction::Correction;
use crate::solver::system::system::System;
use crate::solver::tools::stop::Stop;

/// Share of its force by which a tool may push more than it is to before it leaves its stop.
const OF_NOTE: f64 = 1e-9;

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

    /// Force of a tool on the sheet along its direction [N].
    pub(in crate::solver) fn push_of(&self, tool: usize) -> f64 {
        self.tool_force(tool).dot(&self.tools[tool].setup.direction)
    }
}

/// Puts tools that are past their stop on it, lets go of it those that push more than they are to; how many were wrong.
pub(in crate::solver) fn revise(sys: &mut System) -> usize {
    set(sys, |sys, tool| (sys.tools[tool].travel, sys.push_of(tool)))
}

/// The same as a correction of the present iterate has it.
pub(in crate::solver) fn foresee(sys: &mut System, correction: &Correction) -> usize {
    set(sys, |sys, tool| {
        let by = correction.travels.iter().find(|(moved, _)| *moved == tool);
        let direction = sys.tools[tool].setup.direction;
        let of_tool = correction.foretold.iter().filter(|f| {
            let c = &sys.contact.candidates[f.candidate];
            c.tool == tool && c.active
        });
        let along = of_tool.map(|f| f.force.dot(&direction));
        (sys.tools[tool].travel + by.map_or(0.0, |(_, travel)| *travel), along.sum())
    })
}

/// Sets the state of every stop by the travel and the push of its tool.
fn set(sys: &mut System, of: impl Fn(&System, usize) -> (f64, f64)) -> usize {
    let rounding = 1e-10 * sys.lengths.shortest_edge;
    let mut changes = 0;
    for tool in 0..sys.tools.len() {
        let Stop { at, reached } = sys.stops[tool];
        if at.is_infinite() {
            continue;
        }
        let (travel, push) = of(sys, tool);
        let wanted = sys.roles[tool].push(at).unwrap_or(0.0);
        let now =
            if reached { push - wanted <= OF_NOTE * wanted.abs() } else { travel > at + rounding };
        changes += usize::from(now != reached);
        sys.stops[tool].reached = now;
    }
    changes
}
