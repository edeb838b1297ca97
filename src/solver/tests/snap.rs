//! Limit points: a shallow arch under a dead load has a distant equilibrium; a bar beyond its limit load has none. A
//! released arch springs back whatever a force without a tool would do to it.

use std::sync::Arc;

use super::{setup, stage, steel, tool};
use crate::assembly::Body;
use crate::element::ElementKind;
use crate::increment::limit_point::relax;
use crate::material::elastic::Elastic;
use crate::material::hardening::Hardening;
use crate::material::hill48::Hill48;
use crate::material::plastic::Plastic;
use crate::newton::outcome::NewtonError;
use crate::report::{Energies, RunSummary};
use crate::sheet::hex_mesh::{HexMesh, rectangle};
use crate::stage::step_size::Endurance;
use crate::test_tools::plane;
use crate::{
    Constraints, Control, Curve, IncrementReport, Motion, SheetSide, Simulation, SimulationError,
    SimulationSetup,
};
use kanagata_geometry::Vec3;

const HALF: f64 = 20.0;
const RISE: f64 = 1.0;

/// Half an arch of a given thickness, clamped at x = 20 and symmetric at x = 0; x coordinates of its nodes.
fn half_arch(thickness: f64) -> (HexMesh, Constraints, Vec<f64>) {
    let mut mesh = rectangle(HALF, 1.0, thickness, 20, 1, 1);
    let flat: Vec<f64> = mesh.nodes.iter().map(|x| x.x).collect();
    for (x, flat) in mesh.nodes.iter_mut().zip(&flat) {
        x.z += RISE * (0.5 + 0.5 * (std::f64::consts::PI * flat / HALF).cos());
    }
    let mut constraints = Constraints::none(mesh.nodes.len());
    constraints.symmetry_plane(&mesh.nodes, 0, 0.0, 1e-9);
    for (node, x) in flat.iter().enumerate() {
        constraints.hold(node, 1);
        if *x > HALF - 1e-9 {
            (0..3).for_each(|axis| constraints.hold(node, axis));
        }
    }
    (mesh, constraints, flat)
}

/// Half an arch of thickness 0.2, clamped at x = 20, symmetric at x = 0, with `force` there; deflection of its crown
/// after every increment, energies, and the final residual force [N].
fn arch(force: f64, first_step: f64) -> (Vec<f64>, Energies, RunSummary, f64) {
    let (mesh, constraints, flat) = half_arch(0.2);
    let count = mesh.nodes.len();
    let crown: Vec<usize> = (0..count).filter(|&n| flat[n] < 1e-9).collect();
    let mut loads = vec![0.0; 3 * count];
    crown.iter().for_each(|&n| loads[3 * n + 2] = -force / crown.len() as f64);
    let kind = ElementKind::SolidShell { points: 3, membrane: true };
    let body = Body::new(mesh, kind, steel()).unwrap();
    let mut pushed = stage("push", Vec::new(), first_step);
    pushed.load = Curve::ramp(0.0, 1.0);
    pushed.largest_step = 0.05;
    let setup = SimulationSetup {
        loads: loads.clone(),
        ..setup(body, constraints.clone(), Vec::new(), vec![pushed])
    };
    let (mut drops, mut energies) = (Vec::new(), Energies::default());
    let mut sim = Simulation::new(setup).unwrap();
    let summary = sim
        .run(&mut |r: &IncrementReport<'_>| {
            drops.push(-r.displacements[3 * crown[0] + 2]);
            energies = r.energies;
            Control::Continue
        })
        .unwrap();
    let free = |&i: &usize| !constraints.is_held(i / 3, i % 3);
    let off = |i: usize| (sim.sys.eval.internal_force[i] - loads[i]).abs();
    let unbalanced = (0..loads.len()).filter(free).map(off).fold(0.0, f64::max);
    (drops, energies, summary, unbalanced)
}

