//! Where the nodes stand to the tools: looked for at every iterate, kept at every balance, looked back at once a step is made.

use std::time::Instant;

use super::contact::{Candidate, Force};
use super::system::{Role, System};

/// Cosine between a node's way and the normal of a face that it comes out of.
const LEAVES: f64 = 0.5;

impl System {
    /// Closest points at the present positions.
    pub(super) fn search(&mut self) {
        let start = Instant::now();
        let (x, present) = (self.positions(), self.present());
        self.contact.search(&x, &self.tools, &present, self.lengths.longest_edge);
        self.timings.search += start.elapsed().as_secs_f64();
    }

    /// Closest points on one tool, which has just been moved.
    pub(super) fn search_again(&mut self, tool: usize) {
        let start = Instant::now();
        let x = self.positions();
        let only: Vec<bool> = (0..self.tools.len()).map(|other| other == tool).collect();
        self.contact.search(&x, &self.tools, &only, self.lengths.longest_edge);
        self.timings.search += start.elapsed().as_secs_f64();
    }

    /// Makes the present places of nodes and tools those that the next increment starts from; `forces`: of the tools on the
    /// candidates' nodes.
    pub(super) fn commit_contact(&mut self, forces: &[Force]) {
        let (x, present) = (self.positions(), self.present());
        self.contact.commit(&x, (&self.tools, &present), self.lengths.transition, forces);
    }

    /// A node in whose way a tool stood since the last balance, and that is on its far side now: clear of it, or held off the
    /// face that looks the other way. Of nodes that moved no farther past a tool than the longest edge only those are looked at
    /// that moved out of the face that is next to them now, or past the tool's border.
    pub(super) fn passed_through(&self) -> Option<usize> {
        let (x, present) = (self.positions(), self.present());
        let reach = self.lengths.longest_edge;
        let gone = |c: &&Candidate| {
            let (x, tool) = (&x[c.node], &self.tools[c.tool]);
            let way = c.way(x, tool);
            let moved = way.norm();
            let leaves = c.foot.past_border || way.dot(&c.foot.normal) > LEAVES * moved;
            // What ends farther from the tool than it has moved was never inside.
            let far = moved <= c.foot.gap.abs();
            !far && (leaves || moved > reach) && c.passed_through(x, tool, reach)
        };
        let found = self.contact.candidates.iter().filter(|c| present[c.tool]).find(gone);
        found.map(|c| c.node)
    }

    fn present(&self) -> Vec<bool> {
        self.roles.iter().map(|r| *r != Role::Absent).collect()
    }
}
