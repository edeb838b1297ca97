//! Line search along a correction.
//!
//! Full corrections may overshoot when points alternate between elastic and plastic or between stick and slip, and
//! when a sheet is soft in bending and stiff in its plane. The work of the residual along the correction,
//! `G(s) = du . R(u + s du)`, is the slope of the incremental energy: negative at its start and zero at the optimal
//! step. The full correction is tried first; if it is acceptable, no evaluation is repeated.

use crate::assembly::ElementFailure;
use crate::element::Want;
use crate::system::correction::Correction;
use crate::system::system::System;

/// A step is accepted if the slope at its end is at most this fraction of the slope at its start. A more exact search
/// costs evaluations in a direction that the next correction changes; a looser one accepts steps that overshoot.
const SLOPE_RATIO_MAX: f64 = 0.2;
/// Maximum number of trials with shorter steps. With two, iterations rise by 2 %; with eight they fall by 1 %, for more
/// evaluations.
const TRIALS_MAX: usize = 4;
/// Minimum step length, as a fraction of the correction. Shorter steps do not lead away from a kink of the residual,
/// where a node comes into contact or a point yields. Half of it changes nothing, with twice iterations fall by 3 %, but
/// steps overshoot more.
const STEP_LENGTH_RATIO_MIN: f64 = 0.05;

/// Applies `correction` with a step length of at most `length_max`; body and contact search are then evaluated at the new
/// iterate. Returns the step length. With `full_step` the step is shortened only if an element fails.
///
/// # Errors
/// [`ElementFailure`] if an element fails even with the shortest step.
pub(crate) fn go(
    sys: &mut System,
    correction: &Correction,
    length_max: f64,
    full_step: bool,
) -> Result<f64, ElementFailure> {
    let start = slope(sys, correction);
    let length = first_step(sys, correction, length_max)?;
    sys.search();
    if start >= 0.0 || full_step {
        return Ok(length);
    }
    sys.assemble();
    let end = slope(sys, correction);
    if end <= -SLOPE_RATIO_MAX * start {
        return Ok(length);
    }
    let shorter = shorten(sys, correction, start, (length, end));
    apply(sys, correction, shorter - length);
    sys.evaluate(Want::ResidualAndTangent)?;
    sys.search();
    Ok(shorter)
}

/// Applies `correction` with a step length of at most `length_max` if it is acceptable, and returns the step length.
/// Otherwise the iterate is unchanged, but body and contact search hold the evaluation at the rejected one.
///
/// # Errors
/// [`ElementFailure`] if an element fails even with the shortest step.
pub(crate) fn try_step(
    sys: &mut System,
    correction: &Correction,
    length_max: f64,
) -> Result<Option<f64>, ElementFailure> {
    let start = slope(sys, correction);
    let length = first_step(sys, correction, length_max)?;
    sys.search();
    if start >= 0.0 {
        return Ok(Some(length));
    }
    sys.assemble();
    let is_acceptable = slope(sys, correction) <= -SLOPE_RATIO_MAX * start;
    if !is_acceptable {
        apply(sys, correction, -length);
    }
    Ok(is_acceptable.then_some(length))
}

/// Applies the step length `length_max`, halved until all elements can be evaluated or it is below the minimum.
fn first_step(
    sys: &mut System,
    correction: &Correction,
    length_max: f64,
) -> Result<f64, ElementFailure> {
    let mut length = length_max;
    apply(sys, correction, length);
    loop {
        match sys.evaluate(Want::ResidualAndTangent) {
            Err(_) if length >= STEP_LENGTH_RATIO_MIN * length_max => {}
            found => return found.map(|()| length),
        }
        length *= 0.5;
        apply(sys, correction, -length);
    }
}

/// Step length at which the slope nearly vanishes, by safeguarded secants. The slope is `start` at 0 and positive at
/// `end`, the current iterate, which is restored.
fn shorten(sys: &mut System, correction: &Correction, start: f64, end: (f64, f64)) -> f64 {
    let mut at = |length: f64| {
        apply(sys, correction, length - end.0);
        let found = sys.evaluate(Want::Residual).is_ok().then(|| {
            sys.search();
            sys.assemble();
            slope(sys, correction)
        });
        apply(sys, correction, end.0 - length);
        found.unwrap_or(f64::INFINITY)
    };
    let (mut low, mut high) = ((0.0, start), end);
    let mut length = high.0;
    for _ in 0..TRIALS_MAX {
        let width = high.0 - low.0;
        let secant = low.0 - low.1 * width / (high.1 - low.1);
        length = if high.1.is_finite() {
            secant.clamp(low.0 + 0.1 * width, low.0 + 0.7 * width)
        } else {
            low.0 + 0.5 * width
        };
        match at(length) {
            slope if slope.abs() <= -SLOPE_RATIO_MAX * start => break,
            slope if slope < 0.0 => low = (length, slope),
            slope => high = (length, slope),
        }
    }
    length.max(STEP_LENGTH_RATIO_MIN * end.0)
}

/// Work of the residual along a correction, with the conditions of the last [`System::assemble`].
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

fn apply(sys: &mut System, correction: &Correction, length: f64) {
    sys.u.iter_mut().zip(&correction.u).for_each(|(u, d)| *u += length * d);
    for &(tool, travel) in &correction.travels {
        sys.tools[tool].travel += length * travel;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sheet::hex_mesh::rectangle;
    use crate::tests::{body, setup, steel};
    use crate::{Constraints, Simulation};

    /// A flat strip of 10 x 1 x 0.1 mm, clamped at both ends, with `force` [N] at its middle: soft in bending, stiff
    /// once it sags. Its first correction is scaled by `factor`. Returns its step length, and the slope before and after.
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
        let length_max = (0..sys.u.len())
            .max_by(|&a, &b| correction.u[a].abs().total_cmp(&correction.u[b].abs()));
        let length_max = length_max.unwrap();
        (sys.u[length_max] / correction.u[length_max], [start, end])
    }

    #[test]
    fn an_acceptable_correction_is_applied_in_full() {
        let (length, [start, end]) = first_step(1e-4, 1.0);
        assert!((length - 1.0).abs() < 1e-12 && start < 0.0 && end.abs() < -0.01 * start);
    }

    #[test]
    fn a_correction_that_leads_too_far_is_shortened_to_where_the_slope_vanishes() {
        let (length, [start, end]) = first_step(5.0, 1.0);
        assert!((STEP_LENGTH_RATIO_MIN..0.9).contains(&length), "{length}");
        assert!(start < 0.0 && end.abs() <= -SLOPE_RATIO_MAX * start, "{start} {end}");
    }
    /// As where friction or a buckling load makes the symmetric part of the stiffness indefinite.
    #[test]
    fn a_correction_without_descent_is_applied_whole() {
        let (fraction, [start, end]) = first_step(1e-4, -1.0);
        assert!((fraction - 1.0).abs() < 1e-12, "{fraction}");
        assert!(start > 0.0 && end > start, "{start} {end}");
    }
}
