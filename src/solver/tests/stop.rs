//! A tool driven by force with a stop: it advances to the stop, stays there when the sheet separates, and moves back
//! when the sheet pushes with more than the force.

use super::{body, setup, stage, steel, tool};
use crate::sheet::hex_mesh::rectangle;
use crate::test_tools::plane;
use crate::{
    Constraints, Control, Curve, IncrementReport, Motion, SheetSide, Simulation, SimulationSetup,
    ToolSetup,
};
use kanagata_geometry::Vec3;

/// Travel of the pad's stop [mm].
const STOP: f64 = 0.5;

/// A strip of 20 x 4 x 1 mm, clamped at one end, its other end below a pad and a punch.
fn strip(friction: f64, pad: &[Motion], punch: &[Motion]) -> SimulationSetup {
    let mesh = rectangle(20.0, 4.0, 1.0, 10, 2, 1);
    let mut constraints = Constraints::none(mesh.nodes.len());
    for node in (0..mesh.nodes.len()).filter(|&node| mesh.nodes[node].x < 1e-9) {
        (0..3).for_each(|axis| constraints.hold(node, axis));
    }
    let plate = |name| {
        let corner = Vec3::new(17.0, -5.0, 1.0);
        let over_the_end = plane(name, corner, 10.0 * Vec3::x(), 20.0 * Vec3::y(), -Vec3::z());
        tool(name, over_the_end, -Vec3::z(), SheetSide::Top, friction)
    };
    let tools = vec![ToolSetup { stop: Some(STOP), ..plate("pad") }, plate("punch")];
    let motions = pad.iter().zip(punch).map(|(a, b)| vec![a.clone(), b.clone()]);
    let stages = motions.map(|motions| stage("bend", motions, 0.25)).collect();
    setup(body(mesh, steel()), constraints, tools, stages)
}

fn force(to: f64) -> Motion {
    Motion::Force(Curve::to(to))
}

fn travel(to: f64) -> Motion {
    Motion::Travel(Curve::to(to))
}

/// The pad is pushed onto its stop, the punch is pushed beyond and retracted, the force of the pad is reduced.
fn there_and_back(friction: f64) -> SimulationSetup {
    let pad = [force(100.0), force(100.0), force(100.0), force(5.0)];
    strip(friction, &pad, &[Motion::Hold, travel(1.0), travel(0.0), Motion::Hold])
}

/// Travel and force of both tools, and displacements, at the end of every stage.
fn ends(setup: SimulationSetup) -> Vec<([[f64; 2]; 2], Vec<f64>)> {
    let mut ends = Vec::new();
    let see = &mut |r: &IncrementReport<'_>| {
        let of = |k: usize| [r.tools[k].travel, r.tools[k].force];
        if r.share == 1.0 {
            ends.push(([of(0), of(1)], r.displacements.to_vec()));
        }
        let e = r.energies;
        // Quarters of a stage by the trapezoidal rule: 3e-6 to 6e-6.
        let open = (e.external - e.internal - e.friction).abs();
        assert!(open <= 2e-5 * e.external.abs().max(1e-3), "{e:?}");
        Control::Continue
    };
    Simulation::new(setup).unwrap().run(see).unwrap();
    ends
}

#[test]
fn a_tool_advances_to_its_stop() {
    let ends = ends(there_and_back(0.0));
    let near = |a: f64, b: f64, within: f64| assert!((a - b).abs() <= within, "{a} not {b}");
    let driven = self::ends(strip(0.0, &[travel(STOP)], &[Motion::Hold]));
    let carried = driven[0].0[0][1];
    assert!((20.0..50.0).contains(&carried), "{carried} N");
    // At the stop, which carries the rest of the 100 N.
    let [pad, punch] = ends[0].0;
    near(pad[0], STOP, 1e-12);
    near(pad[1], carried, 1e-6 * carried);
    assert_eq!(punch[1], 0.0);
    // The sheet has separated from it.
    let [pad, punch] = ends[1].0;
    assert_eq!(pad, [STOP, 0.0]);
    near(punch[1], 2.0 * carried, 0.1 * carried);
    // The sheet is in contact with it again.
    let [pad, punch] = ends[2].0;
    near(pad[0], STOP, 1e-12);
    near(pad[1], carried, 1e-6 * carried);
    assert_eq!(punch[1], 0.0);
    for (then, now) in ends[0].1.iter().zip(&ends[2].1) {
        near(*then, *now, 1e-7 * STOP);
    }
    // Its force is less than that of the sheet: it leaves the stop.
    let [pad, _] = ends[3].0;
    near(pad[1], 5.0, 1e-6);
    near(pad[0], STOP * 5.0 / carried, 0.02 * STOP);
}

/// Two tools driven by force with travels coupled by the sheet, one of them at its stop.
#[test]
fn another_tool_driven_by_force_advances() {
    let both = ends(strip(0.1, &[force(100.0), force(100.0)], &[Motion::Hold, force(100.0)]));
    let [pad, punch] = both[1].0;
    assert_eq!(pad, [STOP, 0.0]);
    assert!(punch[0] > 2.0 * STOP && (punch[1] - 100.0).abs() < 1e-6, "{punch:?}");
}

/// A tool beyond its stop at the start of a stage stays there; the stop also applies to springs.
#[test]
fn a_tool_past_its_stop_stays_there() {
    let spring = |force: f64| Motion::Spring { force: Curve::to(force), stiffness: 1.0 };
    for push in [force, spring] {
        let ends =
            ends(strip(0.0, &[travel(0.7), push(60.0), push(5.0)], &[const { Motion::Hold }; 3]));
        assert_eq!(ends[1].0[0][0], 0.7);
        assert!(ends[2].0[0][0] < 0.3, "{:?}", ends[2].0);
    }
    let ends = ends(strip(0.0, &[spring(60.0)], &[Motion::Hold]));
    assert!((ends[0].0[0][0] - STOP).abs() < 1e-12);
}

#[test]
fn a_run_restarted_at_a_stop_is_bit_identical() {
    let mut whole = Simulation::new(there_and_back(0.1)).unwrap();
    whole.run(&mut |_| Control::Continue).unwrap();
    let mut sim = Simulation::new(there_and_back(0.1)).unwrap();
    while sim.advance(&mut |_| Control::Continue).unwrap() {
        let state = sim.state();
        sim = Simulation::new(there_and_back(0.1)).unwrap();
        sim.resume(state).unwrap();
    }
    assert_eq!(whole.summary().iterations, sim.summary().iterations);
    assert!(whole.displacements() == sim.displacements());
}
