//! A whole model turned in space: the same iterations, the same results turned.

use std::sync::Arc;

use nalgebra::{Rotation3, Unit};

use super::{setup, stage, tool};
use crate::contact::test_tools::Builder;
use crate::geometry::{Mat3, Vec3};
use crate::solver::assembly::Body;
use crate::solver::blank::rectangle;
use crate::solver::element::ElementKind;
use crate::solver::material::elastic::Elastic;
use crate::solver::material::hardening::Hardening;
use crate::solver::material::hill48::Hill48;
use crate::solver::material::plastic::Plastic;
use crate::solver::{
    Constraints, Control, Curve, IncrementReport, Motion, Placement, SheetSide, Simulation,
};

/// Element and layers of it.
type Element = (ElementKind, usize);

/// Travel of the dome [mm].
const TRAVEL: f64 = 4.0;

/// A sheet of 60 x 60 x 0.8 mm, clamped all round, stretched with friction over a dome of radius 25 mm, out of the middle
/// so that nothing is symmetric; anisotropic steel. Everything turned by `turn`: the iterations of the increments, and the
/// displacements at the end turned back.
fn stretched(turn: &Mat3, element: Element) -> (Vec<usize>, Vec<Vec3>) {
    let (kind, layers) = element;
    let mut mesh = rectangle(60.0, 60.0, 0.8, 9, 9, layers);
    let mut constraints = Constraints::none(mesh.nodes.len());
    for axis in 0..2 {
        for side in [0.0, 60.0] {
            for node in 0..mesh.nodes.len() {
                if (mesh.nodes[node][axis] - side).abs() < 1e-9 {
                    (0..3).for_each(|held| constraints.hold(node, held));
                }
            }
        }
    }
    mesh.nodes.iter_mut().for_each(|x| *x = turn * *x);
    let hill = Hill48 { f: 0.251, g: 0.297, h: 0.703, l: 1.5, m: 1.5, n: 1.29 };
    let swift = Hardening::Swift { k: 565.0, eps0: 0.007, n: 0.26 };
    let elastic = Elastic { young: 210_000.0, poisson: 0.3 };
    let steel = Plastic::new(elastic, &hill, swift).unwrap().with_axes(turn);
    let dome = Builder::new("dome").grid(6, 6, |u, v| {
        let outward = Vec3::new(1.4 * (u - 0.5), 1.4 * (v - 0.5), -1.0).normalize();
        (turn * (Vec3::new(27.0, 31.5, 30.0) + 25.0 * outward), turn * outward)
    });
    let mut dome = tool("dome", dome.build(), turn * -Vec3::z(), SheetSide::Top, 0.1);
    dome.placement = Placement::Touch;
    let mut draw = stage("draw", vec![Motion::Travel(Curve::ramp(0.0, TRAVEL))], 0.05);
    draw.largest_step = 0.2;
    let body = Body::new(mesh, kind, Arc::new(steel)).unwrap();
    let mut all = setup(body, constraints, vec![dome], vec![draw]);
    all.limits.friction_transition = 1e-4;
    all.limits.force_tolerance = 1e-6;
    let mut iterations = Vec::new();
    let mut sim = Simulation::new(all).unwrap();
    sim.run(&mut |r: &IncrementReport<'_>| {
        iterations.push(r.iterations);
        Control::Continue
    })
    .unwrap();
    let back = |u: &[f64]| turn.transpose() * Vec3::from_column_slice(u);
    (iterations, sim.displacements().chunks_exact(3).map(back).collect())
}

#[test]
fn a_turned_model_takes_the_same_iterations_to_the_same_result() {
    let axis = Unit::new_normalize(Vec3::new(1.0, -2.0, 0.5));
    let turns = [
        Mat3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0),
        Rotation3::from_axis_angle(&axis, 0.7).into_inner(),
    ];
    let kinds = [
        (ElementKind::Hex8, 2),
        (ElementKind::Hex8Enhanced, 2),
        (ElementKind::SolidShell { points: 5, membrane: true }, 1),
    ];
    for element in kinds {
        let (iterations, straight) = stretched(&Mat3::identity(), element);
        let deepest = straight.iter().map(|u| -u.z).fold(0.0, f64::max);
        assert!((deepest - TRAVEL).abs() < 0.2, "{deepest}");
        for turn in &turns {
            let (turned_iterations, turned) = stretched(turn, element);
            let off = straight.iter().zip(&turned).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            println!(
                "{element:?}: {} iterations, off by {off:e} mm",
                iterations.iter().sum::<usize>()
            );
            assert_eq!(iterations, turned_iterations, "{element:?}");
            assert!(off < 1e-8 * TRAVEL, "{element:?}: {off:e} mm");
        }
    }
}
