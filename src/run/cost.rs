//! Estimated cost of a run before it starts: unknowns, memory, time.

use std::time::Instant;

use serde::Serialize;

use kanagata_geometry::Vec3;
use kanagata_scene::preview::SheetCounts;
use kanagata_solver::assembly::Evaluation;
use kanagata_solver::element::{ElementKind, Want};
use kanagata_solver::linear::LinearError;
use kanagata_solver::linear::multifrontal::{Factors, PatternRef, Symbolic};
use kanagata_solver::{Motion, SimulationSetup, Stage};

/// In-plane stretch for timing the element loop: most sheets are plastic there, as in a run.
const TIMED_STRETCH: f64 = 0.03;
/// Largest factorisation that is timed [flop]; the time of a larger one follows from its work.
const TIMED_FLOP_MAX: f64 = 4e10;
/// Speed assumed for a factorisation that is not timed, per core [flop/s]; large factorisations are faster.
const CORE_FLOP_PER_S: f64 = 1.5e10;
/// Factorisations per iteration, few and many: one, and another for every active-set change after which the factors are
/// not updated (`docs/results/main-job.md`: 934 in 381).
const FACTORISATIONS_PER_ITERATION: [f64; 2] = [1.0, 2.5];
/// Time of an iteration over factorisations and element loop: the rest is substitution, contact and search (same run).
const ITERATION_TIME_FACTOR: f64 = 1.35;
/// Newton iterations per increment, few and many, with those of cut increments (same run and others of `docs/results`).
const ITERATIONS_PER_INCREMENT: [f64; 2] = [5.0, 8.0];
/// Increments of a difficult run over the increments of a run in which every step grows as allowed.
const DIFFICULT_INCREMENTS_FACTOR: f64 = 4.0;
/// Increments per tool travel of one sheet thickness, while contacts change all the time. The cross tool at 60 mm and
/// 0.8 mm thickness takes 165 to 220 increments in all.
const INCREMENTS_PER_THICKNESS: f64 = 3.0;
/// Memory of the program without a model [MB].
const PROGRAM_MB: f64 = 10.0;
/// Additional memory for writing the report, which holds the plotting script twice [MB].
const REPORT_MB: f64 = 19.0;
/// Memory per matrix entry [B]: values in tangent and matrix, column, source and target of assembly.
const BYTES_PER_ENTRY: f64 = 40.0;
/// Memory per element [B]: geometry of its points, and its last evaluation.
const BYTES_PER_ELEMENT: f64 = 9_400.0;
/// Copies of the history of all points: committed, trial, before the last step, and part of a checkpoint.
const HISTORY_COPIES: f64 = 4.4;

/// Time of one element with tangent on one thread of a core of 2020 [s] (`check --measure`, docs/results/solver.md).
/// Machines differ by a factor of two.
const HEX8_S: f64 = 5e-6;
const HEX8_ENHANCED_S: f64 = 9e-6;
const SOLID_SHELL_S: f64 = 3e-6;
const SHELL_POINT_S: f64 = 1.2e-6;

/// Exponent of the run time over the unknowns (`docs/results/solver.md`).
pub(super) const TIME_EXPONENT: f64 = 1.5;

/// Estimated cost of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cost {
    /// Unknowns of the sheet.
    pub unknowns: usize,
    /// Whether one element loop and one factorisation were timed; otherwise their times are estimated from counts.
    pub measured: bool,
    /// Work of one factorisation [flop].
    pub flop: f64,
    /// Memory of factors and workspace [MB].
    pub factors_mb: f64,
    /// Peak memory of the process, including its report [MB].
    pub memory_mb: f64,
    /// Time of one element loop with tangent [s].
    pub elements_s: f64,
    /// Time of one factorisation [s].
    pub factor_s: f64,
    /// Increments: few, and many.
    pub increments: [f64; 2],
    /// Newton iterations: few, and many.
    pub iterations: [f64; 2],
    /// Wall time [s]: without difficulties, and with many.
    pub seconds: [f64; 2],
}

/// Cost of a run of the set-up on a sheet with these counts, without allocating or timing anything.
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
            elements_s: sheet.elements as f64 * seconds_per_element(kind) / threads,
            factor_s: flop(sheet) / (CORE_FLOP_PER_S * threads),
        },
    )
}

/// As [`estimate`], but with the symbolic factorisation done, and one element loop and one factorisation timed on this
/// machine.
///
/// # Errors
/// [`LinearError`] when the symbolic factorisation fails.
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

/// Time of a factorisation [s]: measured if it is small, otherwise from its work.
fn factorisation(setup: &SimulationSetup, plan: &Symbolic, mut values: Vec<f64>) -> f64 {
    let pattern = setup.body.pattern();
    let unknowns = 3 * setup.body.mesh().nodes.len();
    if plan.flops() > TIMED_FLOP_MAX || values.len() != pattern.nnz() {
        return plan.flops() / (CORE_FLOP_PER_S * rayon::current_num_threads().max(1) as f64);
    }
    // The sheet is unconstrained here: a diagonal shift makes the matrix regular.
    let diagonal: Vec<usize> = (0..unknowns).filter_map(|row| pattern.position(row, row)).collect();
    let shift = diagonal.iter().map(|&q| values[q].abs()).fold(0.0, f64::max);
    diagonal.iter().for_each(|&q| values[q] += shift);
    let mut store = Factors::default();
    let mut once = || {
        let start = Instant::now();
        let _ = plan.factor(&values, &mut store, &[]);
        start.elapsed().as_secs_f64()
    };
    // The first factorisation also allocates its memory.
    once().min(once())
}

