//! Forces of long increments in which the plastic flow turns: error against short increments, its estimate, its limit.
//!
//! A disc under a ball is first bent and then stretched.

use super::refined_disc::{disc, stretched};
use crate::assembly::WorkError;
use crate::{Control, IncrementReport, Simulation};

const TRAVEL: f64 = 4.0;

/// Travel [mm], force [N] and estimated relative error of every increment.
fn run(step: f64, allowed: Option<f64>) -> Vec<[f64; 3]> {
    let mut all = stretched(disc(6, 0.0), [TRAVEL, step]);
    all.limits.increment_error = allowed;
    let (mut rows, mut before) = (Vec::new(), WorkError::default());
    let mut sim = Simulation::new(all).unwrap();
    sim.run(&mut |r: &IncrementReport<'_>| {
        let sums = r.energies.increment_errors;
        let (lacking, work) = (sums.lacking - before.lacking, sums.work - before.work);
        rows.push([r.tools[0].travel, r.tools[0].force, WorkError { lacking, work }.relative()]);
        before = sums;
        Control::Continue
    })
    .unwrap();
    rows
}

/// True and estimated relative errors of the forces of `rows`.
fn errors(rows: &[[f64; 3]], reference: &[[f64; 3]]) -> Vec<[f64; 2]> {
    let force = |travel: f64| {
        let k = reference.partition_point(|row| row[0] < travel - 1e-9);
        let ([a, fa, _], [b, fb, _]) = (reference[k.saturating_sub(1)], reference[k]);
        if b - a > 0.0 { fa + (fb - fa) * (travel - a) / (b - a) } else { fb }
    };
    let loaded = rows.iter().filter(|row| row[0] > 0.3);
    loaded
        .map(|[travel, found, estimate]| [(found / force(*travel) - 1.0).abs(), *estimate])
        .collect()
}

#[test]
fn the_error_of_long_increments_is_estimated_and_kept() {
    let reference = run(0.025, None);
    let long = run(1.0, None);
    let found = errors(&long, &reference);
    println!("{} increments: {found:.4?}", long.len());
    let [largest, estimate] = found.iter().copied().max_by(|a, b| a[0].total_cmp(&b[0])).unwrap();
    assert!(largest > 0.015, "{largest}");
    assert!(largest < 1.5 * estimate && estimate < 4.0 * largest, "{largest}, {estimate}");
    let kept = run(1.0, Some(0.01));
    let found = errors(&kept, &reference);
    println!("{} increments: {found:.4?}", kept.len());
    assert!(found.iter().all(|[error, _]| *error < 0.015), "{found:?}");
    assert!(kept.len() > long.len() && 3 * kept.len() < reference.len(), "{}", kept.len());
}
