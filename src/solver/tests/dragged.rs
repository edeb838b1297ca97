//! A plate moved along a sheet by a force or a spring, with any constraints of the sheet: only friction resists it.

use super::claims::square;
use super::{body, setup, stage, steel, tool};
use crate::sheet::hex_mesh::rectangle;
use crate::{
    Constraints, Control, Curve, IncrementReport, Motion, SheetSide, Simulation, SimulationError,
    Stage, ToolSetup,
};
use kanagata_geometry::Vec3;

/// Final states of the stages of a plate pressed on a sheet of 10 x 10 mm with 500 N and moved along it: its travel
/// [mm], and its friction over the Coulomb limit.
fn dragged(
    held: f64,
    stop: Option<f64>,
    drives: Vec<(Motion, f64)>,
) -> Result<Vec<[f64; 2]>, SimulationError> {
    let mesh = rectangle(10.0, 10.0, 1.0, 4, 4, 1);
    let mut constraints = Constraints::none(mesh.nodes.len());
    for (node, _) in mesh.nodes.iter().enumerate().filter(|(_, x)| x.x <= held) {
        (0..2).for_each(|axis| constraints.hold(node, axis));
    }
    let plate = tool("plate", square("plate", 1.0, false), Vec3::x(), SheetSide::Top, 0.3);
    let push = tool("push", square("push", 0.0, true), Vec3::z(), SheetSide::Bottom, 0.0);
    let pushes = || Motion::Force(Curve::to(500.0));
    let mut stages = vec![stage("press", vec![Motion::Hold, pushes()], 1.0)];
    for (drive, step) in drives {
        let own = stage("drag", vec![drive, pushes()], step);
        stages.push(Stage { largest_step: step, ..own });
    }
    let plate = ToolSetup { stop, ..plate };
    let mut ends = Vec::new();
    let mut setup = setup(body(mesh, steel()), constraints, vec![plate, push], stages);
    setup.limits.friction_transition = 1e-5;
    Simulation::new(setup)?.run(&mut |r: &IncrementReport<'_>| {
        if r.share == 1.0 {
            ends.push([r.tools[0].travel, r.tools[0].force / 150.0]);
        }
        Control::Continue
    })?;
    Ok(ends.split_off(1))
}

/// For any constraints of the sheet: a force below the friction limit, and a spring that moves the plate along it and
/// back.
#[test]
fn a_force_or_a_spring_drags_a_plate_over_a_sheet() {
    for held in [0.0, 5.0, 10.0] {
        let ends = dragged(held, None, vec![(Motion::Force(Curve::to(149.0)), 0.2)]).unwrap();
        assert!((ends[0][1] - 149.0 / 150.0).abs() < 1e-6, "{held}: {ends:?}");
        assert!(ends[0][0] < 2e-3, "{held}: {ends:?}");
        for step in [0.5, 0.02] {
            let spring = |to| Motion::Spring { force: Curve::to(to), stiffness: 50.0 };
            let ends =
                dragged(held, None, vec![(spring(200.0), 0.2), (spring(0.0), step)]).unwrap();
            assert!((ends[0][0] - 1.0).abs() < 1e-6 && (ends[0][1] - 1.0).abs() < 1e-6, "{ends:?}");
            let [travel, share] = ends[1];
            assert!((0.999..1.0).contains(&travel), "{held}, {step}: {ends:?}");
            assert!((share * 150.0 + 50.0 * travel).abs() < 1e-4, "{held}, {step}: {ends:?}");
        }
    }
}

/// A force above the friction limit moves the plate to its stop, where friction stays constant in time.
#[test]
fn friction_of_a_plate_at_rest_is_constant() {
    for held in [0.0, 10.0] {
        let force = |to| Motion::Force(Curve::to(to));
        let drives = vec![(force(400.0), 0.2), (force(400.0), 0.25), (force(30.0), 0.2)];
        let ends = dragged(held, Some(0.5), drives).unwrap();
        for [travel, share] in &ends[..2] {
            assert_eq!(*travel, 0.5, "{held}: {ends:?}");
            assert!((share - 1.0).abs() < 1e-6, "{held}: {ends:?}");
        }
        assert!((ends[2][1] - 0.2).abs() < 1e-6 && ends[2][0] < 0.5, "{held}: {ends:?}");
    }
}

#[test]
fn a_force_above_the_friction_limit_is_reported() {
    for held in [0.0, 5.0, 10.0] {
        let drag = dragged(held, None, vec![(Motion::Force(Curve::to(160.0)), 0.2)]);
        let told = drag.unwrap_err().to_string();
        assert!(told.contains("`plate` pushes with 1."), "{told}");
        assert!(told.contains("only friction holds it along its direction"), "{told}");
        assert!(told.contains("with 1.5000e2 N at the present normal forces"), "{told}");
    }
}
