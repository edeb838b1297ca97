//! Springback of a bend: `1/R - 1/R' = 12 M (1 - nu^2) / (E t^3)` for a strip in plane strain.

use std::sync::Arc;

use super::{setup, stage};
use crate::geometry::Vec3;
use crate::solver::assembly::Body;
use crate::solver::blank::rectangle;
use crate::solver::element::ElementKind;
use crate::solver::material::elastic::Elastic;
use crate::solver::material::hardening::Hardening;
use crate::solver::material::hill48::Hill48;
use crate::solver::material::plastic::Plastic;
use crate::solver::{Constraints, Control, Curve, IncrementReport, Simulation, SimulationSetup};

const YOUNG: f64 = 210_000.0;
const POISSON: f64 = 0.3;
const LENGTH: f64 = 10.0;

/// A strip of unit width and thickness, symmetric about x = 0, bent by a couple of `force` on the nodes of its end, then
/// let go. Moment and curvature of the bent strip, curvature of the strip let go.
fn bend(kind: ElementKind, layers: usize, cells: usize, force: f64) -> [f64; 3] {
    let mesh = rectangle(LENGTH, 1.0, 1.0, cells, 1, layers);
    let count = mesh.nodes.len();
    let mut constraints = Constraints::none(count);
    constraints.symmetry_plane(&mesh.nodes, 0, 0.0, 1e-9);
    (0..count).for_each(|node| constraints.hold(node, 1));
    (0..count).filter(|&n| mesh.nodes[n].x == 0.0 && mesh.nodes[n].z == 0.0).for_each(|node| {
        constraints.hold(node, 2);
    });
    let (low, high) = (mesh.bottom_nodes(), mesh.top_nodes());
    let mut loads = vec![0.0; 3 * count];
    let end: Vec<(usize, usize)> = low
        .iter()
        .zip(&high)
        .map(|(&a, &b)| (a as usize, b as usize))
        .filter(|&(a, _)| mesh.nodes[a].x > LENGTH - 1e-9)
        .collect();
    for &(a, b) in &end {
        loads[3 * a] = 0.5 * force;
        loads[3 * b] = -0.5 * force;
    }
    let swift = Hardening::Swift { k: 529.5, eps0: 0.00439, n: 0.268 };
    let elastic = Elastic { young: YOUNG, poisson: POISSON };
    let steel = Arc::new(Plastic::new(elastic, &Hill48::MISES, swift).unwrap());
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
    let at = |u: &[f64], node: usize| {
        mesh.nodes[node] + Vec3::from_column_slice(&u[3 * node..3 * node + 3])
    };
    let curvature = |u: &[f64]| {
        // Circle through the mid-surface at x = 0, symmetric: x^2 + z^2 = 2 z / k.
        let middle =
            |column: usize| 0.5 * (at(u, low[column] as usize) + at(u, high[column] as usize));
        let near = 2 * (cells / 2);
        let d = middle(near) - middle(0);
        2.0 * d.z / (d.x * d.x + d.z * d.z)
    };
    let (a, b) = end[0];
    let lever = at(&states[0], b) - at(&states[0], a);
    [force * lever.z, curvature(&states[0]), curvature(&states[states.len() - 1])]
}

#[test]
fn a_bend_springs_back_by_its_moment_over_its_stiffness() {
    let shell = |points| ElementKind::SolidShell { points, membrane: true };
    for (kind, layers) in [(shell(5), 1), (shell(9), 1), (ElementKind::Hex8Enhanced, 4)] {
        let [moment, bent, left] = bend(kind, layers, 20, 44.0);
        let exact = 12.0 * moment * (1.0 - POISSON * POISSON) / YOUNG;
        let error = (bent - left) / exact - 1.0;
        println!("{kind:?}: M {moment:.3}, k {bent:.5} to {left:.5}, springback {error:+.5}");
        // Bent to 60 thicknesses, far into plasticity: most of the bend stays.
        assert!(bent > 0.014 && left > 0.8 * bent, "{kind:?}: {bent} {left}");
        assert!(error.abs() < 1e-3, "{kind:?}: {error}");
    }
}
