//! Stability of an equilibrium: the tangent, projected on the motions that keep nodes at their tools and overcome no
//! friction, must be positive definite.
//!
//! An unstable equilibrium lies beyond a limit point or on the primary branch beyond a bifurcation; the smallest
//! perturbation moves the sheet away from it. Motions of negative stiffness are no instability if friction resists
//! them at slipping nodes: a sheet between its tools that may slide has almost no stiffness along itself, of either
//! sign. Neither is unresisted rigid sliding of a sheet loaded only by tools.

use std::time::Instant;

use rayon::prelude::*;

use super::system::System;
use crate::contact::condition::{Condition, resistance};
use crate::linear::pattern::Pattern;
use kanagata_geometry::Mat3;

/// Stiffness added to every unknown over that of the mesh, so that rounding does not make free motions appear unstable.
/// A thin sheet bends with 1e-9 of the stiffness of the mesh; a hundredth of that does not make it appear stable.
const STABILITY_SHIFT_REL: f64 = 1e-11;

/// Admissible motion of a node, and the stiffness against it besides that of the sheet.
struct Motion {
    node: usize,
    along: Mat3,
    resisted: Mat3,
}

impl System {
    /// Whether the last evaluated equilibrium is stable. With an unsymmetric tangent this is unknown, and the
    /// equilibrium is taken as stable. Overwrites the factors.
    pub(crate) fn lasts(&mut self) -> bool {
        if !self.body.is_symmetric() {
            return true;
        }
        let start = Instant::now();
        self.project_tangent();
        let lasts = self.solver.is_definite(&self.matrix.values) || self.tools_resist();
        self.timings.stability += start.elapsed().as_secs_f64();
        lasts
    }

    /// Sets the matrix to the tangent projected on the motions that tools, supports and friction permit.
    pub(crate) fn project_tangent(&mut self) {
        let motions = self.motions();
        let least = STABILITY_SHIFT_REL * self.scales.normal;
        self.matrix.set(self.body.pattern(), &mut self.eval.tangent, &[], true);
        let values = &mut self.matrix.values;
        project(self.body.pattern(), values, &motions);
        stiffen(self.body.pattern(), values, least);
    }

    /// Admissible motions of the nodes that are not free in all directions.
    fn motions(&self) -> Vec<Motion> {
        let of = |c: &Condition| {
            let free = self.constraints.free_projector(c.node);
            let along = match c.candidate {
                Some(_) if c.stuck => Mat3::zeros(),
                Some(_) => free - c.normal * c.normal.transpose(),
                None => self.free_of_supports(c.node, free),
            };
            let held = (Mat3::identity() - along) * self.scales.normal;
            let resisted = held + along * self.resistance(c, &free) * along;
            Motion { node: c.node, along, resisted }
        };
        self.conditions.iter().map(of).collect()
    }

    /// Stiffness against sliding of a node besides that of the sheet.
    fn resistance(&self, c: &Condition, free: &Mat3) -> Mat3 {
        let Some(k) = c.candidate else { return Mat3::zeros() };
        let candidate = &self.contact.candidates[k];
        let p = self.position(c.node) - self.tools[candidate.tool].shift();
        resistance(
            candidate,
            &p,
            &self.force_at(c.node),
            free,
            self.law(candidate.tool),
            self.scales,
        )
    }
}

/// Projects the matrix on the admissible motions and adds the other stiffness against them.
fn project(pattern: &Pattern, values: &mut [f64], motions: &[Motion]) {
    let mut of_node: Vec<Option<&Motion>> = vec![None; pattern.dim() / 3];
    motions.iter().for_each(|motion| of_node[motion.node] = Some(motion));
    let mut rows = Vec::with_capacity(of_node.len());
    let mut rest = values;
    for node in 0..of_node.len() {
        let stored = pattern.row_ptr[3 * node + 3] - pattern.row_ptr[3 * node];
        let (own, behind) = rest.split_at_mut(stored);
        rows.push(own);
        rest = behind;
    }
    let rows = rows.into_par_iter().enumerate();
    rows.for_each(|(node, rows)| project_rows(pattern, node, rows, &of_node));
}

/// Projects the three rows of a node, block by block.
fn project_rows(pattern: &Pattern, node: usize, rows: &mut [f64], of_node: &[Option<&Motion>]) {
    let width = rows.len() / 3;
    let columns = &pattern.col_idx[pattern.row_ptr[3 * node]..][..width];
    for (first, column) in columns.iter().enumerate().step_by(3) {
        let other = column / 3;
        let (left, right) = (of_node[node], of_node[other]);
        if left.is_none() && right.is_none() {
            continue;
        }
        let mut block = Mat3::from_fn(|i, j| rows[i * width + first + j]);
        if let Some(motion) = left {
            block = motion.along * block;
        }
        if let Some(motion) = right {
            block *= motion.along;
        }
        if let Some(motion) = left.filter(|_| other == node) {
            block += motion.resisted;
        }
        for (i, row) in rows.chunks_exact_mut(width).enumerate() {
            (0..3).for_each(|j| row[first + j] = block[(i, j)]);
        }
    }
}

fn stiffen(pattern: &Pattern, values: &mut [f64], by: f64) {
    for unknown in 0..pattern.dim() {
        if let Some(place) = pattern.position(unknown, unknown) {
            values[place] += by;
        }
    }
}
