//! Tools that approach from a distance in one step, by travel or by force, and tools clear of the sheet.

use super::{body, setup, stage, steel, tool};
use crate::sheet::hex_mesh::rectangle;
use crate::test_tools::{Builder, plane};
use crate::{
    Constraints, ContactMethod, Control, Curve, IncrementReport, Motion, Placement, SheetSide,
    Simulation, SimulationError, SimulationSetup, Stage, ToolSetup,
};
use kanagata_geometry::Vec3;

/// Initial height of the plate above the sheet [mm]: some element lengths.
const AWAY: f64 = 9.0;

fn plate(name: &str, z: f64, up: bool, mu: f64) -> ToolSetup {
    let along = if up { Vec3::z() } else { -Vec3::z() };
    let model = plane(name, Vec3::new(-20.0, -20.0, z), 60.0 * Vec3::x(), 60.0 * Vec3::y(), along);
    tool(name, model, along, if up { SheetSide::Bottom } else { SheetSide::Top }, mu)
}

/// A strip of 20 x 2 x 1 mm clamped at one end, and a plate above its other end with the given `motion`.
fn cantilever(motion: Motion, first_step: f64) -> SimulationSetup {
    let mesh = rectangle(20.0, 2.0, 1.0, 10, 1, 1);
    let mut held = Constraints::none(mesh.nodes.len());
    for node in (0..mesh.nodes.len()).filter(|&node| mesh.nodes[node].x < 1e-9) {
        (0..3).for_each(|axis| held.hold(node, axis));
    }
    let corner = Vec3::new(17.0, -20.0, 1.0 + AWAY);
    let model = plane("plate", corner, 30.0 * Vec3::x(), 60.0 * Vec3::y(), -Vec3::z());
    let tools = vec![tool("plate", model, -Vec3::z(), SheetSide::Top, 0.0)];
    setup(body(mesh, steel()), held, tools, vec![stage("push", vec![motion], first_step)])
}

/// Final travel and force of the plate, and the number of increments.
fn end(setup: SimulationSetup) -> ([f64; 2], usize) {
    let mut last = [0.0; 2];
    let mut see = |r: &IncrementReport<'_>| {
        last = [r.tools[0].travel, r.tools[0].force];
        Control::Continue
    };
    let summary = Simulation::new(setup).unwrap().run(&mut see).unwrap();
    (last, summary.increments)
}

/// Elements are 2 mm long; the plate moves 9 mm to the sheet and 6 mm further.
#[test]
fn a_tool_that_approaches_in_one_step_meets_the_sheet() {
    let down = || Motion::Travel(Curve::to(AWAY + 6.0));
    let (slow, _) = end(cantilever(down(), 0.02));
    let (fast, _) = end(cantilever(down(), 1.0));
    assert!(slow[1] > 10.0, "{slow:?}");
    assert!((fast[1] / slow[1] - 1.0).abs() < 1e-6, "{fast:?} {slow:?}");
}

/// Both faces of a slab 3 mm thick. A step of 15 mm would move it through the sheet to an equilibrium without force
/// on the wrong side.
#[test]
fn a_slab_does_not_cross_the_sheet_in_one_step() {
    let mut setup = cantilever(Motion::Travel(Curve::to(AWAY + 6.0)), 1.0);
    let at = |z: f64| move |u: f64, v: f64| Vec3::new(17.0 + 30.0 * u, 60.0 * v - 20.0, z);
    let (front, back) = (at(1.0 + AWAY), at(4.0 + AWAY));
    let faces = Builder::new("slab").grid(1, 1, |u, v| (front(u, v), -Vec3::z()));
    let both = faces.grid(1, 1, |u, v| (back(u, v), Vec3::z())).build();
    setup.tools[0] = tool("slab", both, -Vec3::z(), SheetSide::Top, 0.0);
    let (found, increments) = end(setup);
    assert!(found[1] > 10.0 && increments > 1, "{found:?} in {increments}");
}

#[test]
fn a_tool_driven_by_force_approaches_from_a_distance() {
    let (found, _) = end(cantilever(Motion::Force(Curve::to(10.0)), 0.25));
    assert!((found[1] - 10.0).abs() < 1e-6 && found[0] > AWAY + 0.1, "{found:?}");
}

