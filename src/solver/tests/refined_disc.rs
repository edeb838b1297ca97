//! Stretching of a clamped disc by a ball, quarter model (case P1 of docs/results/solver.md), on a refined mesh.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use super::{setup, stage, tool};
use crate::assembly::Body;
use crate::element::ElementKind;
use crate::material::card::MaterialCard;
use crate::sheet::hex_mesh::{HexMesh, quarter_disc, thickened};
use crate::sheet::refine::{Refinement, plan_elements};
use crate::test_tools::{arc, revolved};
use crate::{
    Constraints, Control, Curve, IncrementReport, Motion, Placement, SheetSide, Simulation,
    SimulationSetup, ToolSetup,
};
use kanagata_geometry::Vec3;

/// Radius of the disc [mm].
const RADIUS: f64 = 60.0;
/// Converged force on the quarter at 1 mm travel [N]: 40.03 N with 8064 solid-shells, 40.0 N in docs/results/solver.md.
const FORCE: f64 = 40.0;

/// A disc with `core` and `2 core` rings of elements, those within `radius` [mm] of its centre split once.
pub(super) fn disc(core: usize, radius: f64) -> HexMesh {
    let (points, quads) = quarter_disc(RADIUS, core, 2 * core);
    let base = thickened(&points, &quads, 0.8, 1);
    let near = |quad: &[u32; 4]| {
        let corners = quad.map(|column| points[column as usize].xy().norm());
        u8::from(corners.into_iter().fold(f64::INFINITY, f64::min) < radius)
    };
    let quads = plan_elements(&base);
    let levels = quads.iter().map(near).collect();
    Refinement::balanced(quads, levels).mesh(&base, Some(RADIUS))
}

/// A disc stretched by a ball over `travel` [mm], in steps of at most `step` [mm].
pub(super) fn stretched(mesh: HexMesh, [travel, step]: [f64; 2]) -> SimulationSetup {
    let steel: MaterialCard = serde_json::from_str(
        r#"{"name": "steel", "young_mpa": 210000.0, "poisson": 0.3, "yield": {"criterion": "von-mises"},
        "hardening": {"law": "swift", "k": 529.5, "eps0": 0.00439, "n": 0.268}}"#,
    )
    .unwrap();
    let mut constraints = Constraints::none(mesh.nodes.len());
    constraints.symmetry_plane(&mesh.nodes, 0, 0.0, 1e-9);
    constraints.symmetry_plane(&mesh.nodes, 1, 0.0, 1e-9);
    for (node, x) in mesh.nodes.iter().enumerate() {
        if x.xy().norm() > RADIUS - 1e-6 {
            (0..3).for_each(|axis| constraints.hold(node, axis));
        }
    }
    let ball = [arc(8, [0.0, 50.0], 50.0, [-FRAC_PI_2, -FRAC_PI_4], 1.0)];
    let ball = tool("ball", revolved("ball", 8, FRAC_PI_2, &ball), -Vec3::z(), SheetSide::Top, 0.1);
    let tools = vec![ToolSetup { placement: Placement::Touch, ..ball }];
    let mut down = stage("down", vec![Motion::Travel(Curve::to(travel))], 0.1 / travel);
    down.largest_step = step / travel;
    let kind = ElementKind::SolidShell { points: 5, membrane: true };
    let body = Body::new(mesh, kind, steel.build(0.0).unwrap()).unwrap();
    let mut all = setup(body, constraints, tools, vec![down]);
    all.limits.friction_transition = 1e-5;
    all.limits.force_tolerance = 1e-6;
    all
}

/// Force on the quarter at 1 mm travel [N].
fn force(mesh: HexMesh) -> f64 {
    let mut force = 0.0;
    let mut sim = Simulation::new(stretched(mesh, [1.0, 0.1])).unwrap();
    sim.run(&mut |r: &IncrementReport<'_>| {
        force = r.tools[0].force;
        Control::Continue
    })
    .unwrap();
    force
}

/// The base mesh of 180 elements is 4 % off, and within 1 % when it is refined under the ball.
#[test]
fn a_disc_refined_under_the_ball_has_the_converged_force() {
    let (coarse, refined) = (disc(6, 0.0), disc(6, 25.0));
    let count = refined.elements.len();
    assert!(count < 350 && coarse.elements.len() == 180, "{count}");
    let [coarse, refined] = [coarse, refined].map(force);
    println!("{coarse} N with 180 elements, {refined} N with {count}");
    assert!((refined / FORCE - 1.0).abs() < 0.01, "{refined}");
    assert!((coarse / FORCE - 1.0).abs() > 0.03, "{coarse}");
}
