//! Where the nodes stand to the tools: looked for at every iterate, kept at every balance.

use std::time::Instant;

use super::system::System;
use crate::solver::contact::candidate::Force;
use crate::solver::tools::role::Role;

impl System {
    /// Closest points at the present positions.
    pub(in crate::solver) fn search(&mut self) {
        let start = Instant::now();
        let (x, present) = (self.positions(), self.present());
        self.contact.search(&x, &self.tools, &present, self.lengths.longest_edge);
        self.timings.search += start.elapsed().as_secs_f64();
    }

    /// Closest points on one tool, which has just been moved.
    pub(in crate::solver) fn search_again(&mut self, tool: usize) {
        let start = Instant::now();
        let x = self.positions();
        let only: Vec<bool> = (0..self.tools.len()).map(|other| other == tool).collect();
        self.contact.search(&x, &self.tools, &only, self.lengths.longest_edge);
        self.timings.search += start.elapsed().as_secs_f64();
    }

    /// Makes the present places of nodes and tools those that the next increment starts from; `forces`: of the tools on the
    /// candidates' nodes.
    pub(in crate::solver) fn commit_contact(&mut self, forces: &[Force]) {
        let (x, present) = (self.positions(), self.present());
        let (transition, least) = (self.lengths.transition, self.scales.least());
        self.contact.commit(&x, (&self.tools, &present), transition, forces, least);
    }

    pub(in crate::solver) fn present(&self) -> Vec<bool> {
        self.roles.iter().map(|r| *r != Role::Absent).collect()
    }
}
