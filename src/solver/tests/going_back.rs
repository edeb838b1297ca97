//! Release of tools while others stay, against which only friction holds the sheet.

use super::carried::along_y;
use super::{setup, stage, tool};
use crate::assembly::Body;
use crate::element::ElementKind;
use crate::material::card::{self, MaterialCard};
use crate::report::Energies;
use crate::sheet::hex_mesh::rectangle;
use crate::test_tools::{arc, line};
use crate::{
    Constraints, Control, Curve, IncrementReport, Limits, Motion, SheetSide, Simulation,
    SimulationSetup, Stage, ToolSetup,
};
use kanagata_geometry::Vec3;

/// Half of a strip of 80 x 5 x 1 mm drawn 25 mm into a die by a punch against a pad, followed by the given stages.
fn drawn(then: Vec<Stage>) -> SimulationSetup {
    let quarter = std::f64::consts::FRAC_PI_2;
    let die = [
        line(1, [16.05, -50.0], [16.05, -4.0], [-1.0, 0.0]),
        arc(4, [20.05, -4.0], 4.0, [2.0 * quarter, quarter], 1.0),
        line(1, [20.05, 0.0], [60.0, 0.0], [0.0, 1.0]),
    ];
    let punch = [
        line(1, [15.0, 60.0], [15.0, 4.0], [1.0, 0.0]),
        arc(4, [12.0, 4.0], 3.0, [0.0, -quarter], 1.0),
        line(1, [12.0, 1.0], [-1.0, 1.0], [0.0, -1.0]),
    ];
    let pad = [line(1, [-1.0, 0.0], [12.0, 0.0], [0.0, 1.0])];
    let mesh = rectangle(40.0, 5.0, 1.0, 64, 1, 1);
    let mut constraints = Constraints::none(mesh.nodes.len());
    for (node, x) in mesh.nodes.iter().enumerate() {
        constraints.hold(node, 1);
        if x.x < 1e-9 {
            constraints.hold(node, 0);
        }
    }
    let tools = vec![
        tool("die", along_y("die", &die), Vec3::z(), SheetSide::Bottom, 0.2),
        tool("punch", along_y("punch", &punch), -Vec3::z(), SheetSide::Top, 0.2),
        tool("pad", along_y("pad", &pad), Vec3::z(), SheetSide::Bottom, 0.2),
    ];
    let push = || Motion::Force(Curve::to(600.0));
    let clamp = stage("clamp", vec![Motion::Hold, Motion::Hold, push()], 0.25);
    let down = Motion::Travel(Curve::to(25.0));
    let mut draw = stage("draw", vec![Motion::Hold, down, push()], 0.005);
    draw.largest_step = 0.02;
    let steel = card::find("mild-steel-numisheet93").unwrap().build(0.0).unwrap();
    let kind = ElementKind::SolidShell { points: 5, membrane: true };
    let body = Body::new(mesh, kind, steel).unwrap();
    let stages = [vec![clamp, draw], then].concat();
    SimulationSetup { limits: Limits::default(), ..setup(body, constraints, tools, stages) }
}

/// Index of the stage, forces of die and punch [N], height of the lower face at the middle [mm] and nodes in contact
/// with the punch at the end of each increment.
type Course = Vec<(usize, [f64; 2], f64, usize)>;

/// And the final position of the end of the strip relative to its middle [mm].
fn run(setup: SimulationSetup) -> (Course, Energies, [f64; 2]) {
    let (mut course, mut energies, mut end) = (Course::new(), Energies::default(), [0.0; 2]);
    let mut sim = Simulation::new(setup).unwrap();
    sim.run(&mut |r: &IncrementReport<'_>| {
        let [die, punch] = [&r.tools[0], &r.tools[1]];
        course.push((r.stage, [die.force, punch.force], r.displacements[2], punch.contacts));
        energies = r.energies;
        let u = &r.displacements[r.displacements.len() - 3..];
        end = [u[0], u[2] - r.displacements[2]];
        Control::Continue
    })
    .unwrap();
    (course, energies, end)
}

#[test]
fn a_released_punch_leaves_the_part_in_the_die() {
    let off = |name: &str, motions| Stage { largest_step: 0.25, ..stage(name, motions, 0.25) };
    let pad_off = off("pad off", vec![Motion::Hold, Motion::Hold, Motion::Release]);
    let punch_off = off("punch off", vec![Motion::Hold, Motion::Release, Motion::Absent]);
    let die_off = off("die off", vec![Motion::Release, Motion::Absent, Motion::Absent]);
    let (course, energies, end) = run(drawn(vec![pad_off, punch_off, die_off]));
    let at_end = |stage: usize| course.iter().rfind(|row| row.0 == stage).unwrap();
    let [(_, pressed, depth, _), (_, left, after, _), (_, none, ..)] = [2, 3, 4].map(at_end);
    assert!(pressed[1] > 5.0 && (pressed[0] / pressed[1] - 1.0).abs() < 1e-6, "{pressed:?}");
    assert!((after - depth).abs() < 0.5, "the part went from {depth} to {after} mm");
    assert!(left.iter().chain(none).all(|force| force.abs() < 1e-6 * pressed[1]), "{left:?}");
    assert!(energies.released_forces.abs() < 0.01 * energies.external, "{energies:?}");
    assert!(energies.imbalance().abs() < 0.01 * energies.external, "{energies:?}");
    // Its force decreases while the punch moves back in contact.
    let off = || course.iter().filter(|row| row.0 == 3);
    assert!(off().next().unwrap().3 > 0);
    let falls: Vec<f64> = off().map(|row| row.1[1]).collect();
    assert!(falls.windows(2).all(|pair| pair[1] < pair[0]), "{falls:?}");
    // The same part as if both were released at once.
    let at_once = Stage { largest_step: 0.25, ..stage("off", vec![Motion::Release; 3], 0.25) };
    let (_, _, other) = run(drawn(vec![at_once]));
    let apart = (end[0] - other[0]).hypot(end[1] - other[1]);
    assert!(apart < 0.05, "{end:?} {other:?}");
}

