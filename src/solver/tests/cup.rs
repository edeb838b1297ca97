//! A round cup, quarter model: clamped by force, drawn with friction.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use crate::contact::ToolSurface;
use crate::contact::test_tools::{arc, line, revolved};
use crate::geometry::Vec3;
use crate::solver::assembly::Body;
use crate::solver::blank::rectangle;
use crate::solver::element::ElementKind;
use crate::solver::material::elastic::Elastic;
use crate::solver::material::hardening::Hardening;
use crate::solver::material::hill48::Hill48;
use crate::solver::material::plastic::Plastic;
use crate::solver::{
    Constraints, Control, Curve, IncrementReport, Limits, Motion, Placement, SheetSide, Simulation,
    SimulationSetup, Stage, ToolSetup,
};

fn mild_steel() -> Arc<Plastic> {
    let hill = Hill48 { f: 0.251, g: 0.297, h: 0.703, l: 1.5, m: 1.5, n: 1.29 };
    let swift = Hardening::Swift { k: 565.0, eps0: 0.007, n: 0.26 };
    Arc::new(Plastic::new(Elastic { young: 210_000.0, poisson: 0.3 }, &hill, swift).unwrap())
}

const T: f64 = 0.8;

fn tool(
    name: &str,
    model: crate::tool::ToolModel,
    direction: Vec3,
    side: SheetSide,
    mu: f64,
) -> ToolSetup {
    ToolSetup {
        name: name.into(),
        surface: Arc::new(ToolSurface::new(model)),
        offset: Vec3::zeros(),
        direction,
        placement: Placement::Touch,
        friction: mu,
        side,
    }
}

pub(super) fn cup(n: usize, depth: f64, mu: f64) -> SimulationSetup {
    let mesh = rectangle(60.0, 60.0, T, n, n, 2);
    let mut constraints = Constraints::none(mesh.nodes.len());
    constraints.symmetry_plane(&mesh.nodes, 0, 0.0, 1e-9);
    constraints.symmetry_plane(&mesh.nodes, 1, 0.0, 1e-9);
    let body = Body::new(mesh, ElementKind::Hex8, mild_steel()).unwrap();
    let die = [
        line(1, [90.0, 0.0], [37.0, 0.0], [0.0, 1.0]),
        arc(3, [37.0, -7.0], 7.0, [FRAC_PI_2, PI], 1.0),
        line(1, [30.0, -7.0], [30.0, -60.0], [-1.0, 0.0]),
    ];
    let holder = [line(1, [31.0, 0.0], [90.0, 0.0], [0.0, -1.0])];
    let punch = [
        line(1, [0.0, 0.0], [21.0, 0.0], [0.0, -1.0]),
        arc(3, [21.0, 8.0], 8.0, [-FRAC_PI_2, 0.0], 1.0),
        line(1, [29.0, 8.0], [29.0, 60.0], [1.0, 0.0]),
    ];
    let q = FRAC_PI_2;
    let tools = vec![
        tool("die", revolved("die", 6, q, &die), Vec3::z(), SheetSide::Bottom, mu),
        tool("holder", revolved("holder", 6, q, &holder), -Vec3::z(), SheetSide::Top, mu),
        tool("punch", revolved("punch", 6, q, &punch), -Vec3::z(), SheetSide::Top, mu),
    ];
    let clamp = Stage {
        name: "clamp".into(),
        duration: 1.0,
        motions: vec![Motion::Hold, Motion::Force(Curve::ramp(0.0, 20_000.0)), Motion::Absent],
        first_step: 0.5,
        largest_step: 1.0,
    };
    let draw = Stage {
        name: "draw".into(),
        duration: 1.0,
        motions: vec![
            Motion::Hold,
            Motion::Force(Curve::constant(20_000.0)),
            Motion::Travel(Curve::ramp(0.0, depth)),
        ],
        first_step: 0.1 / depth,
        largest_step: (1.0 / depth).min(1.0),
    };
    SimulationSetup {
        body,
        constraints,
        tools,
        stages: vec![clamp, draw],
        limits: Limits::default(),
        share: 4.0,
    }
}

pub(super) fn print(r: &IncrementReport<'_>) -> Control {
    let tools: Vec<String> =
        r.tools.iter().map(|t| format!("{:.4}/{:.1}/{}", t.travel, t.force, t.contacts)).collect();
    println!(
        "{:3} {} {:.4} it {:2} tot {:4} cuts {} [{}] contacts {} slip {} res {:?}",
        r.increment,
        r.stage_name,
        r.share,
        r.iterations,
        r.iterations_total,
        r.cuts,
        tools.join(" "),
        r.contacts,
        r.slipping,
        r.history
            .iter()
            .map(|h| format!("{:.0e}/{:.0e}/{}", h.residual, h.gap, h.changes))
            .collect::<Vec<_>>(),
    );
    Control::Continue
}

#[test]
fn a_cup_is_drawn_quickly() {
    let n = std::env::var("CUP_N").map_or(8, |v| v.parse().unwrap());
    let depth = std::env::var("CUP_DEPTH").map_or(0.6, |v| v.parse().unwrap());
    let mut sim = Simulation::new(cup(
        n,
        depth,
        std::env::var("CUP_MU").map_or(0.05, |v| v.parse().unwrap()),
    ))
    .unwrap();
    let start = std::time::Instant::now();
    let done = sim.run(&mut |r| print(r));
    println!("{:?} {:?}", start.elapsed(), sim.summary());
    println!("{:?}", sim.summary().timings);
    match done {
        Ok(s) => println!("{s:?}"),
        Err(e) => {
            for h in &sim.history {
                println!("{h:?}");
            }
            panic!("{e}")
        }
    }
}
