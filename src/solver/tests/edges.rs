//! Sheets that overhang a tool edge, and sheets that do not.

use super::{body, setup, stage, steel, tool};
use crate::active_set::over_edge::OverEdge;
use crate::sheet::hex_mesh::rectangle;
use crate::test_tools::plane;
use crate::{
    Constraints, Control, Curve, IncrementReport, Motion, SheetSide, Simulation, SimulationSetup,
};
use kanagata_geometry::Vec3;

/// A strip of 60 x 4 x 1 mm, clamped at one end, on a table that ends at `end`; its other end is loaded by 100 N
/// downwards, or upwards.
fn over_table(end: f64, down: f64) -> Option<OverEdge> {
    let mesh = rectangle(60.0, 4.0, 1.0, 30, 1, 1);
    let mut constraints = Constraints::none(mesh.nodes.len());
    let (mut loads, mut tip) = (vec![0.0; 3 * mesh.nodes.len()], Vec::new());
    for (node, x) in mesh.nodes.iter().enumerate() {
        if x.x < 1e-9 {
            (0..3).for_each(|axis| constraints.hold(node, axis));
        } else if x.x > 60.0 - 1e-9 {
            tip.push(node);
        }
    }
    tip.iter().for_each(|node| loads[3 * node + 2] = -down * 25.0);
    let corner = Vec3::new(-5.0, -5.0, 0.0);
    let face = plane("table", corner, Vec3::x() * (end + 5.0), Vec3::y() * 14.0, Vec3::z());
    let table = tool("table", face, Vec3::z(), SheetSide::Bottom, 0.0);
    let mut bend = stage("bend", vec![Motion::Hold], 0.2);
    bend.load = Curve::ramp(0.0, 1.0);
    let setup = SimulationSetup {
        loads,
        ..setup(body(mesh, steel()), constraints, vec![table], vec![bend])
    };
    let mut found = None;
    Simulation::new(setup)
        .unwrap()
        .run(&mut |r: &IncrementReport<'_>| {
            found = r.over_edge.clone();
            Control::Continue
        })
        .unwrap();
    found
}

#[test]
fn a_strip_bent_over_the_end_of_a_table_is_reported() {
    let found = over_table(31.0, 1.0).unwrap();
    assert!(found.tool == 0 && found.nodes >= 2, "{found:?}");
    assert!((found.at.x - 31.0).abs() < 1e-9 && found.at.z.abs() < 1e-9, "{found:?}");
    assert!((0.1..2.0).contains(&found.depth), "{found:?}");
    // Lifted off the table, or on one longer than the strip.
    assert_eq!(over_table(31.0, -1.0), None);
    assert_eq!(over_table(70.0, 1.0), None);
}
