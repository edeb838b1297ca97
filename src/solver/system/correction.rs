//! Linearised system at an iterate: contact conditions replace equilibrium equations, the matrix keeps the pattern of
//! the mesh. It is bordered by the unknown travels of tools driven by force. Its solution is the correction.

use std::time::Instant;

use super::system::System;
use crate::contact::candidate::{Candidate, Expected};
use crate::contact::condition::Condition;
use crate::contact::frame::seen_from;
use crate::linear::{ChangedRows, LinearError};
use kanagata_geometry::Vec3;

/// Correction of the displacements and of the travels of tools driven by force.
#[derive(Debug, Clone)]
pub(crate) struct Correction {
    pub(crate) u: Vec<f64>,
    pub(crate) travels: Vec<(usize, f64)>,
    /// Predicted forces of all candidates in contact.
    pub(crate) foretold: Vec<Foretold>,
}

/// Predicted contact force of a correction.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Foretold {
    pub(crate) candidate: usize,
    /// Force of the tool from `r + K du`, plus friction in constrained directions [N].
    pub(crate) force: Vec3,
    /// Normal force [N].
    pub(crate) lambda: f64,
}

/// Changes of the contact forces due to solutions of the linear system.
struct Changes {
    /// Candidates in contact, ascending.
    touching: Vec<usize>,
    /// Changes of their forces: rows of the tangent at the nodes times each solution.
    by_solution: Vec<Vec<[f64; 3]>>,
    /// Changes of friction in constrained directions, by solution.
    held: Vec<Vec<Vec3>>,
}

impl System {
    /// Solves the linearised system for the correction.
    pub(crate) fn correct(&mut self) -> Result<Correction, LinearError> {
        let start = Instant::now();
        self.condense();
        self.timings.contact += start.elapsed().as_secs_f64();
        self.correct_with(None)
    }

    /// Solves the system at the same iterate after changes of some conditions.
    pub(crate) fn correct_again(&mut self) -> Result<Correction, LinearError> {
        if self.symmetric {
            return self.correct();
        }
        let start = Instant::now();
        let changed = self.matrix.change(self.body.pattern(), &self.conditions);
        self.timings.contact += start.elapsed().as_secs_f64();
        self.correct_with(Some(&changed))
    }

    fn correct_with(&mut self, changed: Option<&ChangedRows>) -> Result<Correction, LinearError> {
        let start = Instant::now();
        let rhs: Vec<f64> = self.residual_vector().iter().map(|f| -f).collect();
        let unknown = |tool: &usize| self.roles[*tool].push(0.0).is_some();
        let moved: Vec<usize> = (0..self.tools.len()).filter(unknown).collect();
        let mut all = vec![rhs];
        all.extend(moved.iter().map(|&tool| self.travel_column(tool)));
        self.timings.contact += start.elapsed().as_secs_f64();
        let before = self.solver.factorisations;
        self.symmetric = changed.is_none() && moved.is_empty() && self.is_symmetric();
        let solved = match changed {
            Some(changed) => self.solver.solve_changed(&self.matrix.values, changed, &mut all),
            None if self.symmetric => {
                self.move_held_columns(&mut all[0]);
                self.solver.solve_symmetric(&self.matrix.values, &mut all)
            }
            None => self.solver.solve(&self.matrix.values, &mut all),
        };
        if self.solver.factorisations > before {
            self.matrix.set_factored(&self.conditions);
        }
        let solver = &self.solver;
        (self.timings.factor, self.timings.update) = (solver.factor_s, solver.update_s);
        self.timings.solve = solver.solve_s;
        self.timings.factorisations = self.solver.factorisations;
        self.timings.updates = self.solver.updates;
        solved?;
        let start = Instant::now();
        let correction = self.border(all, &moved);
        self.timings.contact += start.elapsed().as_secs_f64();
        correction
    }

    /// Whether the matrix is symmetric: constraints are the only conditions.
    fn is_symmetric(&self) -> bool {
        self.body.is_symmetric() && self.conditions.iter().all(|c| c.candidate.is_none())
    }

