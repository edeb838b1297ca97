//! The complete system at an iterate: body, tools, contact and constraints, and its residual.

use std::time::Instant;

use rayon::prelude::*;

use super::matrix::Matrix;
use super::regime::Regime;
use super::timings::Timings;
use crate::assembly::Body;
use crate::assembly::Foresight;
use crate::assembly::{ElementFailure, Evaluation};
use crate::contact::candidate::ContactSet;
use crate::contact::condition::{Condition, hold, touching, untouched};
use crate::contact::face_penetration::Penetration;
use crate::contact::frame::{Scales, can_touch};
use crate::element::Want;
use crate::linear::{CheckedSolver, LinearError, NodeRows};
use crate::numbers::tolerances::ROUNDING_REL;
use crate::sheet::sizes::{Lengths, edge_lengths};
use crate::sheet::supports::Constraints;
use crate::tools::role::Role;
use crate::tools::stop::Stop;
use crate::tools::tool::Tool;
use kanagata_cancel::Cancel;
use kanagata_contact::friction::Coulomb;
use kanagata_geometry::{Mat3, Vec3};

/// State of the iteration.
pub(crate) struct System {
    /// Cancellation of the current increment.
    pub(crate) cancel: Cancel,
    pub(crate) body: Body,
    pub(crate) constraints: Constraints,
    pub(crate) tools: Vec<Tool>,
    pub(crate) roles: Vec<Role>,
    pub(crate) stops: Vec<Stop>,
    pub(crate) contact: ContactSet,
    /// Faces and features for the measurement of penetration between nodes.
    pub(crate) penetration: Penetration,
    pub(crate) u: Vec<f64>,
    /// Applied nodal forces (three for each node) [N].
    pub(crate) applied: Vec<f64>,
    pub(crate) eval: Evaluation,
    /// Loads and stabilisation in addition to tools and supports.
    pub(crate) regime: Regime,
    pub(crate) conditions: Vec<Condition>,
    /// Components held in the next correction, since the sheet is unconstrained ([`super::free_motions`]).
    pub(crate) rigid_supports: Vec<(usize, usize)>,
    /// Displacements at the start of a stage without tools; zero if the model has none.
    pub(crate) stage_start: Vec<f64>,
    pub(crate) scales: Scales,
    pub(crate) lengths: Lengths,
    pub(crate) timings: Timings,
    pub(crate) solver: CheckedSolver,
    pub(crate) node_rows: NodeRows,
    pub(crate) matrix: Matrix,
    /// The factors are those of a symmetric matrix.
    pub(crate) symmetric: bool,
}

/// Norms of the residual.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Residual {
    /// Norm of residual forces [N].
    pub(crate) force: f64,
    /// Norm of contact forces and reactions [N].
    pub(crate) reference: f64,
    /// Largest violation of gap and stick conditions [mm].
    pub(crate) length: f64,
    /// Largest penetration of a node [mm].
    pub(crate) penetration: f64,
    /// Node with the largest residual force.
    pub(crate) worst_node: usize,
    pub(crate) slipping: usize,
    /// Nodes in contact that stick according to the law without transition.
    pub(crate) stuck: usize,
}

impl Residual {
    /// Adds lengths and friction state of a node; `gap` is that of its candidate in contact [mm].
    fn add_contact(&mut self, condition: &Condition, gap: Option<f64>) {
        self.length = self.length.max(condition.length);
        if let Some(gap) = gap {
            self.penetration = self.penetration.max(-gap);
        }
        self.slipping += usize::from(condition.slipping);
        self.stuck += usize::from(condition.stuck);
    }
}

