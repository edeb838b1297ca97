//! Removal of a tool from nodes with applied loads.

use super::claims::square;
use super::{body, setup, stage, steel, tool};
use crate::report::Energies;
use crate::sheet::hex_mesh::rectangle;
use crate::test_tools::plane;
use crate::{
    Constraints, Control, Curve, IncrementReport, Limits, Motion, SheetSide, Simulation,
    SimulationSetup,
};
use kanagata_geometry::Vec3;

/// Fraction of the second stage at which the state is checked.
const FIRST: f64 = 1e-3;

/// A strip of 20 x 4 x 1 mm, clamped at one end, its other end loaded by 30 N onto a plate below, which is then
/// removed while the load stays.
fn strip() -> SimulationSetup {
    let mesh = rectangle(20.0, 4.0, 1.0, 10, 2, 1);
    let mut constraints = Constraints::none(mesh.nodes.len());
    let mut loads = vec![0.0; 3 * mesh.nodes.len()];
    for (node, x) in mesh.nodes.iter().enumerate() {
        if x.x < 1e-9 {
            (0..3).for_each(|axis| constraints.hold(node, axis));
        }
        if x.x > 20.0 - 1e-9 && x.z < 1e-9 {
            loads[3 * node + 2] = -10.0;
        }
    }
    let plate = tool("plate", square("plate", 0.0, true), Vec3::z(), SheetSide::Bottom, 0.0);
    let mut press = stage("press", vec![Motion::Hold], 1.0);
    press.load = Curve::ramp(0.0, 1.0);
    let mut release = stage("release", vec![Motion::Release], FIRST);
    release.load = Curve::constant(1.0);
    let stages = vec![press, release];
    SimulationSetup { loads, ..setup(body(mesh, steel()), constraints, vec![plate], stages) }
}

/// Largest difference of two fields.
fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn the_remaining_force_of_a_removed_tool_excludes_the_loads() {
    let mut states: Vec<(f64, Vec<f64>, f64)> = Vec::new();
    let mut sim = Simulation::new(strip()).unwrap();
    sim.run(&mut |r: &IncrementReport<'_>| {
        states.push((r.share, r.displacements.to_vec(), r.tools[0].force));
        Control::Continue
    })
    .unwrap();
    let pressed = states.iter().position(|s| s.0 == 1.0).unwrap();
    let [before, first, last] = [pressed, pressed + 1, states.len() - 1].map(|k| &states[k]);
    assert!((first.0 - FIRST).abs() < 1e-15);
    let (little, all) =
        (largest_difference(&before.1, &first.1), largest_difference(&before.1, &last.1));
    assert!(all > 0.05, "the strip bends down by {all} mm");
    assert!((little / all - FIRST).abs() < 0.1 * FIRST, "{little} of {all} mm at once");
    assert_eq!(sim.summary().snap_throughs, 0);
    // The remaining force is reported as the force of the tool.
    assert!(before.2 > 1.0 && (first.2 / before.2 - (1.0 - FIRST)).abs() < 1e-12, "{}", first.2);
    assert_eq!(last.2, 0.0);
}

#[test]
fn contact_forces_after_a_stage_are_those_of_its_end() {
    let mut setup = strip();
    setup.stages.truncate(1);
    let mut last = Vec::new();
    let mut sim = Simulation::new(setup).unwrap();
    sim.run(&mut |r: &IncrementReport<'_>| {
        last = r.contact_forces.to_vec();
        Control::Continue
    })
    .unwrap();
    let pushed: f64 = last.chunks_exact(3).map(|f| f[2]).sum();
    assert!((pushed - 30.0).abs() < 1.0, "{pushed} N");
    assert_eq!(last, sim.contact_forces());
}

