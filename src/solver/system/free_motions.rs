//! Free rigid-body motions of an unconstrained sheet: between two stages, or carried by a tool without resistance.
//!
//! Without loads no force acts along the free rigid-body motions, and the sheet does not move along them until a tool
//! carries it. The matrix is singular for these motions, and rounding would determine them. As many components as
//! necessary are therefore held in a correction. The residual does not contain these supports, which carry nothing.
//! The forces of released tools are self-equilibrated except for the motion of the sheet while they decrease; the
//! supports carry only this remainder.

use super::system::System;
use crate::geometry::{Mat3, Vec3};
use crate::solver::contact::condition::Condition;
use crate::solver::numbers::tolerances::ROUNDING_REL;
use crate::solver::sheet::rigid_motions::{take_free_motions, unsupported};

impl System {
    /// Whether only contact forces and supports act on the sheet.
    pub(in crate::solver) fn is_without_loads(&self) -> bool {
        self.applied.iter().all(|&force| force == 0.0)
    }

    /// Components (node and axis) held in the next correction; `touching` are the conditions of the nodes in contact.
    pub(in crate::solver) fn floating(
        &self,
        touching: &[Option<Condition>],
    ) -> Vec<(usize, usize)> {
        if self.regime.is_stabilised() || self.regime.loads {
            return Vec::new();
        }
        let supports = touching.iter().flatten().flat_map(|c| self.supports(c));
        unsupported(&self.constraints, &self.positions(), supports)
    }

    /// Removes from `moves`, the displacements of the last increment, the rigid-body motions that are unconstrained.
    /// A sheet that a tool has carried or lost must not continue to move.
    pub(in crate::solver) fn stop_floating(&self, moves: &mut [f64]) {
        if self.still.is_empty() {
            return;
        }
        let touching = self.conditions.iter().filter(|c| c.candidate.is_some());
        let supports = touching.flat_map(|c| self.supports(c));
        take_free_motions(&self.constraints, &self.positions(), supports, moves);
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
    pub(in crate::solver) fn has_friction(&self, tool: usize) -> bool {
        self.regime.has_friction() && self.tools[tool].setup.friction > 0.0
    }
}

impl Condition {
    /// Holds a component in the correction. The residual force is not changed.
    pub(in crate::solver) fn stand_still(&mut self, axis: usize, stiffness: f64) {
        let along = Vec3::ith(axis, 1.0);
        let own = along * along.transpose();
        self.a = (Mat3::identity() - own) * self.a;
        self.b += own * stiffness;
        self.residual[axis] = 0.0;
    }
}