/// A vee of 90 degrees with shoulders, its punch above a sheet of 1 mm that lies on them; height of the shoulders,
/// and travel at which the flanks are one thickness apart [mm].
fn vee() -> (Vec<ToolSetup>, f64, f64) {
    let eighth = std::f64::consts::FRAC_PI_4;
    let (s, radius) = (0.5_f64.sqrt(), 2.0);
    let [cx, cz] = [7.0 + radius * s, 7.0 - radius * s];
    let top = cz + radius;
    let die = [
        line(1, [-1.0, -1.0], [7.0, 7.0], [-s, s]),
        arc(2, [cx, cz], radius, [3.0 * eighth, 2.0 * eighth], 1.0),
        line(1, [cx, top], [30.0, top], [0.0, 1.0]),
    ];
    let centre = top + 1.0 + radius;
    let [x, z] = [radius * s, centre - radius * s];
    let punch = [
        line(1, [x + 14.0, z + 14.0], [x, z], [s, -s]),
        arc(4, [0.0, centre], radius, [-eighth, -3.0 * eighth], 1.0),
    ];
    let tools = vec![
        tool("die", along_y("die", &die), Vec3::z(), SheetSide::Bottom, 0.1),
        tool("punch", along_y("punch", &punch), -Vec3::z(), SheetSide::Top, 0.1),
    ];
    (tools, top, centre - (1.0 + radius) / s)
}

/// Card of a steel with a strong Bauschinger effect.
const BAUSCHINGER: &str = r#"{
    "name": "steel", "young_mpa": 210000.0, "poisson": 0.3, "yield": {"criterion": "von-mises"},
    "hardening": {"law": "ludwik", "sigma0": 150.0, "k": 300.0, "n": 0.4},
    "backstresses": [{"c_mpa": 5000.0, "gamma": 50.0}, {"c_mpa": 500.0, "gamma": 0.0}]
}"#;

/// Half of a strip of 28 x 1 x 1 mm bent and pressed in a vee of 90 degrees, of steel with a strong Bauschinger
/// effect: its angle [degrees] and the work done on it [N mm], pressed and released.
fn coined(kind: ElementKind, layers: usize) -> [(f64, f64); 2] {
    let (tools, top, shut) = vee();
    let mut mesh = rectangle(14.0, 1.0, 1.0, 14, 1, layers);
    let mut constraints = Constraints::none(mesh.nodes.len());
    for (node, place) in mesh.nodes.iter_mut().enumerate() {
        constraints.hold(node, 1);
        if place.x < 1e-9 {
            constraints.hold(node, 0);
        }
        place.z += top;
    }
    let flank: Vec<usize> = (0..mesh.nodes.len())
        .filter(|&node| (5.5..8.5).contains(&mesh.nodes[node].x) && mesh.nodes[node].z < top + 1e-9)
        .collect();
    let (first, last) = (flank[0], flank[flank.len() - 1]);
    let to = |travel: f64| vec![Motion::Hold, Motion::Travel(Curve::to(travel))];
    let stages = vec![
        Stage { largest_step: 0.04, ..stage("bend", to(shut - 0.5), 0.02) },
        Stage { largest_step: 0.1, ..stage("press", to(shut + 0.04), 0.05) },
        stage("release", vec![Motion::Release; 2], 0.25),
    ];
    let steel: MaterialCard = serde_json::from_str(BAUSCHINGER).unwrap();
    let body = Body::new(mesh, kind, steel.build(0.0).unwrap()).unwrap();
    let setup = setup(body, constraints, tools, stages);
    let mut sim = Simulation::new(SimulationSetup { limits: Limits::default(), ..setup }).unwrap();
    let mut out = [(0.0, 0.0); 2];
    sim.run(&mut |r: &IncrementReport<'_>| {
        let at = |node: usize| {
            let moved = Vec3::from_column_slice(&r.displacements[3 * node..3 * node + 3]);
            r.body.mesh().nodes[node] + moved
        };
        let along = at(last) - at(first);
        out[usize::from(r.stage == 2)] = (along.z.atan2(along.x).to_degrees(), r.energies.external);
        Control::Continue
    })
    .unwrap();
    out
}

#[test]
fn a_released_bend_is_not_pressed_by_remaining_tool_forces() {
    for (kind, layers) in [
        (ElementKind::SolidShell { points: 5, membrane: true }, 1),
        (ElementKind::SolidShell { points: 5, membrane: true }, 2),
        (ElementKind::Hex8, 4),
    ] {
        let [(pressed, before), (free, after)] = coined(kind, layers);
        assert!((pressed - 45.0).abs() < 1.0, "{kind:?} {layers}: {pressed}");
        assert!((free - pressed).abs() < 0.6, "{kind:?} {layers}: from {pressed} to {free}");
        // It returns energy, and no released tool does work on it.
        assert!(after < before && after > 0.5 * before, "{kind:?} {layers}: {before} {after}");
    }
}