#[test]
fn a_shallow_arch_snaps_through_and_releases_elastic_energy() {
    let (drops, energies, summary, unbalanced) = arch(30.0, 0.05);
    assert_eq!(summary.snap_throughs, 1, "{summary:?}");
    let jump = drops.windows(2).position(|w| w[1] - w[0] > 0.5 * RISE).unwrap();
    assert!(drops[jump] < 0.5 * RISE && drops[jump + 1] > 2.0 * RISE, "{drops:?}");
    assert!(drops.windows(2).skip(jump + 1).all(|w| w[1] > w[0]), "{drops:?}");
    assert!(unbalanced < 1e-3, "{unbalanced} N out of balance, or damped");
    // Elastic: the work of the load that is not stored was released.
    let lost = energies.external - energies.elastic;
    assert!(
        (lost - energies.released_elastic).abs() < 1e-3 * energies.external,
        "{lost} {energies:?}"
    );
    assert!(lost > 0.05 * energies.external);
}

/// The first step does not exceed the largest one: snap-through is searched for only below it.
#[test]
fn a_first_step_above_the_largest_has_no_effect() {
    assert_eq!(arch(30.0, 1.0).0, arch(30.0, 0.05).0);
}

/// A bar that hardens to at most 300 MPa, loaded by twice that: there is no further equilibrium.
#[test]
fn a_load_without_equilibrium_leaves_the_last_state() {
    let mesh = rectangle(4.0, 1.0, 1.0, 4, 1, 1);
    let count = mesh.nodes.len();
    let mut constraints = Constraints::none(count);
    let mut loads = vec![0.0; 3 * count];
    for (node, x) in mesh.nodes.iter().enumerate() {
        if x.x < 1e-9 {
            (0..3).for_each(|axis| constraints.hold(node, axis));
        } else if x.x > 4.0 - 1e-9 {
            loads[3 * node] = 600.0 / 4.0;
        }
    }
    let elastic = Elastic { young: 210_000.0, poisson: 0.3 };
    let voce = Hardening::Voce { sigma0: 200.0, q: 100.0, b: 50.0 };
    let material = Arc::new(Plastic::new(elastic, &Hill48::MISES, voce).unwrap());
    let mut pull = stage("pull", Vec::new(), 0.05);
    pull.load = Curve::ramp(0.0, 1.0);
    let body = super::body(mesh, material);
    let setup = SimulationSetup { loads, ..setup(body, constraints, Vec::new(), vec![pull]) };
    let mut sim = Simulation::new(setup).unwrap();
    let (mut last, mut energies) = (Vec::new(), Energies::default());
    let error = sim
        .run(&mut |r: &IncrementReport<'_>| {
            (last, energies) = (r.displacements.to_vec(), r.energies);
            Control::Continue
        })
        .unwrap_err();
    assert!(error.to_string().contains("not converged"), "{error}");
    assert!(sim.displacements() == last && sim.energies == energies);
    assert_eq!(sim.summary().snap_throughs, 0);
    // Failure may not cost more than a run.
    assert!(sim.summary().iterations < 800, "{:?}", sim.summary());
}

/// An arch of thickness 0.4 with its crown pressed down by `depth` and released, and a node of its crown.
fn pressed(depth: f64) -> (Simulation, usize) {
    let thickness = 0.4;
    let (mesh, constraints, flat) = half_arch(thickness);
    let crown = flat.iter().position(|x| *x < 1e-9).unwrap();
    let corner = Vec3::new(-0.5, -1.0, RISE + thickness);
    let face = plane("punch", corner, Vec3::x(), Vec3::y() * 3.0, -Vec3::z());
    let punch = tool("punch", face, -Vec3::z(), SheetSide::Top, 0.0);
    let mut press = stage("press", vec![Motion::Travel(Curve::ramp(0.0, depth))], 0.05);
    press.largest_step = 0.1;
    let mut release = stage("release", vec![Motion::Release], 0.1);
    release.largest_step = 0.1;
    let kind = ElementKind::SolidShell { points: 3, membrane: true };
    let body = Body::new(mesh, kind, steel()).unwrap();
    let setup = setup(body, constraints, vec![punch], vec![press, release]);
    (Simulation::new(setup).unwrap(), crown)
}

