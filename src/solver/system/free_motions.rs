//! A sheet that nothing holds yet: between two stages, or carried along by a tool that meets no resistance.
//!
//! Where the scene has no loads, nothing pushes it along the rigid motions that are free, and it stays where it is in them until
//! a tool takes it along. The matrix says nothing about them; left to it, rounding would say where the sheet goes. A
//! correction therefore has none of them: as many components as it takes stand still in it. What is balanced is the sheet
//! without these supports, which carry nothing. Forces of tools that are let go balance by themselves, but for what the sheet
//! moves under them while they fall to nothing: that alone the supports carry.

use super::system::System;
use crate::geometry::{Mat3, Vec3};
use crate::solver::contact::condition::Condition;
use crate::solver::sheet::rigid_motions::{take_free_motions, unsupported};

/// Stiffness of friction by which a tool holds a node, over the mesh's: less cannot be told from rounding.
const FRICTION_STIFFNESS_REL: f64 = 1e-10;

impl System {
    /// Whether no force acts on the sheet but those of tools that touch it and supports.
    pub(in crate::solver) fn is_without_loads(&self) -> bool {
        self.applied.iter().all(|&force| force == 0.0)
    }

    /// Components (node and axis) that stand still in the next correction; `touching`: conditions of the nodes that touch.
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

    /// Takes from `moves`, the displacements of the last increment, the rigid motions that nothing holds any more: a sheet
    /// that a tool has carried or thrown off does not fly on.
    pub(in crate::solver) fn stop_floating(&self, moves: &mut [f64]) {
        if self.still.is_empty() {
            return;
        }
        let touching = self.conditions.iter().filter(|c| c.candidate.is_some());
        let supports = touching.flat_map(|c| self.supports(c));
        take_free_motions(&self.constraints, &self.positions(), supports, moves);
    }

    /// Directions in which a tool holds a node: across its surface, and along it where friction has a force to go by or, without
    /// friction, the surface is hollow. One that bulges pushes a node off to the side: where it lies it may stay, but nothing
    /// holds it there.
    fn supports(&self, c: &Condition) -> impl Iterator<Item = (usize, Vec3)> + Clone {
        let (node, b_tool) = (c.node, c.b_tool);
        let along = self.constraints.free_projector(node) - c.normal * c.normal.transpose();
        let least = FRICTION_STIFFNESS_REL * self.scales.tangential;
        let rubs = c.candidate.is_some_and(|k| self.has_friction(self.contact.candidates[k].tool));
        let stiff = rubs && !self.regime.is_loose() && (along * b_tool * along).norm() > least;
        let hollow = move |axis: &Vec3| axis.dot(&(b_tool * axis)) > least;
        let (glides, carried) = (!rubs, self.regime.is_loose());
        let holds = move |axis: &Vec3| stiff || (glides && !carried && hollow(axis));
        let axes = (0..3).filter_map(move |axis| (along * Vec3::ith(axis, 1.0)).try_normalize(0.1));
        std::iter::once(c.normal).chain(axes.filter(holds)).map(move |along| (node, along))
    }

    /// Whether a tool has friction in the present iteration.
    pub(in crate::solver) fn has_friction(&self, tool: usize) -> bool {
        self.regime.has_friction() && self.tools[tool].setup.friction > 0.0
    }
}

impl Condition {
    /// Lets a component stand still in the correction. The force out of balance stays what it is.
    pub(in crate::solver) fn stand_still(&mut self, axis: usize, stiffness: f64) {
        let along = Vec3::ith(axis, 1.0);
        let own = along * along.transpose();
        self.a = (Mat3::identity() - own) * self.a;
        self.b += own * stiffness;
        self.residual[axis] = 0.0;
    }
}
