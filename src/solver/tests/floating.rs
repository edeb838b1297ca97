//! Unconstrained sheet: at rest until a tool arrives, then carried by it; damped without tools.

use super::{body, setup, stage, steel, tool};
use crate::newton::outcome::Patience;
use crate::newton::solve::solve;
use crate::sheet::hex_mesh::rectangle;
use crate::system::damper::Damper;
use crate::test_tools::plane;
use crate::{
    Constraints, Control, Curve, IncrementReport, Limits, Motion, RunSummary, SheetSide,
    Simulation, SimulationSetup,
};
use kanagata_geometry::Vec3;

/// Displacements [mm] at a travel of the tool [mm].
type State = (f64, Vec<Vec3>);

/// A free sheet of 20 x 4 x 1 mm pushed up by a plate that starts 2 mm below it and moves by 7 mm; `mm` is the length
/// of a millimetre.
fn pushed_up(friction: f64, mm: f64) -> (Vec<State>, RunSummary) {
    let mesh = rectangle(20.0 * mm, 4.0 * mm, mm, 10, 2, 1);
    let nothing = Constraints::none(mesh.nodes.len());
    let corner = Vec3::new(-10.0, -10.0, -2.0) * mm;
    let [a, b] = [Vec3::x(), Vec3::y()].map(|along| 40.0 * mm * along);
    let plate = plane("plate", corner, a, b, Vec3::z());
    let tools = vec![tool("plate", plate, Vec3::z(), SheetSide::Bottom, friction)];
    let up = Motion::Travel(Curve::to(7.0 * mm));
    let setup = setup(body(mesh, steel()), nothing, tools, vec![stage("lift", vec![up], 0.1)]);
    let setup = SimulationSetup { limits: Limits::default(), ..setup };
    let mut states = Vec::new();
    let mut look = |r: &IncrementReport<'_>| {
        let moved = r.displacements.chunks_exact(3).map(|u| Vec3::from_column_slice(u) / mm);
        states.push((r.tools[0].travel / mm, moved.collect()));
        Control::Continue
    };
    let summary = Simulation::new(setup).unwrap().run(&mut look).unwrap();
    (states, summary)
}

#[test]
fn a_free_sheet_rests_until_a_tool_carries_it() {
    for friction in [0.0, 0.1] {
        let (states, summary) = pushed_up(friction, 1.0);
        assert_eq!(summary.cuts, 0, "{summary:?}");
        assert!(states.iter().any(|(travel, _)| *travel > 0.0 && *travel < 2.0));
        for (travel, moved) in &states {
            let along = Vec3::new(0.0, 0.0, (travel - 2.0).max(0.0));
            let off = moved.iter().map(|u| (u - along).norm()).fold(0.0, f64::max);
            // Rounding of the forces against the light dampers that determine the position of an unconstrained sheet.
            let drift = if *travel < 2.0 { 0.0 } else { 1e-7 };
            assert!(off <= drift, "{off} at {travel}, {friction}");
        }
        let (others, in_metres) = pushed_up(friction, 1e-3);
        assert_eq!(
            (summary.increments, summary.iterations),
            (in_metres.increments, in_metres.iterations)
        );
        let apart = |(a, b): (&State, &State)| (a.1[0] - b.1[0]).norm();
        assert!(states.iter().zip(&others).map(apart).all(|apart| apart < 1e-7));
    }
}

#[test]
fn supports_carry_the_resultant_of_dampers_where_no_tool_acts() {
    let mesh = rectangle(20.0, 4.0, 1.0, 10, 2, 1);
    let free = Constraints::none(mesh.nodes.len());
    let mut sim = Simulation::new(setup(body(mesh, steel()), free, vec![], vec![])).unwrap();
    // The dampers push all nodes in one direction.
    let aside: Vec<f64> = (0..sim.sys.u.len()).map(|i| [0.0, 0.0, 1.0][i % 3]).collect();
    let damper = Damper::new(&sim.sys.body, &aside, 1e-6 * sim.sys.scales.tangential);
    let pushes: f64 = damper.forces(&sim.sys.u).sum();
    sim.sys.regime.continue_with(damper);
    let found = solve(&mut sim.sys, &sim.limits, Patience::All, None, &mut sim.history);
    assert!(found.is_ok() && pushes.abs() > 1.0, "{found:?}, {pushes} N");
}
