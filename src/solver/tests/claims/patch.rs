//! Contact patch test: transmission of a uniform stress state.

use super::{body, setup, square, stage, steel, tool};
use crate::material::elastic::Elastic;
use crate::material::log_strain;
use crate::numbers::tensor;
use crate::sheet::hex_mesh::{HexMesh, rectangle};
use crate::{Constraints, Control, Curve, Motion, SheetSide, Simulation, ToolSetup};
use kanagata_geometry::{Mat3, Vec3};

/// A block of distorted elements with flat faces.
fn distorted() -> HexMesh {
    let mut mesh = rectangle(6.0, 4.0, 2.0, 3, 2, 2);
    for x in &mut mesh.nodes {
        let bump = (x.x * 1.3).sin() * (x.y * 0.9).cos();
        let inside = |v: f64, size: f64| v * (size - v);
        *x += Vec3::new(
            0.02 * inside(x.x, 6.0) * bump,
            0.03 * inside(x.y, 4.0) * bump,
            0.1 * inside(x.z, 2.0) * bump,
        );
    }
    mesh
}

/// Pressed between a flat bed and a flat press.
fn pressed(mesh: &HexMesh, press: Motion) -> Simulation {
    let (constraints, tools) = bed_and_press(mesh);
    pressed_by(mesh, [Motion::Hold, press], constraints, tools, 1.0)
}

fn bed_and_press(mesh: &HexMesh) -> (Constraints, Vec<ToolSetup>) {
    let mut constraints = Constraints::none(mesh.nodes.len());
    constraints.symmetry_plane(&mesh.nodes, 0, 0.0, 1e-9);
    constraints.symmetry_plane(&mesh.nodes, 1, 0.0, 1e-9);
    let tools = vec![
        tool("bed", square("bed", 0.0, true), Vec3::z(), SheetSide::Bottom, 0.0),
        tool("press", square("press", 2.0, false), -Vec3::z(), SheetSide::Top, 0.0),
    ];
    (constraints, tools)
}

fn pressed_by(
    mesh: &HexMesh,
    motions: [Motion; 2],
    constraints: Constraints,
    tools: Vec<ToolSetup>,
    share: f64,
) -> Simulation {
    let stages = vec![stage("press", motions.to_vec(), 0.5)];
    let mut setup = setup(body(mesh.clone(), steel()), constraints, tools, stages);
    setup.limits.force_tolerance = 1e-12;
    setup.share = share;
    let mut sim = Simulation::new(setup).unwrap();
    sim.run(&mut |_| Control::Continue).unwrap();
    sim
}

#[test]
fn contact_transmits_a_uniform_state() {
    let mesh = distorted();
    let sim = pressed(&mesh, Motion::Travel(Curve::ramp(0.0, 0.02)));
    // Uniaxial logarithmic strain: the others follow from Poisson's ratio.
    let axial = (1.98_f64 / 2.0).ln();
    let (across, along) = ((-0.3 * axial).exp() - 1.0, axial.exp() - 1.0);
    for (x, u) in mesh.nodes.iter().zip(sim.displacements().chunks_exact(3)) {
        let expected = Vec3::new(x.x * across, x.y * across, x.z * along);
        let error = (Vec3::from_column_slice(u) - expected).norm();
        assert!(error < 1e-12, "{error:e} at {x:?}");
    }
}

/// Cauchy stress at the corners of every element.
fn stresses(mesh: &HexMesh, u: &[f64]) -> Vec<Mat3> {
    let corner = |k: usize| {
        let side = |up: bool| if up { 1.0 } else { -1.0 };
        Vec3::new(side(matches!(k % 4, 1 | 2)), side(k % 4 > 1), side(k > 3))
    };
    let mut out = Vec::new();
    for element in &mesh.elements {
        for at in (0..8).map(corner) {
            let (mut reference, mut moved) = (Mat3::zeros(), Mat3::zeros());
            for (k, &node) in element.iter().enumerate() {
                let xi = corner(k);
                let part = |i: usize| 0.5 * (1.0 + at[i] * xi[i]);
                let slope = Vec3::new(
                    0.5 * xi.x * part(1) * part(2),
                    0.5 * xi.y * part(0) * part(2),
                    0.5 * xi.z * part(0) * part(1),
                );
                let (node, x) = (node as usize, mesh.nodes[node as usize]);
                reference += x * slope.transpose();
                moved +=
                    (x + Vec3::from_column_slice(&u[3 * node..3 * node + 3])) * slope.transpose();
            }
            out.push(cauchy(&(moved * reference.try_inverse().unwrap())));
        }
    }
    out
}

fn cauchy(f: &Mat3) -> Mat3 {
    let elastic = Elastic { young: 210_000.0, poisson: 0.3 };
    let c = tensor::from_matrix(&(f.transpose() * f));
    let out = log_strain::update(&elastic, &c, &[], &mut [], false).unwrap();
    f * tensor::to_matrix(&out.stress) * f.transpose() / f.determinant()
}

/// Pressed by a force: the stress is the force over the current area, uniform to 1e-10.
#[test]
fn a_flat_press_makes_a_uniform_pressure_on_a_distorted_mesh() {
    let mesh = distorted();
    let force = 24_000.0;
    let sim = pressed(&mesh, Motion::Force(Curve::ramp(0.0, force)));
    let u = sim.displacements();
    let end = |axis: usize| -> f64 {
        let far = (0..mesh.nodes.len())
            .max_by(|&a, &b| mesh.nodes[a][axis].total_cmp(&mesh.nodes[b][axis]));
        far.map(|n| mesh.nodes[n][axis] + u[3 * n + axis]).unwrap()
    };
    let pressure = force / (end(0) * end(1));
    let expected = Mat3::from_diagonal(&Vec3::new(0.0, 0.0, -pressure));
    let worst = stresses(&mesh, u)
        .iter()
        .map(|stress| (stress - expected).amax() / pressure)
        .fold(0.0, f64::max);
    assert!(worst < 1e-10, "{worst:e}");
}

/// A bed that rises against a press on a spring. The spring force is that of the block compressed by the difference
/// of both travels. For a quarter model the spring is that of the complete process.
#[test]
fn a_block_between_a_moving_and_a_sprung_tool_is_in_equilibrium() {
    const RISE: f64 = 0.3;
    let mesh = distorted();
    for (stiffness, preload, share) in
        [(4e5, 0.0, 1.0), (4e5, 20_000.0, 4.0), (2e3, 5e4, 1.0), (1e9, 0.0, 1.0)]
    {
        let (constraints, tools) = bed_and_press(&mesh);
        let spring = Motion::Spring { force: Curve::ramp(0.0, preload), stiffness };
        let motions = [Motion::Travel(Curve::ramp(0.0, RISE)), spring];
        let sim = pressed_by(&mesh, motions, constraints, tools, share);
        let travel = -sim.tool_shifts()[1].z;
        // Nominal stress of uniaxial logarithmic strain: E ln(l) / l.
        let block = |travel: f64| {
            let stretch: f64 = (2.0 - RISE - travel) / 2.0;
            -210_000.0 * stretch.ln() / stretch * 6.0 * 4.0 * share
        };
        let off = |travel: f64| preload - stiffness * travel - block(travel);
        let (mut low, mut high) = (-RISE, 0.5);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if off(middle) > 0.0 { low = middle } else { high = middle }
        }
        assert!((travel - low).abs() < 1e-9, "{stiffness}: {travel} {low}");
    }
}
