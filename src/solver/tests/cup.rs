//! Round cup, quarter model: clamped by force, drawn with friction, released.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use super::{body, stage, tool};
use crate::material::elastic::Elastic;
use crate::material::hardening::Hardening;
use crate::material::hill48::Hill48;
use crate::material::plastic::Plastic;
use crate::newton::record::{IterationRecord, convergence_order};
use crate::sheet::hex_mesh::rectangle;
use crate::snapshot::SimulationState;
use crate::test_tools::{arc, line, revolved};
use crate::{
    Constraints, Control, Curve, IncrementReport, Limits, Motion, Placement, SheetSide, Simulation,
    SimulationSetup, Stage, ToolSetup,
};
use kanagata_geometry::Vec3;

/// Size of the case. `unit` is the length of a millimetre in the unit of the run.
pub(super) struct Case {
    cells: usize,
    depth: f64,
    mu: f64,
    unit: f64,
    release: bool,
    /// Transition from stick to slip in lengths of an edge.
    transition: f64,
    /// Step of the draw over the usual one.
    steps: f64,
}

pub(super) const QUICK: Case =
    Case { cells: 7, depth: 1.0, mu: 0.05, unit: 1.0, release: false, transition: 0.0, steps: 1.0 };

pub(super) fn cup(case: &Case) -> SimulationSetup {
    let u = case.unit;
    let stress = 1.0 / (u * u);
    let mesh = rectangle(60.0 * u, 60.0 * u, 0.8 * u, case.cells, case.cells, 2);
    let mut constraints = Constraints::none(mesh.nodes.len());
    constraints.symmetry_plane(&mesh.nodes, 0, 0.0, 1e-9 * u);
    constraints.symmetry_plane(&mesh.nodes, 1, 0.0, 1e-9 * u);
    let hill = Hill48 { f: 0.251, g: 0.297, h: 0.703, l: 1.5, m: 1.5, n: 1.29 };
    let swift = Hardening::Swift { k: 565.0 * stress, eps0: 0.007, n: 0.26 };
    let elastic = Elastic { young: 210_000.0 * stress, poisson: 0.3 };
    let steel = Arc::new(Plastic::new(elastic, &hill, swift).unwrap());
    SimulationSetup {
        body: body(mesh, steel),
        constraints,
        loads: Vec::new(),
        tools: tools(case),
        stages: stages(case),
        limits: Limits {
            friction_transition: case.transition,
            force_tolerance: 1e-8,
            ..Limits::default()
        },
        share: 4.0,
    }
}

/// Die, holder and punch of revolution, which stand where they touch the sheet.
fn tools(case: &Case) -> Vec<ToolSetup> {
    let u = case.unit;
    let l = |a: [f64; 2], b: [f64; 2], n: [f64; 2]| line(1, a.map(|v| v * u), b.map(|v| v * u), n);
    let die = [
        l([90.0, 0.0], [37.0, 0.0], [0.0, 1.0]),
        arc(3, [37.0 * u, -7.0 * u], 7.0 * u, [FRAC_PI_2, PI], 1.0),
        l([30.0, -7.0], [30.0, -60.0], [-1.0, 0.0]),
    ];
    let holder = [l([31.0, 0.0], [90.0, 0.0], [0.0, -1.0])];
    let punch = [
        l([0.0, 0.0], [21.0, 0.0], [0.0, -1.0]),
        arc(3, [21.0 * u, 8.0 * u], 8.0 * u, [-FRAC_PI_2, 0.0], 1.0),
        l([29.0, 8.0], [29.0, 60.0], [1.0, 0.0]),
    ];
    let q = FRAC_PI_2;
    let mut tools = vec![
        tool("die", revolved("die", 6, q, &die), Vec3::z(), SheetSide::Bottom, case.mu),
        tool("holder", revolved("holder", 6, q, &holder), -Vec3::z(), SheetSide::Top, case.mu),
        tool("punch", revolved("punch", 6, q, &punch), -Vec3::z(), SheetSide::Top, case.mu),
    ];
    tools.iter_mut().for_each(|t| t.placement = Placement::Touch);
    tools
}

fn stages(case: &Case) -> Vec<Stage> {
    let hold = || Motion::Force(Curve::constant(20_000.0));
    let clamp = vec![Motion::Hold, Motion::Force(Curve::ramp(0.0, 20_000.0)), Motion::Absent];
    let draw = vec![Motion::Hold, hold(), Motion::Travel(Curve::ramp(0.0, case.depth * case.unit))];
    let mut out =
        vec![stage("clamp", clamp, 0.5), stage("draw", draw, 0.025 * case.steps / case.depth)];
    out[1].largest_step = (0.2 * case.steps / case.depth).min(1.0);
    if case.release {
        out.push(stage("release", vec![Motion::Release; 3], 0.5));
    }
    out
}

/// Results of a run.
struct Outcome {
    sim: Simulation,
    iterations: Vec<usize>,
    histories: Vec<Vec<IterationRecord>>,
}

fn run(case: &Case) -> Outcome {
    let mut sim = Simulation::new(cup(case)).unwrap();
    let (mut iterations, mut histories) = (Vec::new(), Vec::new());
    sim.run(&mut |r: &IncrementReport<'_>| {
        iterations.push(r.iterations);
        histories.push(r.history.to_vec());
        check_balance(r);
        Control::Continue
    })
    .unwrap();
    Outcome { sim, iterations, histories }
}

