//! Inverted elements: the strains of a solid-shell, computed from lengths, do not detect inversion.

use super::{setup, stage, steel};
use crate::assembly::Body;
use crate::element::{ElementKind, FailureReason};
use crate::newton::outcome::NewtonError;
use crate::sheet::hex_mesh::rectangle;
use crate::{
    Constraints, Control, Curve, IncrementReport, Simulation, SimulationError, SimulationSetup,
};

/// A sheet of 3 x 3 elements of 2 mm, all held but one corner, which a force pushes along the diagonal into its
/// element. Displacement of the corner at the last equilibrium [mm], and the result of the run.
fn pushed_in(force: f64) -> (f64, Result<(), SimulationError>) {
    let mesh = rectangle(6.0, 6.0, 0.8, 3, 3, 1);
    let count = mesh.nodes.len();
    let corner: Vec<usize> =
        (0..count).filter(|&n| mesh.nodes[n].x.min(mesh.nodes[n].y) > 5.9).collect();
    let mut held = Constraints::none(count);
    let mut loads = vec![0.0; 3 * count];
    for node in 0..count {
        let axes = if corner.contains(&node) { 2..3 } else { 0..3 };
        axes.for_each(|axis| held.hold(node, axis));
    }
    for &node in &corner {
        loads[3 * node] = -force / 8.0_f64.sqrt();
        loads[3 * node + 1] = -force / 8.0_f64.sqrt();
    }
    let kind = ElementKind::SolidShell { points: 3, membrane: true };
    let [body, judge] = [(); 2].map(|()| Body::new(mesh.clone(), kind, steel()).unwrap());
    let mut push = stage("push", Vec::new(), 1.0);
    push.load = Curve::ramp(0.0, 1.0);
    let setup = SimulationSetup { loads, ..setup(body, held, Vec::new(), vec![push]) };
    let mut way = 0.0;
    let ended = Simulation::new(setup).unwrap().run(&mut |r: &IncrementReport<'_>| {
        judge.not_inside_out(r.displacements).unwrap();
        way = -r.displacements[3 * corner[0]];
        Control::Continue
    });
    (way, ended.map(|_| ()))
}

#[test]
fn no_equilibrium_with_an_inverted_element_is_accepted() {
    let (way, ended) = pushed_in(1e5);
    assert!(ended.is_ok() && way > 0.3, "{way} {ended:?}");
    // Its stiffness grows without bound, but more slowly than steps of that force jump over the singularity.
    let (way, ended) = pushed_in(1e8);
    // There the corner lies on the opposite side of the diagonal for a Gauss point, 2 / 1.577 mm away.
    assert!((way - 1.268).abs() < 1e-3, "{way}");
    let Err(SimulationError::GaveUp { cause, .. }) = ended else { panic!("{ended:?}") };
    let NewtonError::Element(failure) = *cause else { panic!("{cause}") };
    assert_eq!(failure.element, 8);
    assert!(matches!(failure.reason, FailureReason::Inverted { .. }), "{failure}");
}
