//! Forces at the nodes, of tools and supports on them.

use super::system::System;
use crate::geometry::Vec3;
use crate::solver::contact::candidate::{Candidate, Force};
use crate::solver::contact::frame::{contact_normal, whole_force};
use crate::solver::contact::held_friction::held_friction;

impl System {
    /// Internal minus applied force at a node: the force of tools and supports on it.
    pub(in crate::solver) fn force_at(&self, node: usize) -> Vec3 {
        let range = 3 * node..3 * node + 3;
        Vec3::from_column_slice(&self.eval.internal_force[range.clone()])
            - Vec3::from_column_slice(&self.applied[range])
    }

    /// Force of a tool on the node of a touching candidate: what its free directions leave over, what that is the part of, and
    /// friction along a way of the tool in which the node is held.
    pub(in crate::solver) fn contact_force(&self, c: &Candidate) -> Vec3 {
        self.force_of(c, &self.force_at(c.node), self.held_friction(c))
    }

    /// The same of a force at the node and of friction where it is held [N].
    pub(in crate::solver) fn force_of(&self, c: &Candidate, at_node: &Vec3, held: Vec3) -> Vec3 {
        if self.constraints.is_free(c.node) {
            return *at_node;
        }
        let free = self.constraints.free_projector(c.node);
        whole_force(&c.foot, &free, free * at_node) + held
    }

    /// Friction on the node of a touching candidate in the directions in which that is held [N].
    pub(in crate::solver) fn held_friction(&self, c: &Candidate) -> Vec3 {
        if self.constraints.is_free(c.node) {
            return Vec3::zeros();
        }
        let free = self.constraints.free_projector(c.node);
        let force = free * self.force_at(c.node);
        let p = self.position(c.node) - self.tools[c.tool].shift();
        held_friction(c, &p, &force, &free, self.law(c.tool), self.scales)
    }

    /// Forces of the tools on the nodes of all candidates.
    pub(in crate::solver) fn candidate_forces(&self) -> Vec<Force> {
        self.contact.candidates.iter().map(|c| Force::of(c, &self.contact_force(c))).collect()
    }

    /// Force of a tool on the modelled part of the sheet.
    pub(in crate::solver) fn tool_force(&self, tool: usize) -> Vec3 {
        self.contact
            .active()
            .filter(|(_, c)| c.tool == tool)
            .map(|(_, c)| self.contact_force(c))
            .sum()
    }

    /// Normal force at a touching candidate.
    pub(in crate::solver) fn lambda(&self, k: usize) -> f64 {
        let c = &self.contact.candidates[k];
        let free = self.constraints.free_projector(c.node);
        contact_normal(c, &free).dot(&self.force_at(c.node))
    }
}