    /// Moves the columns of held components, whose corrections are known, to the right-hand side.
    fn move_held_columns(&mut self, rhs: &mut [f64]) {
        let pattern = self.body.pattern();
        for c in &self.conditions {
            let stands = |&k: &usize| {
                self.constraints.is_held(c.node, k) || self.rigid_supports.contains(&(c.node, k))
            };
            for i in (0..3).filter(stands).map(|k| 3 * c.node + k) {
                let Some(diagonal) = pattern.position(i, i) else { continue };
                let known = rhs[i] / self.matrix.values[diagonal];
                // The pattern is structurally symmetric.
                for q in pattern.row_ptr[i]..pattern.row_ptr[i + 1] {
                    let row = pattern.col_idx[q];
                    if let Some(place) = pattern.position(row, i).filter(|_| row != i) {
                        rhs[row] -= self.matrix.values[place] * known;
                        self.matrix.values[place] = 0.0;
                    }
                }
            }
        }
    }

    /// Residual of every row: equilibrium, or the condition that replaces it.
    pub(crate) fn residual_vector(&self) -> Vec<f64> {
        let mut out: Vec<f64> =
            self.eval.internal_force.iter().zip(&self.applied).map(|(f, a)| f - a).collect();
        for c in &self.conditions {
            out[3 * c.node..3 * c.node + 3].copy_from_slice(c.residual.as_slice());
        }
        out
    }

    /// Sets up the matrix from tangent and conditions.
    pub(crate) fn condense(&mut self) {
        let copy = self.is_symmetric();
        let tangent = &mut self.eval.tangent;
        self.matrix.set(self.body.pattern(), tangent, &self.conditions, copy);
    }

    /// Minus the derivative of the residual by the travel of `tool`: an additional right-hand side.
    pub(crate) fn travel_column(&self, tool: usize) -> Vec<f64> {
        let mut column = vec![0.0; self.u.len()];
        for c in &self.conditions {
            let candidate = c.candidate.map(|k| &self.contact.candidates[k]);
            if let Some(candidate) = candidate.filter(|candidate| candidate.tool == tool) {
                let v = c.b_tool * self.seen_from(candidate, self.tools[tool].setup.direction);
                column[3 * c.node..3 * c.node + 3].copy_from_slice(v.as_slice());
            }
        }
        column
    }

    /// Displacement of a tool as it acts on the node of a candidate.
    fn seen_from(&self, c: &Candidate, way: Vec3) -> Vec3 {
        seen_from(&c.foot, &self.constraints.free_projector(c.node), way)
    }

    /// Bordered system `[K -Z; W S]` with one row and column for each tool driven by force; `S` is the stiffness of
    /// springs. `all` is the solution of the right-hand side, then one for the travel of each tool in `moved`.
    fn border(&self, mut all: Vec<Vec<f64>>, moved: &[usize]) -> Result<Correction, LinearError> {
        let changes = self.changes_of_force(&all, moved);
        let z = all.split_off(1);
        let mut u = all.pop().unwrap_or_default();
        let travels = self.travels(&changes, moved)?;
        for (column, travel) in z.iter().zip(travels.iter()) {
            u.iter_mut().zip(column).for_each(|(u, z)| *u += z * travel);
        }
        self.body.mesh().set_means(&mut u);
        let foretold = self.foretold(&changes, &travels);
        let travels = moved.iter().copied().zip(travels.iter().copied()).collect();
        Ok(Correction { u, travels, foretold })
    }

    fn changes_of_force(&self, solutions: &[Vec<f64>], moved: &[usize]) -> Changes {
        let touching: Vec<usize> = self.contact.active().map(|(k, _)| k).collect();
        let nodes: Vec<usize> = touching.iter().map(|&k| self.contact.candidates[k].node).collect();
        let (pattern, node_rows) = (self.body.pattern(), &self.node_rows);
        let by_solution = self.matrix.changes_of_force(pattern, node_rows, &nodes, solutions);
        let held = (0..solutions.len()).map(|j| {
            let tool = j.checked_sub(1).map(|j| moved[j]);
            self.held_changes(&touching, &by_solution[j], &solutions[j], tool)
        });
        let held = held.collect();
        Changes { touching, by_solution, held }
    }

    /// Changes of friction in constrained directions due to the solution `u` for the travel of a tool, which changes
    /// the contact forces by `forces` [N]. Without a tool, `u` is the solution of the right-hand side, and the change
    /// includes the difference to the linearised law.
    fn held_changes(
        &self,
        touching: &[usize],
        forces: &[[f64; 3]],
        u: &[f64],
        tool: Option<usize>,
    ) -> Vec<Vec3> {
        let mut changes = vec![Vec3::zeros(); touching.len()];
        for condition in &self.conditions {
            let (Some(held), Some(k)) = (condition.held, condition.candidate) else { continue };
            let Ok(at) = touching.binary_search(&k) else { continue };
            let c = &self.contact.candidates[k];
            let way = Vec3::from_column_slice(&u[3 * c.node..3 * c.node + 3]);
            let moved = tool.filter(|&t| t == c.tool).map(|t| self.tools[t].setup.direction);
            let past = way - moved.unwrap_or_default();
            changes[at] = held.change(&condition.normal, &Vec3::from(forces[at]), &past);
            if tool.is_none() {
                changes[at] += held.missing(&self.held_friction(c));
            }
        }
        changes
    }

