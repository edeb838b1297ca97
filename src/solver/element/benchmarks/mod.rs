//! Published and closed-form benchmarks of the elements.

mod compressed;
mod flange;
mod shells;
mod tube;

use kanagata_geometry::Vec3;
use std::sync::Arc;

use super::super::material::elastic::Elastic;
use super::testing::{Problem, solve};
use super::*;
use crate::assembly::Body;
use crate::sheet::hex_mesh::{self, HexMesh};

const SHELL: ElementKind = ElementKind::SolidShell { points: 3, membrane: false };
const SHELL_ENHANCED: ElementKind = ElementKind::SolidShell { points: 3, membrane: true };

fn body(mesh: &HexMesh, kind: ElementKind, young: f64, poisson: f64) -> Body {
    Body::new(mesh.clone(), kind, Arc::new(Elastic { young, poisson })).unwrap()
}

/// Nodes whose reference position satisfies `test`.
fn select(mesh: &HexMesh, test: impl Fn(&Vec3) -> bool) -> Vec<usize> {
    (0..mesh.nodes.len()).filter(|&node| test(&mesh.nodes[node])).collect()
}

fn clamp(nodes: &[usize]) -> Vec<(usize, f64)> {
    nodes.iter().flat_map(|&node| (0..3).map(move |i| (3 * node + i, 0.0))).collect()
}

/// `total` force in `direction`, distributed over nodes by the tributary fraction of `weight`.
fn spread(
    nodes: &[usize],
    total: f64,
    direction: usize,
    weight: impl Fn(usize) -> f64,
) -> Vec<(usize, f64)> {
    let sum: f64 = nodes.iter().map(|&node| weight(node)).sum();
    nodes.iter().map(|&node| (3 * node + direction, total * weight(node) / sum)).collect()
}

/// Cantilever strip, length over thickness 100, Poisson 0.3, plane strain across: `w = 4 P L³ (1 - ν²) / (E b t³)`
/// from beam theory. One layer of solid-shells bends freely; the mean-dilatation brick locks.
#[test]
fn thin_strip_bends_without_locking() {
    let (length, width, thickness, force) = (100.0, 10.0, 1.0, 0.05);
    let mesh = hex_mesh::rectangle(length, width, thickness, 20, 2, 1);
    let exact =
        4.0 * force * length.powi(3) * (1.0 - 0.09) / (210_000.0 * width * thickness.powi(3));
    let tip = select(&mesh, |x| x.x > length - 1e-9);
    let mut held = clamp(&select(&mesh, |x| x.x < 1e-9));
    held.extend((0..mesh.nodes.len()).map(|node| (3 * node + 1, 0.0)));
    let share = |node: usize| if (mesh.nodes[node].y - 5.0).abs() < 1e-9 { 2.0 } else { 1.0 };
    let problem = Problem { held, loads: spread(&tip, force, 2, share), steps: 1 };
    let deflection = |kind| {
        let (u, _) = solve(&mut body(&mesh, kind, 210_000.0, 0.3), &problem);
        u[3 * tip[0] + 2] / exact
    };
    for kind in [SHELL, SHELL_ENHANCED, ElementKind::Hex8Enhanced] {
        let ratio = deflection(kind);
        assert!((ratio - 1.0).abs() < 0.01, "{kind:?} {ratio}");
    }
    let locked = deflection(ElementKind::Hex8);
    assert!(locked < 0.2, "{locked}");
}

/// Elastica: a cantilever under a dead end load `P L² / (E I) = 4`; tip at `w/L = 0.66996`, `u/L = -0.32894`
/// (Mattiasson 1981).
#[test]
fn cantilever_in_large_rotation_is_the_elastica() {
    let (length, width, thickness) = (10.0, 1.0, 0.1);
    let mesh = hex_mesh::rectangle(length, width, thickness, 20, 1, 1);
    let inertia = width * thickness.powi(3) / 12.0;
    let force = 4.0 * 1e6 * inertia / (length * length);
    let tip = select(&mesh, |x| x.x > length - 1e-9);
    let problem = Problem {
        held: clamp(&select(&mesh, |x| x.x < 1e-9)),
        loads: spread(&tip, force, 2, |_| 1.0),
        steps: 8,
    };
    for kind in [SHELL, SHELL_ENHANCED, ElementKind::Hex8Enhanced] {
        let (u, history) = solve(&mut body(&mesh, kind, 1e6, 0.0), &problem);
        let mean =
            |i: usize| tip.iter().map(|&node| u[3 * node + i]).sum::<f64>() / tip.len() as f64;
        assert!((mean(2) / length / 0.66996 - 1.0).abs() < 0.005, "{kind:?} {}", mean(2) / length);
        assert!((mean(0) / length / -0.32894 - 1.0).abs() < 0.005, "{kind:?} {}", mean(0) / length);
        let last = &history[history.len() - 3..];
        assert!(last[2] < 10.0 * last[1].powf(1.5) + 1e-10, "not quadratic: {history:?}");
    }
}

