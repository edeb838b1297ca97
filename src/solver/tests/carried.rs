//! Unconstrained sheets moved by tools, and a sheet pushed without friction.

use super::{body, setup, stage, steel, tool};
use crate::sheet::hex_mesh::rectangle;
use crate::test_tools::{Builder, Piece, arc, line};
use crate::{
    Constraints, Control, Curve, IncrementReport, Motion, RunSummary, SheetSide, Simulation,
    SimulationSetup, ToolSetup,
};
use kanagata_geometry::Vec3;
use kanagata_tool::ToolModel;

/// Final state of a run: largest force of each tool [N], displacements [mm], summary.
struct End {
    forces: Vec<f64>,
    moved: Vec<Vec3>,
    summary: RunSummary,
}

fn run(setup: SimulationSetup) -> End {
    let (mut forces, mut moved) = (vec![0.0; setup.tools.len()], Vec::new());
    let mut see = |r: &IncrementReport<'_>| {
        let now = r.tools.iter().map(|tool| tool.force.abs());
        forces.iter_mut().zip(now).for_each(|(most, force)| *most = force.max(*most));
        moved = r.displacements.chunks_exact(3).map(Vec3::from_column_slice).collect();
        Control::Continue
    };
    let summary = Simulation::new(setup).unwrap().run(&mut see).unwrap();
    End { forces, moved, summary }
}

/// A profile in the x-z plane, extruded along y far beyond the sheets.
pub(super) fn along_y(name: &str, profile: &[Piece]) -> ToolModel {
    let pieces = profile.iter().fold(Builder::new(name), |builder, piece| {
        builder.grid(piece.cells, 1, |t, v| {
            let ([x, z], [nx, nz]) = (piece.at)(t);
            (Vec3::new(x, 60.0 * v - 28.0, z), Vec3::new(nx, 0.0, nz))
        })
    });
    pieces.build()
}

const TURN: f64 = std::f64::consts::TAU;

fn rod(name: &str, [x, z]: [f64; 2], r: f64, down: bool, mu: f64) -> ToolSetup {
    let model = along_y(name, &[arc(12, [x, z], r, [0.0, TURN], 1.0)]);
    let (direction, side) =
        if down { (-Vec3::z(), SheetSide::Top) } else { (Vec3::z(), SheetSide::Bottom) };
    tool(name, model, direction, side, mu)
}

/// A strip of 60 x 4 x 1 mm on a table with a round edge at x = 20, and a rod that moves down on its overhang: it
/// rotates about the edge and slides without resistance.
fn tipped(mu: f64) -> (End, Vec<Vec3>) {
    let mesh = rectangle(60.0, 4.0, 1.0, 30, 1, 1);
    let nodes = mesh.nodes.clone();
    let flat = line(1, [-20.0, 0.0], [17.0, 0.0], [0.0, 1.0]);
    let edge = arc(8, [17.0, -3.0], 3.0, [0.25 * TURN, -TURN / 6.0], 1.0);
    let table = tool("table", along_y("table", &[flat, edge]), Vec3::z(), SheetSide::Bottom, mu);
    let down = rod("rod", [33.0, 7.0], 5.0, true, mu);
    let motions = vec![Motion::Hold, Motion::Travel(Curve::to(12.0))];
    let nothing = Constraints::none(nodes.len());
    let stages = vec![stage("tip", motions, 0.05)];
    (run(setup(body(mesh, steel()), nothing, vec![table, down], stages)), nodes)
}

/// The matrix is singular; rounding must not move the strip out of the path of its tools.
#[test]
fn a_strip_tips_over_an_edge_without_a_force() {
    for mu in [0.0, 0.1] {
        let (end, nodes) = tipped(mu);
        assert!(end.forces.iter().all(|force| *force < 1e-5), "{mu}: {:?}", end.forces);
        let aside = end.moved.iter().map(|u| u.y.abs()).fold(0.0, f64::max);
        let now: Vec<Vec3> = nodes.iter().zip(&end.moved).map(|(x, u)| x + u).collect();
        let along = |x: f64| {
            let at = nodes.iter().zip(&now).filter(|(n, _)| n.y + n.z + (n.x - x).abs() < 1e-9);
            at.map(|(_, now)| *now).sum::<Vec3>()
        };
        let (rear, front) = (along(0.0), along(60.0));
        assert!(aside < 1e-3, "{mu}: {aside}");
        assert!(rear.z > 5.0 && front.z < -15.0, "{mu}: {rear} {front}");
        assert!(((front - rear).norm() - 60.0).abs() < 1e-9, "{mu}: it has been stretched");
    }
}

/// A strip of 60 x 5 x 1 mm on two rods 44 mm apart and a third above its middle, which moves down by `depth` and
/// then up. `held`: constrained at its middle along and across.
fn bent(mu: f64, held: bool, depth: f64, up: bool) -> End {
    let mesh = rectangle(60.0, 5.0, 1.0, 30, 2, 1);
    let mut constraints = Constraints::none(mesh.nodes.len());
    if held {
        constraints.symmetry_plane(&mesh.nodes, 1, 2.5, 1e-9);
        constraints.symmetry_plane(&mesh.nodes, 0, 30.0, 1e-9);
    }
    let below = |x: f64| rod("below", [x, -3.0], 3.0, false, mu);
    let tools = vec![below(8.0), below(52.0), rod("punch", [30.0, 4.0], 3.0, true, mu)];
    let to = |end: f64| vec![Motion::Hold, Motion::Hold, Motion::Travel(Curve::to(end))];
    let mut stages = vec![stage("in", to(depth), 0.1)];
    if up {
        stages.push(stage("out", to(-20.0), 0.1));
    }
    run(setup(body(mesh, steel()), constraints, tools, stages))
}

