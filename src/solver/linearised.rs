//! The system linearised at one iterate: the conditions put in the place of equations, the matrix in the mesh's own
//! pattern, the unknown travels of tools moved by force on its border; its solution, the correction.

use std::ops::Range;
use std::time::Instant;

use super::conditions::Condition;
use super::linear::{ChangedRows, LinearError};
use super::pattern::Pattern;
use super::system::System;
use crate::geometry::Vec3;

/// A correction: of the displacements, and of the travels of the tools moved by force.
#[derive(Debug, Clone)]
pub(super) struct Correction {
    pub(super) u: Vec<f64>,
    pub(super) travels: Vec<(usize, f64)>,
    /// What it foretells of every touching candidate.
    pub(super) foretold: Vec<Foretold>,
}

/// The force that a correction foretells at a touching node.
#[derive(Debug, Clone, Copy)]
pub(super) struct Foretold {
    pub(super) candidate: usize,
    /// Force of the tool, `r + K du` [N].
    pub(super) force: Vec3,
    /// Normal force [N].
    pub(super) lambda: f64,
}

/// Displacements, and the travel of each tool moved by force.
type Bordered = (Vec<f64>, Vec<(usize, f64)>);

impl System {
    /// Solves the linearised system for the correction.
    pub(super) fn correct(&mut self) -> Result<Correction, LinearError> {
        let start = Instant::now();
        self.condense();
        self.timings.contact += start.elapsed().as_secs_f64();
        self.correct_with(None)
    }

    /// Solves it again after some conditions have changed, at the same iterate.
    pub(super) fn correct_again(&mut self) -> Result<Correction, LinearError> {
        if self.symmetric {
            return self.correct();
        }
        let start = Instant::now();
        let changed = self.change_conditions();
        self.timings.contact += start.elapsed().as_secs_f64();
        self.correct_with(Some(&changed))
    }

    fn correct_with(&mut self, changed: Option<&ChangedRows>) -> Result<Correction, LinearError> {
        let start = Instant::now();
        let rhs: Vec<f64> = self.residual_vector().iter().map(|f| -f).collect();
        let moved: Vec<(usize, f64)> = self
            .roles
            .iter()
            .enumerate()
            .filter_map(|(t, role)| Some((t, role.push(self.tools[t].travel)?)))
            .collect();
        let mut all = vec![rhs];
        all.extend(moved.iter().map(|&(tool, _)| self.travel_column(tool)));
        let borders: Vec<Vec<f64>> = moved.iter().map(|&(tool, _)| self.force_row(tool)).collect();
        self.timings.contact += start.elapsed().as_secs_f64();
        let before = self.solver.factorisations;
        self.symmetric = changed.is_none() && moved.is_empty() && self.is_symmetric();
        self.unstable = false;
        let solved = match changed {
            Some(changed) => self.solver.solve_changed(&self.values, changed, &mut all),
            None if self.symmetric => {
                self.move_held_columns(&mut all[0]);
                let definite = self.solver.solve_symmetric(&self.values, &mut all);
                definite.map(|definite| self.unstable = !definite)
            }
            None => self.solver.solve(&self.values, &mut all),
        };
        if self.solver.factorisations > before {
            self.factored.clone_from(&self.conditions);
            self.replaced.clear();
        }
        (self.timings.factor, self.timings.solve) = (self.solver.factor_s, self.solver.solve_s);
        self.timings.factorisations = self.solver.factorisations;
        self.timings.updates = self.solver.updates;
        solved?;
        let start = Instant::now();
        let (u, travels) = self.border(all, &borders, &moved)?;
        let foretold = self.foretold(&u);
        self.timings.contact += start.elapsed().as_secs_f64();
        Ok(Correction { u, travels, foretold })
    }

    /// Whether nothing but held components stands in the way of a symmetric matrix.
    fn is_symmetric(&self) -> bool {
        self.body.is_symmetric() && self.conditions.iter().all(|c| c.candidate.is_none())
    }

