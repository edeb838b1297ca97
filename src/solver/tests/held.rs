//! Nodes constrained in a direction in which the tool normal has a component, or along which the tool slides: normal
//! force and friction act on the support too.

use super::claims::square;
use super::{body, setup, stage, steel, tool};
use crate::sheet::hex_mesh::rectangle;
use crate::test_tools::plane;
use crate::{
    Constraints, Control, Curve, IncrementReport, Motion, SheetSide, Simulation, SimulationSetup,
};
use kanagata_geometry::Vec3;

/// Final state of a wall: force vector [N], travel [mm], its work and that of friction [N mm].
struct End {
    force: Vec3,
    travel: f64,
    work: f64,
    friction: f64,
}

/// A strip of 20 x 4 x 1 mm, clamped at one end, free in the transverse direction. A wall inclined by 30 degrees
/// moves down and presses its other end.
fn pressed(motion: Motion) -> End {
    let mesh = rectangle(20.0, 4.0, 1.0, 10, 2, 1);
    let mut constraints = Constraints::none(mesh.nodes.len());
    constraints.symmetry_plane(&mesh.nodes, 0, 0.0, 1e-9);
    (0..mesh.nodes.len()).for_each(|node| {
        constraints.hold(node, 1);
        constraints.hold(node, 2);
    });
    let (sin, cos) = 30.0_f64.to_radians().sin_cos();
    // Through the upper edge of the end.
    let up = Vec3::new(sin, 0.0, cos);
    let corner = Vec3::new(20.0, -2.0, 1.0) - up * 5.0;
    let normal = Vec3::new(-cos, 0.0, sin);
    let face = plane("wall", corner, Vec3::y() * 8.0, up * 10.0, normal);
    let wall = tool("wall", face, Vec3::z(), SheetSide::Both, 0.0);
    let press = stage("press", vec![motion], 0.25);
    let setup: SimulationSetup = setup(body(mesh, steel()), constraints, vec![wall], vec![press]);
    let mut end = End { force: Vec3::zeros(), travel: 0.0, work: 0.0, friction: 0.0 };
    Simulation::new(setup)
        .unwrap()
        .run(&mut |r: &IncrementReport<'_>| {
            let (force, travel) = (Vec3::from(r.tools[0].force_vector), r.tools[0].travel);
            end = End { force, travel, work: r.energies.external, friction: r.energies.friction };
            Control::Continue
        })
        .unwrap();
    end
}

#[test]
fn an_inclined_wall_pushes_along_its_normal_and_does_the_work() {
    let end = pressed(Motion::Travel(Curve::to(1.5)));
    assert!(end.force.x < -1000.0, "{}", end.force);
    let slope = 30.0_f64.to_radians().tan();
    assert!((end.force.z / -end.force.x / slope - 1.0).abs() < 1e-9, "{}", end.force);
    assert!(end.work > 10.0 && end.friction.abs() < 1e-9 * end.work, "{}", end.friction);
    // Driven by this force it has the same travel.
    let forced = pressed(Motion::Force(Curve::ramp(0.0, end.force.z)));
    assert!((forced.travel / 1.5 - 1.0).abs() < 1e-6, "{}", forced.travel);
}

/// A sheet, 1 mm thick, with the numbers of elements along x and y, and the force [N] that presses it on a bed.
struct Pressed {
    size: [f64; 2],
    elements: [usize; 2],
    force: f64,
}

const SMALL: Pressed = Pressed { size: [8.0, 4.0], elements: [4, 2], force: 100.0 };

/// The sheet in sliding contact with its bed, which moves along `way`, friction 0.3; nodes up to `held` are held
/// along x and y. Force of the bed [N], its work and that of friction [N mm].
fn friction_ratio(
    sheet: &Pressed,
    held: f64,
    way: Vec3,
    course: Curve,
    step: f64,
) -> (Vec3, [f64; 2]) {
    let ([x, y], [nx, ny], force) = (sheet.size, sheet.elements, sheet.force);
    let mesh = rectangle(x, y, 1.0, nx, ny, 1);
    let mut constraints = Constraints::none(mesh.nodes.len());
    for (node, _) in mesh.nodes.iter().enumerate().filter(|(_, x)| x.x <= held) {
        constraints.hold(node, 0);
        constraints.hold(node, 1);
    }
    let tools = vec![
        tool("bed", square("bed", 0.0, true), way, SheetSide::Bottom, 0.3),
        tool("weight", square("weight", 1.0, false), -Vec3::z(), SheetSide::Top, 0.0),
    ];
    let weight = |curve: Curve| Motion::Force(curve);
    let stages = vec![
        stage("load", vec![Motion::Hold, weight(Curve::ramp(0.0, force))], 1.0),
        stage("rub", vec![Motion::Travel(course), weight(Curve::constant(force))], step),
    ];
    let mut setup = setup(body(mesh, steel()), constraints, tools, stages);
    setup.stages[1].largest_step = step;
    let mut end = (Vec3::zeros(), [0.0; 2]);
    Simulation::new(setup)
        .unwrap()
        .run(&mut |r: &IncrementReport<'_>| {
            let force = Vec3::from(r.tools[0].force_vector);
            end = (force, [r.energies.external, r.energies.friction]);
            Control::Continue
        })
        .unwrap();
    end
}

/// Friction has the Coulomb value for any constraints and any direction of the bed.
#[test]
fn friction_on_constrained_nodes_is_carried_by_their_supports() {
    for way in [Vec3::x(), Vec3::new(0.6, 0.8, 0.0)] {
        for held in [0.0, 4.0, 8.0] {
            let (force, [work, friction]) = friction_ratio(&SMALL, held, way, Curve::to(0.05), 0.2);
            let along = force.dot(&way);
            assert!((along / 30.0 - 1.0).abs() < 1e-3, "{held}: {along}");
            let across = (force - way * along).xy().norm();
            assert!(across < 0.02 * along, "{held}: {across}");
            assert!((friction / 1.5 - 1.0).abs() < 0.02, "{held}: {friction}");
            assert!(work >= friction, "{held}: {work} {friction}");
        }
    }
}

/// Reversed sliding: friction changes its direction within increments, and its work is that of the path.
#[test]
fn reversed_friction_does_the_work_of_its_path() {
    let course = Curve::new(vec![(0.0, 0.0), (0.25, 0.05), (0.75, -0.05), (1.0, 0.0)]);
    let (_, [work, friction]) = friction_ratio(&SMALL, 0.0, Vec3::x(), course, 0.125);
    assert!((friction / 6.0 - 1.0).abs() < 0.02, "{friction}");
    assert!((work / friction - 1.0).abs() < 0.02, "{work} {friction}");
}

/// Large sliding across a sheet held at one end: the pressure moves to the other side when friction reverses, some
/// nodes separate and others come into contact.
#[test]
fn nodes_that_separate_as_friction_reverses_keep_its_work() {
    let sheet = Pressed { size: [10.0, 10.0], elements: [6, 6], force: 500.0 };
    for step in [0.5, 0.1] {
        let course = Curve::new(vec![(0.0, 0.0), (0.5, 1.0), (1.0, -1.0)]);
        let (force, [work, friction]) = friction_ratio(&sheet, 0.0, Vec3::y(), course, step);
        assert!((force.y / -150.0 - 1.0).abs() < 1e-3, "{step}: {force}");
        assert!((friction / 450.0 - 1.0).abs() < 2e-3, "{step}: {friction}");
        assert!((work / friction - 1.0).abs() < 1e-3, "{step}: {work} {friction}");
    }
}
