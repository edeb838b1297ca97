//! Springback of a bend: `1/R - 1/R' = 12 M (1 - nu^2) / (E t^3)` for a strip in plane strain; moment of a sharp
//! bend.

use std::sync::Arc;

use super::{setup, stage};
use crate::assembly::Body;
use crate::element::ElementKind;
use crate::material::elastic::Elastic;
use crate::material::hardening::Hardening;
use crate::material::hill48::Hill48;
use crate::material::plastic::Plastic;
use crate::sheet::hex_mesh::{HexMesh, rectangle};
use crate::{Constraints, Control, Curve, IncrementReport, Simulation, SimulationSetup};
use kanagata_geometry::Vec3;

const YOUNG: f64 = 210_000.0;
const POISSON: f64 = 0.3;

/// A strip of unit width and thickness, symmetric about x = 0, `length` [mm] with the given number of cells, bent by
/// a couple of `force` on the nodes of its end, then released. Moment and curvature of the bent strip, curvature
/// after release.
fn bend(
    (kind, layers): (ElementKind, usize),
    (length, cells): (f64, usize),
    force: f64,
) -> [f64; 3] {
    let mesh = rectangle(length, 1.0, 1.0, cells, 1, layers);
    let count = mesh.nodes.len();
    let mut constraints = Constraints::none(count);
    constraints.symmetry_plane(&mesh.nodes, 0, 0.0, 1e-9);
    (0..count).for_each(|node| constraints.hold(node, 1));
    (0..count).filter(|&n| mesh.nodes[n].x == 0.0 && mesh.nodes[n].z == 0.0).for_each(|node| {
        constraints.hold(node, 2);
    });
    let (loads, [a, b]) = couple(&mesh, length, force);
    let elastic = Elastic { young: YOUNG, poisson: POISSON };
    let steel = Arc::new(Plastic::new(elastic, &Hill48::MISES, swift()).unwrap());
    let stages = [(0.0, 1.0), (1.0, 0.0)].map(|(from, to)| {
        let mut stage = stage("bend", Vec::new(), 0.05);
        stage.load = Curve::ramp(from, to);
        stage.largest_step = 0.1;
        stage
    });
    let body = Body::new(mesh.clone(), kind, steel).unwrap();
    let setup = SimulationSetup { loads, ..setup(body, constraints, Vec::new(), stages.to_vec()) };
    let mut states: Vec<Vec<f64>> = Vec::new();
    Simulation::new(setup)
        .unwrap()
        .run(&mut |r: &IncrementReport<'_>| {
            if r.share == 1.0 {
                states.push(r.displacements.to_vec());
            }
            Control::Continue
        })
        .unwrap();
    let lever = moved(&mesh, &states[0], b) - moved(&mesh, &states[0], a);
    let [bent, released] =
        [0, states.len() - 1].map(|k| curvature(&mesh, &states[k], 2 * (cells / 2)));
    [force * lever.z, bent, released]
}

/// Opposite forces [N] on the nodes of the end of a strip, and one of its pairs of a lower and an upper node.
fn couple(mesh: &HexMesh, length: f64, force: f64) -> (Vec<f64>, [usize; 2]) {
    let mut loads = vec![0.0; 3 * mesh.nodes.len()];
    let pairs = mesh.bottom_nodes().into_iter().zip(mesh.top_nodes());
    let end: Vec<[usize; 2]> = pairs
        .map(|(a, b)| [a as usize, b as usize])
        .filter(|&[a, _]| mesh.nodes[a].x > length - 1e-9)
        .collect();
    for [a, b] in &end {
        loads[3 * a] = 0.5 * force;
        loads[3 * b] = -0.5 * force;
    }
    (loads, end[0])
}

/// Position of a node with the displacements `u`.
fn moved(mesh: &HexMesh, u: &[f64], node: usize) -> Vec3 {
    mesh.nodes[node] + Vec3::from_column_slice(&u[3 * node..3 * node + 3])
}

/// Curvature of the circle through the middle surface at a column and, symmetric, at x = 0: x^2 + z^2 = 2 z / k.
fn curvature(mesh: &HexMesh, u: &[f64], column: usize) -> f64 {
    let (low, high) = (mesh.bottom_nodes(), mesh.top_nodes());
    let middle = |column: usize| {
        0.5 * (moved(mesh, u, low[column] as usize) + moved(mesh, u, high[column] as usize))
    };
    let d = middle(column) - middle(0);
    2.0 * d.z / (d.x * d.x + d.z * d.z)
}