/// Cook's membrane with `cells` x `cells` elements and end load `force` upwards; returns the displacement of point
/// (48, `height`) over the force.
fn cook(cells: usize, kind: ElementKind, poisson: f64, plane_strain: bool, height: f64) -> f64 {
    let force = 1e-2;
    let mut mesh = hex_mesh::rectangle(1.0, 1.0, 1.0, cells, cells, 1);
    for node in &mut mesh.nodes {
        let (x, y) = (48.0 * node.x, node.y);
        *node = Vec3::new(x, 44.0 * node.x + y * (44.0 - 28.0 * node.x), node.z);
    }
    let end = select(&mesh, |x| x.x > 48.0 - 1e-9);
    let share = |node: usize| {
        let y = mesh.nodes[node].y;
        if (y - 44.0).abs() < 1e-9 || (y - 60.0).abs() < 1e-9 { 1.0 } else { 2.0 }
    };
    let mut held = clamp(&select(&mesh, |x| x.x < 1e-9));
    let flat = select(&mesh, |x| plane_strain || x.z < 1e-9);
    held.extend(flat.iter().map(|&node| (3 * node + 2, 0.0)));
    let problem = Problem { held, loads: spread(&end, force, 1, share), steps: 1 };
    let (u, _) = solve(&mut body(&mesh, kind, 1.0, poisson), &problem);
    let point = select(&mesh, |x| x.x > 48.0 - 1e-9 && (x.y - height).abs() < 1e-9);
    u[3 * point[0] + 1] / force
}

/// Plane stress, E = 1, ν = 1/3: the middle of the end rises 23.96 per unit load (Simo & Rifai 1990).
#[test]
fn cook_membrane_in_plane_stress() {
    for kind in [SHELL_ENHANCED, ElementKind::Hex8Enhanced] {
        let rise = cook(16, kind, 1.0 / 3.0, false, 52.0);
        assert!((rise / 23.96 - 1.0).abs() < 0.02, "{kind:?} {rise}");
    }
    // Without membrane modes the in-plane bending of this mesh is that of bilinear quadrilaterals.
    let plain = cook(16, SHELL, 1.0 / 3.0, false, 52.0);
    assert!(
        plain < 0.99 * cook(16, SHELL_ENHANCED, 1.0 / 3.0, false, 52.0) && plain > 22.5,
        "{plain}"
    );
}

/// Plane strain, ν = 0.4999: the coarse mesh agrees with the fine one of another formulation. The remaining deviation
/// is discretisation error, not volumetric locking.
#[test]
fn nearly_incompressible_cook_membrane_does_not_lock() {
    let fine = cook(24, ElementKind::Hex8Enhanced, 0.4999, true, 60.0);
    for kind in [ElementKind::Hex8, ElementKind::Hex8Enhanced] {
        let rise = cook(12, kind, 0.4999, true, 60.0);
        assert!((rise / fine - 1.0).abs() < 0.025, "{kind:?} {rise} {fine}");
    }
}

/// Pinched hemisphere with an 18 degree hole, R = 10, t = 0.04, E = 6.825e7, ν = 0.3, quarter with unit loads:
/// 0.0940 (MacNeal & Harder 1985; 0.093 by Simo, Fox & Rifai 1989).
#[test]
fn pinched_hemisphere() {
    let cells = 16;
    let (radius, thickness) = (10.0, 0.04);
    let mut mesh = hex_mesh::rectangle(1.0, 1.0, 1.0, cells, cells, 1);
    let degrees = std::f64::consts::PI / 180.0;
    for node in &mut mesh.nodes {
        let (along, up) = (90.0 * degrees * node.x, 72.0 * degrees * node.y);
        let r = radius + thickness * (node.z - 0.5);
        *node = Vec3::new(r * up.cos() * along.cos(), r * up.cos() * along.sin(), r * up.sin());
    }
    let mut held: Vec<(usize, f64)> = Vec::new();
    held.extend(select(&mesh, |x| x.y.abs() < 1e-9).iter().map(|&node| (3 * node + 1, 0.0)));
    held.extend(select(&mesh, |x| x.x.abs() < 1e-9).iter().map(|&node| (3 * node, 0.0)));
    let on_x = select(&mesh, |x| x.y.abs() < 1e-9 && x.z.abs() < 1e-9);
    let on_y = select(&mesh, |x| x.x.abs() < 1e-9 && x.z.abs() < 1e-9);
    held.push((3 * on_x[0] + 2, 0.0));
    let size = 1e-2;
    let mut loads = spread(&on_x, size, 0, |_| 1.0);
    loads.extend(spread(&on_y, -size, 1, |_| 1.0));
    let problem = Problem { held, loads, steps: 1 };
    for kind in [SHELL, SHELL_ENHANCED] {
        let (u, _) = solve(&mut body(&mesh, kind, 6.825e7, 0.3), &problem);
        let out = 0.5 * (u[3 * on_x[0]] + u[3 * on_x[1]]) / size;
        assert!((out / 0.0935 - 1.0).abs() < 0.02, "{kind:?} {out}");
    }
}
