//! Tools driven by force without resistance: limit of their correction, and the first node along their direction.

use super::{body, setup, steel, tool};
use crate::active_set::driven_tools::{keep_pushed_tools, oppose};
use crate::newton::solve::step_length_limit;
use crate::sheet::hex_mesh::rectangle;
use crate::system::correction::Correction;
use crate::system::system::System;
use crate::test_tools::Builder;
use crate::tools::role::Role;
use crate::{Constraints, SheetSide, Simulation};
use kanagata_geometry::Vec3;

/// A sheet descending in steps of 4 mm, one node every 2 mm, and a rod of radius 2 mm pushed down with its axis at x
/// = 8.5, z = 10.
fn rod_over_stairs() -> System {
    let mut mesh = rectangle(20.0, 2.0, 1.0, 10, 1, 1);
    mesh.nodes.iter_mut().for_each(|x| x.z += (2.0 * (10.0 - x.x)).clamp(0.0, 12.0));
    let held = Constraints::none(mesh.nodes.len());
    let on = |u: f64, v: f64| {
        let (sin, cos) = (std::f64::consts::TAU * u).sin_cos();
        let normal = Vec3::new(sin, 0.0, -cos);
        (Vec3::new(8.5, 60.0 * v - 20.0, 10.0) + 2.0 * normal, normal)
    };
    let model = Builder::new("rod").grid(32, 1, on).build();
    let tools = vec![tool("rod", model, -Vec3::z(), SheetSide::Top, 0.0)];
    let mut sys = Simulation::new(setup(body(mesh, steel()), held, tools, Vec::new())).unwrap().sys;
    sys.roles = vec![Role::Force(10.0)];
    sys.search();
    sys
}

/// The node at x = 6 is closest, and the rod passes it.
#[test]
fn a_force_moves_a_tool_to_the_first_node_along_its_direction() {
    let mut sys = rod_over_stairs();
    assert_eq!(keep_pushed_tools(&mut sys), 1);
    let (_, touching) = sys.contact.active().next().unwrap();
    assert!((sys.position(touching.node).x - 8.0).abs() < 1e-9);
    let way = 5.0 - 3.75_f64.sqrt();
    assert!((sys.tools[0].travel - way).abs() < 0.1, "{}", sys.tools[0].travel);
}

/// A node that has slid around an edge touches a wall parallel to the direction of the tool, its only contact.
#[test]
fn a_tool_in_contact_with_a_wall_only_moves_to_the_next_node() {
    let mut sys = rod_over_stairs();
    let beside: Vec<usize> = (0..sys.contact.candidates.len())
        .filter(|&k| (sys.position(sys.contact.candidates[k].node).x - 6.0).abs() < 1e-9)
        .collect();
    for &k in &beside {
        let c = &mut sys.contact.candidates[k];
        (c.active, c.foot.normal) = (true, Vec3::x());
    }
    assert!(oppose(&mut sys) && !oppose(&mut sys));
    let met = sys.contact.active().filter(|(k, _)| !beside.contains(k));
    let at: Vec<f64> = met.map(|(_, c)| sys.position(c.node).x).collect();
    assert!(at.len() == 1 && (at[0] - 8.0).abs() < 1e-9, "{at:?}");
}

/// If the sheet moves with a tool, the pivot of the matrix is rounding: the correction was 3e16 mm, beyond the range
/// of the search.
#[test]
fn a_correction_of_a_tool_is_bounded() {
    let sys = rod_over_stairs();
    let of = |travel: f64| Correction {
        u: vec![0.0; sys.u.len()],
        travels: vec![(0, travel)],
        foretold: Vec::new(),
    };
    assert!(step_length_limit(&sys, &of(-3e16)) * 3e16 < 50.0 * sys.lengths.longest_edge);
    assert!((step_length_limit(&sys, &of(10.0)) - 1.0).abs() < 1e-15);
}