fn swift() -> Hardening {
    Hardening::Swift { k: 529.5, eps0: 0.00439, n: 0.268 }
}

fn shell(points: u8) -> ElementKind {
    ElementKind::SolidShell { points, membrane: true }
}

/// Moment of a strip of unit width and thickness in plane strain with fibre strain `ln (1 + k z)` only.
fn moment_of_fibres(curvature: f64) -> f64 {
    const FIBRES: usize = 2000;
    let width = 2.0 / 3.0_f64.sqrt();
    let stress = |z: f64| {
        let total = width * (curvature * z).ln_1p().abs();
        let mut plastic = 0.0;
        for _ in 0..60 {
            plastic = (total - swift().flow_stress(plastic).0 / YOUNG).max(0.0);
        }
        let elastic = YOUNG / (1.0 - POISSON * POISSON) * total / width;
        if plastic > 0.0 { width * swift().flow_stress(plastic).0 } else { elastic }
    };
    let place = |k: usize| (k as f64 + 0.5) / FIBRES as f64 - 0.5;
    (0..FIBRES).map(|k| stress(place(k)) * place(k).abs() / FIBRES as f64).sum()
}

/// In bending to a radius of few thicknesses the thickness strain varies with the square of the height. Without this
/// term the strip is 5 to 28 % too stiff at 9 to 5.6 thicknesses.
#[test]
fn a_sharp_bend_has_the_moment_of_its_fibres() {
    for ((kind, layers), force) in [
        ((shell(5), 1), 59.0),
        ((shell(9), 1), 59.0),
        ((shell(9), 1), 76.0),
        ((ElementKind::SolidShell { points: 9, membrane: false }, 1), 76.0),
        ((ElementKind::Hex8Enhanced, 2), 59.0),
    ] {
        let [moment, bent, _] = bend((kind, layers), (2.0, 4), force);
        let off = moment / moment_of_fibres(bent) - 1.0;
        println!(
            "{kind:?} x {layers}: R/t {:.2}, M {moment:.2}, {off:+.4} of its fibres'",
            1.0 / bent
        );
        assert!((4.0..15.0).contains(&(1.0 / bent)) && off.abs() < 0.05, "{kind:?}: {off}");
    }
}

/// One layer of solid-shells with the default of six points, and with eight and ten, over R/t 6 to 100. Below ten thicknesses
/// what is missing is not that of the points: eight and ten have the same.
#[test]
fn six_points_have_the_moment_of_the_fibres() {
    for points in [6, 8, 10] {
        let off = [41.0, 44.0, 50.0, 59.0, 68.0, 74.0].map(|force| {
            let [moment, bent, _] = bend((shell(points), 1), (2.0, 4), force);
            let off = moment / moment_of_fibres(bent) - 1.0;
            println!("{points} points: R/t {:.1}, {off:+.4} of its fibres'", 1.0 / bent);
            off.abs()
        });
        assert!(off[..4].iter().all(|off| *off < 0.01), "{points}: {off:?}");
        assert!(off[4..].iter().all(|off| *off < 0.022), "{points}: {off:?}");
    }
}

#[test]
fn a_bend_springs_back_by_its_moment_over_its_stiffness() {
    for (kind, layers) in
        [(shell(5), 1), (shell(6), 1), (shell(9), 1), (ElementKind::Hex8Enhanced, 4)]
    {
        let [moment, bent, left] = bend((kind, layers), (10.0, 20), 44.0);
        let exact = 12.0 * moment * (1.0 - POISSON * POISSON) / YOUNG;
        let error = (bent - left) / exact - 1.0;
        println!("{kind:?}: M {moment:.3}, k {bent:.5} to {left:.5}, springback {error:+.5}");
        // Bent to 60 thicknesses, far into plasticity: most of the curvature remains.
        assert!(bent > 0.014 && left > 0.8 * bent, "{kind:?}: {bent} {left}");
        assert!(error.abs() < 1e-3, "{kind:?}: {error}");
    }
}
