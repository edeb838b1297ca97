//! Hertz contact, both ways: a rigid sphere or cylinder on an elastic block, an elastic crown under a rigid flat.

mod halfspace;
mod sphere;

use std::f64::consts::PI;

use super::{setup, square, stage, steel, tool};
use crate::assembly::Body;
use crate::element::ElementKind;
use crate::sheet::hex_mesh::{HexMesh, rectangle};
use crate::test_tools::Builder;
use crate::{Constraints, Control, Curve, IncrementReport, Motion, SheetSide, Simulation};
use kanagata_geometry::Vec3;
use kanagata_tool::ToolModel;

/// Radius of the sphere, the cylinder or the crown [mm].
const RADIUS: f64 = 30.0;
/// `E / (1 - nu^2)` [MPa].
const MODULUS: f64 = 210_000.0 / 0.91;

/// The curved body.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Curved {
    Tool,
    Block,
}

/// Maps the nodes of a unit block to a block below z = 0, finest at the origin (the same mapping for any number of
/// elements). The top of a curved block is `r^2 / 2R` lower near the origin.
fn grade(mesh: &mut HexMesh, size: f64, grading: f64, round: f64, line: bool, curved: Curved) {
    let place = |share: f64| size * (grading * share).sinh() / grading.sinh();
    for node in &mut mesh.nodes {
        let depth = place(1.0 - node.z);
        let (x, y) = (place(node.x), if line { node.y } else { place(node.y) });
        let r2 = if line { x * x } else { x * x + y * y };
        let fall = round * round / (2.0 * RADIUS) * -(-r2 / (round * round)).exp_m1();
        let share = if curved == Curved::Block { 1.0 - depth / size } else { 0.0 };
        *node = Vec3::new(x, y, -depth - fall * share);
    }
}

/// A cylinder about the y axis, within 12 degrees on either side of its lowest line.
fn cylinder() -> ToolModel {
    let half = 12.0_f64.to_radians();
    Builder::new("cylinder")
        .grid(12, 1, |u, v| {
            let (s, c) = (half * (2.0 * u - 1.0)).sin_cos();
            let normal = Vec3::new(s, 0.0, -c);
            (normal * RADIUS + Vec3::new(0.0, 3.0 * v - 1.0, RADIUS), normal)
        })
        .build()
}

/// Line contact under a force `F'`: the pressure at the columns of nodes against `p0 sqrt(1 - (x/a)^2)` with
/// `a^2 = 4 F' R / (pi E*)`. Relative error of the peak, and mean error over the mean pressure. Half a block of
/// `n` x 1 x `n` elements in plane strain, 40 half widths wide and deep.
fn line(curved: Curved, n: usize) -> [f64; 2] {
    let a = 0.3;
    let force = PI * a * a * MODULUS / (4.0 * RADIUS);
    let mut mesh = rectangle(1.0, 1.0, 1.0, n, 1, n);
    grade(&mut mesh, 40.0 * a, 4.7, 8.0 * a, true, curved);
    let count = mesh.nodes.len();
    let mut constraints = Constraints::none(count);
    constraints.symmetry_plane(&mesh.nodes, 0, 0.0, 1e-9);
    constraints.symmetry_plane(&mesh.nodes, 2, -40.0 * a, 1e-6);
    (0..count).for_each(|node| constraints.hold(node, 1));
    let rigid = match curved {
        Curved::Block => square("flat", 0.0, false),
        Curved::Tool => cylinder(),
    };
    // Columns come in pairs, at y = 0 and 1.
    let tops: Vec<usize> = mesh.top_nodes().iter().map(|&node| node as usize).collect();
    let x: Vec<f64> = tops.iter().step_by(2).map(|&node| mesh.nodes[node].x).collect();
    let tools = vec![tool("rigid", rigid, -Vec3::z(), SheetSide::Top, 0.0)];
    let stages = vec![stage("press", vec![Motion::Force(Curve::ramp(0.0, 0.5 * force))], 0.5)];
    let body = Body::new(mesh, ElementKind::Hex8Enhanced, steel()).unwrap();
    let mut sim = Simulation::new(setup(body, constraints, tools, stages)).unwrap();
    let mut load = Vec::new();
    sim.run(&mut |r: &IncrementReport<'_>| {
        let push = |pair: &[usize]| pair.iter().map(|n| -r.contact_forces[3 * n + 2]).sum::<f64>();
        load = tops.chunks_exact(2).map(push).collect();
        Control::Continue
    })
    .unwrap();
    let peak = (force * MODULUS / (PI * RADIUS)).sqrt();
    let width = |k: usize| 0.5 * (x[(k + 1).min(n)] - x[k.saturating_sub(1)]);
    let hertz = |x: f64| peak * (1.0 - (x / a).powi(2)).max(0.0).sqrt();
    let wrong = (0..n).map(|k| (load[k] - hertz(x[k]) * width(k)).abs()).sum::<f64>();
    [load[0] / width(0) / peak - 1.0, wrong / (0.5 * force)]
}

/// Finest of three meshes: 14 elements over the half width.
#[test]
fn pressure_of_a_cylinder_and_of_a_crown() {
    for curved in [Curved::Tool, Curved::Block] {
        let found = [12, 24, 48].map(|n| line(curved, n));
        let rate = (found[0][1] / found[2][1]).log2() / 2.0;
        println!("line, curved {curved:?}: peak, distribution {found:?}, rate {rate:.2}");
        assert!(found[2].iter().all(|error| error.abs() < 0.01), "{curved:?}: {found:?}");
        assert!(rate > 0.9, "{curved:?}: {found:?}");
    }
}