/// Unknowns per column of nodes.
fn unknowns_per_column(sheet: &SheetCounts) -> f64 {
    3.0 * sheet.levels as f64
}

/// Work of a factorisation [flop]. Nested dissection of a grid of p x q columns of m unknowns takes `c p² q m³` (George
/// 1973); c is fitted to 14 grids of 70 to 26 000 columns, within 25 %.
fn flop(sheet: &SheetCounts) -> f64 {
    let [short, long] = sheet.columns;
    let slender = 38.0 + 26.0 * (1.0 - short / long);
    slender * short * short * long * unknowns_per_column(sheet).powi(3)
}

/// Memory of the factors and their workspace [B]: `c p q log2 p m²`, fitted to the same grids.
fn factor_bytes(sheet: &SheetCounts) -> f64 {
    let [short, long] = sheet.columns;
    8.0 * 16.3 * short * long * short.max(2.0).log2() * unknowns_per_column(sheet).powi(2)
}

/// Number of matrix entries of a grid.
fn entries(sheet: &SheetCounts) -> f64 {
    let [short, long] = sheet.columns.map(|n| (3.0 * n - 2.0).max(1.0));
    9.0 * short * long * (3.0 * sheet.levels as f64 - 2.0).max(1.0)
}

/// Work and times of one factorisation and one element loop.
struct Work {
    measured: bool,
    flop: f64,
    factors: f64,
    elements_s: f64,
    factor_s: f64,
}

/// Time of one element with its tangent on one thread [s].
fn seconds_per_element(kind: ElementKind) -> f64 {
    match kind {
        ElementKind::Hex8 => HEX8_S,
        ElementKind::Hex8Enhanced => HEX8_ENHANCED_S,
        ElementKind::SolidShell { points, .. } => SOLID_SHELL_S + f64::from(points) * SHELL_POINT_S,
    }
}

impl Cost {
    fn new(setup: &SimulationSetup, sheet: &SheetCounts, work: Work) -> Self {
        // Compared with 12 runs of 582 to 35,721 unknowns: -5 to +12 % (docs/results/solver.md).
        let bytes = work.factors
            + entries(sheet) * BYTES_PER_ENTRY
            + sheet.elements as f64
                * (BYTES_PER_ELEMENT
                    + HISTORY_COPIES * setup.body.state_bytes_per_element() as f64);
        let fewest: f64 = setup.stages.iter().map(fewest_increments).sum();
        let thickness = setup.body.mesh().mean_thickness().max(1e-300);
        let increments = [
            fewest,
            (DIFFICULT_INCREMENTS_FACTOR * fewest)
                .max(INCREMENTS_PER_THICKNESS * total_travel(setup) / thickness),
        ];
        let iterations = [0, 1].map(|k| increments[k] * ITERATIONS_PER_INCREMENT[k]);
        let one = FACTORISATIONS_PER_ITERATION
            .map(|n| ITERATION_TIME_FACTOR * (work.elements_s + n * work.factor_s));
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

/// Wall time of an element loop over the stretched sheet [s], and its tangent (empty if an element fails).
fn element_loop(setup: &mut SimulationSetup) -> (f64, Vec<f64>) {
    let stretch = |x: &Vec3| [TIMED_STRETCH * x.x, TIMED_STRETCH * x.y, 0.0];
    let u: Vec<f64> = setup.body.mesh().nodes.iter().flat_map(stretch).collect();
    let mut out = Evaluation::default();
    let mut shortest = f64::INFINITY;
    for _ in 0..3 {
        let start = Instant::now();
        let done = setup.body.evaluate(&u, Want::ResidualAndTangent, &mut out).is_ok();
        shortest = shortest.min(start.elapsed().as_secs_f64());
        if !done {
            out.tangent.clear();
        }
    }
    setup.body.restore();
    (shortest, out.tangent)
}

/// Increments of a stage without cuts: those of the run it follows, then steps that grow by half up to the largest
/// allowed.
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

/// Total travel of all travel-driven tools over all stages [mm].
fn total_travel(setup: &SimulationSetup) -> f64 {
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
    /// Range of the wall time of a run that costs `factor` times as much, in words.
    #[must_use]
    pub fn times(&self, factor: f64) -> String {
        let [low, high] = self.seconds.map(|s| duration(s * factor));
        format!("{low} to {high}")
    }
}

/// A duration in seconds, minutes or hours.
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
    use kanagata_solver::Curve;
    use kanagata_solver::assembly::Body;
    use kanagata_solver::material::card;
    use kanagata_solver::sheet::hex_mesh::rectangle;

    /// Compares the estimates from counts with the symbolic factorisation.
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