/// A free strip between two plates, released and then pressed with a larger force: the supports of the release are
/// removed.
#[test]
fn a_sheet_released_and_pressed_again_has_no_supports() {
    let mesh = rectangle(20.0, 4.0, 1.0, 10, 2, 2);
    let nothing = Constraints::none(mesh.nodes.len());
    let plate = |name, z, up: bool, side| {
        let direction = if up { Vec3::z() } else { -Vec3::z() };
        tool(name, square(name, z, up), direction, side, 0.1)
    };
    let tools = vec![
        plate("upper", 1.0, false, SheetSide::Top),
        plate("lower", 0.0, true, SheetSide::Bottom),
    ];
    let to = |travel: f64| Motion::Travel(Curve::to(travel));
    let stages = vec![
        stage("press", vec![to(1e-3), Motion::Hold], 1.0),
        stage("release", vec![Motion::Release; 2], 1.0),
        stage("again", vec![to(-0.2), to(0.203)], 1.0),
    ];
    let mut forces = Vec::new();
    let mut sim = Simulation::new(setup(body(mesh, steel()), nothing, tools, stages)).unwrap();
    sim.run(&mut |r: &IncrementReport<'_>| {
        forces = r.tools.iter().map(|tool| tool.force_vector).collect::<Vec<_>>();
        let e = r.energies;
        let open = e.external - e.internal - e.friction;
        assert!(open.abs() <= 1e-6 * e.external.abs(), "{e:?}");
        Control::Continue
    })
    .unwrap();
    // Three times the first force.
    let pressed = 3e-3 * 210_000.0 * 20.0 * 4.0;
    assert!((forces[1][2] / pressed - 1.0).abs() < 0.2, "{forces:?} N instead of {pressed}");
    for (one, other) in forces[0].iter().zip(&forces[1]) {
        assert!((one + other).abs() < 1e-6 * pressed, "{forces:?}");
    }
    let moved = sim.displacements().chunks_exact(3);
    moved.for_each(|u| assert!((u[2] - 0.2).abs() < 0.01, "{u:?}"));
}

/// A free sheet between a plate and a smaller one that is pushed onto it: before contact friction has no normal
/// force.
#[test]
fn a_free_sheet_is_clamped_at_once() {
    let mesh = rectangle(20.0, 20.0, 1.0, 10, 10, 1);
    let nothing = Constraints::none(mesh.nodes.len());
    let [x, y] = [Vec3::x(), Vec3::y()].map(|along| 13.0 * along);
    let upper = plane("upper", Vec3::new(2.5, 3.5, 1.0), x, y, -Vec3::z());
    let lower = square("lower", 0.0, true);
    let tools = vec![
        tool("upper", upper, -Vec3::z(), SheetSide::Top, 0.1),
        tool("lower", lower, Vec3::z(), SheetSide::Bottom, 0.1),
    ];
    let clamp = stage("clamp", vec![Motion::Force(Curve::to(1e4)), Motion::Hold], 1.0);
    let limits = Limits::default();
    let setup = setup(body(mesh, steel()), nothing, tools, vec![clamp]);
    let mut sim = Simulation::new(SimulationSetup { limits, ..setup }).unwrap();
    let summary = sim.run(&mut |_| Control::Continue).unwrap();
    assert!(summary.cuts == 0 && summary.increments == 1, "{summary:?}");
    assert!(summary.iterations <= 6, "{summary:?}");
    let gliding = |u: &[f64]| u[0].abs().max(u[1].abs());
    let farthest = sim.displacements().chunks_exact(3).map(gliding).fold(0.0, f64::max);
    assert!(farthest < 1e-2, "{farthest} mm");
}

/// A block is pressed onto a floor that slides under it, released, and pressed again while the floor is at rest: the
/// earlier friction has no effect.
#[test]
fn slip_memory_vanishes_with_the_normal_force() {
    let mesh = rectangle(10.0, 10.0, 2.0, 2, 2, 1);
    let nothing = Constraints::none(mesh.nodes.len());
    let floor = tool("floor", square("floor", 0.0, true), Vec3::x(), SheetSide::Bottom, 0.3);
    let press = tool("press", square("press", 2.0, false), -Vec3::z(), SheetSide::Top, 0.1);
    let with = |name: &str, x: f64, force: f64| {
        let motions = vec![Motion::Travel(Curve::to(x)), Motion::Force(Curve::to(force))];
        stage(name, motions, 0.2)
    };
    let stages = vec![
        with("press", 0.0, 100.0),
        with("drag", 1.0, 100.0),
        with("lift", 1.0, 0.0),
        with("again", 1.0, 100.0),
    ];
    let mut along = vec![0.0; 4];
    let mut see = |r: &IncrementReport<'_>| {
        along[r.stage] = r.tools[0].force;
        Control::Continue
    };
    let setup = setup(body(mesh, steel()), nothing, vec![floor, press], stages);
    Simulation::new(setup).unwrap().run(&mut see).unwrap();
    assert!((along[1].abs() - 10.0).abs() < 0.01 && along[3].abs() < 0.01, "{along:?}");
}

