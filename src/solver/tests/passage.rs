//! Tools with narrow noses, which a step could move past nodes of the sheet undetected.

use super::{body, setup, stage, steel, tool};
use crate::sheet::hex_mesh::rectangle;
use crate::test_tools::{Builder, Piece, arc, line};
use crate::{Constraints, Control, Curve, IncrementReport, Motion, SheetSide, Simulation};
use kanagata_geometry::Vec3;

const PI: f64 = std::f64::consts::PI;

/// Half a strip of 20 x 1 x 1 mm with the symmetry plane x = 0, its far end held, pressed `down` [mm] at its middle
/// by a tool with this profile in x-z, with elements of `size` [mm] and steps of `step`: final force [N], step cuts.
fn pressed(profile: &[Piece], size: f64, down: f64, step: f64) -> (f64, usize) {
    let mesh = rectangle(20.0, 1.0, 1.0, (20.0 / size) as usize, 1, 1);
    let mut held = Constraints::none(mesh.nodes.len());
    for (node, x) in mesh.nodes.iter().enumerate() {
        held.hold(node, 1);
        if x.x < 1e-9 || x.x > 20.0 - 1e-9 {
            held.hold(node, 0);
        }
        if x.x > 20.0 - 1e-9 {
            held.hold(node, 2);
        }
    }
    let model = profile.iter().fold(Builder::new("nose"), |builder, piece| {
        builder.grid(piece.cells, 1, |t, v| {
            let ([x, z], [nx, nz]) = (piece.at)(t);
            (Vec3::new(x, 4.0 * v - 1.0, z), Vec3::new(nx, 0.0, nz))
        })
    });
    let tools = vec![tool("nose", model.build(), -Vec3::z(), SheetSide::Top, 0.0)];
    let mut stages = vec![stage("press", vec![Motion::Travel(Curve::to(down))], step)];
    stages[0].largest_step = step;
    let mut force = 0.0;
    let mut see = |r: &IncrementReport<'_>| {
        force = r.tools[0].force;
        Control::Continue
    };
    let setup = setup(body(mesh, steel()), held, tools, stages);
    let cuts = Simulation::new(setup).unwrap().run(&mut see).unwrap().cuts;
    (force, cuts)
}

/// Nodes in the symmetry plane may end inside the blade, whose flanks push normal to that plane: without a check the
/// blade would advance without a force.
#[test]
fn a_blade_does_not_cross_nodes_in_a_symmetry_plane() {
    let blade = |r: f64| {
        let flank = |x: f64| line(1, [x, 1.0 + r], [x, 60.0], [x.signum(), 0.0]);
        [flank(-r), arc(8, [0.0, 1.0 + r], r, [PI, 2.0 * PI], 1.0), flank(r)]
    };
    for (r, size) in [(0.5, 1.0), (0.6, 1.0), (0.5, 0.5)] {
        let (slow, _) = pressed(&blade(r), size, 6.0, 0.02);
        let (fast, cuts) = pressed(&blade(r), size, 6.0, 1.0);
        assert!(slow > 10.0 && (fast / slow - 1.0).abs() < 1e-3, "{r}: {slow} {fast}");
        assert!(cuts > 0, "{r}: in steps it is not");
    }
}

/// Half a rod, thinner than a quarter of an element.
#[test]
fn a_thin_rod_with_an_open_back_does_not_cross_the_sheet() {
    for r in [0.05, 0.2] {
        let rod = [arc(8, [0.0, 1.0 + r], r, [PI, 2.0 * PI], 1.0)];
        let ((slow, _), (fast, _)) = (pressed(&rod, 1.0, 1.0, 0.02), pressed(&rod, 1.0, 1.0, 1.0));
        assert!(slow > 1.0 && (fast / slow - 1.0).abs() < 1e-3, "{r}: {slow} {fast}");
    }
}

/// A node at a border of patches moves past the tool only by rounding: this is no crossing, however short the step.
#[test]
fn a_node_at_rest_on_a_patch_border_is_no_crossing() {
    for r in [0.9, 1.4, 1.8, 2.9, 3.1] {
        let rod = [arc(8, [0.0, 1.0 + r], r, [PI, 2.0 * PI], 1.0)];
        let (force, cuts) = pressed(&rod, 2.0, 3.0, 0.1);
        assert!(force > 10.0 && cuts == 0, "{r}: {force} N after {cuts} cuts");
    }
}
