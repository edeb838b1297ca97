//! Increments that end where those of another run ended.

use super::cup::{QUICK, cup};
use crate::solver::{Control, IncrementReport, Simulation, SimulationSetup};

/// Stage, share and iterations of every increment, cuts, and where the sheet ends.
fn run(setup: SimulationSetup) -> (Vec<(usize, f64, usize)>, usize, Vec<f64>) {
    let mut sim = Simulation::new(setup).unwrap();
    let mut increments = Vec::new();
    let summary = sim.run(&mut |r: &IncrementReport<'_>| {
        if r.increment > 0 {
            increments.push((r.stage, r.share, r.iterations));
        }
        Control::Continue
    });
    (increments, summary.unwrap().cuts, sim.displacements().to_vec())
}

#[test]
fn a_run_that_takes_the_increments_of_another_is_that_run_to_the_bit() {
    let (own, cuts, sheet) = run(cup(&QUICK));
    let mut setup = cup(&QUICK);
    for (k, stage) in setup.stages.iter_mut().enumerate() {
        stage.ends = own.iter().filter(|i| i.0 == k).map(|i| i.1).collect();
        (stage.first_step, stage.largest_step) = (0.5, 0.5);
    }
    let (followed, fewer, same) = run(setup);
    assert_eq!(own, followed);
    assert!(fewer <= cuts, "{fewer} cuts instead of {cuts}");
    assert!(sheet.iter().zip(&same).all(|(a, b)| a.to_bits() == b.to_bits()));
}

#[test]
fn an_increment_that_fails_is_cut_and_the_next_ends_are_met_again() {
    let mut setup = cup(&QUICK);
    setup.limits.iterations = 4;
    setup.stages[1].ends = vec![0.7, 0.75];
    let (increments, cuts, _) = run(setup);
    let draw: Vec<f64> = increments.iter().filter(|i| i.0 == 1).map(|i| i.1).collect();
    assert!(cuts > 0 && draw[0] < 0.7, "{cuts} cuts, {draw:?}");
    let at = draw.iter().position(|&share| share == 0.7).expect("an increment ends at 0.7");
    assert!(draw[at + 1..].contains(&0.75) && draw.last() == Some(&1.0), "{draw:?}");
}
