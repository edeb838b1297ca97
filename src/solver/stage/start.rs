//! Start of a stage and release of tools.
//!
//! If other tools hold the sheet, released tools first move back with it, pushing with a force that decreases almost
//! to zero. Constant nodal forces would follow a sheet that only friction holds against them. Then, or at once if no
//! tool stays, their forces are replaced by nodal forces that decrease to zero.

use super::description::Stage;
use super::plan::Plan;
use super::state::Simulation;
use crate::active_set::active_set::take_in;
use crate::active_set::driven_tools::keep_pushed_tools;
use crate::contact::candidate::Candidate;
use crate::error::SimulationError;
use crate::numbers::tolerances::ACCURACY_REL;
use crate::sheet::rigid_motions::share_along_free_motions;
use crate::system::system::System;
use crate::tools::motion::Motion;
use crate::tools::role::Role;

/// Fraction of a stage in which tools move back with the sheet before their release.
const RELEASE_SHARE: f64 = 0.5;

pub(crate) fn begin(sim: &mut Simulation, stage: usize) -> Result<Plan, SimulationError> {
    let sys = &mut sim.sys;
    let mut plan = Plan {
        stage,
        start_travels: sys.tools.iter().map(|t| t.travel).collect(),
        start_forces: sim.committed.pushes.iter().map(|force| force * sim.share).collect(),
        at: 0.0,
        gone: true,
        kept: None,
        released: vec![0.0; sys.u.len()],
        unsupported: Vec::new(),
        clear: Vec::new(),
    };
    let motions = &sim.stages[stage].motions;
    if let Some(kept) = go_back_first(sys, motions, &plan.start_forces) {
        (plan.at, plan.gone) = (RELEASE_SHARE, false);
        plan.kept = kept.map(|tool| (tool, sys.u.clone()));
    } else {
        plan.released = released(sys, motions);
    }
    arrange(sim, &mut plan, 0.0)?;
    Ok(plan)
}

/// Releases tools at the fraction `share` of a stage; they have moved back with the sheet so far.
pub(crate) fn release_tools(
    sim: &mut Simulation,
    plan: &mut Plan,
    share: f64,
) -> Result<(), SimulationError> {
    let motions = &sim.stages[plan.stage].motions;
    for (tool, _) in motions.iter().enumerate().filter(|(_, m)| **m == Motion::Release) {
        plan.start_forces[tool] = sim.committed.pushes[tool] * sim.share;
    }
    (plan.at, plan.gone) = (share, true);
    plan.released = released(&sim.sys, motions);
    arrange(sim, plan, share)
}

/// Sets tools and loads at the fraction `share` of a stage.
fn arrange(sim: &mut Simulation, plan: &mut Plan, share: f64) -> Result<(), SimulationError> {
    let sys = &mut sim.sys;
    let now = &sim.stages[plan.stage];
    sim.committed.forget_last();
    set_targets(sys, now, plan, share, sim.share);
    add_loads(sys, &sim.loads, now.load.at(share));
    sim.committed.applied.copy_from_slice(&sys.applied);
    sim.committed.dropped = drop_absent(sys);
    sys.search();
    take_in(sys);
    keep_pushed_tools(sys);
    if plan.gone && !is_held_by_tools(sys, &now.motions, &plan.start_forces) {
        plan.unsupported = plan.kept.as_ref().map_or_else(|| sys.u.clone(), |(_, u)| u.clone());
        plan.clear = (0..sys.tools.len()).filter(|&t| sys.roles[t] != Role::Absent).collect();
        plan.clear.iter().for_each(|&tool| sys.roles[tool] = Role::Absent);
    }
    let forces = sys.candidate_forces();
    sys.commit_contact(&forces);
    if plan.is_free() {
        let pushes = sim.loads.iter().map(|load| load * now.load.at(1.0)).collect::<Vec<_>>();
        check_net_load(sys, &pushes)
            .map_err(|share| SimulationError::NothingHolds { stage: now.name.clone(), share })?;
    }
    Ok(())
}

/// Sets tools and applied forces to their state at `share` of the stage.
pub(crate) fn set_targets(sys: &mut System, stage: &Stage, plan: &Plan, share: f64, whole: f64) {
    for (tool, motion) in stage.motions.iter().enumerate() {
        let (role, travel) = driven(motion, plan, tool, share, whole);
        sys.roles[tool] = role;
        sys.set_stop(tool, plan.start_travels[tool]);
        if let Some(travel) = travel {
            sys.tools[tool].travel = travel;
        }
    }
    if plan.is_free() {
        sys.stage_start.copy_from_slice(&plan.unsupported);
    }
    let remaining = plan.remaining(share);
    for (a, r) in sys.applied.iter_mut().zip(&plan.released) {
        *a = r * remaining;
    }
}

