//! Claims about the elements.

use kanagata_geometry::Vec3;
use std::sync::Arc;

use super::super::material::elastic::Elastic;
use super::super::material::hardening::Hardening;
use super::super::material::hill48::Hill48;
use super::super::material::plastic::{Backstress, Plastic};
use super::*;
use crate::assembly::Body;
use crate::assembly::Evaluation;
use crate::material::Material;
use crate::sheet::hex_mesh::{self, HexMesh};
use kanagata_geometry::Mat3;

fn steel() -> Arc<dyn Material> {
    Arc::new(Elastic { young: 210_000.0, poisson: 0.3 })
}

/// A unit-ish element with uneven corners.
fn distorted() -> HexMesh {
    let mut mesh = hex_mesh::rectangle(1.2, 0.9, 0.7, 1, 1, 1);
    for (index, node) in mesh.nodes.iter_mut().enumerate() {
        let phase = index as f64;
        *node +=
            0.08 * Vec3::new((3.1 * phase).sin(), (1.7 * phase + 1.0).cos(), (2.3 * phase).sin());
    }
    mesh
}

fn pseudo_random(seed: u64, count: usize) -> Vec<f64> {
    let mut state = seed;
    (0..count)
        .map(|_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
        })
        .collect()
}

const SHELL: ElementKind = ElementKind::SolidShell { points: 3, membrane: false };
const SHELL_ENHANCED: ElementKind = ElementKind::SolidShell { points: 3, membrane: true };

const ALL: [ElementKind; 4] = [ElementKind::Hex8, ElementKind::Hex8Enhanced, SHELL, SHELL_ENHANCED];

/// Evaluates at `u` until the internal modes have converged.
fn converge_modes(body: &mut Body, u: &[f64], out: &mut Evaluation) {
    for _ in 0..30 {
        body.evaluate(u, Want::ResidualAndTangent, out).unwrap();
        let largest = out.internal_force.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        if out.internal_residual <= 1e-12 * largest {
            return;
        }
    }
    panic!("internal modes did not settle: {:e}", out.internal_residual);
}

/// Largest difference of the tangent from central differences, relative to its largest entry.
fn tangent_error(body: &mut Body, u: &[f64], step: f64) -> f64 {
    let mut out = Evaluation::default();
    converge_modes(body, u, &mut out);
    let pattern = body.pattern().clone();
    let largest = out.tangent.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let (mut plus, mut minus) = (Evaluation::default(), Evaluation::default());
    let mut worst = 0.0_f64;
    for column in 0..u.len() {
        let mut moved = u.to_vec();
        moved[column] += step;
        body.evaluate(&moved, Want::Residual, &mut plus).unwrap();
        moved[column] = u[column] - step;
        body.evaluate(&moved, Want::Residual, &mut minus).unwrap();
        for row in 0..u.len() {
            let difference = (plus.internal_force[row] - minus.internal_force[row]) / (2.0 * step);
            let exact = pattern.position(row, column).map_or(0.0, |at| out.tangent[at]);
            worst = worst.max((difference - exact).abs() / largest);
        }
    }
    worst
}

#[test]
fn elastic_tangent_is_the_derivative_of_the_force() {
    for kind in ALL {
        let mut body = Body::new(distorted(), kind, steel()).unwrap();
        let u: Vec<f64> = pseudo_random(7, 24).iter().map(|x| 0.12 * x).collect();
        let error = tangent_error(&mut body, &u, 1e-5);
        assert!(error < 1e-8, "{kind:?} {error:e}");
    }
}

#[test]
fn rigid_motion_gives_no_force() {
    let mesh = distorted();
    let turn = nalgebra::Rotation3::from_euler_angles(0.7, -1.9, 2.4);
    let u: Vec<f64> = mesh
        .nodes
        .iter()
        .flat_map(|x| {
            let moved = turn * x + Vec3::new(3.0, -2.0, 1.0) - x;
            [moved.x, moved.y, moved.z]
        })
        .collect();
    for kind in ALL {
        let mut body = Body::new(mesh.clone(), kind, steel()).unwrap();
        let mut out = Evaluation::default();
        body.evaluate(&u, Want::ResidualAndTangent, &mut out).unwrap();
        let largest = out.internal_force.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        assert!(largest < 1e-14 * 210_000.0 * 20.0, "{kind:?} {largest:e}");
    }
}