impl System {
    pub(crate) fn new(
        body: Body,
        mut constraints: Constraints,
        tools: Vec<Tool>,
    ) -> Result<Self, LinearError> {
        let mesh = body.mesh();
        mesh.hanging_nodes().for_each(|(node, _)| constraints.hang(node));
        let n = 3 * mesh.nodes.len();
        let contact = ContactSet::new(mesh, &tools);
        let mut solver = CheckedSolver::new(body.pattern(), body.mesh().groups())?;
        let lengths = edge_lengths(body.mesh());
        solver.max_plausible_entry = lengths.size;
        let penetration = Penetration::of(body.mesh(), &tools, lengths.longest_edge);
        let not_of_nodes = || LinearError::Pattern("its rows are not those of nodes".into());
        Ok(Self {
            lengths,
            roles: vec![Role::Absent; tools.len()],
            cancel: Cancel::default(),
            stops: vec![Stop::NONE; tools.len()],
            contact,
            penetration,
            u: vec![0.0; n],
            applied: vec![0.0; n],
            eval: Evaluation::default(),
            regime: Regime::default(),
            conditions: Vec::new(),
            rigid_supports: Vec::new(),
            stage_start: vec![0.0; n],
            scales: Scales { normal: 1.0, tangential: 1.0, rounding: 0.0, compliance: 0.0 },
            timings: Timings::default(),
            solver,
            node_rows: NodeRows::of(body.pattern()).ok_or_else(not_of_nodes)?,
            matrix: Matrix::new(body.pattern()),
            symmetric: false,
            body,
            constraints,
            tools,
        })
    }

    pub(crate) fn node_count(&self) -> usize {
        self.constraints.len()
    }

    /// Displacement of a node.
    pub(crate) fn displacement(&self, node: usize) -> Vec3 {
        Vec3::from_column_slice(&self.u[3 * node..3 * node + 3])
    }

    /// Nodes that share an element with `node`, including itself.
    pub(crate) fn neighbours(&self, node: usize) -> impl Iterator<Item = usize> {
        let pattern = self.body.pattern();
        let row = pattern.row_ptr[3 * node]..pattern.row_ptr[3 * node + 1];
        pattern.col_idx[row].iter().step_by(3).map(|column| column / 3)
    }

    /// Current position of a node.
    pub(crate) fn position(&self, node: usize) -> Vec3 {
        self.body.mesh().nodes[node] + self.displacement(node)
    }

    /// Evaluates the elements, and the dampers if there are any, at the current displacements.
    pub(crate) fn evaluate(&mut self, want: Want) -> Result<(), ElementFailure> {
        let start = Instant::now();
        self.body.mesh().set_means(&mut self.u);
        let done = self.body.evaluate(&self.u, want, &mut self.eval);
        self.finish(want, start, done)
    }

    /// As [`Self::evaluate`] for the law linearised at the predicted strains, with its tangent.
    pub(crate) fn evaluate_foreseen(&mut self, foresight: Foresight) -> Result<(), ElementFailure> {
        let start = Instant::now();
        self.body.mesh().set_means(&mut self.u);
        let done = self.body.evaluate_foreseen(&self.u, foresight, &mut self.eval);
        self.finish(Want::ResidualAndTangent, start, done)
    }

    /// As [`Self::evaluate`] with the plastic tangent at all points on the yield surface.
    pub(crate) fn evaluate_at_yield(&mut self) -> Result<(), ElementFailure> {
        let start = Instant::now();
        self.body.mesh().set_means(&mut self.u);
        let done = self.body.evaluate_at_yield(&self.u, &mut self.eval);
        self.finish(Want::ResidualAndTangent, start, done)
    }

    /// Adds the dampers, if there are any, to the element forces evaluated since `start`.
    fn finish(
        &mut self,
        want: Want,
        start: Instant,
        done: Result<(), ElementFailure>,
    ) -> Result<(), ElementFailure> {
        if let (Ok(()), Some(damper)) = (&done, self.regime.damper()) {
            damper.add(&self.u, want, self.body.pattern(), &mut self.eval);
        }
        if want == Want::ResidualAndTangent {
            self.matrix.renew();
        }
        self.timings.elements += start.elapsed().as_secs_f64();
        done
    }

    pub(crate) fn positions(&self) -> Vec<Vec3> {
        (0..self.node_count()).map(|node| self.position(node)).collect()
    }