    /// Takes the columns of held components, whose corrections are known, to the right-hand side.
    fn move_held_columns(&mut self, rhs: &mut [f64]) {
        let pattern = self.body.pattern();
        for c in &self.conditions {
            for i in (0..3).filter(|&k| self.constraints.is_held(c.node, k)).map(|k| 3 * c.node + k)
            {
                let Some(diagonal) = pattern.position(i, i) else { continue };
                let known = rhs[i] / self.values[diagonal];
                // The pattern is its own mirror.
                for q in pattern.row_ptr[i]..pattern.row_ptr[i + 1] {
                    let row = pattern.col_idx[q];
                    if let Some(place) = pattern.position(row, i).filter(|_| row != i) {
                        rhs[row] -= self.values[place] * known;
                        self.values[place] = 0.0;
                    }
                }
            }
        }
    }

    /// Residual of every row: equilibrium, or the conditions in its place.
    pub(super) fn residual_vector(&self) -> Vec<f64> {
        let mut out: Vec<f64> =
            self.eval.internal_force.iter().zip(&self.applied).map(|(f, a)| f - a).collect();
        for c in &self.conditions {
            out[3 * c.node..3 * c.node + 3].copy_from_slice(c.residual.as_slice());
        }
        out
    }

    /// Rows of the tangent with the conditions in place.
    pub(super) fn condense(&mut self) {
        self.values.copy_from_slice(&self.eval.tangent);
        let pattern = self.body.pattern();
        for c in &self.conditions {
            let rows = rows_of(pattern, c.node);
            put(c, pattern, &mut self.values[rows]);
        }
    }

    /// Puts the conditions that differ from those in the factors in their place; what that adds to the rows in the
    /// factors.
    fn change_conditions(&mut self) -> ChangedRows {
        let mut changed = ChangedRows::default();
        let pattern = self.body.pattern();
        for (rows, values) in self.replaced.drain(..) {
            self.values[rows].copy_from_slice(&values);
        }
        for (node, [before, now]) in different(&self.factored, &self.conditions) {
            let rows = rows_of(pattern, node);
            let width = rows.len() / 3;
            let with = |condition: Option<&Condition>| {
                let mut values = self.eval.tangent[rows.clone()].to_vec();
                condition.iter().for_each(|c| put(c, pattern, &mut values));
                values
            };
            let (before, now) = (with(before), with(now));
            self.values[rows.clone()].copy_from_slice(&now);
            let added: Vec<f64> = now.iter().zip(&before).map(|(now, old)| now - old).collect();
            for (k, added) in added.chunks_exact(width).enumerate() {
                changed.rows.push(3 * node + k);
                changed.added.push(added.to_vec());
            }
            self.replaced.push((rows, before));
        }
        changed
    }

    /// Minus the derivative of the residual by the travel of `tool`: the extra right-hand side.
    pub(super) fn travel_column(&self, tool: usize) -> Vec<f64> {
        let mut column = vec![0.0; self.u.len()];
        for c in &self.conditions {
            if c.candidate.is_some_and(|k| self.contact.candidates[k].tool == tool) {
                let v = c.b_tool * self.tools[tool].setup.direction;
                column[3 * c.node..3 * c.node + 3].copy_from_slice(v.as_slice());
            }
        }
        column
    }

    /// Derivative of the tool's force along its direction by the displacements.
    fn force_row(&self, tool: usize) -> Vec<f64> {
        let mut row = vec![0.0; self.u.len()];
        let pattern = self.body.pattern();
        let d = self.tools[tool].setup.direction;
        for (_, c) in self.contact.active().filter(|(_, c)| c.tool == tool) {
            let along = self.constraints.free_projector(c.node) * d;
            for k in 0..3 {
                for q in pattern.row_ptr[3 * c.node + k]..pattern.row_ptr[3 * c.node + k + 1] {
                    row[pattern.col_idx[q]] += along[k] * self.eval.tangent[q];
                }
            }
        }
        row
    }