/// Deflection of the crown of a released arch, its largest displacement, and the number of snap-throughs.
fn pressed_and_released(depth: f64) -> (f64, f64, usize) {
    let (mut sim, crown) = pressed(depth);
    let summary = sim.run(&mut |_| Control::Continue).unwrap();
    let most = sim.displacements().iter().fold(0.0, |m: f64, u| m.max(u.abs()));
    (-sim.displacements()[3 * crown + 2], most, summary.snap_throughs)
}

/// Past the limit point (0.53) the decreasing force left by the tool pushes the crown further along unstable
/// equilibria, to one without any force at 1.31. The arch itself, between the tool and that equilibrium, springs
/// back.
#[test]
fn a_released_arch_springs_back_from_an_unstable_branch() {
    let (drop, most, snaps) = pressed_and_released(1.0);
    assert!(most < 1e-9 * RISE && snaps == 1, "{drop} {most} {snaps}");
}

/// Pressed further the crown leaves the tool, and its final position does not depend on the depth.
#[test]
fn an_arch_released_after_snap_through_stays_there() {
    let [(drop, ..), (deeper, ..)] = [1.6, 1.9].map(pressed_and_released);
    assert!(drop > 1.6 && (deeper - drop).abs() < 1e-6, "{drop} {deeper}");
}

/// A tool that advances while dampers retain the sheet works against the dampers: this does not lead to the next
/// equilibrium.
#[test]
fn a_tool_that_works_against_the_dampers_leaves_the_last_state() {
    let (mut sim, _) = pressed(1.2);
    let mut last = Vec::new();
    let mut advance = |sim: &mut Simulation| {
        let stopped = sim.run(&mut |r: &IncrementReport<'_>| {
            last = r.displacements.to_vec();
            if r.share > 0.0 { Control::Stop } else { Control::Continue }
        });
        assert!(matches!(stopped, Err(SimulationError::Stopped { .. })), "{stopped:?}");
        last.clone()
    };
    let first = advance(&mut sim);
    let (plan, energies) = (sim.under_way.as_ref().unwrap().plan.clone(), sim.energies);
    sim.history.clear();
    let found = relax(&mut sim, &plan, (None, 0.6), &Endurance::FULL, false);
    // Pushed further, the dampers would reach an equilibrium after 40 iterations.
    let at_once = matches!(found, Err(NewtonError::StillMoving { iterations }) if iterations < 20);
    assert!(at_once, "{found:?}");
    assert!(sim.displacements() == first && sim.energies == energies);
    assert_eq!(sim.summary().snap_throughs, 0);
    assert!(advance(&mut sim) != first);
}

/// Between 1.3 and 1.6 the crown snaps off the tool to its other equilibrium, within any step that moves the tool
/// there. The trapezoidal rule sees the same forces at both ends of the step, so the released energy must be found
/// otherwise.
#[test]
fn a_jump_within_a_step_is_reported_as_snap_through_with_its_energy() {
    let (mut sim, crown) = pressed(1.5);
    let (mut at_end, mut drop, mut snaps) = (Energies::default(), 0.0, 0);
    sim.run(&mut |r: &IncrementReport<'_>| {
        if r.stage == 0 {
            (at_end, drop, snaps) = (r.energies, -r.displacements[3 * crown + 2], r.snap_throughs);
        }
        Control::Continue
    })
    .unwrap();
    assert!(drop > 1.6 && snaps == 1, "{drop} {snaps}");
    let lost = at_end.external - at_end.elastic;
    assert!(lost > 0.02 * at_end.external, "{at_end:?}");
    assert!((lost - at_end.released_elastic).abs() < 0.01 * at_end.external, "{lost} {at_end:?}");
}
