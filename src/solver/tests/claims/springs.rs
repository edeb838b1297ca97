//! Contact by springs (penalty and augmented Lagrangian) compared with exact contact.

use super::{body, setup, square, stage, steel, tool};
use crate::sheet::hex_mesh::rectangle;
use crate::{
    Constraints, ContactMethod, Control, Curve, IncrementReport, Motion, SheetSide, Simulation,
};
use kanagata_geometry::Vec3;

/// Force of the press on a block pressed by 0.02 mm between a bed and a press, iterations, largest and smallest
/// penetration of a node.
fn pressed(contact: ContactMethod) -> (f64, usize, [f64; 2]) {
    let mesh = rectangle(6.0, 4.0, 2.0, 3, 2, 2);
    let mut constraints = Constraints::none(mesh.nodes.len());
    constraints.symmetry_plane(&mesh.nodes, 0, 0.0, 1e-9);
    constraints.symmetry_plane(&mesh.nodes, 1, 0.0, 1e-9);
    let tools = vec![
        tool("bed", square("bed", 0.0, true), Vec3::z(), SheetSide::Bottom, 0.2),
        tool("press", square("press", 2.0, false), -Vec3::z(), SheetSide::Top, 0.2),
    ];
    let motions = vec![Motion::Hold, Motion::Travel(Curve::ramp(0.0, 0.02))];
    let stages = vec![stage("press", motions, 0.5)];
    let mut setup = setup(body(mesh, steel()), constraints, tools, stages);
    setup.limits.contact = contact;
    let mut sim = Simulation::new(setup).unwrap();
    let (mut force, mut iterations, mut reported) = (0.0, 0, 0.0);
    sim.run(&mut |r: &IncrementReport<'_>| {
        (force, iterations) = (r.tools[1].force, r.iterations_total);
        reported = r.history.last().map_or(0.0, |last| last.penetration);
        Control::Continue
    })
    .unwrap();
    let top = sim.sys.contact.active().filter(|(_, c)| c.tool == 1);
    let gaps: Vec<f64> = top.map(|(_, c)| c.foot.gap).collect();
    assert_eq!(gaps.len(), 12);
    let all = sim.sys.contact.active().map(|(_, c)| -c.foot.gap).fold(0.0, f64::max);
    assert!((reported - all).abs() < 1e-15, "{reported} {all}");
    if let ContactMethod::Penalty { .. } = contact {
        for (k, c) in sim.sys.contact.active() {
            let spring = sim.sys.lambda(k) * sim.sys.scales.compliance;
            assert!((c.foot.gap + spring).abs() < 1e-9 * spring, "{} {spring}", c.foot.gap);
        }
    }
    let deepest = gaps.iter().copied().fold(f64::INFINITY, f64::min);
    (force, iterations, [deepest, gaps.iter().copied().fold(f64::NEG_INFINITY, f64::max)])
}

#[test]
fn the_penalty_error_is_inverse_to_its_stiffness_and_vanishes_with_augmentation() {
    let (exact, few, _) = pressed(ContactMethod::Exact);
    let [soft, hard] = [20.0, 200.0].map(|stiffness| pressed(ContactMethod::Penalty { stiffness }));
    let (error, smaller) = (1.0 - soft.0 / exact, 1.0 - hard.0 / exact);
    assert!(error > 1e-3 && soft.2[1] < 0.0, "{error} {:?}", soft.2);
    assert!((8.0..12.0).contains(&(error / smaller)), "{error} {smaller}");
    let (force, many, gaps) = pressed(ContactMethod::Augmented { stiffness: 20.0 });
    // Gap tolerance over the 0.02 mm travel of the press.
    assert!((force / exact - 1.0).abs() < 1e-4, "{force} {exact}");
    assert!(gaps.iter().all(|gap| gap.abs() <= 2e-6), "{gaps:?}");
    assert!(
        2 * many > 3 * few,
        "{many} iterations against {few}: exact contact needs no outer loop"
    );
}
