//! Tools that come to the sheet in one step from afar, by travel or by force, and tools that stand clear of it.

use super::{body, setup, stage, steel, tool};
use crate::contact::test_tools::{Builder, plane};
use crate::geometry::Vec3;
use crate::solver::blank::rectangle;
use crate::solver::{
    Constraints, Control, Curve, IncrementReport, Motion, SheetSide, Simulation, SimulationError,
    SimulationSetup, Stage, ToolSetup,
};

/// How far above the sheet the plate begins [mm]: some elements.
const AWAY: f64 = 9.0;

fn plate(name: &str, z: f64, up: bool, mu: f64) -> ToolSetup {
    let along = if up { Vec3::z() } else { -Vec3::z() };
    let model = plane(name, Vec3::new(-20.0, -20.0, z), 60.0 * Vec3::x(), 60.0 * Vec3::y(), along);
    tool(name, model, along, if up { SheetSide::Bottom } else { SheetSide::Top }, mu)
}

/// A strip of 20 x 2 x 1 mm held at one end, and a plate above its other end that moves as `motion` says.
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

/// Travel and force of the plate at the end, and increments.
fn end(setup: SimulationSetup) -> ([f64; 2], usize) {
    let mut last = [0.0; 2];
    let mut see = |r: &IncrementReport<'_>| {
        last = [r.tools[0].travel, r.tools[0].force];
        Control::Continue
    };
    let summary = Simulation::new(setup).unwrap().run(&mut see).unwrap();
    (last, summary.increments)
}

/// Elements are 2 mm long; the plate comes 9 mm through the air and goes 6 mm on.
#[test]
fn a_tool_that_comes_in_one_step_meets_the_sheet() {
    let down = || Motion::Travel(Curve::to(AWAY + 6.0));
    let (slow, _) = end(cantilever(down(), 0.02));
    let (fast, _) = end(cantilever(down(), 1.0));
    assert!(slow[1] > 10.0, "{slow:?}");
    assert!((fast[1] / slow[1] - 1.0).abs() < 1e-6, "{fast:?} {slow:?}");
}

/// Both faces of a slab 3 mm thick, which a step of 15 mm takes clean through the sheet: a balance without a force, on the
/// wrong side.
#[test]
fn a_slab_is_not_taken_through_the_sheet_in_one_step() {
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
fn a_tool_moved_by_force_comes_from_afar() {
    let (found, _) = end(cantilever(Motion::Force(Curve::to(10.0)), 0.25));
    assert!((found[1] - 10.0).abs() < 1e-6 && found[0] > AWAY + 0.1, "{found:?}");
}

#[test]
fn a_tool_moved_by_force_past_the_sheet_says_so() {
    let mut setup = cantilever(Motion::Force(Curve::to(10.0)), 0.25);
    setup.tools[0].offset = Vec3::new(0.0, 500.0, 0.0);
    let error = Simulation::new(setup).unwrap().run(&mut |_| Control::Continue).unwrap_err();
    let said = error.to_string();
    assert!(said.contains("nothing to push against") && said.contains("`plate`"), "{said}");
}

/// A free sheet pressed between two plates with `mu`; the upper one goes back up, the lower one is let go while the upper one
/// stays where it is; `loads` then.
fn let_go(loads: Vec<f64>) -> (Result<(), SimulationError>, Vec<(bool, f64)>) {
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
fn a_tool_that_stands_clear_does_not_hold_a_sheet_that_is_let_go() {
    let (done, seen) = let_go(Vec::new());
    done.unwrap();
    let last = seen.last().unwrap();
    assert!(last.0 && last.1 < 0.01, "{seen:?}");
    assert!(seen.iter().any(|(free, _)| !free));
}

#[test]
fn loads_on_a_sheet_that_nothing_holds_must_balance() {
    let nodes = rectangle(20.0, 2.0, 1.0, 10, 1, 1).nodes;
    let at = |x: f64, force: f64| -> Vec<f64> {
        let on = |n: &Vec3| if (n.x - x).abs() < 1e-9 { force } else { 0.0 };
        nodes.iter().flat_map(|n| [on(n), 0.0, 0.0]).collect()
    };
    let stretch: Vec<f64> = at(0.0, -5.0).iter().zip(at(20.0, 5.0)).map(|(a, b)| a + b).collect();
    let_go(stretch).0.unwrap();
    let error = let_go(at(20.0, 5.0)).0.unwrap_err();
    assert!(matches!(error, SimulationError::NothingHolds { share, .. } if share > 0.9), "{error}");
}
