//! Closed forms: Hertz, the incline, a uniform state through contact; lengths in other units.

use std::f64::consts::FRAC_PI_2;

use super::{body, setup, stage, steel, tool};
use crate::contact::test_tools::{arc, plane, revolved};
use crate::geometry::Vec3;
use crate::solver::blank::rectangle;
use crate::solver::{
    Constraints, Control, Curve, IncrementReport, Motion, SheetSide, Simulation, SimulationSetup,
};

fn square(name: &str, z: f64, up: bool) -> crate::tool::ToolModel {
    let normal = if up { Vec3::z() } else { -Vec3::z() };
    plane(name, Vec3::new(-50.0, -50.0, z), Vec3::x() * 200.0, Vec3::y() * 200.0, normal)
}

/// Force vectors of all tools at the end of the run.
fn final_forces(setup: SimulationSetup) -> Vec<Vec3> {
    let mut forces = Vec::new();
    let mut sim = Simulation::new(setup).unwrap();
    sim.run(&mut |r: &IncrementReport<'_>| {
        forces = r.tools.iter().map(|t| Vec3::from(t.force_vector)).collect();
        Control::Continue
    })
    .unwrap();
    forces
}

/// Rigid sphere of Nagata patches on an elastic block that stands for a half-space: F = 4/3 E* sqrt(R) d^1.5.
/// Mesh: 14^3 trilinear elements of a quarter, 6 over the contact radius, growing to 100 radii.
#[test]
fn hertz_force_of_a_sphere_within_three_percent() {
    let (radius, approach) = (30.0_f64, 0.01_f64);
    let contact_radius = (radius * approach).sqrt();
    let n = 14;
    let (fine, growth) = (contact_radius / 6.0, 1.42_f64);
    let place = |k: f64| fine * (growth.powf(k) - 1.0) / (growth - 1.0);
    let mut mesh = rectangle(1.0, 1.0, 1.0, n, n, n);
    let index = |x: f64| (x * n as f64).round();
    for x in &mut mesh.nodes {
        *x = Vec3::new(place(index(x.x)), place(index(x.y)), -place(n as f64 - index(x.z)));
    }
    let mut constraints = Constraints::none(mesh.nodes.len());
    constraints.symmetry_plane(&mesh.nodes, 0, 0.0, 1e-9);
    constraints.symmetry_plane(&mesh.nodes, 1, 0.0, 1e-9);
    let bottom = -place(n as f64);
    constraints.symmetry_plane(&mesh.nodes, 2, bottom, 1e-6);
    let ball = [arc(12, [0.0, radius], radius, [-FRAC_PI_2, -0.5], 1.0)];
    let model = revolved("ball", 6, FRAC_PI_2, &ball);
    let tools = vec![tool("ball", model, -Vec3::z(), SheetSide::Top, 0.0)];
    let stages = vec![stage("press", vec![Motion::Travel(Curve::ramp(0.0, approach))], 1.0)];
    let forces = final_forces(setup(body(mesh, steel()), constraints, tools, stages));
    let exact = 4.0 / 3.0 * 210_000.0 / 0.91 * radius.sqrt() * approach.powf(1.5);
    let found = -4.0 * forces[0].z;
    assert!((found / exact - 1.0).abs() < 0.03, "{found} against {exact}");
}

/// NAFEMS CGS-4 turned round: the incline is drawn under a block that is held, F/G at sliding.
#[test]
fn force_to_slide_up_an_incline() {
    let (slope, mu) = (0.1, 0.3);
    let mut mesh = rectangle(8.0, 4.0, 3.0, 4, 2, 2);
    for x in &mut mesh.nodes {
        x.z += slope * x.x * (1.0 - x.z / 3.0);
    }
    let mut constraints = Constraints::none(mesh.nodes.len());
    for node in 0..mesh.nodes.len() {
        if mesh.nodes[node].x == 0.0 && node % 3 > 0 {
            constraints.hold(node, 0);
            constraints.hold(node, 1);
        }
    }
    let incline = plane(
        "incline",
        Vec3::new(-50.0, -50.0, -50.0 * slope),
        Vec3::new(100.0, 0.0, 100.0 * slope),
        Vec3::y() * 100.0,
        Vec3::new(-slope, 0.0, 1.0).normalize(),
    );
    let tools = vec![
        tool("incline", incline, -Vec3::x(), SheetSide::Bottom, mu),
        tool("weight", square("weight", 3.0, false), -Vec3::z(), SheetSide::Top, 0.0),
    ];
    let stages = vec![
        stage("load", vec![Motion::Hold, Motion::Force(Curve::ramp(0.0, 100.0))], 1.0),
        stage(
            "slide",
            vec![Motion::Travel(Curve::ramp(0.0, 1.0)), Motion::Force(Curve::constant(100.0))],
            0.2,
        ),
    ];
    let forces = final_forces(setup(body(mesh, steel()), constraints, tools, stages));
    let ratio = forces[0].x.abs() / forces[0].z;
    let exact = (slope + mu) / (1.0 - mu * slope);
    assert!((ratio / exact - 1.0).abs() < 1e-3, "{ratio} against {exact}");
    assert!((forces[1].z + 100.0).abs() < 1e-6 && (forces[0].z - 100.0).abs() < 1e-6);
}

#[test]
fn a_uniform_state_passes_through_contact() {
    let mut mesh = rectangle(6.0, 4.0, 2.0, 3, 2, 2);
    // Distort inside and on the faces, but keep the faces flat.
    for x in &mut mesh.nodes {
        let bump = (x.x * 1.3).sin() * (x.y * 0.9).cos();
        let inside = |v: f64, size: f64| v * (size - v);
        *x += Vec3::new(
            0.02 * inside(x.x, 6.0) * bump,
            0.03 * inside(x.y, 4.0) * bump,
            0.1 * inside(x.z, 2.0) * bump,
        );
    }
    let mut constraints = Constraints::none(mesh.nodes.len());
    constraints.symmetry_plane(&mesh.nodes, 0, 0.0, 1e-9);
    constraints.symmetry_plane(&mesh.nodes, 1, 0.0, 1e-9);
    let tools = vec![
        tool("bed", square("bed", 0.0, true), Vec3::z(), SheetSide::Bottom, 0.0),
        tool("press", square("press", 2.0, false), -Vec3::z(), SheetSide::Top, 0.0),
    ];
    let stages =
        vec![stage("press", vec![Motion::Hold, Motion::Travel(Curve::ramp(0.0, 0.02))], 0.5)];
    let nodes = mesh.nodes.clone();
    let mut sim = Simulation::new(setup(body(mesh, steel()), constraints, tools, stages)).unwrap();
    sim.run(&mut |_| Control::Continue).unwrap();
    // Uniaxial logarithmic strain: the others follow by Poisson's ratio.
    let axial = (1.98_f64 / 2.0).ln();
    let (across, along) = ((-0.3 * axial).exp() - 1.0, axial.exp() - 1.0);
    for (x, u) in nodes.iter().zip(sim.displacements().chunks_exact(3)) {
        let expected = Vec3::new(x.x * across, x.y * across, x.z * along);
        assert!((Vec3::from_column_slice(u) - expected).norm() < 1e-9, "{x:?} {u:?} {expected:?}");
    }
}
