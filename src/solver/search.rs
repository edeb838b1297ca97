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

    /// A node that does not touch a tool although that stood in its way since the last balance. Steps in which a node moves no
    /// farther past a tool than the longest edge take it through only where it comes out of its back, or past its border: there
    /// the search finds what is inside.
    pub(super) fn passed_through(&self) -> Option<usize> {
        let (x, present) = (self.positions(), self.present());
        let reach = self.lengths.longest_edge;
        let outside = |c: &Candidate| c.foot.gap >= 0.0 || c.foot.past_border;
        let free = |c: &&Candidate| !c.active && present[c.tool] && outside(c);
        let gone = |c: &&Candidate| {
            let (x, tool) = (&x[c.node], &self.tools[c.tool]);
            let way = c.way(x, tool);
            let moved = way.norm();
            let leaves = c.foot.past_border || way.dot(&c.foot.normal) > LEAVES * moved;
            // What ends farther from the tool than it has moved was never inside.
            let far = moved <= c.foot.gap.abs();
            !far && (leaves || moved > reach) && c.passed_through(x, tool, reach)
        };
        let found = self.contact.candidates.iter().filter(free).find(gone);
        found.map(|c| c.node)
    }

    fn present(&self) -> Vec<bool> {
        self.roles.iter().map(|r| *r != Role::Absent).collect()
    }
}