/// Control of a tool at `share` of the stage, and its travel if prescribed [mm]; `whole` is the ratio of the complete
/// process to the modelled part.
fn driven(
    motion: &Motion,
    plan: &Plan,
    tool: usize,
    share: f64,
    whole: f64,
) -> (Role, Option<f64>) {
    let (start, carried) = (plan.start_travels[tool], plan.start_forces[tool]);
    let clear = plan.clear.contains(&tool);
    let (role, travel) = match motion {
        Motion::Hold => (Role::Travel, Some(start)),
        Motion::Travel(curve) => (Role::Travel, Some(curve.starting_at(start).at(share))),
        Motion::Advance(curve) => (Role::Travel, Some(start + curve.starting_at(0.0).at(share))),
        Motion::Force(curve) => (Role::Force(curve.starting_at(carried).at(share) / whole), None),
        Motion::Spring { force, stiffness } => {
            let at_zero = carried + stiffness * start;
            let force = force.starting_at(at_zero).at(share);
            // An excluded tool, clear of the sheet, moves to the position at which its spring is unstretched.
            let slack = clear.then_some(force / stiffness);
            (Role::Spring { force: force / whole, stiffness: stiffness / whole }, slack)
        }
        Motion::Release => match plan.going_back(tool, share) {
            Some(force) if force > 0.0 => (Role::Force(force / whole), None),
            Some(_) => (Role::Travel, Some(start)),
            None => (Role::Absent, None),
        },
        Motion::Absent => (Role::Absent, None),
    };
    (if clear { Role::Absent } else { role }, travel)
}

/// Adds the fraction `share` of the loads of the model to the applied forces.
pub(crate) fn add_loads(sys: &mut System, loads: &[f64], share: f64) {
    sys.regime.loads = loads.iter().any(|load| share * load != 0.0);
    sys.applied.iter_mut().zip(loads).for_each(|(a, load)| *a += share * load);
}

/// Whether released tools push the sheet onto others, and which of them stays in place while they move back, if no
/// other tool does: the one with the largest force. `None` if something else would move the sheet.
fn go_back_first(sys: &System, motions: &[Motion], carried: &[f64]) -> Option<Option<usize>> {
    let touches = |tool: usize| sys.contact.active().any(|(_, c)| c.tool == tool);
    let (mut pushing, mut stays) = (Vec::new(), false);
    for (tool, motion) in motions.iter().enumerate() {
        match motion {
            Motion::Absent => {}
            Motion::Force(_) => return None,
            Motion::Release if sys.scales.of_note(carried[tool]) > 0.0 => pushing.push(tool),
            Motion::Release => {}
            _ => stays |= touches(tool),
        }
    }
    // Of two tools that push against each other the first, independent of rounding.
    let enough = (1.0 - 1e-6) * pushing.iter().map(|&tool| carried[tool]).fold(0.0, f64::max);
    let most = pushing.iter().copied().find(|&tool| carried[tool] >= enough);
    match pushing.len() {
        0 => None,
        _ if stays => Some(None),
        1 => None,
        _ => Some(most),
    }
}

/// Removes contact with absent tools. Returns whether one of them pushed the sheet, without forces that replace it.
fn drop_absent(sys: &mut System) -> bool {
    let gone = |c: &Candidate| c.active && sys.roles[c.tool] == Role::Absent;
    let pushes = |c: &Candidate| sys.scales.of_note(sys.contact_force(c).norm()) > 0.0;
    let dropped = sys.contact.candidates.iter().filter(|c| gone(c)).any(pushes);
    for c in &mut sys.contact.candidates {
        c.active &= sys.roles[c.tool] != Role::Absent;
    }
    dropped
}

/// Nodal forces of the tools that are released (three for each node) [N].
fn released(sys: &System, motions: &[Motion]) -> Vec<f64> {
    let mut out = vec![0.0; sys.u.len()];
    for (_, c) in sys.contact.active().filter(|(_, c)| motions[c.tool] == Motion::Release) {
        let force = sys.contact_force(c);
        out[3 * c.node..3 * c.node + 3].copy_from_slice(force.as_slice());
    }
    out
}

/// Whether tools hold the sheet at the start of a stage or come into contact during it. Tools clear of a sheet that
/// others release, or that move away from it, do not; `carried` are the forces of the tools at the start of the stage
/// [N].
fn is_held_by_tools(sys: &System, motions: &[Motion], carried: &[f64]) -> bool {
    let lets_go = motions.contains(&Motion::Release);
    let touches = |tool: usize| sys.contact.active().any(|(_, c)| c.tool == tool);
    motions.iter().enumerate().any(|(tool, motion)| match motion {
        Motion::Absent | Motion::Release => false,
        _ => !lets_go || touches(tool) || sys.comes(tool, motion, carried[tool]),
    })
}

/// Checks that `loads` do not act along free rigid-body motions of the sheet at its current position.
///
/// # Errors
/// The fraction of the loads that does.
fn check_net_load(sys: &System, loads: &[f64]) -> Result<(), f64> {
    let share = share_along_free_motions(&sys.constraints, &sys.positions(), loads);
    if share > ACCURACY_REL { Err(share) } else { Ok(()) }
}
