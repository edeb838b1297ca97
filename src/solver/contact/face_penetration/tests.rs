//! Tools between the nodes of a sheet: detection, and no false detection.

use std::f64::consts::{FRAC_PI_2, PI};

use super::*;
use crate::sheet::hex_mesh::rectangle;
use crate::sheet::supports::Constraints;
use crate::system::system::System;
use crate::test_tools::{arc, plane, revolved};
use crate::tests::{body, steel};
use crate::tools::role::Role;
use crate::{Placement, ToolSetup};
use kanagata_tool::ToolModel;

/// A sheet of 40 x 40 x 1 mm in elements of 4 mm under (`Top`) or over (`Bottom`) a tool.
fn found(
    model: ToolModel,
    offset: Vec3,
    side: SheetSide,
    bend: impl Fn(&Vec3) -> Vec3,
) -> Option<FacePenetration> {
    let mesh = rectangle(40.0, 40.0, 1.0, 10, 10, 1);
    let moved: Vec<f64> = mesh.nodes.iter().flat_map(|x| <[f64; 3]>::from(bend(x) - x)).collect();
    let direction = if side == SheetSide::Bottom { Vec3::z() } else { -Vec3::z() };
    let setup = ToolSetup {
        name: "tool".into(),
        surface: std::sync::Arc::new(kanagata_contact::ToolSurface::new(model)),
        offset,
        direction,
        placement: Placement::AsGiven,
        friction: 0.0,
        side,
        stop: None,
    };
    let constraints = Constraints::none(mesh.nodes.len());
    let tools = vec![Tool { setup, travel: 0.0 }];
    let mut sys = System::new(body(mesh, steel()), constraints, tools).unwrap();
    sys.roles = vec![Role::Travel];
    sys.u = moved;
    sys.face_penetration().deepest
}

fn flat(x: &Vec3) -> Vec3 {
    *x
}

/// Lower half of a ball of given radius, its lowest point at the origin.
fn ball(radius: f64) -> ToolModel {
    revolved("ball", 8, 2.0 * PI, &[arc(6, [0.0, radius], radius, [-FRAC_PI_2, 0.0], 1.0)])
}

#[test]
fn a_ball_between_nodes_is_found_wherever_it_lies_on_a_face() {
    for (x, y) in [(18.0, 18.0), (17.1, 18.7), (16.4, 17.9), (18.0, 16.0), (19.3, 19.1)] {
        for radius in [0.3, 1.0, 3.0, 7.0] {
            let at = Vec3::new(x, y, 1.0 - 0.2);
            let FacePenetration { tool, depth, at: place } =
                found(ball(radius), at, SheetSide::Top, flat).unwrap();
            assert!(tool == 0 && depth <= 0.2 + 1e-4, "{depth}");
            assert!(depth > 0.19, "{depth} of 0.2 for a radius of {radius} at {x}, {y}");
            assert!((place - at).norm() < 1.0, "{place:?}");
        }
    }
    // Just clear of the sheet.
    assert_eq!(found(ball(1.0), Vec3::new(18.0, 18.0, 1.001), SheetSide::Top, flat), None);
}

/// Faces of an edge, a corner and a free border, from either side of the sheet.
#[test]
fn edges_corners_and_borders_are_found() {
    let block = |x: f64, y: f64| {
        let (a, b, c) = (Vec3::x() * 0.9, Vec3::y() * 0.7, Vec3::z() * 5.0);
        let corner = Vec3::new(x, y, 0.0);
        let mut model = plane("t", corner, a, b, -Vec3::z());
        model.patches.extend(plane("t", corner, b, c, -Vec3::x()).patches);
        model.patches.extend(plane("t", corner, a, c, -Vec3::y()).patches);
        model
    };
    let depth =
        |model: ToolModel, z: f64, side| found(model, Vec3::z() * z, side, flat).map(|f| f.depth);
    let close = |found: Option<f64>, expected: f64| (found.unwrap() - expected).abs() < 1e-9;
    assert!(close(depth(block(17.3, 22.2), 0.7, SheetSide::Top), 0.3));
    assert!(close(depth(block(17.3, 22.2), 0.7, SheetSide::Both), 0.3));
    // A narrow face with free borders on all sides.
    assert!(close(
        depth(
            plane("t", Vec3::new(1.0, 13.1, 0.0), Vec3::x() * 38.0, Vec3::y() * 0.5, Vec3::z()),
            0.25,
            SheetSide::Bottom
        ),
        0.25
    ));
    assert_eq!(depth(block(17.3, 22.2), 1.01, SheetSide::Top), None);
}

/// A sheet wrapped around a cylinder, its nodes on it: a chord of 4 mm has a sag of R (1 - cos(w / 2R)).
#[test]
fn the_sag_of_faces_on_a_radius_is_their_depth() {
    for radius in [6.0, 12.0, 30.0] {
        let wrapped = |x: &Vec3| {
            let angle = (x.x - 20.0) / radius;
            let r = radius + x.z;
            Vec3::new(20.0 + r * angle.sin(), x.y, r * angle.cos() - radius)
        };
        let profile = |v: f64| {
            let angle = -2.0 + 4.0 * v;
            Vec3::new(20.0 + radius * angle.sin(), 0.0, radius * angle.cos() - radius)
        };
        let at = |u: f64, v: f64| {
            let x = profile(v) + Vec3::y() * (60.0 * u - 10.0);
            let out = x - Vec3::new(20.0, x.y, -radius);
            (x, out.normalize())
        };
        let model = crate::test_tools::Builder::new("r").grid(1, 24, at).build();
        let depth = found(model, Vec3::zeros(), SheetSide::Bottom, wrapped).unwrap().depth;
        let sag = radius * (1.0 - (2.0 / radius).cos());
        assert!((depth / sag - 1.0).abs() < 0.01, "{radius}: {depth} for {sag}");
    }
}

#[test]
fn a_tool_through_the_sheet_is_distinguished_from_one_beside_it() {
    let through = found(ball(1.0), Vec3::new(18.0, 18.0, -1.7), SheetSide::Top, flat).unwrap();
    assert!((through.depth - 2.7).abs() < 0.01, "{through:?}");
    // Beside the rim, below the upper face.
    assert_eq!(found(ball(1.0), Vec3::new(-1.2, 18.0, 0.3), SheetSide::Top, flat), None);
}
