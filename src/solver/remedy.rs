//! Message of a run that did not converge: position, tool, probable cause and remedy.

use crate::error::SimulationError;
use crate::linear::LinearError;
use crate::newton::outcome::NewtonError;
use crate::stage::description::Stage;
use crate::stage::state::Simulation;
use crate::system::system::System;
use crate::tools::motion::Motion;
use crate::tools::role::Role;
use crate::tools::way::FACING_COS_MIN;

fn largest_residual_node(sys: &System) -> usize {
    let forces = sys.unbalanced().map(|force| force.norm_squared()).enumerate();
    forces.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(node, _)| node)
}

/// Node at which an attempt at an increment failed.
fn failed_node(sys: &System, cause: &NewtonError) -> usize {
    match cause {
        NewtonError::NotConverged { node, .. } | NewtonError::PassedThrough { node } => *node,
        NewtonError::Element(failure) => sys.body.mesh().elements[failure.element][0] as usize,
        NewtonError::Linear(LinearError::Singular { unknown }) => {
            (unknown / 3).min(sys.node_count().saturating_sub(1))
        }
        NewtonError::Linear(_) | NewtonError::StillMoving { .. } | NewtonError::Cancelled => {
            largest_residual_node(sys)
        }
    }
}

/// Error of a run without equilibrium in a step from `share` of the stage.
pub(crate) fn gave_up(
    sim: &Simulation,
    stage: usize,
    share: f64,
    step: f64,
    cause: NewtonError,
) -> SimulationError {
    let sys = &sim.sys;
    let node = failed_node(sys, &cause);
    let x = sys.position(node);
    let name = |tool: usize| sys.tools[tool].setup.name.as_str();
    let present = (0..sys.tools.len()).filter(|&tool| sys.roles[tool] != Role::Absent);
    let nearest = present
        .map(|tool| (sys.tools[tool].closest(&x, None).gap.abs(), tool))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let tool = match &cause {
        NewtonError::Linear(LinearError::Unopposed { tool }) => Some(*tool),
        _ => nearest.map(|n| n.1),
    };
    SimulationError::GaveUp {
        stage: sim.stages[stage].name.clone(),
        increment: sim.summary.increments + 1,
        share,
        step,
        node,
        x: x.x,
        y: x.y,
        z: x.z,
        tool: tool.map_or("none", name).into(),
        remedy: remedy(sim, &sim.stages[stage], share, &cause).into(),
        cause: Box::new(cause),
    }
}

/// Probable cause of the failure and remedy.
fn remedy(sim: &Simulation, stage: &Stage, share: f64, cause: &NewtonError) -> String {
    let sys = &sim.sys;
    let mut out = excess_loads(sim, stage, share);
    out += match cause {
        NewtonError::Linear(LinearError::Unopposed { tool })
            if friction_capacity(sys, *tool).is_some() =>
        {
            "Let it push no harder than friction holds it, or give it a `stop_mm`"
        }
        NewtonError::Linear(LinearError::Unopposed { .. }) => {
            "Let it push where the sheet is, or give the blank a finer mesh under its edge"
        }
        NewtonError::Linear(_) => {
            "Nothing may hold the sheet there against its loads and tools (friction may have given way): hold it (`holds`, `symmetry`), or keep a tool at it"
        }
        NewtonError::Element(_) => {
            "Elements there are deformed too far: make them shorter along the bend (four over 90 degrees of the tool's radius; a check of the scene names radii for which they are too long, and the length wanted), take a smaller largest_increment of the stage, or check the tools' clearance there"
        }
        _ => {
            "Try a finer blank mesh near that place, a smaller first_increment of the stage, or check the tools' clearance there"
        }
    };
    out
}

/// Forces and loads that may exceed the capacity of the sheet.
fn excess_loads(sim: &Simulation, stage: &Stage, share: f64) -> String {
    const PAST: &str =
        "the sheet may not carry it (drive it by `travel_mm` to pass a maximum of the force). ";
    let sys = &sim.sys;
    let removed = removed_tools(sim, stage);
    let mut out = String::new();
    for (tool, motion) in stage.motions.iter().enumerate() {
        let Motion::Force(curve) = motion else { continue };
        let pushes = sim.committed.pushes[tool] * sim.share;
        let grows = curve.starting_at(pushes).rates(share)[1] > 0.0 && !sys.stops[tool].reached;
        let why = if grows {
            "and its force increases".into()
        } else if pushes > 0.0 && !removed.is_empty() {
            format!("while the stage removes {removed}")
        } else {
            continue;
        };
        let name = &sys.tools[tool].setup.name;
        out += &format!("`{name}` pushes with {pushes:.4e} N, {why}: ");
        out += &friction_capacity(sys, tool).map_or_else(
            || PAST.into(),
            |capacity| {
                format!(
                    "only friction holds it along its direction, with {:.4e} N at the present normal forces (press it harder, or move it by `travel_mm`). ",
                    capacity * sim.share
                )
            },
        );
    }
    let [_, grows] = stage.load.rates(share);
    if grows > 0.0 && sim.loads.iter().any(|load| *load != 0.0) {
        let now = stage.load.at(share);
        out += &format!("{now:.4} of the loads act and increase: {PAST}");
    }
    out
}

/// Names of the tools that a stage releases or excludes.
fn removed_tools(sim: &Simulation, stage: &Stage) -> String {
    let before = sim.stage.checked_sub(1).map(|before| &sim.stages[before].motions);
    let goes = |tool: usize| match stage.motions[tool] {
        Motion::Release => true,
        Motion::Absent => before.is_some_and(|before| before[tool] != Motion::Absent),
        _ => false,
    };
    let removed = (0..stage.motions.len()).filter(|&tool| goes(tool));
    let names: Vec<&str> = removed.map(|tool| sim.sys.tools[tool].setup.name.as_str()).collect();
    names.join(", ")
}

/// Maximum friction along its direction [N] of a tool that had contact at the last equilibrium only with walls
/// parallel to its direction; `None` if it had other contacts or none.
fn friction_capacity(sys: &System, tool: usize) -> Option<f64> {
    let direction = sys.tools[tool].setup.direction;
    let mut capacity = None;
    for (c, (touched, force)) in sys.contact.candidates.iter().zip(sys.contact.before()) {
        if c.tool != tool || !touched {
            continue;
        }
        let normal = force.normal();
        // Without a force the orientation of the contact is unknown.
        if normal.norm() == 0.0 {
            continue;
        }
        if normal.dot(&direction).abs() > FACING_COS_MIN * normal.norm() {
            return None;
        }
        *capacity.get_or_insert(0.0) += sys.law(tool).mu * normal.norm();
    }
    capacity
}