/// A strip of 20 x 4 x 1 mm, clamped at one end, bent up by 1 mm by a plate that is then removed at once.
#[test]
fn the_energy_released_by_a_removed_tool_is_reported() {
    let mesh = rectangle(20.0, 4.0, 1.0, 10, 2, 1);
    let mut constraints = Constraints::none(mesh.nodes.len());
    for node in (0..mesh.nodes.len()).filter(|&node| mesh.nodes[node].x < 1e-9) {
        (0..3).for_each(|axis| constraints.hold(node, axis));
    }
    let corner = Vec3::new(15.0, -2.0, 0.0);
    let face = plane("plate", corner, Vec3::x() * 10.0, Vec3::y() * 8.0, Vec3::z());
    let plate = tool("plate", face, Vec3::z(), SheetSide::Bottom, 0.0);
    let stages = vec![
        stage("press", vec![Motion::Travel(Curve::to(1.0))], 0.1),
        stage("gone", vec![Motion::Absent], 0.1),
    ];
    let mut energies = Vec::new();
    let mut sim =
        Simulation::new(setup(body(mesh, steel()), constraints, vec![plate], stages)).unwrap();
    let done = sim
        .run(&mut |r: &IncrementReport<'_>| {
            energies.push((r.stage, r.energies));
            Control::Continue
        })
        .unwrap();
    let pressed = energies.iter().rfind(|(stage, _)| *stage == 0).unwrap().1;
    let last = energies.last().unwrap().1;
    assert!(pressed.elastic > 1.0 && last.elastic < 1e-9 * pressed.elastic, "{last:?}");
    assert!((last.released_elastic / pressed.elastic - 1.0).abs() < 0.01, "{last:?} {pressed:?}");
    assert!(last.imbalance().abs() < 1e-6 * pressed.elastic && done.snap_throughs > 0, "{last:?}");
}

/// A strip of 40 x 4 x 0.8 mm, clamped by 400 N on its first 10 mm between a plate and a holder without friction. A
/// pad lifts its other end by 2 mm before the holder is removed at once.
fn lifted_by(holder: f64) -> (Energies, Energies) {
    let mesh = rectangle(40.0, 4.0, 0.8, 20, 1, 1);
    let mut constraints = Constraints::none(mesh.nodes.len());
    for (node, x) in mesh.nodes.iter().enumerate() {
        constraints.hold(node, 1);
        if x.x < 1e-9 {
            constraints.hold(node, 0);
        }
    }
    let face = |name: &str, from: f64, z: f64, up: f64| {
        let corner = Vec3::new(from, -2.0, z);
        plane(name, corner, Vec3::x() * 12.0, Vec3::y() * 8.0, Vec3::z() * up)
    };
    let tools = vec![
        tool("die", face("die", -1.0, 0.0, 1.0), Vec3::z(), SheetSide::Bottom, 0.0),
        tool("holder", face("holder", -1.0, 0.8, -1.0), -Vec3::z(), SheetSide::Top, 0.0),
        tool("pad", face("pad", 35.0, 0.0, 1.0), Vec3::z(), SheetSide::Bottom, 0.0),
    ];
    let push = || Motion::Force(Curve::constant(holder));
    let stages = vec![
        stage("clamp", vec![Motion::Hold, Motion::Force(Curve::to(holder)), Motion::Hold], 0.25),
        stage("lift", vec![Motion::Hold, push(), Motion::Travel(Curve::to(2.0))], 0.1),
        stage("gone", vec![Motion::Hold, Motion::Absent, Motion::Hold], 0.1),
    ];
    let mut energies = Vec::new();
    let mut sim = Simulation::new(setup(body(mesh, steel()), constraints, tools, stages)).unwrap();
    sim.run(&mut |r: &IncrementReport<'_>| {
        energies.push((r.stage, r.energies));
        Control::Continue
    })
    .unwrap();
    let lifted = energies.iter().rfind(|(stage, _)| *stage == 1).unwrap().1;
    (lifted, energies.last().unwrap().1)
}

/// The clamping force vanishes within a small part of the springback; half of it over the whole springback would be
/// many times the stored energy.
#[test]
fn a_removed_clamp_does_no_work_during_springback() {
    for holder in [200.0, 2000.0] {
        let (lifted, last) = lifted_by(holder);
        assert!(lifted.elastic > 1.0 && last.elastic < 0.02 * lifted.elastic, "{last:?}");
        let freed = lifted.elastic - last.elastic;
        assert!(
            (last.released_elastic / freed - 1.0).abs() < 0.01,
            "{holder} N: {last:?} {lifted:?}"
        );
        assert!((last.external - lifted.external).abs() < 0.01 * freed, "{last:?} {lifted:?}");
        assert!(last.imbalance().abs() < 1e-2 * freed, "{last:?}");
    }
}
