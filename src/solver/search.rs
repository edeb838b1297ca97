//! Where the nodes stand to the tools: looked for at every iterate, kept at every balance, looked back at once a step is made.

use std::time::Instant;

use super::contact::{Candidate, Force};
use super::system::{Role, System};

impl System {
    /// Closest points at the present positions.
    pub(super) fn search(&mut self) {
        let start = Instant::now();
        let (x, present) = (self.positions(), self.present());
        self.contact.search(&x, &self.tools, &present, self.lengths.longest_edge);
        self.timings.search += start.elapsed().as_secs_f64();
    }

    /// Closest points on one tool, however far away it is.
    pub(super) fn search_far(&mut self, tool: usize) {
        let start = Instant::now();
        let x = self.positions();
        let only: Vec<bool> = (0..self.tools.len()).map(|other| other == tool).collect();
        self.contact.search(&x, &self.tools, &only, f64::INFINITY);
        self.timings.search += start.elapsed().as_secs_f64();
    }

    /// Makes the present places of nodes and tools those that the next increment starts from; `forces`: of the tools on the
    /// candidates' nodes.
    pub(super) fn commit_contact(&mut self, forces: &[Force]) {
        let (x, present) = (self.positions(), self.present());
        self.contact.commit(&x, (&self.tools, &present), self.lengths.transition, forces);
    }

    /// A node that does not touch a tool although that stood in its way since the last balance. Steps in which nothing moves
    /// farther past a tool than the longest edge take nothing through it: there the search finds what is inside.
    pub(super) fn passed_through(&self) -> Option<usize> {
        let (x, present) = (self.positions(), self.present());
        let reach = self.lengths.longest_edge;
        let free = |c: &&Candidate| !c.active && present[c.tool] && c.foot.gap >= 0.0;
        let gone = |c: &&Candidate| {
            let (x, tool) = (&x[c.node], &self.tools[c.tool]);
            // What ends farther from the tool than it has moved was never inside.
            c.moved(x, tool) > reach.max(c.foot.gap) && c.passed_through(x, tool, reach)
        };
        let found = self.contact.candidates.iter().filter(free).find(gone);
        found.map(|c| c.node)
    }

    fn present(&self) -> Vec<bool> {
        self.roles.iter().map(|r| *r != Role::Absent).collect()
    }
}