#[test]
fn a_tool_driven_by_force_past_the_sheet_is_an_error() {
    let mut setup = cantilever(Motion::Force(Curve::to(10.0)), 0.25);
    setup.tools[0].offset = Vec3::new(0.0, 500.0, 0.0);
    let error = Simulation::new(setup).unwrap().run(&mut |_| Control::Continue).unwrap_err();
    let said = error.to_string();
    assert!(said.contains("nothing to push against") && said.contains("`plate`"), "{said}");
}

/// A free sheet pressed between two plates with `mu`. The upper one is retracted, then the lower one is released
/// while the upper one stays; then `loads` act.
fn release(loads: Vec<f64>) -> (Result<(), SimulationError>, Vec<(bool, f64)>) {
    let mesh = rectangle(20.0, 2.0, 1.0, 10, 1, 1);
    let held = Constraints::none(mesh.nodes.len());
    let tools = vec![plate("below", 0.0, true, 0.2), plate("above", 1.0, false, 0.2)];
    let up = |to: f64| Motion::Travel(Curve::to(to));
    let last = Stage {
        load: Curve::ramp(0.0, 1.0),
        ..stage("let go", vec![Motion::Release, Motion::Hold], 0.5)
    };
    let stages = vec![
        stage("press", vec![Motion::Hold, up(0.01)], 0.5),
        stage("lift", vec![Motion::Hold, up(-3.0)], 0.5),
        last,
    ];
    let setup = SimulationSetup { loads, ..setup(body(mesh, steel()), held, tools, stages) };
    let mut seen = Vec::new();
    let mut see = |r: &IncrementReport<'_>| {
        let farthest = r.displacements.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
        seen.push((r.free, farthest));
        Control::Continue
    };
    let done = Simulation::new(setup).unwrap().run(&mut see).map(|_| ());
    (done, seen)
}

#[test]
fn a_tool_clear_of_a_released_sheet_does_not_hold_it() {
    let (done, seen) = release(Vec::new());
    done.unwrap();
    let last = seen.last().unwrap();
    assert!(last.0 && last.1 < 0.01, "{seen:?}");
    assert!(seen.iter().any(|(free, _)| !free));
}

#[test]
fn loads_on_an_unconstrained_sheet_must_be_self_equilibrated() {
    let nodes = rectangle(20.0, 2.0, 1.0, 10, 1, 1).nodes;
    let at = |x: f64, force: f64| -> Vec<f64> {
        let on = |n: &Vec3| if (n.x - x).abs() < 1e-9 { force } else { 0.0 };
        nodes.iter().flat_map(|n| [on(n), 0.0, 0.0]).collect()
    };
    let stretch: Vec<f64> = at(0.0, -5.0).iter().zip(at(20.0, 5.0)).map(|(a, b)| a + b).collect();
    release(stretch).0.unwrap();
    let error = release(at(20.0, 5.0)).0.unwrap_err();
    assert!(matches!(error, SimulationError::NothingHolds { share, .. } if share > 0.9), "{error}");
}

/// A free sheet is pressed between plates and the upper one retracted; then the lower one is released while the upper
/// one moves by `motion`. Final position of the sheet, and whether it was unconstrained in that stage.
fn release_while(motion: Motion) -> (Vec3, bool) {
    let mesh = rectangle(20.0, 2.0, 1.0, 10, 1, 1);
    let held = Constraints::none(mesh.nodes.len());
    let tools = vec![plate("below", 0.0, true, 0.2), plate("above", 1.0, false, 0.2)];
    let up = |to: f64| Motion::Travel(Curve::to(to));
    let stages = vec![
        stage("press", vec![Motion::Hold, up(0.01)], 0.5),
        stage("lift", vec![Motion::Hold, up(-3.0)], 0.5),
        stage("let go", vec![Motion::Release, motion], 0.25),
    ];
    let (mut moved, mut free) = (Vec3::zeros(), true);
    let mut see = |r: &IncrementReport<'_>| {
        let all = r.displacements.chunks_exact(3).map(Vec3::from_column_slice);
        moved = all.fold(Vec3::zeros(), |far, u| if u.norm() > far.norm() { u } else { far });
        free = r.stage < 2 || (free && r.free);
        Control::Continue
    };
    Simulation::new(setup(body(mesh, steel()), held, tools, stages))
        .unwrap()
        .run(&mut see)
        .unwrap();
    (moved, free)
}