    /// The bordered unknowns: `[K -Z; W S]` with one row and column a tool moved by force; S the stiffness of springs.
    fn border(
        &self,
        mut all: Vec<Vec<f64>>,
        borders: &[Vec<f64>],
        moved: &[(usize, f64)],
    ) -> Result<Bordered, LinearError> {
        let z = all.split_off(1);
        let Some(mut u) = all.pop() else { return Ok((Vec::new(), Vec::new())) };
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let m = moved.len();
        if m == 0 {
            return Ok((u, Vec::new()));
        }
        let spring = |i: usize, j: usize| {
            if i == j { self.roles[moved[i].0].stiffness() } else { 0.0 }
        };
        let matrix =
            nalgebra::DMatrix::from_fn(m, m, |i, j| dot(&borders[i], &z[j]) + spring(i, j));
        let missing = nalgebra::DVector::from_fn(m, |i, _| {
            let (tool, wanted) = moved[i];
            let now = self.tool_force(tool).dot(&self.tools[tool].setup.direction);
            wanted - now - dot(&borders[i], &u)
        });
        let travels =
            matrix.lu().solve(&missing).ok_or(LinearError::Singular { unknown: self.u.len() })?;
        for (column, travel) in z.iter().zip(travels.iter()) {
            u.iter_mut().zip(column).for_each(|(u, z)| *u += z * travel);
        }
        Ok((u, moved.iter().zip(travels.iter()).map(|(&(tool, _), &s)| (tool, s)).collect()))
    }

    /// Forces that the linearised system gives the touching nodes.
    fn foretold(&self, du: &[f64]) -> Vec<Foretold> {
        let pattern = self.body.pattern();
        let values = &self.eval.tangent;
        let of = |c: &Condition, candidate: usize| {
            let mut change = Vec3::zeros();
            for i in 0..3 {
                let row = 3 * c.node + i;
                change[i] = (pattern.row_ptr[row]..pattern.row_ptr[row + 1])
                    .map(|q| values[q] * du[pattern.col_idx[q]])
                    .sum();
            }
            let force = self.force_at(c.node) + change;
            Foretold { candidate, force, lambda: c.normal.dot(&force) }
        };
        self.conditions.iter().filter_map(|c| c.candidate.map(|k| of(c, k))).collect()
    }
}

/// Places of a node's three rows in the values.
fn rows_of(pattern: &Pattern, node: usize) -> Range<usize> {
    pattern.row_ptr[3 * node]..pattern.row_ptr[3 * node + 3]
}

/// Puts a condition in the place of its node's three rows.
fn put(c: &Condition, pattern: &Pattern, rows: &mut [f64]) {
    let start = pattern.row_ptr[3 * c.node];
    let width = rows.len() / 3;
    let (row0, rest) = rows.split_at_mut(width);
    let (row1, row2) = rest.split_at_mut(width);
    for j in 0..width {
        let v = c.a * Vec3::new(row0[j], row1[j], row2[j]);
        (row0[j], row1[j], row2[j]) = (v.x, v.y, v.z);
    }
    let Some(at) = pattern.position(3 * c.node, 3 * c.node).map(|q| q - start) else {
        return;
    };
    let b = c.b + c.b_tool;
    for k in 0..3 {
        row0[at + k] += b[(0, k)];
        row1[at + k] += b[(1, k)];
        row2[at + k] += b[(2, k)];
    }
}

/// Nodes whose conditions differ in two lists by rising nodes, with both.
fn different<'a>(
    before: &'a [Condition],
    now: &'a [Condition],
) -> Vec<(usize, [Option<&'a Condition>; 2])> {
    let mut out = Vec::new();
    let (mut before, mut now) = (before.iter().peekable(), now.iter().peekable());
    while let Some(node) =
        before.peek().map(|c| c.node).into_iter().chain(now.peek().map(|c| c.node)).min()
    {
        let pair = [before.next_if(|c| c.node == node), now.next_if(|c| c.node == node)];
        let same = match pair {
            [Some(a), Some(b)] => (a.a, a.b, a.b_tool) == (b.a, b.b, b.b_tool),
            _ => false,
        };
        if !same {
            out.push((node, pair));
        }
    }
    out
}
