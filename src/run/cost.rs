//! What a run will take, said before it runs: unknowns, memory, time.

use std::time::Instant;

use crate::geometry::Vec3;
use crate::solver::assembly::Evaluation;
use crate::solver::element::Want;
use crate::solver::linear::LinearError;
use crate::solver::linear::multifrontal::{Factors, PatternRef, Symbolic};
use crate::solver::{Motion, SimulationSetup, Stage};

/// In-plane stretch at which the element loop is timed: most sheets are plastic there, as in a run.
const STRETCH: f64 = 0.03;
/// A factorisation above this is not tried, its time is that of a smaller part of it [flop].
const TRIED_FLOP: f64 = 4e10;
/// Flop a second of a factorisation too large to be tried, a core; large ones do better.
const RATE: f64 = 1.5e10;
/// Factorisations an iteration: one, and one more wherever the active set is settled in between and the factors are not
/// brought up to date (`docs/results/main-job.md`: 934 in 381).
const FACTORISATIONS: [f64; 2] = [1.0, 2.5];
/// Substitution, contact and search over factorisation and elements together, there.
const BESIDE: f64 = 1.35;
/// Newton iterations an increment, cuts included, there and in the other runs of `docs/results`.
const ITERATIONS: [f64; 2] = [5.0, 8.0];
/// Increments over those of a run in which every step grows as it may.
const CUTS: f64 = 4.0;
/// Increments while the tools travel one thickness of the sheet, where contacts change all the time (the cross tool to
/// 60 mm, 0.8 mm thick: 165 to 220 in all).
const A_THICKNESS: f64 = 3.0;
/// Memory of the program without a model [MB].
const PROGRAM_MB: f64 = 10.0;
/// What writing the report takes on top at the end, the plotting script twice [MB].
const REPORT_MB: f64 = 19.0;
/// Bytes an entry of the matrix: its value in tangent and matrix, columns, and where it comes from and goes to.
const ENTRY: f64 = 40.0;
/// Bytes an element: the geometry of its points, and what it answered last.
const ELEMENT: f64 = 9_400.0;
/// Copies of the history of all points: committed, on trial, before the last step, and what a checkpoint takes.
const HISTORIES: f64 = 4.4;

/// What a run will take.
#[derive(Debug, Clone, PartialEq)]
pub struct Cost {
    /// Unknowns of the sheet.
    pub unknowns: usize,
    /// Work of one factorisation [flop].
    pub flop: f64,
    /// Factors and workspace [MB].
    pub factors_mb: f64,
    /// Most memory of the process, with the report at its end [MB].
    pub memory_mb: f64,
    /// One element loop with tangent [s].
    pub elements_s: f64,
    /// One factorisation [s].
    pub factor_s: f64,
    /// Increments: fewest, and many.
    pub increments: [f64; 2],
    /// Newton iterations: few, and many.
    pub iterations: [f64; 2],
    /// Wall time [s]: if all goes well, and if it goes badly.
    pub seconds: [f64; 2],
}

/// Measures one element loop and one factorisation of the set-up on this machine.
///
/// # Errors
/// [`LinearError`] when the matrix cannot be planned.
pub fn cost(setup: &mut SimulationSetup) -> Result<Cost, LinearError> {
    let unknowns = 3 * setup.body.mesh().nodes.len();
    let pattern = setup.body.pattern();
    let groups = setup.body.mesh().groups();
    let columns: Vec<u32> = pattern.col_idx.iter().map(|&c| c as u32).collect();
    let view = PatternRef { row_start: &pattern.row_ptr, columns: &columns };
    let plan = Symbolic::new(view, &groups.of_unknown, &groups.centers)
        .map_err(|e| LinearError::Pattern(e.to_string()))?;
    let (flop, factors) = (plan.flops(), plan.bytes() as f64);
    let (elements_s, mut values) = element_loop(setup);
    let pattern = setup.body.pattern();
    let factor_s = if flop <= TRIED_FLOP && values.len() == pattern.nnz() {
        // Nothing holds the sheet yet: what makes the matrix regular is added.
        let diagonal: Vec<usize> =
            (0..unknowns).filter_map(|row| pattern.position(row, row)).collect();
        let most = diagonal.iter().map(|&q| values[q].abs()).fold(0.0, f64::max);
        diagonal.iter().for_each(|&q| values[q] += most);
        let mut store = Factors::default();
        let mut once = || {
            let start = Instant::now();
            let _ = plan.factor(&values, &mut store, &[]);
            start.elapsed().as_secs_f64()
        };
        // The first one also takes its memory from the system.
        once().min(once())
    } else {
        flop / (RATE * rayon::current_num_threads().max(1) as f64)
    };
    // Measured: 12 runs of 582 to 35,721 unknowns, with this to -5 and +12 % (docs/results/solver.md).
    let (elements, state) = (setup.body.mesh().elements.len(), setup.body.export_state().len());
    let bytes = factors
        + pattern.nnz() as f64 * ENTRY
        + elements as f64 * ELEMENT
        + HISTORIES * state as f64;
    let least: f64 = setup.stages.iter().map(fewest_increments).sum();
    let thickness = setup.body.mesh().mean_thickness().max(1e-300);
    let increments = [least, (CUTS * least).max(A_THICKNESS * travelled(setup) / thickness)];
    let iterations = [0, 1].map(|k| increments[k] * ITERATIONS[k]);
    let one = FACTORISATIONS.map(|n| BESIDE * (elements_s + n * factor_s));
    Ok(Cost {
        unknowns,
        flop,
        factors_mb: factors / 1e6,
        memory_mb: PROGRAM_MB + REPORT_MB + bytes / 1e6,
        elements_s,
        factor_s,
        increments,
        iterations,
        seconds: [0, 1].map(|k| iterations[k] * one[k]),
    })
}