/// The matrix of an unconstrained sheet is singular: a retracting tool must not count as its support.
#[test]
fn a_retracting_tool_does_not_hold_a_released_sheet() {
    let away = Motion::Travel(Curve::to(-20.0));
    let slack = Motion::Spring { force: Curve::to(-30.0), stiffness: 5.0 };
    for motion in [away, Motion::Advance(Curve::to(-0.001)), slack] {
        let (moved, free) = release_while(motion.clone());
        assert!(free && moved.norm() < 0.01, "{motion:?}: {moved}");
    }
}

#[test]
fn an_approaching_tool_carries_a_released_sheet() {
    let (moved, free) = release_while(Motion::Travel(Curve::to(2.0)));
    assert!(!free && (moved - Vec3::new(0.0, 0.0, -2.0)).norm() < 0.02, "{moved}");
}

/// A block of 10 mm is held under a face 4.4 mm above it, with a wall that descends from its end at `wall` [mm];
/// `motion` moves the face onto the block with friction. Force, and the relative energy error.
fn under_a_cap(wall: f64, motion: Motion, first_step: f64) -> Result<[f64; 2], SimulationError> {
    let mesh = rectangle(10.0, 2.0, 1.0, 10, 2, 1);
    let mut held = Constraints::none(mesh.nodes.len());
    for node in (0..mesh.nodes.len()).filter(|&node| mesh.nodes[node].z < 1e-9) {
        (0..3).for_each(|axis| held.hold(node, axis));
    }
    let face = |u: f64, v: f64| Vec3::new(-5.0 + (wall + 5.0) * u, 20.0 * v - 9.0, 5.4);
    let side = |u: f64, v: f64| Vec3::new(wall, 20.0 * v - 9.0, 5.4 - 5.0 * u);
    let cap = Builder::new("cap").grid(2, 2, |u, v| (face(u, v), -Vec3::z()));
    let cap = cap.grid(2, 2, |u, v| (side(u, v), -Vec3::x())).build();
    let tools = vec![tool("cap", cap, -Vec3::z(), SheetSide::Top, 0.1)];
    let setup =
        setup(body(mesh, steel()), held, tools, vec![stage("press", vec![motion], first_step)]);
    let mut found = [0.0; 2];
    let mut see = |r: &IncrementReport<'_>| {
        let e = &r.energies;
        found = [r.tools[0].force, (e.external - e.internal - e.friction) / e.external.max(1e-9)];
        Control::Continue
    };
    Simulation::new(setup)?.run(&mut see)?;
    Ok(found)
}

/// The slip must not be measured from the wall, which was closer to the initial position of the nodes than the face.
#[test]
fn friction_after_an_approach_uses_the_slip_on_the_contacted_face() {
    let down = || Motion::Travel(Curve::to(4.41));
    let [slow, _] = under_a_cap(13.0, down(), 0.02).unwrap();
    let [fast, lacks] = under_a_cap(13.0, down(), 1.0).unwrap();
    assert!((fast / slow - 1.0).abs() < 0.01 && lacks.abs() < 1e-3, "{fast} {slow} {lacks}");
}

/// A wall beside the sheet is closer than the face ahead, but exerts no force.
#[test]
fn a_force_moves_a_face_past_the_walls_beside_it() {
    for wall in [13.0, 10.4, 10.05] {
        let [force, _] = under_a_cap(wall, Motion::Force(Curve::to(20.0)), 0.5).unwrap();
        assert!((force - 20.0).abs() < 1e-6, "{force} with a wall at {wall}");
    }
}

/// Nodes on springs lie inside the tool, and a chord of their path crosses it: neither is a crossing.
#[test]
fn a_tool_retracted_in_one_step_is_no_crossing() {
    let stages = |first| {
        let to = |to: f64| vec![Motion::Travel(Curve::to(to))];
        vec![stage("push", to(AWAY + 0.3), 1.0), stage("back", to(0.0), first)]
    };
    let mut pushed = cantilever(Motion::Hold, 0.1);
    pushed.limits.contact = ContactMethod::Penalty { stiffness: 10.0 };
    pushed.stages = stages(1.0);
    let mut last = 0.0;
    let mut see = |r: &IncrementReport<'_>| {
        last = r.tools[0].force;
        Control::Continue
    };
    let summary = Simulation::new(pushed).unwrap().run(&mut see).unwrap();
    assert!(summary.cuts == 0 && last == 0.0, "{summary:?} {last}");
}

