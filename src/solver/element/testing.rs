//! Newton solver for element benchmarks: dead loads, prescribed displacements, load stepping.

use faer::prelude::*;
use faer::sparse::{SparseColMat, Triplet};

use super::Want;
use crate::assembly::Body;
use crate::assembly::Evaluation;

/// Boundary conditions and dead loads.
#[derive(Debug, Clone, Default)]
pub struct Problem {
    /// Prescribed degrees of freedom and their displacements [mm] at full load.
    pub held: Vec<(usize, f64)>,
    /// Forces at full load [N].
    pub loads: Vec<(usize, f64)>,
    /// Number of load steps; the load level grows with the square of the step.
    pub steps: usize,
}

/// Displacement at full load and the relative residual of each iteration of the last step. Converged to 1e-9 of the
/// largest force, or to the force of 1e-14 mm on the stiffest entry.
pub fn solve(body: &mut Body, problem: &Problem) -> (Vec<f64>, Vec<f64>) {
    let count = body.pattern().dim();
    let mut free = vec![true; count];
    problem.held.iter().for_each(|&(dof, _)| free[dof] = false);
    let mut u = vec![0.0; count];
    let mut out = Evaluation::default();
    let mut history = Vec::new();
    for step in 1..=problem.steps {
        let level = (step as f64 / problem.steps as f64).powi(2);
        let mut target: Vec<(usize, f64)> =
            problem.held.iter().map(|&(dof, value)| (dof, level * value)).collect();
        history.clear();
        for iteration in 0.. {
            assert!(iteration < 40, "step {step} does not converge: {history:?}");
            body.evaluate(&u, Want::ResidualAndTangent, &mut out).unwrap();
            let mut residual: Vec<f64> = out.internal_force.iter().map(|f| -f).collect();
            problem.loads.iter().for_each(|&(dof, force)| residual[dof] += level * force);
            let scale =
                residual.iter().chain(&out.internal_force).fold(0.0_f64, |m, v| m.max(v.abs()));
            let free_residual = (0..count)
                .filter(|&dof| free[dof])
                .fold(0.0_f64, |m, dof| m.max(residual[dof].abs()));
            let error = free_residual.max(out.internal_residual) / scale.max(1e-300);
            let stiffest = out.tangent.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            let rounding = 1e-14 * stiffest / scale.max(1e-300);
            history.push(error);
            let moved = target.iter().all(|&(dof, value)| u[dof] == value);
            if moved && error < 1e-9 + rounding {
                break;
            }
            let step_u = newton_step(body, &out.tangent, &residual, &free, &target, &u);
            u.iter_mut().zip(&step_u).for_each(|(u, du)| *u += du);
            target.iter_mut().for_each(|&mut (dof, value)| u[dof] = value);
        }
        body.commit();
    }
    (u, history)
}

/// Newton step of the free degrees of freedom; prescribed ones move to their targets.
fn newton_step(
    body: &Body,
    tangent: &[f64],
    residual: &[f64],
    free: &[bool],
    target: &[(usize, f64)],
    u: &[f64],
) -> Vec<f64> {
    let pattern = body.pattern();
    let count = pattern.dim();
    let mut step = vec![0.0; count];
    target.iter().for_each(|&(dof, value)| step[dof] = value - u[dof]);
    let mut rhs = Mat::<f64>::zeros(count, 1);
    let mut triplets = Vec::new();
    for row in 0..count {
        if !free[row] {
            triplets.push(Triplet::new(row, row, 1.0));
            rhs[(row, 0)] = step[row];
            continue;
        }
        let mut right = residual[row];
        for at in pattern.row_ptr[row]..pattern.row_ptr[row + 1] {
            let column = pattern.col_idx[at];
            if free[column] {
                triplets.push(Triplet::new(row, column, tangent[at]));
            } else {
                right -= tangent[at] * step[column];
            }
        }
        rhs[(row, 0)] = right;
    }
    let matrix =
        SparseColMat::<usize, f64>::try_new_from_triplets(count, count, &triplets).unwrap();
    let solution = matrix.sp_lu().unwrap().solve(&rhs);
    (0..count).map(|dof| solution[(dof, 0)]).collect()
}