    /// Sets the scales of the conditions from the tangent of the undeformed sheet. They are means of the largest and
    /// the smallest stiffness of a node over all directions, so that they do not depend on the axes. `stiffness` is
    /// that of contact springs over that of the mesh, if there are any.
    pub(crate) fn set_scales(&mut self, stiffness: Option<f64>) {
        let (mut most, mut least) = (0.0, 0.0);
        let count = self.body.mesh().free_node_count().max(1) as f64;
        for node in (0..self.node_count()).filter(|&node| !self.constraints.is_hanging(node)) {
            let stiffness = self.stiffness_of(node).symmetric_eigenvalues();
            most += stiffness.max() / count;
            least += stiffness.min() / count;
        }
        let positive = |v: f64| if v > 0.0 && v.is_finite() { v } else { 1.0 };
        self.scales = Scales {
            normal: positive(most),
            tangential: positive(least),
            rounding: ROUNDING_REL * self.lengths.shortest_edge,
            compliance: stiffness.map_or(0.0, |s| 1.0 / (s * positive(most))),
        };
    }

    /// Stiffness of a node with all others fixed: symmetric part of its diagonal block of the tangent [N/mm].
    fn stiffness_of(&self, node: usize) -> Mat3 {
        let pattern = self.body.pattern();
        let block = Mat3::from_fn(|i, j| {
            let place = pattern.position(3 * node + i, 3 * node + j);
            place.map_or(0.0, |q| self.eval.tangent[q])
        });
        0.5 * (block + block.transpose())
    }

    /// Sets the multipliers of the augmented Lagrangian method to the current forces if a gap exceeds `allowed` [mm];
    /// returns whether it did.
    pub(crate) fn augment(&mut self, allowed: f64) -> bool {
        if self.contact.active().all(|(_, c)| c.foot.gap.abs() <= allowed) {
            return false;
        }
        let forces: Vec<(usize, f64)> =
            self.contact.active().map(|(k, _)| (k, self.lambda(k).max(0.0))).collect();
        forces.into_iter().for_each(|(k, force)| self.contact.candidates[k].push = force);
        true
    }

    /// Conditions of all nodes that are held or in contact, and the norm of the residual. Nodes in contact that no
    /// tool can push separate.
    pub(crate) fn assemble(&mut self) -> Residual {
        let start = Instant::now();
        let touching = self.touching_conditions();
        self.rigid_supports = self.find_rigid_supports(&touching);
        self.conditions.clear();
        let mut residual = Residual::default();
        let carry = self.supports_carry();
        let (mut worst, mut squares, mut supports) = (0.0, 0.0, 0.0);
        for (node, condition) in touching.into_iter().enumerate() {
            let r = self.force_at(node);
            let free = self.constraints.free_projector(node);
            let carried = if condition.is_some() { r } else { r - free * r };
            supports += carried.norm_squared();
            let supported = self.rigid_supports_of(node).next().is_some();
            let plain = condition.is_none() && !supported && self.constraints.is_free(node);
            let mut condition = condition.unwrap_or_else(|| untouched(node, &r, &free));
            if carry {
                supports += self.take_carried(&mut condition).norm_squared();
            }
            let unbalanced = condition.force.norm_squared();
            squares += unbalanced;
            if unbalanced > worst {
                (worst, residual.worst_node) = (unbalanced, node);
            }
            let gap = condition.candidate.map(|k| self.contact.candidates[k].foot.gap);
            residual.add_contact(&condition, gap);
            if !plain {
                self.support(&mut condition, &free);
                self.conditions.push(condition);
            }
        }
        self.look_at_tools(&mut residual);
        residual.force = (squares + self.unbalanced_tools()).sqrt();
        residual.reference = supports.sqrt();
        self.timings.contact += start.elapsed().as_secs_f64();
        residual
    }

