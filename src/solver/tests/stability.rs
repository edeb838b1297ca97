//! Unstable equilibria: columns, which buckle at Euler's load, and the effect of long steps.

use super::carried::along_y;
use super::{setup, stage, steel, tool};
use crate::assembly::Body;
use crate::element::ElementKind;
use crate::material::card::MaterialCard;
use crate::sheet::hex_mesh::{HexMesh, rectangle};
use crate::test_tools::{arc, plane};
use crate::{
    Constraints, Control, Curve, IncrementReport, Motion, SheetSide, Simulation, SimulationSetup,
};
use kanagata_geometry::Vec3;

const LENGTH: f64 = 60.0;

/// A column of section 1 by 1 that bends only about y, in plane strain.
fn column() -> (HexMesh, Constraints) {
    let mesh = rectangle(LENGTH, 1.0, 1.0, 60, 1, 1);
    let mut constraints = Constraints::none(mesh.nodes.len());
    (0..mesh.nodes.len()).for_each(|node| constraints.hold(node, 1));
    (mesh, constraints)
}

fn body(mesh: HexMesh) -> Body {
    Body::new(mesh, ElementKind::SolidShell { points: 3, membrane: true }, steel()).unwrap()
}

/// Euler load of a column of this length between hinges [N].
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

/// Result of a clamped column.
struct Clamped {
    /// Load of unstable increments, and of those with a perturbation, in thousandths of Euler's load.
    unstable: Vec<usize>,
    buckled: Vec<usize>,
    /// Lateral deflection of its end [mm].
    aside: f64,
}

/// A column clamped at one end under a load on the other that rises to 1.5 times Euler's load (for twice the length
/// between hinges) in `steps`, and a lateral load.
fn clamped(across: f64, steps: usize) -> Clamped {
    let (mesh, mut constraints) = column();
    constraints.symmetry_plane(&mesh.nodes, 0, 0.0, 1e-9);
    (0..mesh.nodes.len()).filter(|&n| mesh.nodes[n].x < 1e-9).for_each(|n| constraints.hold(n, 2));
    let end = (0..mesh.nodes.len()).find(|&n| mesh.nodes[n].x > LENGTH - 1e-9).unwrap();
    let loads = loads_at(&mesh, LENGTH, Vec3::new(-1.5 * euler(2.0 * LENGTH), 0.0, across));
    let mut load = stage("load", Vec::new(), 1.0 / steps as f64);
    load.load = Curve::ramp(0.0, 1.0);
    load.largest_step = load.first_step;
    let setup = SimulationSetup { loads, ..setup(body(mesh), constraints, Vec::new(), vec![load]) };
    let mut done = Clamped { unstable: Vec::new(), buckled: Vec::new(), aside: 0.0 };
    let mut before = [0; 2];
    let mut sim = Simulation::new(setup).unwrap();
    sim.run(&mut |r: &IncrementReport<'_>| {
        let at = (1500.0 * r.share).round() as usize;
        done.unstable.extend((r.unstable > before[0]).then_some(at));
        done.buckled.extend((r.buckles > before[1]).then_some(at));
        (before, done.aside) = ([r.unstable, r.buckles], r.displacements[3 * end + 2]);
        Control::Continue
    })
    .unwrap();
    done
}

/// Without lateral load a straight column buckles at Euler's load (within a hundredth), towards its top, and follows
/// the elastica, whose end is deflected by 0.79 of the length at 1.5 times that load.
#[test]
fn a_straight_column_buckles_at_eulers_load() {
    for (steps, latest) in [(300, 1010), (15, 1100)] {
        let Clamped { unstable, buckled, aside } = clamped(0.0, steps);
        assert!(unstable.is_empty(), "{unstable:?}");
        assert!(buckled.len() == 1 && (1000..=latest).contains(&buckled[0]), "{buckled:?}");
        assert!((aside / (elastica(1.5) * LENGTH) - 1.0).abs() < 0.02, "{steps}: {aside}");
    }
}

