//! How much of a correction to take.
//!
//! Elastic and plastic, sticking and sliding points in turn, and sheets that are soft in bending and stiff in their
//! plane, make whole corrections lead too far. The work of the residual along the correction,
//! `G(s) = du . R(u + s du)`, is the slope of the incremental energy: it is negative where a correction begins and
//! vanishes where its best part ends. The whole correction is tried first; where it is good, nothing is done twice.

use crate::solver::assembly::ElementFailure;
use crate::solver::element::Want;
use crate::solver::system::correction::Correction;
use crate::solver::system::system::System;

/// A correction is good when the slope at its end is at most this share of the slope at its beginning.
const SLOPE_RATIO: f64 = 0.2;
/// Trials of shorter steps.
const MAX_TRIALS: usize = 4;
/// Smallest share taken.
const MIN_STEP: f64 = 0.05;
/// Halvings of a correction after which an element fails.
const MAX_HALVINGS: usize = 6;

/// Applies `correction`, at most the share `most` of it; leaves the body evaluated and the tools searched there. The share
/// taken. With `whole` no more is asked than that the elements can be evaluated.
///
/// # Errors
/// An element that fails however short the step.
pub(in crate::solver) fn go(
    sys: &mut System,
    correction: &Correction,
    most: f64,
    whole: bool,
) -> Result<f64, ElementFailure> {
    let start = slope(sys, correction);
    let share = first_step(sys, correction, most)?;
    sys.search();
    if start >= 0.0 || whole {
        return Ok(share);
    }
    sys.assemble();
    let end = slope(sys, correction);
    if end <= -SLOPE_RATIO * start {
        return Ok(share);
    }
    let shorter = shorten(sys, correction, start, (share, end));
    apply(sys, correction, shorter - share);
    sys.evaluate(Want::ResidualAndTangent)?;
    sys.search();
    Ok(shorter)
}

/// Applies `correction`, at most the share `most` of it, if it is good: the share taken. Otherwise everything stays where it
/// was but what the body and the tools were last evaluated for.
///
/// # Errors
/// An element that fails however short the step.
pub(in crate::solver) fn fits(
    sys: &mut System,
    correction: &Correction,
    most: f64,
) -> Result<Option<f64>, ElementFailure> {
    let start = slope(sys, correction);
    let share = first_step(sys, correction, most)?;
    sys.search();
    if start >= 0.0 {
        return Ok(Some(share));
    }
    sys.assemble();
    let good = slope(sys, correction) <= -SLOPE_RATIO * start;
    if !good {
        apply(sys, correction, -share);
    }
    Ok(good.then_some(share))
}

/// Takes the share `most`, or as many halves of it as an element needs.
fn first_step(sys: &mut System, correction: &Correction, most: f64) -> Result<f64, ElementFailure> {
    let mut share = most;
    apply(sys, correction, share);
    for _ in 0..MAX_HALVINGS {
        if sys.evaluate(Want::ResidualAndTangent).is_ok() {
            return Ok(share);
        }
        share *= 0.5;
        apply(sys, correction, -share);
    }
    sys.evaluate(Want::ResidualAndTangent).map(|()| share)
}

/// Share after which the slope has nearly vanished, when it is `start` at the beginning and positive at `end`, where
/// the iterate is and stays.
fn shorten(sys: &mut System, correction: &Correction, start: f64, end: (f64, f64)) -> f64 {
    let mut at = |share: f64| {
        apply(sys, correction, share - end.0);
        let found = sys.evaluate(Want::Residual).is_ok().then(|| {
            sys.search();
            sys.assemble();
            slope(sys, correction)
        });
        apply(sys, correction, end.0 - share);
        found.unwrap_or(f64::INFINITY)
    };
    let (mut low, mut high) = ((0.0, start), end);
    let mut share = high.0;
    for _ in 0..MAX_TRIALS {
        let width = high.0 - low.0;
        let secant = low.0 - low.1 * width / (high.1 - low.1);
        share = if high.1.is_finite() {
            secant.clamp(low.0 + 0.1 * width, low.0 + 0.7 * width)
        } else {
            low.0 + 0.5 * width
        };
        match at(share) {
            slope if slope.abs() <= -SLOPE_RATIO * start => break,
            slope if slope < 0.0 => low = (share, slope),
            slope => high = (share, slope),
        }
    }
    share.max(MIN_STEP * end.0)
}

