//! Increments with the ends of an earlier run.

use super::cup::{QUICK, cup};
use crate::{Control, IncrementReport, RunSummary, Simulation, SimulationError, SimulationSetup};
use kanagata_cancel::Cancel;

/// Stage, fraction and iterations of every increment, step cuts, and final displacements.
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
fn a_run_with_prescribed_increments_is_bit_identical() {
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
fn a_failed_increment_is_cut_and_later_ends_are_kept() {
    let mut setup = cup(&QUICK);
    setup.limits.iterations = 4;
    setup.stages[1].ends = vec![0.7, 0.75];
    let (increments, cuts, _) = run(setup);
    let draw: Vec<f64> = increments.iter().filter(|i| i.0 == 1).map(|i| i.1).collect();
    assert!(cuts > 0 && draw[0] < 0.7, "{cuts} cuts, {draw:?}");
    let at = draw.iter().position(|&share| share == 0.7).expect("an increment ends at 0.7");
    assert!(draw[at + 1..].contains(&0.75) && draw.last() == Some(&1.0), "{draw:?}");
}

/// After an error the stage remains active: the same run, or one resumed from its saved state, ends as one without
/// the error.
#[test]
fn a_stage_remains_active_after_an_error() {
    let (whole, _, sheet) = run(cup(&QUICK));
    let see = &mut |_: &IncrementReport<'_>| Control::Continue;
    let (mut first, mut second) =
        (Simulation::new(cup(&QUICK)).unwrap(), Simulation::new(cup(&QUICK)).unwrap());
    // In the middle of a stage, at the start of one, and at the start of the run.
    let begins = whole.iter().position(|i| i.0 > 0).unwrap();
    for limit in [0, 2, begins, whole.len() - 1] {
        first.limits.increments = limit;
        for _ in 0..2 {
            let error = first.run(see).unwrap_err();
            assert!(matches!(error, SimulationError::TooManyIncrements { .. }), "{error}");
            assert_eq!(first.summary().increments, limit);
        }
    }
    second.resume(first.state()).unwrap();
    first.limits.increments = whole.len();
    for sim in [&mut first, &mut second] {
        assert_eq!(sim.run(see).unwrap().increments, whole.len());
        let same = sim.displacements().iter().zip(&sheet);
        assert!(same.into_iter().all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}

/// Stopped within increments and continued from the saved state: the work counts as in a run without stop.
#[test]
fn a_run_stopped_within_an_increment_counts_its_work_once() {
    let watch = &mut |_: &IncrementReport<'_>| Control::Continue;
    let counts = |done: &RunSummary| {
        let t = &done.timings;
        [done.increments, t.factorisations, t.updates, t.cycling]
    };
    let start = std::time::Instant::now();
    let whole = Simulation::new(cup(&QUICK)).unwrap().run(watch).unwrap();
    let time = start.elapsed();
    for k in 1..6 {
        let (mut sim, cancel) = (Simulation::new(cup(&QUICK)).unwrap(), Cancel::default());
        sim.set_cancel(cancel.clone());
        let stop = std::thread::spawn(move || {
            std::thread::sleep(time * k / 6);
            cancel.request();
        });
        // A run that ends before the request is continued as well.
        let _ = sim.run(watch);
        stop.join().unwrap();
        let mut next = Simulation::new(cup(&QUICK)).unwrap();
        next.resume(sim.state()).unwrap();
        assert_eq!(counts(&next.run(watch).unwrap()), counts(&whole));
    }
}

/// Stopped by its observer before the first increment, and continued.
#[test]
fn a_run_stopped_at_its_start_continues() {
    let (whole, _, sheet) = run(cup(&QUICK));
    let mut sim = Simulation::new(cup(&QUICK)).unwrap();
    let error = sim.advance(&mut |_: &IncrementReport<'_>| Control::Stop).unwrap_err();
    assert!(matches!(error, SimulationError::Stopped { increment: 0 }), "{error}");
    let mut starts = 0;
    sim.run(&mut |r: &IncrementReport<'_>| {
        starts += usize::from(r.increment == 0);
        Control::Continue
    })
    .unwrap();
    assert!(starts == 0 && sim.summary().increments == whole.len());
    assert!(sim.displacements().iter().zip(&sheet).all(|(a, b)| a.to_bits() == b.to_bits()));
}