/// Checks equilibrium of tools and sheet, and the energy balance.
fn check_balance(r: &IncrementReport<'_>) {
    let forces: Vec<Vec3> = r.tools.iter().map(|t| Vec3::from(t.force_vector)).collect();
    let largest = forces.iter().map(|f| f.z.abs()).fold(0.0, f64::max);
    let sum: f64 = forces.iter().map(|f| f.z).sum();
    assert!(sum.abs() <= 1e-8 * largest, "{sum} of {largest} in increment {}", r.increment);
    let nodal: f64 = r.contact_forces.chunks_exact(3).map(|f| f[2]).sum();
    assert!((nodal - sum).abs() <= 1e-8 * largest);
    // The work integrals are trapezoidal: that of the element forces is accurate to a few per cent at this step size.
    let e = &r.energies;
    assert!((e.external - e.internal - e.friction).abs() <= 2e-6 * e.external.abs(), "{e:?}");
    assert!((e.internal - e.elastic - e.plastic).abs() <= 0.03 * e.internal.abs(), "{e:?}");
}

#[test]
fn a_drawn_cup_is_in_equilibrium_without_penetration() {
    let Outcome { mut sim, iterations, histories } = run(&QUICK);
    assert!(iterations.iter().sum::<usize>() <= 12 * iterations.len(), "{iterations:?}");
    sim.sys.search();
    let deepest = sim
        .sys
        .contact
        .candidates
        .iter()
        .filter(|c| !c.foot.past_border && c.foot.gap.is_finite())
        .map(|c| c.foot.gap)
        .fold(f64::INFINITY, f64::min);
    assert!(deepest >= -1e-9, "{deepest}");
    // Separate stick and slip: a node that changes its state at the end reduces the order.
    let exact = orders(&histories);
    assert!(exact[exact.len() / 2] > 1.6 && exact[exact.len() * 3 / 4] > 1.8, "{exact:?}");
}

/// The energy error of tools, elements and friction is that of the trapezoidal rule.
#[test]
fn the_energy_error_decreases_with_the_step() {
    let open = |steps: f64| {
        let case = Case { transition: 1e-4, depth: 2.0, steps, ..QUICK };
        let e = run(&case).sim.energies;
        (e.external - e.internal - e.friction).abs() / e.external
    };
    let (whole, half) = (open(1.0), open(0.5));
    assert!(whole < 2e-6 && half < 0.5 * whole, "{whole:e} {half:e}");
}

#[test]
fn a_frictional_draw_converges_quadratically() {
    // Deep enough for increments that do not converge too fast to show their order, and several runs for a sufficient
    // number.
    let of = |steps| run(&Case { transition: 1e-5, depth: 2.0, steps, ..QUICK }).histories;
    let histories: Vec<_> = [1.0, 0.7, 0.5, 0.3].into_iter().flat_map(of).collect();
    let orders = orders(&histories);
    assert!(orders[orders.len() / 2] > 1.8, "{orders:?}");
}

/// Orders of convergence of the increments that show one, ascending. Many converge too fast.
fn orders(histories: &[Vec<IterationRecord>]) -> Vec<f64> {
    let mut orders: Vec<f64> = histories.iter().filter_map(|h| convergence_order(h)).collect();
    assert!(orders.len() >= 4, "{} of {}", orders.len(), histories.len());
    orders.sort_by(f64::total_cmp);
    orders
}

#[test]
fn results_do_not_depend_on_threads_or_repetition() {
    let case = Case { depth: 0.3, ..QUICK };
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&case).sim.displacements().to_vec())
    };
    let one = with(1);
    assert!(one == with(2) && one == with(2) && one == with(4));
}

#[test]
fn results_do_not_depend_on_the_unit_of_length() {
    let mm = run(&Case { depth: 0.3, ..QUICK });
    // A power of two, so that rounding is the same and any constant with a unit has an effect.
    let unit = 1.0 / 1024.0;
    let m = run(&Case { depth: 0.3, unit, ..QUICK });
    assert_eq!(mm.iterations, m.iterations);
    for (a, b) in mm.sim.displacements().iter().zip(m.sim.displacements()) {
        assert!((a - b / unit).abs() < 1e-8, "{a} {b}");
    }
}

#[test]
fn a_released_cup_has_no_contact_forces() {
    let Outcome { sim, .. } = run(&Case { depth: 0.6, release: true, ..QUICK });
    let sys = &sim.sys;
    let largest = (0..sys.node_count())
        .map(|n| (sys.constraints.free_projector(n) * sys.force_at(n)).norm())
        .fold(0.0, f64::max);
    assert!(largest < 1e-4, "{largest} N left at a free node");
    assert_eq!(sys.contact.active().count(), 0);
}

/// Saved after every increment and continued in a new simulation: clamp, draw, release, bit-identically.
#[test]
fn a_restarted_run_is_bit_identical() {
    let case = Case { depth: 0.3, release: true, transition: 1e-4, ..QUICK };
    let whole = run(&case).sim;
    let mut sim = Simulation::new(cup(&case)).unwrap();
    while sim.advance(&mut |_| Control::Continue).unwrap() {
        let state = sim.state();
        let text = serde_json::to_string(&state).unwrap();
        let mut read: SimulationState = serde_json::from_str(&text).unwrap();
        read.material.clone_from(&state.material);
        assert!(read == state);
        sim = Simulation::new(cup(&case)).unwrap();
        sim.resume(read).unwrap();
    }
    let (all, last) = (whole.summary(), sim.summary());
    assert_eq!(all.iterations, last.iterations);
    assert_eq!(all.timings.factorisations, last.timings.factorisations);
    assert!(whole.displacements() == sim.displacements());
    let other = Simulation::new(cup(&Case { cells: 6, ..case })).unwrap().state();
    assert!(sim.resume(other).unwrap_err().to_string().contains("another set-up"));
}