/// Work of the residual along a correction, with the conditions that [`System::assemble`] left.
fn slope(sys: &System, correction: &Correction) -> f64 {
    let of_nodes = sys.unbalanced().zip(correction.u.chunks_exact(3));
    let nodes: f64 =
        of_nodes.map(|(force, du)| (0..3).map(|k| force[k] * du[k]).sum::<f64>()).sum();
    let tools: f64 = correction
        .travels
        .iter()
        .map(|&(tool, travel)| {
            sys.wanted(tool).map_or(0.0, |wanted| (sys.push_of(tool) - wanted) * travel)
        })
        .sum();
    nodes + tools
}

fn apply(sys: &mut System, correction: &Correction, share: f64) {
    sys.u.iter_mut().zip(&correction.u).for_each(|(u, d)| *u += share * d);
    for &(tool, travel) in &correction.travels {
        sys.tools[tool].travel += share * travel;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::sheet::hex_mesh::rectangle;
    use crate::solver::tests::{body, setup, steel};
    use crate::solver::{Constraints, Simulation};

    /// A flat strip of 10 x 1 x 0.1 mm, clamped at both ends, with `force` [N] on its middle: soft in bending, stiff once
    /// deflected. Its first correction is scaled by `factor`. Fraction of that applied, and the slope along it before and after.
    fn first_step(force: f64, factor: f64) -> (f64, [f64; 2]) {
        let mesh = rectangle(10.0, 1.0, 0.1, 20, 1, 1);
        let mut constraints = Constraints::none(mesh.nodes.len());
        let mut applied = vec![0.0; 3 * mesh.nodes.len()];
        for (node, x) in mesh.nodes.iter().enumerate() {
            if x.x < 1e-9 || x.x > 10.0 - 1e-9 {
                (0..3).for_each(|axis| constraints.hold(node, axis));
            }
            if (x.x - 5.0).abs() < 1e-9 {
                applied[3 * node + 2] = -force / 4.0;
            }
        }
        let setup = setup(body(mesh, steel()), constraints, Vec::new(), Vec::new());
        let mut sys = Simulation::new(setup).unwrap().sys;
        sys.applied = applied;
        sys.search();
        sys.assemble();
        let mut correction = sys.correct().unwrap();
        correction.u.iter_mut().for_each(|u| *u *= factor);
        let start = slope(&sys, &correction);
        go(&mut sys, &correction, 1.0, false).unwrap();
        sys.assemble();
        let end = slope(&sys, &correction);
        let most = (0..sys.u.len())
            .max_by(|&a, &b| correction.u[a].abs().total_cmp(&correction.u[b].abs()));
        let most = most.unwrap();
        (sys.u[most] / correction.u[most], [start, end])
    }

    #[test]
    fn a_good_correction_is_taken_whole() {
        let (share, [start, end]) = first_step(1e-4, 1.0);
        assert!((share - 1.0).abs() < 1e-12 && start < 0.0 && end.abs() < -0.01 * start);
    }

    #[test]
    fn a_correction_that_leads_too_far_is_shortened_to_where_the_slope_vanishes() {
        let (share, [start, end]) = first_step(5.0, 1.0);
        assert!((MIN_STEP..0.9).contains(&share), "{share}");
        assert!(start < 0.0 && end.abs() <= -SLOPE_RATIO * start, "{start} {end}");
    }
    /// As where friction or a buckling load makes the symmetric part of the stiffness indefinite.
    #[test]
    fn a_correction_without_descent_is_applied_whole() {
        let (fraction, [start, end]) = first_step(1e-4, -1.0);
        assert!((fraction - 1.0).abs() < 1e-12, "{fraction}");
        assert!(start > 0.0 && end > start, "{start} {end}");
    }
}