/// Homogeneous finite deformation of distorted elements: interior nodes carry no force.
#[test]
fn patch_test_in_finite_strain() {
    let mut mesh = hex_mesh::rectangle(2.0, 2.0, 2.0, 2, 2, 2);
    let middle = (4 * 3) + 1;
    mesh.nodes[middle] += Vec3::new(0.21, -0.17, 0.13);
    let gradient = Mat3::new(0.2, 0.1, -0.05, 0.02, -0.15, 0.1, 0.08, -0.03, 0.12);
    let u: Vec<f64> = mesh.nodes.iter().flat_map(|x| (gradient * x).data.0[0]).collect();
    for kind in [ElementKind::Hex8, ElementKind::Hex8Enhanced] {
        let mut body = Body::new(mesh.clone(), kind, steel()).unwrap();
        let mut out = Evaluation::default();
        body.evaluate(&u, Want::ResidualAndTangent, &mut out).unwrap();
        let largest = out.internal_force.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        assert!(
            out.internal_residual < 1e-10 * largest,
            "{kind:?} modes wake: {:e}",
            out.internal_residual
        );
        for i in 0..3 {
            let force = out.internal_force[3 * middle + i];
            assert!(force.abs() < 1e-10 * largest, "{kind:?} {force:e} of {largest:e}");
        }
    }
}

/// The paper's sheet (Table 1).
fn sheet() -> Arc<dyn Material> {
    let hill = Hill48 { f: 0.251, g: 0.297, h: 0.703, l: 1.5, m: 1.5, n: 1.29 };
    let swift = Hardening::Swift { k: 529.5, eps0: 0.00439, n: 0.268 };
    Arc::new(Plastic::new(Elastic { young: 210_000.0, poisson: 0.3 }, &hill, swift).unwrap())
}

/// The sheet with a backstress that recovers: its tangent is not symmetric.
fn recovering() -> Arc<dyn Material> {
    let hill = Hill48 { f: 0.251, g: 0.297, h: 0.703, l: 1.5, m: 1.5, n: 1.29 };
    let voce = Hardening::Voce { sigma0: 150.0, q: 100.0, b: 10.0 };
    let steel = Plastic::new(Elastic { young: 210_000.0, poisson: 0.3 }, &hill, voce).unwrap();
    let backstress = Backstress { modulus: 5000.0, recovery: 50.0 };
    Arc::new(steel.with_backstresses(vec![backstress]).unwrap())
}

#[test]
fn plastic_tangent_is_the_derivative_of_the_force() {
    let (sheet, recovering) = (sheet(), recovering());
    assert!(sheet.is_symmetric() && !recovering.is_symmetric());
    let laws = [sheet, recovering];
    for (kind, law) in ALL.into_iter().flat_map(|kind| laws.each_ref().map(|law| (kind, law))) {
        let mut body = Body::new(distorted(), kind, Arc::clone(law)).unwrap();
        let mut out = Evaluation::default();
        let before: Vec<f64> = pseudo_random(3, 24).iter().map(|x| 0.02 * x).collect();
        converge_modes(&mut body, &before, &mut out);
        body.commit();
        let plastic = |body: &Body| body.element_states().unwrap()[0].mean.plastic_strain;
        let start = plastic(&body);
        let u: Vec<f64> = pseudo_random(7, 24).iter().map(|x| 0.12 * x).collect();
        let error = tangent_error(&mut body, &u, 1e-6);
        assert!(error < 1e-6, "{kind:?} {error:e}");
        body.evaluate(&u, Want::Residual, &mut out).unwrap();
        body.commit();
        assert!(plastic(&body) > start + 0.05);
    }
}

/// After restoring, or a round trip through bytes, the forces are bit-identical.
#[test]
fn restored_and_imported_states_are_bit_identical() {
    for kind in ALL {
        check_bit_identity(kind);
    }
}