    /// Travels of the tools driven by force for which they push with their prescribed force, or reach their stops.
    fn travels(&self, changes: &Changes, moved: &[usize]) -> Result<Vec<f64>, LinearError> {
        let m = moved.len();
        if m == 0 {
            return Ok(Vec::new());
        }
        // Change of the push of the i-th tool due to solution `j`.
        let pushed = |i: usize, j: usize| -> f64 {
            let (tool, d) = (moved[i], self.tools[moved[i]].setup.direction);
            let all = changes.touching.iter().zip(&changes.by_solution[j]).zip(&changes.held[j]);
            let of_tool = all.filter(|&((&k, _), _)| self.contact.candidates[k].tool == tool);
            let along =
                |c: &Candidate| self.constraints.free_projector(c.node) * self.seen_from(c, d);
            let push = |c: &Candidate, change: &[f64; 3]| along(c).dot(&Vec3::from(*change));
            of_tool
                .map(|((&k, change), held)| {
                    push(&self.contact.candidates[k], change) + held.dot(&d)
                })
                .sum()
        };
        let own = |i: usize, j: usize, value: f64| if i == j { value } else { 0.0 };
        let matrix = nalgebra::DMatrix::from_fn(m, m, |i, j| match self.short_of_stop(moved[i]) {
            Some(_) => own(i, j, 1.0),
            None => pushed(i, j + 1) + own(i, j, self.roles[moved[i]].stiffness()),
        });
        let missing = nalgebra::DVector::from_fn(m, |i, _| {
            let missing = |tool| Some(self.wanted(tool)? - self.push_of(tool) - pushed(i, 0));
            self.short_of_stop(moved[i]).or_else(|| missing(moved[i])).unwrap_or(0.0)
        });
        let travels = matrix.lu().solve(&missing);
        let idle = |tool: &&usize| !self.contact.active().any(|(_, c)| c.tool == **tool);
        let tool = moved.iter().find(idle).or(moved.first()).copied().unwrap_or(0);
        Ok(travels.ok_or(LinearError::Unopposed { tool })?.iter().copied().collect())
    }

    /// Initialises the expected contact forces with those of the equilibrium at which the body was last evaluated.
    pub(crate) fn expect_as_last(&mut self) {
        for k in 0..self.contact.candidates.len() {
            let c = &self.contact.candidates[k];
            let force = c.active.then(|| self.contact_force(c));
            self.contact.candidates[k].expected = force.map(Expected::AsLast);
        }
    }

    /// Updates the expected contact forces by the fraction `share` of the change predicted by `correction`.
    pub(crate) fn expect(&mut self, correction: &Correction, share: f64) {
        for foretold in &correction.foretold {
            let c = &mut self.contact.candidates[foretold.candidate];
            let before = match c.expected {
                Some(Expected::AsLast(force) | Expected::Foretold(force)) => force,
                None => foretold.force,
            };
            let force = before + (foretold.force - before) * share;
            c.expected = Some(Expected::Foretold(force));
        }
    }

    /// Contact forces predicted by the linearised system.
    fn foretold(&self, changes: &Changes, travels: &[f64]) -> Vec<Foretold> {
        let shares = || std::iter::once(1.0).chain(travels.iter().copied());
        let of = |c: &Condition| {
            let candidate = c.candidate?;
            let at = changes.touching.binary_search(&candidate).ok()?;
            let by = changes.by_solution.iter().zip(shares());
            let change: Vec3 = by.map(|(by, share)| Vec3::from(by[at]) * share).sum();
            let by = changes.held.iter().zip(shares());
            let held_change: Vec3 = by.map(|(by, share)| by[at] * share).sum();
            let of_candidate = &self.contact.candidates[candidate];
            let rest = self.force_at(c.node) + change;
            let force =
                self.force_of(of_candidate, &rest, self.held_friction(of_candidate) + held_change);
            Some(Foretold { candidate, force, lambda: c.normal.dot(&rest) })
        };
        self.conditions.iter().filter_map(of).collect()
    }
}
