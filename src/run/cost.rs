//! What a run will take, said before it runs: unknowns, memory, time.

use std::time::Instant;

use serde::Serialize;

use crate::geometry::Vec3;
use crate::scene::preview::SheetCounts;
use crate::solver::assembly::Evaluation;
use crate::solver::element::{ElementKind, Want};
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

/// Times of one element with its tangent on one thread of a core of 2020 [s] (`check --measure`, docs/results/solver.md): they
/// differ by a factor of two between machines.
const HEX8_S: f64 = 5e-6;
const HEX8_ENHANCED_S: f64 = 9e-6;
const SOLID_SHELL_S: f64 = 3e-6;
const SHELL_POINT_S: f64 = 1.2e-6;

/// Time grows with this power of the unknowns (`docs/results/solver.md`).
pub(super) const GROWTH: f64 = 1.5;

/// What a run will take.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cost {
    /// Unknowns of the sheet.
    pub unknowns: usize,
    /// Whether the times of one loop and one factorisation are measured; else they are estimated from counts.
    pub measured: bool,
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

/// What a run of the set-up on a sheet of these counts will take: nothing is allocated or timed.
#[must_use]
pub fn estimate(setup: &SimulationSetup, sheet: &SheetCounts) -> Cost {
    let threads = rayon::current_num_threads().max(1) as f64;
    let kind = setup.body.kind();
    Cost::new(
        setup,
        sheet,
        Work {
            measured: false,
            flop: flop(sheet),
            factors: factor_bytes(sheet),
            elements_s: sheet.elements as f64 * seconds_an_element(kind) / threads,
            factor_s: flop(sheet) / (RATE * threads),
        },
    )
}

/// As [`estimate`], with one element loop and one factorisation planned and timed on this machine.
///
/// # Errors
/// [`LinearError`] when the matrix cannot be planned.
pub fn measure(setup: &mut SimulationSetup) -> Result<Cost, LinearError> {
    let sheet = SheetCounts::of_mesh(setup.body.mesh());
    let pattern = setup.body.pattern();
    let groups = setup.body.mesh().groups();
    let columns: Vec<u32> = pattern.col_idx.iter().map(|&c| c as u32).collect();
    let view = PatternRef { row_start: &pattern.row_ptr, columns: &columns };
    let plan = Symbolic::new(view, &groups.of_unknown, &groups.centers)
        .map_err(|e| LinearError::Pattern(e.to_string()))?;
    let (flop, factors) = (plan.flops(), plan.bytes() as f64);
    let (elements_s, values) = element_loop(setup);
    let factor_s = factorisation(setup, &plan, values);
    Ok(Cost::new(setup, &sheet, Work { measured: true, flop, factors, elements_s, factor_s }))
}

/// Time of a factorisation [s]: tried where it is small, else by its work.
fn factorisation(setup: &SimulationSetup, plan: &Symbolic, mut values: Vec<f64>) -> f64 {
    let pattern = setup.body.pattern();
    let unknowns = 3 * setup.body.mesh().nodes.len();
    if plan.flops() > TRIED_FLOP || values.len() != pattern.nnz() {
        return plan.flops() / (RATE * rayon::current_num_threads().max(1) as f64);
    }
    // Nothing holds the sheet yet: what makes the matrix regular is added.
    let diagonal: Vec<usize> = (0..unknowns).filter_map(|row| pattern.position(row, row)).collect();
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
}

/// Unknowns of a column of nodes.
fn unknowns_a_column(sheet: &SheetCounts) -> f64 {
    3.0 * sheet.levels as f64
}

/// Work of a factorisation [flop]: nested dissection of a grid of p x q columns of m unknowns takes `c p² q m³` (George 1973), with
/// c fitted to 14 grids of 70 to 26 000 columns, within 25 %.
fn flop(sheet: &SheetCounts) -> f64 {
    let [short, long] = sheet.columns;
    let slender = 38.0 + 26.0 * (1.0 - short / long);
    slender * short * short * long * unknowns_a_column(sheet).powi(3)
}

