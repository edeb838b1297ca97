//! Free rigid-body motions of the sheet: before a tool reaches it, carried by a tool without resistance, or released.
//!
//! Equilibrium does not determine the position of a sheet along its free motions. Of the equilibria that differ by
//! such a motion, the one closest to a reference position is taken (least squares over the nodes):
//!
//! 1. The matrix is singular for the free motions. As many components as necessary are held in a correction
//!    ([`System::find_rigid_supports`]). Among tools without loads these supports carry nothing. Elsewhere they carry a
//!    resultant that is no residual ([`System::supports_carry`]). In a stage without tools they stay where they are.
//! 2. An increment predicted among tools contains no free motion ([`System::remove_free_motions`]).
//! 3. A sheet on which no force acts any more is moved to its reference position as a rigid body
//!    ([`System::move_closest_to`]). The reference is the start of a stage without tools, and otherwise the last
//!    equilibrium.

use super::system::System;
use crate::contact::condition::Condition;
use crate::numbers::tolerances::ROUNDING_REL;
use crate::sheet::rigid_motions::{nearest_free, take_free_motions, unsupported};
use crate::tools::role::Role;
use kanagata_geometry::{Mat3, Vec3};

impl System {
    /// Whether only contact forces and supports act on the sheet.
    pub(crate) fn is_without_loads(&self) -> bool {
        self.applied.iter().all(|&force| force == 0.0)
    }

    /// Whether any tool is present.
    pub(crate) fn has_tools(&self) -> bool {
        self.roles.iter().any(|role| *role != Role::Absent)
    }

    /// Components (node and axis) held in the next correction; `touching` are the conditions of the nodes in contact.
    /// Among tools, dampers and loads determine the position of the sheet. Without tools the components are the same in
    /// the whole stage: forces of released tools have a resultant, so the equilibrium depends on the supports.
    pub(crate) fn find_rigid_supports(
        &self,
        touching: &[Option<Condition>],
    ) -> Vec<(usize, usize)> {
        if self.has_tools() && (self.regime.is_stabilised() || self.regime.loads) {
            return Vec::new();
        }
        let supports = touching.iter().flatten().flat_map(|c| self.supports(c));
        let nodes =
            if self.has_tools() { self.positions() } else { self.moved_by(&self.stage_start) };
        unsupported(&self.constraints, &nodes, supports)
    }

    /// Positions of the nodes for these displacements (three for each node).
    fn moved_by(&self, displacements: &[f64]) -> Vec<Vec3> {
        let moved = displacements.chunks_exact(3).map(Vec3::from_column_slice);
        self.body.mesh().nodes.iter().zip(moved).map(|(x, u)| x + u).collect()
    }

    /// Removes the supported components of a node from the projector onto its free directions.
    pub(crate) fn free_of_supports(&self, node: usize, mut free: Mat3) -> Mat3 {
        self.rigid_supports_of(node).for_each(|axis| free[(axis, axis)] = 0.0);
        free
    }

    /// Components of a node held in the next correction.
    pub(crate) fn rigid_supports_of(&self, node: usize) -> impl Iterator<Item = usize> {
        self.rigid_supports.iter().filter(move |(at, _)| *at == node).map(|(_, axis)| *axis)
    }

    /// Whether the supports carry a resultant: that of forces of released tools as the sheet deforms, of loads, or of the
    /// dampers of a sheet without tools.
    pub(crate) fn supports_carry(&self) -> bool {
        !self.has_tools() || !self.is_without_loads()
    }

    /// Removes from the residual force of a node what its supports carry, and returns it.
    pub(crate) fn take_carried(&self, condition: &mut Condition) -> Vec3 {
        let mut carried = Vec3::zeros();
        for axis in self.rigid_supports_of(condition.node) {
            carried[axis] = std::mem::take(&mut condition.force[axis]);
        }
        carried
    }

    /// Removes from `moves`, the displacements of the last increment, the rigid-body motions that are unconstrained.
    /// A sheet that a tool has carried or lost must not continue to move.
    pub(crate) fn remove_free_motions(&self, moves: &mut [f64]) {
        if self.rigid_supports.is_empty() || !self.has_tools() {
            return;
        }
        let touching = self.conditions.iter().filter(|c| c.candidate.is_some());
        let supports = touching.flat_map(|c| self.supports(c));
        take_free_motions(&self.constraints, &self.positions(), supports, moves);
    }

    /// Moves the sheet as a rigid body, with its internal forces, to the position closest to the displacements
    /// `reference` (three for each node): least squares over the nodes, as far as the constraints permit.
    pub(crate) fn move_closest_to(&mut self, reference: &[f64]) {
        let now = self.positions();
        let (turn, shift) = nearest_free(&self.constraints, &now, &self.moved_by(reference));
        for (node, x) in now.iter().enumerate() {
            let at = 3 * node..3 * node + 3;
            let u = self.displacement(node) + (turn * x + shift - x);
            self.u[at.clone()].copy_from_slice(u.as_slice());
            let force = &mut self.eval.internal_force[at];
            let turned = turn * Vec3::from_column_slice(force);
            force.copy_from_slice(turned.as_slice());
        }
        self.body.mesh().set_means(&mut self.u);
    }

    /// Directions in which a tool supports a node: the normal, and tangents with friction that has a normal force.
    /// Without friction a tangent counts only if the surface is concave along it; a convex surface has no restoring
    /// effect.
    fn supports(&self, c: &Condition) -> impl Iterator<Item = (usize, Vec3)> + Clone {
        let (node, b_tool) = (c.node, c.b_tool);
        let along = self.constraints.free_projector(node) - c.normal * c.normal.transpose();
        let least = ROUNDING_REL * self.scales.tangential;
        let rubs = c.candidate.is_some_and(|k| self.has_friction(self.contact.candidates[k].tool));
        let stiff = rubs && !self.regime.is_loose() && (along * b_tool * along).norm() > least;
        let hollow = move |axis: &Vec3| axis.dot(&(b_tool * axis)) > least;
        let (glides, carried) = (!rubs, self.regime.is_loose());
        let holds = move |axis: &Vec3| stiff || (glides && !carried && hollow(axis));
        let axes = (0..3).filter_map(move |axis| (along * Vec3::ith(axis, 1.0)).try_normalize(0.1));
        std::iter::once(c.normal).chain(axes.filter(holds)).map(move |along| (node, along))
    }

    /// Whether a tool has friction in the current iteration.
    pub(crate) fn has_friction(&self, tool: usize) -> bool {
        self.regime.has_friction() && self.tools[tool].setup.friction > 0.0
    }
}

impl Condition {
    /// Holds a component in the correction. The residual force is not changed.
    pub(crate) fn hold_in_correction(&mut self, axis: usize, stiffness: f64) {
        let along = Vec3::ith(axis, 1.0);
        let own = along * along.transpose();
        self.a = (Mat3::identity() - own) * self.a;
        self.b += own * stiffness;
        self.residual[axis] = 0.0;
    }
}