/// Convex rods push a sheet without friction to the side unless it is exactly symmetric.
#[test]
fn a_strip_bent_without_friction_stays_between_its_rods() {
    let (held, free) = (bent(0.0, true, 2.0, false), bent(0.0, false, 2.0, false));
    let apart = held.moved.iter().zip(&free.moved).map(|(a, b)| (a - b).norm());
    assert!(held.forces[2] > 50.0 && free.forces[2] > 50.0);
    assert!((held.forces[2] / free.forces[2] - 1.0).abs() < 1e-6);
    assert!(apart.fold(0.0, f64::max) < 1e-6);
    // Its nodes are in an unstable position; the sheet is not, as it slides through at no cost.
    assert!(free.summary.unstable == 0 && free.summary.snap_throughs == 0, "{:?}", free.summary);
}

/// The sheet must not adhere to the punch by forces at the level of rounding.
#[test]
fn a_retracted_punch_separates_from_the_sheet() {
    for (mu, held) in [(0.0, false), (0.1, false), (0.0, true), (0.1, true)] {
        let end = bent(mu, held, 1.0, true);
        let farthest = end.moved.iter().map(Vec3::norm).fold(0.0, f64::max);
        assert!(farthest < 1e-3, "{mu}, {held}: {farthest}");
    }
}

/// A strip of 30 x 1 x 1 mm between the halves of a joggle of 2 mm, constrained only across, which close with
/// friction; the model is shifted by `shift` [mm]. Final force [N], and displacement of the strip along itself [mm].
fn joggled(shift: [f64; 2], largest_step: f64) -> (f64, f64) {
    let (dip, slope) = (2.0, 0.75_f64.acos());
    let run_out = 8.0 * slope.sin();
    let [x, z] = shift;
    let quarter = 0.25 * TURN;
    let lower = along_y(
        "lower",
        &[
            line(1, [x - 15.0, z], [x, z], [0.0, 1.0]),
            arc(6, [x, z - 4.0], 4.0, [quarter, quarter - slope], 1.0),
            arc(6, [x + run_out, z + 2.0], 4.0, [-quarter - slope, -quarter], -1.0),
            line(1, [x + run_out, z - dip], [x + 30.0, z - dip], [0.0, 1.0]),
        ],
    );
    let top = z + 1.0 + dip;
    let upper = along_y(
        "upper",
        &[
            line(1, [x - 15.0, top], [x, top], [0.0, -1.0]),
            arc(6, [x, top - 5.0], 5.0, [quarter, quarter - slope], -1.0),
            arc(6, [x + run_out, top + 1.0], 3.0, [-quarter - slope, -quarter], 1.0),
            line(1, [x + run_out, top - dip], [x + 30.0, top - dip], [0.0, -1.0]),
        ],
    );
    let mut mesh = rectangle(30.0, 1.0, 1.0, 60, 1, 1);
    mesh.nodes.iter_mut().for_each(|node| *node += Vec3::new(x - 10.0, 0.0, z));
    let mut held = Constraints::none(mesh.nodes.len());
    (0..mesh.nodes.len()).for_each(|node| held.hold(node, 1));
    let tools = vec![
        tool("lower", lower, Vec3::z(), SheetSide::Bottom, 0.3),
        tool("upper", upper, -Vec3::z(), SheetSide::Top, 0.3),
    ];
    let mut close = stage("close", vec![Motion::Hold, Motion::Travel(Curve::to(0.8))], 0.05);
    close.largest_step = largest_step;
    close.first_step = largest_step.min(0.05);
    let stages = vec![close];
    let end = run(setup(body(mesh, steel()), held, tools, stages));
    (end.forces[1], end.moved.iter().map(|u| u.x).sum::<f64>() / end.moved.len() as f64)
}

/// It first rotates and slides without a force, then it is bent: results agree to the last digits.
#[test]
fn the_path_of_an_unconstrained_strip_does_not_depend_on_the_origin() {
    let (force, along) = joggled([0.0, 0.0], 1.0);
    assert!(force > 10.0, "{force}");
    for shift in [[10.0, 0.0], [100.0, 0.0], [0.0, 50.0], [7.0, 3.0]] {
        let (other, aside) = joggled(shift, 1.0);
        assert!((other / force - 1.0).abs() < 1e-8, "{shift:?}: {other} {force}");
        assert!((aside - along).abs() < 1e-8, "{shift:?}: {aside} {along}");
    }
}

/// When the halves prevent sliding, the strip is held by friction or bent. Its displacement by then varies with the
/// step size by hundredths of a millimetre, and the force by one hundredth.
#[test]
fn the_path_of_an_unconstrained_strip_hardly_depends_on_the_step() {
    let (force, along) = joggled([0.0, 0.0], 1.0);
    for step in [0.05, 0.02] {
        let (other, aside) = joggled([0.0, 0.0], step);
        assert!((other / force - 1.0).abs() < 0.02, "{step}: {other} {force}");
        assert!((aside - along).abs() < 0.05, "{step}: {aside} {along}");
    }
}