/// Comparison with the elastica.
#[test]
fn a_column_with_a_lateral_load_buckles_to_its_side() {
    for across in [1e-3, -1e-3] {
        let Clamped { unstable, buckled, aside } = clamped(across, 15);
        assert!(unstable.is_empty() && buckled.is_empty(), "{unstable:?} {buckled:?}");
        let expected = across.signum() * elastica(1.5) * LENGTH;
        assert!((aside / expected - 1.0).abs() < 0.02, "{aside} {expected}");
    }
}

/// Lateral deflection of the end of a clamped elastica over its length, at this load over Euler's:
/// `K(p) = pi/2 sqrt(load)`, then `2 p / K`.
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

/// A column shortened by 1 mm between two walls that hold its ends by friction, with this lateral load at its middle:
/// force of a wall, lateral deflection at the middle, unstable increments, and work of the walls [N mm].
fn between_walls(across: f64, first_step: f64) -> (f64, f64, usize, f64) {
    let (mesh, constraints) = column();
    let middle = (0..mesh.nodes.len()).find(|&n| (mesh.nodes[n].x - 30.0).abs() < 1e-9).unwrap();
    let loads = loads_at(&mesh, 30.0, Vec3::z() * across);
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
    let mut last = (0.0, 0.0, 0, 0.0);
    sim.run(&mut |r: &IncrementReport<'_>| {
        last = (r.tools[0].force, r.displacements[3 * middle + 2], r.unstable, r.energies.external);
        Control::Continue
    })
    .unwrap();
    last
}

/// Force of a column between walls with this lateral deflection [N]: Euler's load for hinges at the edges of its
/// ends, half its thickness off its axis, minus the effect of a lateral load at its middle (both by their first
/// harmonic), plus the second term of the elastica.
fn closed_form(across: f64, aside: f64) -> f64 {
    let pi = std::f64::consts::PI;
    let euler = euler(LENGTH) * (1.0 + pi * pi / 8.0 * (aside / LENGTH).powi(2));
    (euler * aside - across * 2.0 * LENGTH / (pi * pi)) / (aside - 4.0 / pi * 0.5)
}

/// Its first step alone is 3000 N beyond Euler's load. A long step must not end on the unstable branch, on which the
/// column is deflected against its load or, without one, straight.
#[test]
fn a_column_between_walls_buckles_however_long_the_steps() {
    for across in [1.0, 0.0] {
        let fine = between_walls(across, 0.005);
        let coarse = between_walls(across, 0.1);
        for (force, aside, unstable, work) in [fine, coarse] {
            // By the trapezoidal rule from step to step; the sheet is perturbed slightly beyond its buckling load.
            assert!((work / fine.3 - 1.0).abs() < 0.04, "{work} {}", fine.3);
            assert!(aside > 3.0 && unstable == 0, "{fine:?} {coarse:?}");
            assert!((force / closed_form(across, aside) - 1.0).abs() < 0.01, "{force} {aside}");
        }
        assert!((fine.0 / coarse.0 - 1.0).abs() < 1e-5, "{fine:?} {coarse:?}");
    }
}

