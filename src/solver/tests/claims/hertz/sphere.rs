//! Point contact under a given force: approach, and pressure distribution.

use std::f64::consts::{FRAC_PI_2, PI};

use super::halfspace::Pressed;
use super::{Curved, MODULUS, RADIUS, grade, setup, square, stage, steel, tool};
use crate::assembly::Body;
use crate::element::ElementKind;
use crate::sheet::hex_mesh::{HexMesh, rectangle};
use crate::test_tools::{arc, revolved};
use crate::{
    Constraints, Control, Curve, IncrementReport, Motion, SheetSide, Simulation, SimulationSetup,
};
use kanagata_geometry::Vec3;
use kanagata_tool::ToolModel;

/// Contact radius [mm]: a thousandth of the radius of the sphere; strains of 0.05 %, small as in Hertz theory.
const A: f64 = 1e-3 * RADIUS;
/// Width and depth of the block [mm]; the forces on its faces represent the rest of the half-space.
const SIZE: f64 = 6.0 * A;
/// Refinement at the centre (see [`grade`]).
const GRADING: f64 = 3.5;

/// Force [N] for this contact radius.
fn force() -> f64 {
    4.0 / 3.0 * MODULUS * A.powi(3) / RADIUS
}

fn rigid(curved: Curved) -> ToolModel {
    match curved {
        Curved::Block => square("flat", 0.0, false),
        Curved::Tool => {
            // Twelve rings of patches up to 1.5 times the width of the block.
            let reach = -FRAC_PI_2 + 1.5 * SIZE / RADIUS;
            let ball = [arc(12, [0.0, RADIUS], RADIUS, [-FRAC_PI_2, reach], 1.0)];
            revolved("ball", 6, FRAC_PI_2, &ball)
        }
    }
}

/// Fractions of the force at which errors are evaluated, so that the edge of contact has many positions relative to
/// the elements of every mesh. At a single force the sign of the error depends on the node that the edge has just
/// reached.
fn shares() -> Vec<f64> {
    (0..8).map(|k| 0.44 + 0.08 * f64::from(k)).collect()
}

/// A quarter of the process.
fn process(curved: Curved, mesh: HexMesh) -> SimulationSetup {
    let mut constraints = Constraints::none(mesh.nodes.len());
    constraints.symmetry_plane(&mesh.nodes, 0, 0.0, 1e-9);
    constraints.symmetry_plane(&mesh.nodes, 1, 0.0, 1e-9);
    // All forces are self-equilibrated: one node, deep below the centre, is held against vertical rigid motion.
    constraints.hold(0, 2);
    let loads = Pressed::new(force(), A).forces(&mesh, SIZE);
    let tools = vec![tool("rigid", rigid(curved), -Vec3::z(), SheetSide::Top, 0.0)];
    let mut press = stage("press", vec![Motion::Force(Curve::ramp(0.0, force()))], 1.0);
    (press.load, press.ends) = (Curve::ramp(0.0, 1.0), shares());
    let body = Body::new(mesh, ElementKind::Hex8Enhanced, steel()).unwrap();
    let mut all = setup(body, constraints, tools, vec![press]);
    (all.loads, all.share) = (loads, 4.0);
    all.limits.gap_tolerance = 1e-10;
    all
}

/// Errors, root mean square over the fractions of the force: force at the computed approach over that of Hertz; nodal
/// pressure (root mean square over the disc) over the mean pressure; pressure at the centre. Then the largest error
/// of the force.
#[derive(Debug, Default)]
struct Wrong {
    force: f64,
    pressure: f64,
    peak: f64,
    worst: f64,
}

/// Nodal pressures at the top: squared differences from Hertz at a contact radius `a` [mm] over the disc, over the
/// mean pressure; and the relative difference at the centre. `x`: positions of the nodes along either side.
fn pressure_error(load: &[f64], x: &[f64], a: f64) -> [f64; 2] {
    let (last, peak) = (x.len() - 1, 2.0 * MODULUS * a / (PI * RADIUS));
    let width = |k: usize| 0.5 * (x[(k + 1).min(last)] - x[k.saturating_sub(1)]);
    let off = |k: usize| {
        let (i, j) = (k / x.len(), k % x.len());
        let left = 1.0 - (x[i] * x[i] + x[j] * x[j]) / (a * a);
        let area = width(i) * width(j);
        (area, load[k] / area / peak - left.max(0.0).sqrt())
    };
    let square: f64 = (0..load.len()).map(off).map(|(area, off)| area * off * off).sum();
    [square / (0.25 * PI * a * a) * 2.25, off(0).1]
}

/// On a block of `n`^3 elements.
fn sphere(curved: Curved, n: usize) -> Wrong {
    let mut mesh = rectangle(1.0, 1.0, 1.0, n, n, n);
    grade(&mut mesh, SIZE, GRADING, 1e3 * A, false, curved);
    let tops: Vec<usize> = mesh.top_nodes().iter().map(|&node| node as usize).collect();
    let x: Vec<f64> = tops[..=n].iter().map(|&node| mesh.nodes[node].y).collect();
    let sinks = Pressed::new(force(), A).sinks(&mesh.nodes[0]);
    let mut sim = Simulation::new(process(curved, mesh)).unwrap();
    let mut wrong = Wrong::default();
    sim.run(&mut |r: &IncrementReport<'_>| {
        if r.increment == 0 {
            return Control::Continue;
        }
        let a = A * r.share.cbrt();
        let approach = r.tools[0].travel + r.share * sinks;
        let force = (a * a / RADIUS / approach).powf(1.5) - 1.0;
        let load: Vec<f64> = tops.iter().map(|node| -r.contact_forces[3 * node + 2]).collect();
        let [pressure, peak] = pressure_error(&load, &x, a);
        wrong.force += force * force;
        wrong.pressure += pressure;
        wrong.peak += peak * peak;
        wrong.worst = wrong.worst.max(force.abs());
        Control::Continue
    })
    .unwrap();
    let mean = |sum: f64| (sum / shares().len() as f64).sqrt();
    Wrong {
        force: mean(wrong.force),
        pressure: mean(wrong.pressure),
        peak: mean(wrong.peak),
        worst: wrong.worst,
    }
}

/// Linear elements: the error of the force, an energy, should be of second order in the element size; that of the
/// pressure, which has a square-root edge, of first order. `KANAGATA_HERTZ=18` sets the number of elements along a
/// side of the finest mesh.
#[test]
fn force_and_pressure_of_a_sphere_and_of_a_crown() {
    let given = std::env::var("KANAGATA_HERTZ").ok().and_then(|text| text.parse().ok());
    let meshes = [6, 9, given.unwrap_or(13)];
    for curved in [Curved::Tool, Curved::Block] {
        let found = meshes.map(|n| sphere(curved, n));
        let rate = |error: fn(&Wrong) -> f64| {
            (error(&found[0]) / error(&found[2])).ln() / (meshes[2] as f64 / meshes[0] as f64).ln()
        };
        let rates = [rate(|w| w.force), rate(|w| w.pressure), rate(|w| w.peak)];
        println!("sphere, curved {curved:?}, {meshes:?}: {found:.5?}, rates {rates:.2?}");
        assert!(found.windows(2).all(|w| w[1].force < w[0].force && w[1].pressure < w[0].pressure));
        assert!(found[2].worst < 0.01 && found[2].peak < 0.01, "{curved:?}: {found:?}");
        assert!(rates[0] > 1.5 && rates[1] > 0.8, "{curved:?}: {rates:?}");
    }
}
