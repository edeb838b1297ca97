//! Quarter of the cross tool, coarse mesh: the process of the demo with analytic tools.

use std::sync::Arc;

use super::{body, stage, tool};
use crate::material::elastic::Elastic;
use crate::material::hardening::Hardening;
use crate::material::hill48::Hill48;
use crate::material::plastic::Plastic;
use crate::sheet::hex_mesh::rectangle;
use crate::test_tools::cross;
use crate::{
    Constraints, Control, Curve, IncrementReport, Limits, Motion, Placement, SheetSide, Simulation,
    SimulationSetup,
};
use kanagata_geometry::Vec3;

fn setup(n: usize, depth: f64) -> SimulationSetup {
    let mesh = rectangle(125.0, 125.0, 0.8, n, n, 2);
    let mut constraints = Constraints::none(mesh.nodes.len());
    constraints.symmetry_plane(&mesh.nodes, 0, 0.0, 1e-9);
    constraints.symmetry_plane(&mesh.nodes, 1, 0.0, 1e-9);
    let hill = Hill48 { f: 0.251, g: 0.297, h: 0.703, l: 1.29, m: 1.29, n: 1.29 };
    let swift = Hardening::Swift { k: 565.32, eps0: 0.007117, n: 0.2589 };
    let elastic = Elastic { young: 206_000.0, poisson: 0.3 };
    let steel = Arc::new(Plastic::new(elastic, &hill, swift).unwrap());
    let [die, holder, punch] = cross(4);
    let mut tools = vec![
        tool("die", die, Vec3::z(), SheetSide::Bottom, 0.03),
        tool("holder", holder, -Vec3::z(), SheetSide::Top, 0.03),
        tool("punch", punch, -Vec3::z(), SheetSide::Top, 0.03),
    ];
    tools.iter_mut().for_each(|t| t.placement = Placement::Touch);
    let force = 72_500.0;
    let clamp = vec![Motion::Hold, Motion::Force(Curve::ramp(0.0, force)), Motion::Absent];
    let draw = vec![
        Motion::Hold,
        Motion::Force(Curve::constant(force)),
        Motion::Travel(Curve::ramp(0.0, depth)),
    ];
    let mut stages = vec![stage("clamp", clamp, 1.0), stage("draw", draw, 0.1 / depth)];
    stages[1].largest_step = (1.0 / depth).min(1.0);
    SimulationSetup {
        body: body(mesh, steel),
        constraints,
        loads: Vec::new(),
        tools,
        stages,
        limits: Limits::default(),
        share: 4.0,
    }
}

#[test]
fn the_cross_tool_starts_to_draw() {
    let n = 10;
    let depth = 0.5;
    let mut sim = Simulation::new(setup(n, depth)).unwrap();
    let mut punch = Vec::new();
    let done = sim.run(&mut |r: &IncrementReport<'_>| {
        punch.push((r.tools[2].travel, r.tools[2].force));
        Control::Continue
    });
    let summary = done.unwrap();
    assert!(summary.iterations <= 16 * summary.increments, "{summary:?}");
    let last = punch.last().unwrap();
    assert!((last.0 - depth).abs() < 1e-12 && last.1 > 1000.0, "{punch:?}");
}