/// A strut of 100 x 10 x 4 mm with one end in a symmetry plane and the other against a flat wall that moves by 1 mm,
/// of a metal that yields at 150 MPa and hardens with 10 % of its stiffness. Steps of 1 / `steps`, a lateral load at
/// its middle. Largest and final force [N], perturbations and unstable equilibria.
fn strut(steps: usize, across: f64) -> ([f64; 2], [usize; 2]) {
    let card: MaterialCard = serde_json::from_str(
        r#"{"name": "bilinear", "young_mpa": 200000.0, "poisson": 0.3, "yield": {"criterion": "von-mises"},
            "hardening": {"law": "ludwik", "sigma0": 150.0, "k": 20000.0, "n": 1.0}}"#,
    )
    .unwrap();
    let mesh = rectangle(100.0, 10.0, 4.0, 30, 2, 1);
    let mut constraints = Constraints::none(mesh.nodes.len());
    constraints.symmetry_plane(&mesh.nodes, 0, 0.0, 1e-9);
    for (node, x) in mesh.nodes.iter().enumerate() {
        if x.x.abs() + x.z.abs() < 1e-9 {
            constraints.hold(node, 2);
        }
        if x.y.abs() + x.z.abs() < 1e-9 && (x.x < 1e-9 || x.x > 100.0 - 1e-9) {
            constraints.hold(node, 1);
        }
    }
    let loads = loads_at(&mesh, 50.0, Vec3::z() * across);
    let corner = Vec3::new(100.0, -10.0, -40.0);
    let face = plane("wall", corner, Vec3::y() * 30.0, Vec3::z() * 90.0, -Vec3::x());
    let wall = tool("wall", face, -Vec3::x(), SheetSide::Both, 0.0);
    let mut press = stage("press", vec![Motion::Travel(Curve::ramp(0.0, 1.0))], 1.0 / steps as f64);
    (press.largest_step, press.load) = (press.first_step, Curve::constant(1.0));
    let kind = ElementKind::SolidShell { points: 5, membrane: true };
    let body = Body::new(mesh, kind, card.build(0.0).unwrap()).unwrap();
    let setup = SimulationSetup { loads, ..setup(body, constraints, vec![wall], vec![press]) };
    let (mut forces, mut counts) = ([0.0; 2], [0; 2]);
    let mut sim = Simulation::new(setup).unwrap();
    sim.run(&mut |r: &IncrementReport<'_>| {
        forces = [r.tools[0].force.max(forces[0]), r.tools[0].force];
        counts = [r.buckles, r.unstable];
        Control::Continue
    })
    .unwrap();
    (forces, counts)
}

/// No straight strut of this length is stable beyond yield (by its tangent modulus at 45 MPa, elastically at 165):
/// 6000 N.
#[test]
fn a_straight_strut_buckles_where_it_yields_however_long_the_steps() {
    let ([_, bent], _) = strut(100, 1.0);
    for steps in [5, 20, 100] {
        let ([largest, end], [buckles, unstable]) = strut(steps, 0.0);
        assert!((0.97..1.01).contains(&(largest / 6000.0)), "{steps}: {largest}");
        assert!(buckles == 1 && unstable == 0, "{steps}: {buckles} {unstable}");
        assert!((end / bent - 1.0).abs() < 0.03, "{steps}: {end} {bent}");
    }
}

/// A strip of 200 x 40 x 1.5 mm on two rolls of radius 15 mm 120 mm apart, bent by 25 mm by a punch of radius 20 mm
/// at its middle, with a load along it at one node [N]: increments, cuts, unstable equilibria, perturbations, and
/// final force of the punch [N].
fn bent_on_rolls(friction: f64, along: f64) -> ([usize; 4], f64) {
    let card: MaterialCard = serde_json::from_str(
        r#"{"name": "bilinear", "young_mpa": 210000.0, "poisson": 0.3, "yield": {"criterion": "von-mises"},
            "hardening": {"law": "table", "strain": [0.0, 1.0], "stress": [235.0, 1441.9]}}"#,
    )
    .unwrap();
    let mut mesh = rectangle(200.0, 40.0, 1.5, 80, 1, 1);
    mesh.nodes.iter_mut().for_each(|x| x.x -= 100.0);
    let mut constraints = Constraints::none(mesh.nodes.len());
    (0..mesh.nodes.len()).for_each(|node| constraints.hold(node, 1));
    let middle = mesh.nodes.iter().position(|x| x.x.abs() < 1e-9).unwrap();
    let mut loads = vec![0.0; 3 * mesh.nodes.len()];
    loads[3 * middle] = along;
    let quarter = std::f64::consts::FRAC_PI_2;
    let roll = |x: f64| [arc(16, [x, -15.0], 15.0, [2.0 * quarter, 0.0], 1.0)];
    let punch = [arc(16, [0.0, 21.5], 20.0, [-2.0 * quarter, 0.0], 1.0)];
    let tools = vec![
        tool("punch", along_y("punch", &punch), -Vec3::z(), SheetSide::Top, friction),
        tool("right", along_y("right", &roll(60.0)), Vec3::z(), SheetSide::Bottom, friction),
        tool("left", along_y("left", &roll(-60.0)), Vec3::z(), SheetSide::Bottom, friction),
    ];
    let down = Motion::Travel(Curve::ramp(0.0, 25.0));
    let mut press = stage("press", vec![down, Motion::Hold, Motion::Hold], 0.05);
    (press.largest_step, press.load) = (0.1, Curve::constant(1.0));
    let kind = ElementKind::SolidShell { points: 7, membrane: true };
    let body = Body::new(mesh, kind, card.build(0.0).unwrap()).unwrap();
    let setup = SimulationSetup {
        loads,
        limits: crate::Limits::default(),
        ..setup(body, constraints, tools, vec![press])
    };
    let mut sim = Simulation::new(setup).unwrap();
    let mut found = ([0; 4], 0.0);
    sim.run(&mut |r: &IncrementReport<'_>| {
        found = ([r.increment, r.cuts, r.unstable, r.buckles], r.tools[0].force);
        Control::Continue
    })
    .unwrap();
    found
}