fn check_bit_identity(kind: ElementKind) {
    let mesh = hex_mesh::rectangle(3.0, 2.0, 0.8, 3, 2, 2);
    let count = 3 * mesh.nodes.len();
    let mut body = Body::new(mesh.clone(), kind, sheet()).unwrap();
    let mut out = Evaluation::default();
    let one: Vec<f64> = pseudo_random(1, count).iter().map(|x| 0.01 * x).collect();
    let two: Vec<f64> = pseudo_random(2, count).iter().map(|x| 0.02 * x).collect();
    body.evaluate(&one, Want::ResidualAndTangent, &mut out).unwrap();
    body.commit();
    let saved = body.export_state();
    body.evaluate(&two, Want::ResidualAndTangent, &mut out).unwrap();
    let first = out.clone();
    body.restore();
    body.evaluate(&two, Want::ResidualAndTangent, &mut out).unwrap();
    assert_eq!(first, out);
    let mut other = Body::new(mesh, kind, sheet()).unwrap();
    other.import_state(&saved).unwrap();
    other.evaluate(&two, Want::ResidualAndTangent, &mut out).unwrap();
    assert_eq!(first, out);
    assert!(other.import_state(&saved[8..]).is_err());
}

#[test]
fn results_do_not_depend_on_threads() {
    let mesh = hex_mesh::rectangle(9.0, 7.0, 0.8, 9, 7, 2);
    let u: Vec<f64> = pseudo_random(2, 3 * mesh.nodes.len()).iter().map(|x| 0.02 * x).collect();
    let run = |kind: ElementKind, threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut body = Body::new(mesh.clone(), kind, sheet()).unwrap();
        let mut out = Evaluation::default();
        pool.install(|| body.evaluate(&u, Want::ResidualAndTangent, &mut out).unwrap());
        out
    };
    for kind in ALL {
        assert_eq!(run(kind, 1), run(kind, 3));
    }
}

#[test]
fn inverted_elements_are_reported_lowest_first() {
    let mesh = hex_mesh::rectangle(3.0, 1.0, 1.0, 3, 1, 1);
    let mut u = vec![0.0; 3 * mesh.nodes.len()];
    for node in mesh.elements[1] {
        u[3 * node as usize + 2] = -2.0 * mesh.nodes[node as usize].z;
    }
    let mut body = Body::new(mesh, ElementKind::Hex8, sheet()).unwrap();
    let failure = body.evaluate(&u, Want::Residual, &mut Evaluation::default()).unwrap_err();
    assert_eq!(failure.element, 0);
    assert!(matches!(failure.reason, FailureReason::Inverted { .. }));
}

/// The solid-shell passes the patch test on meshes whose thickness lines are parallel.
#[test]
fn solid_shell_patch_test_in_finite_strain() {
    let mut mesh = hex_mesh::rectangle(2.0, 2.0, 0.4, 2, 2, 2);
    for level in 0..3 {
        mesh.nodes[4 * 3 + level] += Vec3::new(0.21, -0.17, 0.0);
        mesh.nodes[3 + level] += Vec3::new(0.0, -0.2, 0.0);
    }
    let middle = 4 * 3 + 1;
    let gradient = Mat3::new(0.2, 0.1, -0.05, 0.02, -0.15, 0.1, 0.08, -0.03, 0.12);
    let u: Vec<f64> = mesh.nodes.iter().flat_map(|x| (gradient * x).data.0[0]).collect();
    for kind in [SHELL, SHELL_ENHANCED] {
        let mut body = Body::new(mesh.clone(), kind, steel()).unwrap();
        let mut out = Evaluation::default();
        body.evaluate(&u, Want::ResidualAndTangent, &mut out).unwrap();
        let largest = out.internal_force.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        assert!(
            out.internal_residual < 1e-10 * largest,
            "{kind:?} modes wake: {:e}",
            out.internal_residual
        );
        for i in 0..3 {
            let force = out.internal_force[3 * middle + i];
            assert!(force.abs() < 1e-10 * largest, "{kind:?} {force:e} of {largest:e}");
        }
    }
}