    /// Adds violations of the tools: penetration of nodes in contact with another tool, and the travel to a stop.
    fn look_at_tools(&self, residual: &mut Residual) {
        let busy = (0..self.contact.candidates.len()).filter(|&k| self.is_beyond_a_second_tool(k));
        let depth = busy.map(|k| -self.contact.candidates[k].foot.gap);
        residual.penetration = depth.fold(residual.penetration, f64::max);
        let stops = (0..self.tools.len()).filter_map(|tool| self.short_of_stop(tool));
        residual.length = stops.fold(residual.length, |length, off| length.max(off.abs()));
    }

    /// Whether the node of a candidate, in contact with another tool, penetrates this one. Each node has at most one
    /// contact pair.
    fn is_beyond_a_second_tool(&self, k: usize) -> bool {
        let c = &self.contact.candidates[k];
        let present = self.roles[c.tool] != Role::Absent;
        !c.active && present && c.foot.gap < 0.0 && !c.foot.past_border && self.can_touch(k)
    }

    /// Adds held components of a node, and those held in the correction, to its condition. The row of a hanging node is
    /// that of a support without displacement: its displacement follows from its masters.
    fn support(&self, condition: &mut Condition, free: &Mat3) {
        let node = condition.node;
        let hangs = self.constraints.is_hanging(node);
        let offset = if hangs { Vec3::zeros() } else { self.displacement(node) };
        hold(condition, free, &offset, self.scales);
        for axis in self.rigid_supports_of(node) {
            condition.hold_in_correction(axis, self.scales.normal);
        }
    }

    /// Squared difference between prescribed and actual forces of tools driven by force.
    fn unbalanced_tools(&self) -> f64 {
        let off = |tool: usize| Some(self.push_of(tool) - self.wanted(tool)?);
        (0..self.tools.len()).filter_map(off).map(|off| off * off).sum()
    }

    /// Residual force at every node [N]: of equilibrium, or of Coulomb's law if a tool or a support carries the rest.
    pub(crate) fn unbalanced(&self) -> impl Iterator<Item = Vec3> {
        let mut conditions = self.conditions.iter().peekable();
        (0..self.node_count()).map(move |node| {
            conditions.next_if(|c| c.node == node).map_or_else(|| self.force_at(node), |c| c.force)
        })
    }

    /// Stores the sliding state of every candidate in contact; once per iterate.
    pub(crate) fn remember_sliding(&mut self) {
        for c in &self.conditions {
            if let Some(k) = c.candidate {
                self.contact.candidates[k].sliding = !c.stuck;
            }
        }
    }

    /// Conditions of all nodes in contact that a tool can push.
    fn touching_conditions(&self) -> Vec<Option<Condition>> {
        let mut by_node: Vec<Option<usize>> = vec![None; self.node_count()];
        for (k, c) in self.contact.active() {
            by_node[c.node].get_or_insert(k);
        }
        let idle = self.is_idle();
        let nodes = by_node.par_iter().with_min_len(64).enumerate();
        nodes.map(|(node, k)| self.touching(node, (*k)?, idle)).collect()
    }

    /// Condition that candidate `k` imposes on its node in place of equilibrium; `idle`: no tool pushes the sheet.
    fn touching(&self, node: usize, k: usize, idle: bool) -> Option<Condition> {
        let (r, free) = (&self.force_at(node), &self.constraints.free_projector(node));
        let c = &self.contact.candidates[k];
        let tool = &self.tools[c.tool];
        let p = self.position(c.node) - tool.shift();
        let law = self.law(c.tool);
        let mut out = touching(c, &p, r, free, law, self.scales, idle)?;
        out.candidate = Some(k);
        Some(out)
    }

    /// Friction law of a tool.
    pub(crate) fn law(&self, tool: usize) -> Coulomb {
        let mu = if self.has_friction(tool) { self.tools[tool].setup.friction } else { 0.0 };
        Coulomb { mu, transition: self.lengths.transition }
    }

    /// Whether contact of this candidate is admissible.
    pub(crate) fn can_touch(&self, k: usize) -> bool {
        let c = &self.contact.candidates[k];
        self.roles[c.tool] != Role::Absent && can_touch(c, &self.constraints.free_projector(c.node))
    }
}
