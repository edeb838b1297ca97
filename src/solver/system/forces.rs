//! Forces of tools and supports on the nodes.

use super::system::System;
use crate::contact::candidate::{Candidate, Force};
use crate::contact::frame::{contact_normal, whole_force};
use crate::contact::held_friction::held_friction;
use kanagata_geometry::Vec3;

impl System {
    /// Internal minus applied force at a node: the force of tools and supports on it.
    pub(crate) fn force_at(&self, node: usize) -> Vec3 {
        let range = 3 * node..3 * node + 3;
        Vec3::from_column_slice(&self.eval.internal_force[range.clone()])
            - Vec3::from_column_slice(&self.applied[range])
    }

    /// Force of a tool on the node of a candidate in contact. It consists of the residual in the free directions, the
    /// part of the normal force that the support carries, and friction in constrained directions.
    pub(crate) fn contact_force(&self, c: &Candidate) -> Vec3 {
        self.force_of(c, &self.force_at(c.node), self.held_friction(c))
    }

    /// As [`Self::contact_force`] for a given nodal force and friction in constrained directions [N].
    pub(crate) fn force_of(&self, c: &Candidate, at_node: &Vec3, held: Vec3) -> Vec3 {
        if self.constraints.is_free(c.node) {
            return *at_node;
        }
        let free = self.constraints.free_projector(c.node);
        whole_force(&c.foot, &free, free * at_node) + held
    }

    /// Friction in the constrained directions of the node of a candidate in contact [N].
    pub(crate) fn held_friction(&self, c: &Candidate) -> Vec3 {
        if self.constraints.is_free(c.node) {
            return Vec3::zeros();
        }
        let free = self.constraints.free_projector(c.node);
        let force = free * self.force_at(c.node);
        let p = self.position(c.node) - self.tools[c.tool].shift();
        held_friction(c, &p, &force, &free, self.law(c.tool), self.scales)
    }

    /// Contact forces of all candidates.
    pub(crate) fn candidate_forces(&self) -> Vec<Force> {
        self.contact.candidates.iter().map(|c| Force::of(c, &self.contact_force(c))).collect()
    }

    /// Force of a tool on the modelled part of the sheet.
    pub(crate) fn tool_force(&self, tool: usize) -> Vec3 {
        self.contact
            .active()
            .filter(|(_, c)| c.tool == tool)
            .map(|(_, c)| self.contact_force(c))
            .sum()
    }

    /// Normal force of a candidate in contact.
    pub(crate) fn lambda(&self, k: usize) -> f64 {
        let c = &self.contact.candidates[k];
        let free = self.constraints.free_projector(c.node);
        contact_normal(c, &free).dot(&self.force_at(c.node))
    }
}
