//! Balances that do not last: columns, which buckle at Euler's load, and what long steps make of them.

use super::{setup, stage, steel, tool};
use crate::contact::test_tools::plane;
use crate::geometry::Vec3;
use crate::solver::assembly::Body;
use crate::solver::blank::{HexMesh, rectangle};
use crate::solver::element::ElementKind;
use crate::solver::{
    Constraints, Control, Curve, IncrementReport, Motion, SheetSide, Simulation, SimulationSetup,
};

const LENGTH: f64 = 60.0;

/// A column of section 1 by 1 that bends about y alone, as wide as plane strain has it.
fn column() -> (HexMesh, Constraints) {
    let mesh = rectangle(LENGTH, 1.0, 1.0, 60, 1, 1);
    let mut constraints = Constraints::none(mesh.nodes.len());
    (0..mesh.nodes.len()).for_each(|node| constraints.hold(node, 1));
    (mesh, constraints)
}

fn body(mesh: HexMesh) -> Body {
    Body::new(mesh, ElementKind::SolidShell { points: 3, membrane: true }, steel()).unwrap()
}

/// Euler's load of a column of this length between hinges [N].
fn euler(length: f64) -> f64 {
    let stiffness = 210_000.0 / (1.0 - 0.3 * 0.3) / 12.0;
    stiffness * (std::f64::consts::PI / length).powi(2)
}

fn loads_at(mesh: &HexMesh, at: f64, force: Vec3) -> Vec<f64> {
    let there: Vec<usize> =
        (0..mesh.nodes.len()).filter(|&n| (mesh.nodes[n].x - at).abs() < 1e-9).collect();
    let mut loads = vec![0.0; 3 * mesh.nodes.len()];
    for node in &there {
        (0..3).for_each(|k| loads[3 * node + k] = force[k] / there.len() as f64);
    }
    loads
}

/// A column clamped at one end under a load on the other that rises to 1.5 times Euler's (twice the length between hinges)
/// in so many steps, and a load across it; increments that did not last, and how far its end went aside.
fn clamped(across: f64, steps: usize) -> (Vec<usize>, f64) {
    let (mesh, mut constraints) = column();
    constraints.symmetry_plane(&mesh.nodes, 0, 0.0, 1e-9);
    (0..mesh.nodes.len()).filter(|&n| mesh.nodes[n].x < 1e-9).for_each(|n| constraints.hold(n, 2));
    let end = (0..mesh.nodes.len()).find(|&n| mesh.nodes[n].x > LENGTH - 1e-9).unwrap();
    let loads = loads_at(&mesh, LENGTH, Vec3::new(-1.5 * euler(2.0 * LENGTH), 0.0, across));
    let mut load = stage("load", Vec::new(), 1.0 / steps as f64);
    load.load = Curve::ramp(0.0, 1.0);
    load.largest_step = load.first_step;
    let setup = SimulationSetup { loads, ..setup(body(mesh), constraints, Vec::new(), vec![load]) };
    let (mut unstable, mut aside, mut before) = (Vec::new(), 0.0, 0);
    let mut sim = Simulation::new(setup).unwrap();
    sim.run(&mut |r: &IncrementReport<'_>| {
        if r.unstable > before {
            unstable.push((1500.0 * r.share).round() as usize);
        }
        (before, aside) = (r.unstable, r.displacements[3 * end + 2]);
        Control::Continue
    })
    .unwrap();
    (unstable, aside)
}

/// A straight column stays straight, but lasts no longer from Euler's load on (told within a hundredth of it).
#[test]
fn a_straight_column_does_not_last_above_eulers_load() {
    let (unstable, aside) = clamped(0.0, 300);
    assert!((1000..=1010).contains(&unstable[0]), "{unstable:?}");
    assert!(unstable.len() > 95 && *unstable.last().unwrap() == 1500, "{unstable:?}");
    // What rounding makes of it there grows.
    assert!(aside.abs() < 1e-3, "{aside}");
}

/// The elastica has the end 0.79 of the length aside, at 1.5 times Euler's load (`cos(alpha / 2)` of the tip's angle is the
/// modulus of its elliptic integral).
#[test]
fn a_column_with_a_load_across_buckles_to_the_side_it_is_pushed_to() {
    for across in [1e-3, -1e-3] {
        let (unstable, aside) = clamped(across, 15);
        assert!(unstable.is_empty(), "{unstable:?}");
        let expected = across.signum() * elastica(1.5) * LENGTH;
        assert!((aside / expected - 1.0).abs() < 0.02, "{aside} {expected}");
    }
}

/// How far aside the end of a clamped elastica is, over its length, at this load over Euler's: `K(p) = pi/2 sqrt(load)`,
/// then `2 p / K`.
fn elastica(load: f64) -> f64 {
    let complete = |p: f64| {
        let (mut a, mut b) = (1.0, (1.0 - p * p).sqrt());
        for _ in 0..20 {
            (a, b) = (0.5 * (a + b), f64::sqrt(a * b));
        }
        std::f64::consts::FRAC_PI_2 / a
    };
    let wanted = std::f64::consts::FRAC_PI_2 * load.sqrt();
    let (mut low, mut high) = (0.0, 1.0 - 1e-12);
    for _ in 0..60 {
        let p = 0.5 * (low + high);
        if complete(p) < wanted { low = p } else { high = p }
    }
    2.0 * low / wanted
}

/// A column pressed together by 1 mm between two walls that hold its ends by friction, with a load of 1 N across its middle;
/// force of a wall, how far the middle went aside, and increments that did not last.
fn between_walls(first_step: f64) -> (f64, f64, usize) {
    let (mesh, constraints) = column();
    let middle = (0..mesh.nodes.len()).find(|&n| (mesh.nodes[n].x - 30.0).abs() < 1e-9).unwrap();
    let loads = loads_at(&mesh, 30.0, Vec3::z());
    let wall = |name: &str, x: f64, towards: Vec3| {
        let corner = Vec3::new(x, -1.0, -10.0);
        let face = plane(name, corner, Vec3::y() * 3.0, Vec3::z() * 30.0, towards);
        tool(name, face, towards, SheetSide::Both, 0.3)
    };
    let tools = vec![wall("left", 0.0, Vec3::x()), wall("right", LENGTH, -Vec3::x())];
    let motions = vec![Motion::Hold, Motion::Travel(Curve::ramp(0.0, 1.0))];
    let mut press = stage("press", motions, first_step);
    press.largest_step = 0.1;
    press.load = Curve::constant(1.0);
    let setup = SimulationSetup { loads, ..setup(body(mesh), constraints, tools, vec![press]) };
    let mut sim = Simulation::new(setup).unwrap();
    let mut last = (0.0, 0.0, 0);
    sim.run(&mut |r: &IncrementReport<'_>| {
        last = (r.tools[0].force, r.displacements[3 * middle + 2], r.unstable);
        Control::Continue
    })
    .unwrap();
    last
}

/// Its first step alone is 3000 N beyond Euler's load: a long step must not end on the branch that does not last, on which
/// the column is bent against its load.
#[test]
fn a_column_between_walls_buckles_as_its_load_has_it_however_long_the_steps() {
    let fine = between_walls(0.005);
    let coarse = between_walls(0.1);
    for (force, aside, unstable) in [fine, coarse] {
        assert!(aside > 3.0 && unstable == 0, "{fine:?} {coarse:?}");
        assert!((0.9..1.2).contains(&(force / euler(LENGTH))), "{force}");
    }
    assert!((fine.0 / coarse.0 - 1.0).abs() < 1e-5, "{fine:?} {coarse:?}");
}
