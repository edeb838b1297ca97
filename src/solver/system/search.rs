//! Contact search: foot points of all nodes, updated at every iterate and stored at every equilibrium.

use std::time::Instant;

use super::system::System;
use crate::contact::candidate::Force;
use crate::tools::role::Role;

impl System {
    /// Updates the foot points for the current positions.
    pub(crate) fn search(&mut self) {
        let start = Instant::now();
        let (x, present) = (self.positions(), self.present());
        self.contact.search(&x, &self.tools, &present, self.lengths.longest_edge);
        self.timings.search += start.elapsed().as_secs_f64();
    }

    /// Updates the foot points on one tool, which has moved.
    pub(crate) fn search_again(&mut self, tool: usize) {
        let start = Instant::now();
        let x = self.positions();
        let only: Vec<bool> = (0..self.tools.len()).map(|other| other == tool).collect();
        self.contact.search(&x, &self.tools, &only, self.lengths.longest_edge);
        self.timings.search += start.elapsed().as_secs_f64();
    }

    /// Makes the current positions of nodes and tools the reference of the next increment; `forces` are the contact
    /// forces of the candidates.
    pub(crate) fn commit_contact(&mut self, forces: &[Force]) {
        let (x, present) = (self.positions(), self.present());
        let (transition, least) = (self.lengths.transition, self.scales.least());
        self.contact.commit(&x, (&self.tools, &present), transition, forces, least);
    }

    pub(crate) fn present(&self) -> Vec<bool> {
        self.roles.iter().map(|r| *r != Role::Absent).collect()
    }
}
