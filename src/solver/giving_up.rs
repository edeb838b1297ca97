//! What a run that gives up says: where, at which tool, and what to try.

use super::ahead::FACING;
use super::linear::LinearError;
use super::newton::NewtonError;
use super::simulation::{Simulation, SimulationError};
use super::stages::Stage;
use super::system::{Role, System};
use super::tools::Motion;

fn farthest_from_balance(sys: &System) -> usize {
    let forces = sys.unbalanced().map(|force| force.norm_squared()).enumerate();
    forces.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(node, _)| node)
}

/// The error of a run that found no balance in a step from `share` of the stage on.
pub(super) fn gave_up(
    sim: &Simulation,
    stage: usize,
    share: f64,
    step: f64,
    cause: NewtonError,
) -> SimulationError {
    let sys = &sim.sys;
    let node = match &cause {
        NewtonError::NotConverged { node, .. } | NewtonError::PassedThrough { node } => *node,
        NewtonError::Element(failure) => sys.body.mesh().elements[failure.element][0] as usize,
        NewtonError::Linear(LinearError::Singular { unknown }) => {
            (unknown / 3).min(sys.node_count().saturating_sub(1))
        }
        NewtonError::Linear(_) | NewtonError::StillMoving { .. } => farthest_from_balance(sys),
    };
    let x = sys.position(node);
    let name = |tool: usize| sys.tools[tool].setup.name.as_str();
    let there = (0..sys.tools.len()).filter(|&tool| sys.roles[tool] != Role::Absent);
    let nearest = there
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

/// What may have ended a run, and what to try.
fn remedy(sim: &Simulation, stage: &Stage, share: f64, cause: &NewtonError) -> String {
    let sys = &sim.sys;
    let pushes = |tool: usize| sim.committed.pushes[tool] * sim.share;
    let grows = |tool: usize| match &stage.motions[tool] {
        Motion::Force(curve) => {
            curve.starting_at(pushes(tool)).rates(share)[1] > 0.0 && !sys.stops[tool].reached
        }
        _ => false,
    };
    let mut out = String::new();
    for tool in (0..sys.tools.len()).filter(|&tool| grows(tool)) {
        out += &format!(
            "`{}` pushes with {:.4e} N there, and is to push with more: ",
            sys.tools[tool].setup.name,
            pushes(tool)
        );
        out += &match friction_alone(sys, tool) {
            Some(most) => format!(
                "nothing but friction holds it along its way, and that bears {:.4e} N at most by what presses it on the sheet there (press it harder, or move it by `travel_mm`). ",
                most * sim.share
            ),
            None => "the sheet may not carry it (a `travel_mm` goes past a largest force). ".into(),
        };
    }
    out += match cause {
        NewtonError::Linear(LinearError::Unopposed { tool })
            if friction_alone(sys, *tool).is_some() =>
        {
            "Let it push no harder than friction holds it, or give it a `stop_mm`"
        }
        NewtonError::Linear(LinearError::Unopposed { .. }) => {
            "Let it push where the sheet is, or give the blank a finer mesh under its edge"
        }
        NewtonError::Linear(_) => {
            "Nothing may hold the sheet there against its loads and tools (friction may have given way): hold it (`holds`, `symmetry`), or keep a tool at it"
        }
        _ => {
            "Try a finer blank mesh near that place, a smaller first_increment of the stage, or check the tools' clearance there"
        }
    };
    out
}

/// What friction can bear of a tool at most that touched the sheet at the last balance with nothing but faces along its way [N];
/// none of one that met the sheet otherwise, or not.
fn friction_alone(sys: &System, tool: usize) -> Option<f64> {
    let direction = sys.tools[tool].setup.direction;
    let mut most = None;
    for (c, (touched, force)) in sys.contact.candidates.iter().zip(sys.contact.before()) {
        if c.tool != tool || !touched {
            continue;
        }
        let normal = force.normal();
        if normal.dot(&direction).abs() > FACING * normal.norm() {
            return None;
        }
        *most.get_or_insert(0.0) += sys.law(tool).mu * normal.norm();
    }
    most
}