/// Wall time of an element loop over the stretched sheet [s], and the tangent it makes (none when it fails).
fn element_loop(setup: &mut SimulationSetup) -> (f64, Vec<f64>) {
    let stretch = |x: &Vec3| [STRETCH * x.x, STRETCH * x.y, 0.0];
    let u: Vec<f64> = setup.body.mesh().nodes.iter().flat_map(stretch).collect();
    let mut out = Evaluation::default();
    let mut least = f64::INFINITY;
    for _ in 0..3 {
        let start = Instant::now();
        let done = setup.body.evaluate(&u, Want::ResidualAndTangent, &mut out).is_ok();
        least = least.min(start.elapsed().as_secs_f64());
        if !done {
            out.tangent.clear();
        }
    }
    setup.body.restore();
    (least, out.tangent)
}

/// Increments of a stage: those of the run it follows, behind them as many as if every step grew by half until it is as
/// large as allowed.
fn fewest_increments(stage: &Stage) -> f64 {
    let mut step = stage.first_step.min(stage.largest_step);
    let (mut share, mut count) =
        (stage.ends.last().copied().unwrap_or(0.0), stage.ends.len() as f64);
    while share < 1.0 - 1e-9 && count < 1e6 {
        share += step;
        step = (1.5 * step).min(stage.largest_step);
        count += 1.0;
    }
    count
}

/// Travel of all tools that are driven by travel, over all stages [mm].
fn travelled(setup: &SimulationSetup) -> f64 {
    let of = |tool: usize| -> f64 {
        let mut now = 0.0;
        let motions = setup.stages.iter().map(|s| &s.motions[tool]);
        let range = motions.map(|motion| {
            let curve = match motion {
                Motion::Travel(curve) => {
                    curve.starting_at(std::mem::replace(&mut now, curve.at(1.0)))
                }
                Motion::Advance(curve) => {
                    now += curve.at(1.0);
                    curve.starting_at(0.0)
                }
                _ => return 0.0,
            };
            let [low, high] = curve.extent();
            high - low
        });
        range.sum()
    };
    (0..setup.tools.len()).map(of).sum()
}

impl Cost {
    /// Wall time of a run that costs `factor` times as much, in words.
    #[must_use]
    pub fn times(&self, factor: f64) -> String {
        let [low, high] = self.seconds.map(|s| duration(s * factor));
        format!("{low} to {high}")
    }
}

/// Seconds, minutes or hours.
#[must_use]
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 10.0 => format!("{s:.1} s"),
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::Curve;

    #[test]
    fn steps_grow_by_half() {
        let stage = |first_step: f64, largest_step: f64| Stage {
            name: String::new(),
            duration: 1.0,
            motions: vec![Motion::Hold],
            load: Curve::constant(0.0),
            first_step,
            largest_step,
            ends: Vec::new(),
        };
        assert_eq!(fewest_increments(&stage(1.0, 1.0)), 1.0);
        let followed = Stage { ends: vec![0.1, 0.3, 0.5], ..stage(0.25, 0.25) };
        assert_eq!(fewest_increments(&followed), 5.0);
        assert_eq!(fewest_increments(&stage(0.1, 0.1)), 10.0);
        // 0.25, 0.375, 0.5625.
        assert_eq!(fewest_increments(&stage(0.25, 1.0)), 3.0);
        assert_eq!(duration(600.0), "10 min");
    }
}