/// A strip on rolls has almost no stiffness along itself, of either sign; friction on the rolls keeps it from sliding
/// through.
#[test]
fn a_strip_held_by_friction_does_not_buckle() {
    for friction in [0.05, 0.12, 0.3] {
        let ([increments, _, unstable, buckles], force) = bent_on_rolls(friction, 0.0);
        let ([with_load, ..], other) = bent_on_rolls(friction, 0.05);
        assert!(unstable == 0 && buckles == 0, "{friction}: {unstable} and {buckles}");
        assert!(increments <= with_load + 1, "{friction}: {increments} and {with_load}");
        assert!((force / other - 1.0).abs() < 1e-2, "{friction}: {force} and {other}");
    }
}

/// Without friction the strip slides through at no cost, except for the effect of contact at nodes: this is no
/// buckling. The force of the punch is that of a strip which a small load moves along.
#[test]
fn a_strip_without_friction_slides_and_does_not_buckle() {
    let ([increments, cuts, unstable, buckles], force) = bent_on_rolls(0.0, 0.0);
    let (_, other) = bent_on_rolls(0.01, 0.0);
    assert!(unstable + buckles == 0, "{unstable}, {buckles}, {cuts}");
    assert!(increments <= 12, "{increments}");
    assert!((force / other - 1.0).abs() < 0.05, "{force} and {other}");
}

/// A strip of 40 mm on top of a roll of this radius [mm], without friction and with weights of 0.5 N at its two ends,
/// slides off with a stiffness of -1 N over the radius: whether its equilibrium is stable.
fn lies_on_a_roll(radius: f64) -> bool {
    let mut mesh = rectangle(40.0, 4.0, 1.0, 40, 1, 1);
    mesh.nodes.iter_mut().for_each(|x| x.x -= 20.0);
    let mut constraints = Constraints::none(mesh.nodes.len());
    (0..mesh.nodes.len()).for_each(|node| constraints.hold(node, 1));
    let loads = [-20.0, 20.0].map(|at| loads_at(&mesh, at, Vec3::z() * -0.5));
    let loads = loads[0].iter().zip(&loads[1]).map(|(a, b)| a + b).collect();
    let quarter = std::f64::consts::FRAC_PI_2;
    let roll = [arc(64, [0.0, -radius], radius, [2.0 * quarter, 0.0], 1.0)];
    let roll = tool("roll", along_y("roll", &roll), Vec3::z(), SheetSide::Bottom, 0.0);
    let mut rest = stage("rest", vec![Motion::Hold], 0.5);
    rest.load = Curve::constant(1.0);
    let setup = SimulationSetup {
        loads,
        limits: crate::Limits::default(),
        ..setup(body(mesh), constraints, vec![roll], vec![rest])
    };
    let mut unstable = 0;
    let mut sim = Simulation::new(setup).unwrap();
    sim.run(&mut |r: &IncrementReport<'_>| {
        unstable = r.unstable;
        Control::Continue
    })
    .unwrap();
    unstable == 0
}

/// Weights release potential energy: the position is unstable, though nothing buckles.
#[test]
fn a_strip_with_weights_slides_off_a_roll() {
    assert!([10.0, 100.0].iter().all(|radius| !lies_on_a_roll(*radius)));
}