/// Memory of the factors and their workspace [B]: `c p q log2 p m²`, fitted as there.
fn factor_bytes(sheet: &SheetCounts) -> f64 {
    let [short, long] = sheet.columns;
    8.0 * 16.3 * short * long * short.max(2.0).log2() * unknowns_a_column(sheet).powi(2)
}

/// Entries of the matrix of a grid.
fn entries(sheet: &SheetCounts) -> f64 {
    let [short, long] = sheet.columns.map(|n| (3.0 * n - 2.0).max(1.0));
    9.0 * short * long * (3.0 * sheet.levels as f64 - 2.0).max(1.0)
}

/// Work of one factorisation and one element loop.
struct Work {
    measured: bool,
    flop: f64,
    factors: f64,
    elements_s: f64,
    factor_s: f64,
}

/// Time of one element with its tangent on one thread [s].
fn seconds_an_element(kind: ElementKind) -> f64 {
    match kind {
        ElementKind::Hex8 => HEX8_S,
        ElementKind::Hex8Enhanced => HEX8_ENHANCED_S,
        ElementKind::SolidShell { points, .. } => SOLID_SHELL_S + f64::from(points) * SHELL_POINT_S,
    }
}

impl Cost {
    fn new(setup: &SimulationSetup, sheet: &SheetCounts, work: Work) -> Self {
        // Measured: 12 runs of 582 to 35,721 unknowns, with this to -5 and +12 % (docs/results/solver.md).
        let bytes = work.factors
            + entries(sheet) * ENTRY
            + sheet.elements as f64
                * (ELEMENT + HISTORIES * setup.body.state_bytes_per_element() as f64);
        let least: f64 = setup.stages.iter().map(fewest_increments).sum();
        let thickness = setup.body.mesh().mean_thickness().max(1e-300);
        let increments = [least, (CUTS * least).max(A_THICKNESS * travelled(setup) / thickness)];
        let iterations = [0, 1].map(|k| increments[k] * ITERATIONS[k]);
        let one = FACTORISATIONS.map(|n| BESIDE * (work.elements_s + n * work.factor_s));
        Self {
            unknowns: 3 * sheet.nodes,
            measured: work.measured,
            flop: work.flop,
            factors_mb: work.factors / 1e6,
            memory_mb: PROGRAM_MB + REPORT_MB + bytes / 1e6,
            elements_s: work.elements_s,
            factor_s: work.factor_s,
            increments,
            iterations,
            seconds: [0, 1].map(|k| iterations[k] * one[k]),
        }
    }
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
    let tools = setup.stages.first().map_or(0, |stage| stage.motions.len());
    (0..tools).map(of).sum()
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
    use crate::solver::assembly::Body;
    use crate::solver::material::card;
    use crate::solver::sheet::hex_mesh::rectangle;

    /// What is estimated from counts against the plan of the factorisation itself.
    #[test]
    fn work_and_memory_from_counts_are_those_of_the_plan() {
        for (nx, ny, layers) in [(20, 20, 1), (40, 40, 1), (20, 20, 3), (60, 6, 2), (80, 2, 1)] {
            let mesh = rectangle(nx as f64, ny as f64, 1.0, nx, ny, layers);
            let sheet = SheetCounts {
                columns: [ny as f64 + 1.0, nx as f64 + 1.0],
                ..SheetCounts::of_mesh(&mesh)
            };
            let steel = card::find("mild-steel-neto2012").unwrap().build(0.0).unwrap();
            let groups = mesh.groups();
            let body = Body::new(mesh, ElementKind::Hex8, steel).unwrap();
            let pattern = body.pattern();
            let columns: Vec<u32> = pattern.col_idx.iter().map(|&c| c as u32).collect();
            let view = PatternRef { row_start: &pattern.row_ptr, columns: &columns };
            let plan = Symbolic::new(view, &groups.of_unknown, &groups.centers).unwrap();
            assert_eq!(entries(&sheet), pattern.nnz() as f64);
            let ratios = [flop(&sheet) / plan.flops(), factor_bytes(&sheet) / plan.bytes() as f64];
            assert!(ratios.iter().all(|r| (0.75..1.35).contains(r)), "{nx} x {ny}: {ratios:?}");
        }
    }

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
