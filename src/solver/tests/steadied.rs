//! Active-set cycling: a strip that buckles from wall to wall.

use super::{setup, stage, steel, tool};
use crate::assembly::Body;
use crate::element::ElementKind;
use crate::sheet::hex_mesh::rectangle;
use crate::test_tools::plane;
use crate::{
    Constraints, Control, Curve, IncrementReport, Motion, SheetSide, Simulation, SimulationSetup,
};
use kanagata_geometry::Vec3;

const LENGTH: f64 = 60.0;
const THICKNESS: f64 = 0.2;
const FORCE: f64 = 60.0;

/// A strip clamped at x = 0 and guided at its other end, where it is loaded by 60 N (35 times its buckling load)
/// between two walls at the given distance.
fn squeezed(elements: usize, room: f64, friction: f64) -> Simulation {
    let mut mesh = rectangle(LENGTH, 1.0, THICKNESS, elements, 1, 1);
    let flat = mesh.nodes.clone();
    let count = flat.len();
    let mut constraints = Constraints::none(count);
    let mut loads = vec![0.0; 3 * count];
    let end: Vec<usize> = (0..count).filter(|&n| flat[n].x > LENGTH - 1e-9).collect();
    for (node, x) in flat.iter().enumerate() {
        mesh.nodes[node].z += 0.01 * (1.0 - (std::f64::consts::TAU * x.x / LENGTH).cos());
        constraints.hold(node, 1);
        if x.x < 1e-9 {
            (0..3).for_each(|axis| constraints.hold(node, axis));
        }
    }
    for &node in &end {
        constraints.hold(node, 2);
        loads[3 * node] = -FORCE / end.len() as f64;
    }
    let [along, across] = [Vec3::x() * (LENGTH + 4.0), Vec3::y() * 3.0];
    let corner = |z: f64| Vec3::new(-2.0, -1.0, z);
    let up = plane("lower", corner(-room), along, across, Vec3::z());
    let down = plane("upper", corner(THICKNESS + room), along, across, -Vec3::z());
    let tools = vec![
        tool("lower", up, Vec3::z(), SheetSide::Bottom, friction),
        tool("upper", down, -Vec3::z(), SheetSide::Top, friction),
    ];
    let mut push = stage("push", vec![Motion::Hold, Motion::Hold], 0.02);
    push.load = Curve::ramp(0.0, 1.0);
    push.largest_step = 0.02;
    let kind = ElementKind::SolidShell { points: 3, membrane: true };
    let body = Body::new(mesh, kind, steel()).unwrap();
    let setup = SimulationSetup { loads, ..setup(body, constraints, tools, vec![push]) };
    let mut sim = Simulation::new(setup).unwrap();
    sim.run(&mut |_: &IncrementReport<'_>| Control::Continue).unwrap();
    sim
}

/// Largest residual force of a node not carried by a wall or a support [N].
fn unbalanced(sim: &Simulation) -> f64 {
    let sys = &sim.sys;
    let touches = |node: usize| sys.contact.active().any(|(_, c)| c.node == node);
    let free = (0..sys.node_count()).filter(|&node| !touches(node));
    free.map(|node| (sys.constraints.free_projector(node) * sys.force_at(node)).norm())
        .fold(0.0, f64::max)
}

fn all_cases_requested() -> bool {
    std::env::var_os("KANAGATA_STRIPS").is_some()
}

/// Elements, room and friction of the cases; with `KANAGATA_STRIPS` all cases of docs/results/solver.md.
fn cases() -> Vec<(usize, f64, f64)> {
    if !all_cases_requested() {
        return vec![(40, 0.05, 0.05), (40, 0.25, 0.2), (70, 0.1, 0.0)];
    }
    let rooms = |elements| [0.05, 0.1, 0.25].map(move |room| (elements, room));
    let strips = [40, 70].into_iter().flat_map(rooms);
    strips.flat_map(|(n, room)| [0.0, 0.05, 0.2].map(move |mu| (n, room, mu))).collect()
}

/// Nodes in contact are in tension, and penetrate when released, wherever a wave of the strip is about to snap
/// through. These three cases need viscous stabilisation: shorter steps or a viscous motion from the last equilibrium
/// do not suffice.
#[test]
fn a_strip_buckles_from_wall_to_wall() {
    for (elements, room, friction) in cases() {
        let sim = squeezed(elements, room, friction);
        let summary = sim.summary();
        println!("{elements} elements, room {room}, friction {friction}: {summary:?}");
        assert!(summary.stabilised >= 4, "{summary:?}");
        // Step cuts after unstable equilibria are a considerable part of them.
        assert!(summary.iterations < 3000, "{summary:?}");
        assert!(summary.unstable == 0 || all_cases_requested(), "{summary:?}");
        assert!(!sim.sys.regime.is_stabilised());
        assert!(unbalanced(&sim) < 1e-6 * FORCE, "{} N", unbalanced(&sim));
        let pushed = |(k, _): (usize, _)| sim.sys.lambda(k);
        let least = sim.sys.contact.active().map(pushed).fold(f64::INFINITY, f64::min);
        assert!(least > -1e-6 * FORCE, "pulled with {least} N");
        let inside = |x: &Vec3| x.z > -room - 1e-6 && x.z < THICKNESS + room + 1e-6;
        assert!((0..sim.sys.node_count()).all(|node| inside(&sim.sys.position(node))));
    }
}