/// The lower borders of the walls around the sheet are closer than the face.
#[test]
fn a_tool_whose_walls_surround_the_sheet_is_placed_on_its_face() {
    let mesh = rectangle(10.0, 10.0, 1.0, 10, 10, 1);
    for room in [0.4, 0.02] {
        let (low, high) = (-room, 10.0 + room);
        let at = |u: f64| low + (high - low) * u;
        let face =
            Builder::new("cap").grid(2, 2, |u, v| (Vec3::new(at(u), at(v), 30.0), -Vec3::z()));
        let with = |b: Builder, x: f64, n: f64| {
            b.grid(2, 2, move |u, v| (Vec3::new(x, at(u), 30.0 - 20.0 * v), n * Vec3::x()))
        };
        let walls = with(with(face, low, 1.0), high, -1.0);
        let across = |b: Builder, y: f64, n: f64| {
            b.grid(2, 2, move |u, v| (Vec3::new(at(u), y, 30.0 - 20.0 * v), n * Vec3::y()))
        };
        let cap = across(across(walls, low, 1.0), high, -1.0).build();
        let mut cap = tool("cap", cap, -Vec3::z(), SheetSide::Top, 0.0);
        cap.placement = Placement::Touch;
        let held = Constraints::none(mesh.nodes.len());
        let mut setup = setup(
            body(mesh.clone(), steel()),
            held,
            vec![cap],
            vec![stage("wait", vec![Motion::Hold], 1.0)],
        );
        setup.place().unwrap();
        assert!((setup.tools[0].offset.z + 29.0).abs() < 1e-9, "{}", setup.tools[0].offset);
    }
}

/// A closed rod thinner than a step: nodes inside would be projected onto its back.
#[test]
fn a_rod_does_not_cross_nodes() {
    let rod = |u: f64, v: f64| {
        let (sin, cos) = (std::f64::consts::TAU * u).sin_cos();
        let normal = Vec3::new(sin, 0.0, -cos);
        let middle = Vec3::new(18.0, 60.0 * v - 20.0, 3.5);
        (middle + 2.0 * normal, normal)
    };
    let pushed = |first: f64| {
        let mut setup = cantilever(Motion::Travel(Curve::to(6.0)), first);
        let model = Builder::new("rod").grid(32, 1, rod).build();
        setup.tools = vec![tool("rod", model, -Vec3::z(), SheetSide::Top, 0.0)];
        end(setup).0[1]
    };
    let (slow, fast) = (pushed(0.02), pushed(0.6));
    assert!(slow > 10.0 && (fast / slow - 1.0).abs() < 1e-3, "{slow} {fast}");
}

/// A half-round pin with an open back, in steps longer than its depth: the closest point of a node inside is on its
/// border.
#[test]
fn a_pin_with_an_open_back_does_not_cross_the_sheet() {
    // In elements longer than a step.
    let mut pushed = cantilever(Motion::Travel(Curve::to(6.0)), 0.6);
    let mesh = rectangle(20.0, 5.0, 1.0, 10, 1, 1);
    let mut held = Constraints::none(mesh.nodes.len());
    for node in (0..mesh.nodes.len()).filter(|&node| mesh.nodes[node].x < 1e-9) {
        (0..3).for_each(|axis| held.hold(node, axis));
    }
    (pushed.body, pushed.constraints) = (body(mesh, steel()), held);
    let on = |u: f64, v: f64| {
        let (sin, cos) = (2.9 * (u - 0.5)).sin_cos();
        let normal = Vec3::new(sin, 0.0, -cos);
        (Vec3::new(18.0, 0.0, 4.0) + 3.0 * normal + Vec3::new(0.0, 60.0 * v - 20.0, 0.0), normal)
    };
    let pin = Builder::new("pin").grid(16, 1, on).build();
    pushed.tools = vec![tool("pin", pin, -Vec3::z(), SheetSide::Top, 0.0)];
    let (found, _) = end(pushed);
    assert!(found[1] > 10.0, "{found:?}");
}
