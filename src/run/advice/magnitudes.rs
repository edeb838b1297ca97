//! Implausible friction coefficients and tool forces: errors of a decimal point or of a unit.

use super::finding::Finding;
use super::material::FLOW_STRESS_STRAIN;
use kanagata_report::doubt::DoubtCode;
use kanagata_scene::Plan;
use kanagata_solver::sheet::hex_mesh::HexMesh;
use kanagata_solver::{Motion, SimulationSetup};

/// Friction coefficient of a dry, galling sheet: the largest that is plausible.
const FRICTION_MAX: f64 = 1.0;

/// The doubt about tools whose friction coefficient the scene does not give.
pub(super) fn friction_not_given(plan: &Plan) -> Option<Finding> {
    let without = plan.scene.tools.iter().filter(|tool| tool.friction.is_none());
    let names: Vec<&str> = without.map(|tool| tool.name.as_str()).collect();
    (!names.is_empty()).then(|| {
        Finding::doubt(
            DoubtCode::FrictionNotGiven,
            names.join(", "),
            format!("No friction coefficient is given for {}; 0 is used.", names.join(", ")),
            "Give `friction` of each tool (lubricated sheets 0.02 to 0.2), 0 where none is meant."
                .into(),
        )
    })
}

/// Findings on implausible friction coefficients, and on forces that crush the whole blank.
pub(super) fn findings(plan: &Plan, setup: &SimulationSetup, out: &mut Vec<Finding>) {
    for tool in setup.tools.iter().filter(|tool| tool.friction > FRICTION_MAX) {
        out.push(
            Finding::doubt(
                DoubtCode::SceneUnits,
                format!("{}.friction", tool.name),
                format!(
                    "{} has a friction coefficient of {} ({FRICTION_MAX} is the largest expected).",
                    tool.name, tool.friction
                ),
                "Lubricated sheets have 0.02 to 0.2, dry ones seldom more than 0.6.".into(),
            )
            .exceeds([tool.friction, FRICTION_MAX]),
        );
    }
    let Some((flow_stress, _)) = plan.card.tension(FLOW_STRESS_STRAIN) else { return };
    let area = area(setup.body.mesh());
    for (k, tool) in setup.tools.iter().enumerate() {
        let largest = |motion: &Motion| match motion {
            Motion::Force(curve) => curve.extent()[1],
            _ => 0.0,
        };
        let force = setup.stages.iter().map(|stage| largest(&stage.motions[k])).fold(0.0, f64::max);
        if force > flow_stress * area {
            out.push(
                Finding::doubt(
                    DoubtCode::SceneUnits,
                    format!("{}.force_n", tool.name),
                    format!(
                        "{} pushes with {force:.3e} N: {:.3e} MPa over the whole blank of {area:.0} mm2, above its flow stress of {flow_stress:.0} MPa. The blank is crushed.",
                        tool.name,
                        force / area
                    ),
                    "Check the unit: forces are in N, of the whole process.".into(),
                )
                .exceeds([force, flow_stress * area]),
            );
        }
    }
}

/// Area of the lower face of the sheet [mm²].
fn area(mesh: &HexMesh) -> f64 {
    let face = |element: &[u32; 8]| {
        let nodes = [0, 1, 2, 3].map(|corner| element[corner] as usize);
        let [a, b, c, d] = nodes.map(|node| mesh.nodes[node]);
        let lower = nodes.iter().all(|node| node % mesh.nodes_per_column == 0);
        if lower { 0.5 * (c - a).cross(&(d - b)).norm() } else { 0.0 }
    };
    mesh.elements.iter().map(face).sum()
}
