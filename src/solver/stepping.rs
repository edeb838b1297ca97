//! Increments of a stage: tried, cut and tried again, followed past limit points; how stages begin and end.

use super::active_set::{keep_pushed_tools, take_in};
use super::constraints::Constraints;
use super::linear::LinearError;
use super::newton::{NewtonError, NewtonStats, Patience};
use super::pace::Pace;
use super::relaxation::{Endurance, relax};
use super::rigid::{hold_rigid_modes, share_along_free_motions};
use super::simulation::{Control, Simulation, SimulationError};
use super::stages::{IncrementReport, Stage};
use super::steadying::ITERATIONS;
use super::system::{Role, System};
use super::tools::Motion;
use super::trial::{Plan, accept, add_loads, attempt, forces, lay_down, restore, set_targets};
use crate::geometry::Vec3;

use serde::{Deserialize, Serialize};

/// Steps shorter than this share of a stage's first one are taken for the approach to a limit point, and the next
/// balance is sought this share of the first step beyond it.
const SNAPS: f64 = 0.02;
const BEYOND: f64 = 0.1;

/// Attempts at an increment in which dampers led to no balance, after which there are none: a shorter step meets the same.
const LOST: usize = 2;

/// A stage under way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct UnderWay {
    pub(super) plan: Plan,
    pace: Pace,
    endurance: Endurance,
    /// Share of the stage done.
    share: f64,
    start_time: f64,
}

impl UnderWay {
    /// Where the next increment ends, and how long it may take. One that another run has made is tried whole, and given
    /// all the time it wants, as that run may have come to it by cutting.
    fn next(&self, stages: &[Stage]) -> (f64, Patience) {
        let (share, step) = (self.share, self.pace.step);
        let none = self.plan.lets_go(stages);
        let ends: &[f64] = if none { &[] } else { &stages[self.plan.stage].ends };
        let at = ends.partition_point(|&end| end <= share);
        let end =
            ends.get(at).copied().unwrap_or_else(|| stages[self.plan.stage].next_corner(share));
        let met = share == 0.0 || at.checked_sub(1).is_some_and(|last| ends[last] == share);
        if at < ends.len() && met && !self.pace.has_failed() {
            return (end, Patience::All);
        }
        let target = if share + 1.001 * step >= end { end } else { share + step };
        (target, self.pace.patience())
    }
}

/// Makes one increment, beginning the next stage where one has ended; false when all stages are done.
pub(super) fn advance(
    sim: &mut Simulation,
    observer: &mut dyn FnMut(&IncrementReport<'_>) -> Control,
) -> Result<bool, SimulationError> {
    if sim.stage >= sim.stages.len() {
        return Ok(false);
    }
    let mut now = match sim.under_way.take() {
        Some(now) => now,
        None => begin_stage(sim, observer)?,
    };
    let stage = now.plan.stage;
    let iterations = increment(sim, &mut now)?.iterations;
    sim.time = now.start_time + now.share * sim.stages[stage].duration;
    sim.summary.increments += 1;
    sim.summary.iterations += iterations;
    let share = now.share;
    if share < 1.0 {
        sim.under_way = Some(now);
    } else {
        sim.stage += 1;
        lay_down(sim, &now.plan);
    }
    sim.report(stage, share, iterations, observer)?;
    Ok(true)
}

/// Tries shorter and shorter steps until one ends in balance; past a limit point, the way to the next balance.
fn increment(sim: &mut Simulation, now: &mut UnderWay) -> Result<NewtonStats, SimulationError> {
    let (stage, share) = (now.plan.stage, now.share);
    let first = sim.stages[stage].first_step.min(sim.stages[stage].largest_step);
    let lets_go = now.plan.lets_go(&sim.stages);
    let (mut snaps, mut lost) = (false, 0);
    loop {
        if sim.summary.increments >= sim.limits.increments {
            return Err(SimulationError::TooManyIncrements { limit: sim.limits.increments });
        }
        let (target, patience) = now.next(&sim.stages);
        let patience = if lost < LOST { patience } else { Patience::UpTo(sim.limits.iterations) };
        sim.history.clear();
        let error = match attempt(sim, &now.plan, [share, target], patience) {
            Ok(stats) if snaps || !(sim.sys.unstable && lets_go) => {
                let as_before = !sim.stages[stage].turns(target);
                accept(sim, as_before.then_some(target - share));
                sim.summary.steadied += usize::from(stats.steadied);
                now.share = target;
                now.pace.went_well(stats.iterations);
                return Ok(stats);
            }
            Ok(_) => None,
            Err(cause) => Some(gave_up(sim, stage, share, target - share, cause)),
        };
        sim.summary.iterations += sim.history.len().saturating_sub(1);
        lost += usize::from(sim.history.len() > ITERATIONS);
        restore(sim);
        if error.is_some() {
            sim.summary.cuts += 1;
            now.pace.failed(target - share);
        }
        if (error.is_none() || now.pace.step < SNAPS * first) && !snaps {
            snaps = true;
            if let Some(stats) = past_limit_point(sim, now) {
                return Ok(stats);
            }
        }
        if let Some(error) = error
            && now.pace.step < sim.limits.smallest_step * first
        {
            return Err(error);
        }
    }
}

/// Follows the sheet to the next balance past a limit point, or to a balance that lasts. Tools that are let go stay behind
/// as forces that fall to nothing, and forces that no tool guides can fold a sheet as tools never would: it is then
/// followed to where it lies without any, where it comes to rest.
fn past_limit_point(sim: &mut Simulation, now: &mut UnderWay) -> Option<NewtonStats> {
    let stage = &sim.stages[now.plan.stage];
    let beyond = BEYOND * stage.first_step.min(stage.largest_step);
    let pace = Pace::new(beyond, stage.largest_step, sim.limits.wanted_iterations);
    let near = (now.share + beyond).min(stage.next_corner(now.share));
    let lets_go = now.plan.lets_go(&sim.stages);
    for target in [lets_go.then_some(1.0), Some(near)].into_iter().flatten() {
        sim.history.clear();
        let found = relax(sim, &now.plan, target, &now.endurance);
        now.endurance = now.endurance.after(found.is_ok());
        if let Ok(stats) = found {
            now.share = target;
            now.pace = pace;
            return Some(stats);
        }
        sim.summary.iterations += sim.history.len();
    }
    None
}

fn begin_stage(
    sim: &mut Simulation,
    observer: &mut dyn FnMut(&IncrementReport<'_>) -> Control,
) -> Result<UnderWay, SimulationError> {
    let stage = sim.stage;
    let plan = begin(sim, stage)?;
    if stage == 0 {
        sim.report(0, 0.0, 0, observer)?;
    }
    let (first, largest) = (sim.stages[stage].first_step, sim.stages[stage].largest_step);
    let pace = Pace::new(first, largest, sim.limits.wanted_iterations);
    let endurance = Endurance::FULL;
    Ok(UnderWay { plan, pace, endurance, share: 0.0, start_time: sim.time })
}

fn begin(sim: &mut Simulation, stage: usize) -> Result<Plan, SimulationError> {
    let sys = &mut sim.sys;
    sys.constraints = sim.held.clone();
    sys.held_at.fill(0.0);
    let now = &sim.stages[stage];
    let mut plan = Plan {
        stage,
        start_travels: sys.tools.iter().map(|t| t.travel).collect(),
        start_forces: sim.committed.pushes.iter().map(|force| force * sim.share).collect(),
        released: released(sys, &now.motions),
        unsupported: Vec::new(),
        clear: Vec::new(),
    };
    sim.committed.forget_last();
    set_targets(sys, now, &plan, 0.0, sim.share);
    add_loads(sys, &sim.loads, now.load.at(0.0));
    sim.committed.applied.copy_from_slice(&sys.applied);
    for c in &mut sys.contact.candidates {
        c.active &= sys.roles[c.tool] != Role::Absent;
    }
    sys.search();
    take_in(sys);
    keep_pushed_tools(sys);
    if !is_held_by_tools(sys, &now.motions, &plan.start_forces) {
        plan.unsupported = sys.u.clone();
        plan.clear = (0..sys.tools.len()).filter(|&t| sys.roles[t] != Role::Absent).collect();
        plan.clear.iter().for_each(|&tool| sys.roles[tool] = Role::Absent);
    }
    let forces = forces(sys);
    sys.commit_contact(&forces);
    if plan.is_free() {
        let pushes = sim.loads.iter().map(|load| load * now.load.at(1.0)).collect::<Vec<_>>();
        hold_where_it_is(sys, &pushes)
            .map_err(|share| SimulationError::NothingHolds { stage: now.name.clone(), share })?;
    }
    Ok(plan)
}

/// Forces on the nodes of the tools that are taken away (three a node) [N].
fn released(sys: &System, motions: &[Motion]) -> Vec<f64> {
    let mut out = vec![0.0; sys.u.len()];
    for (_, c) in sys.contact.active().filter(|(_, c)| motions[c.tool] == Motion::Release) {
        let force = sys.contact_force(c.node);
        out[3 * c.node..3 * c.node + 3].copy_from_slice(force.as_slice());
    }
    out
}

/// Whether tools hold the sheet where a stage begins, or come to it in the stage. Those that stand clear of a sheet that others
/// let go, or go away from it, do not; `carried`: forces of the tools when the stage begins [N].
fn is_held_by_tools(sys: &System, motions: &[Motion], carried: &[f64]) -> bool {
    let lets_go = motions.contains(&Motion::Release);
    let touches = |tool: usize| sys.contact.active().any(|(_, c)| c.tool == tool);
    motions.iter().enumerate().any(|(tool, motion)| match motion {
        Motion::Absent | Motion::Release => false,
        _ => !lets_go || touches(tool) || sys.comes(tool, motion, carried[tool]),
    })
}

/// Holds the rigid modes of the sheet where it is now, which `loads` must not push it along.
///
/// # Errors
/// The share of the loads that does.
fn hold_where_it_is(sys: &mut System, loads: &[f64]) -> Result<(), f64> {
    const ROUNDING: f64 = 1e-6;
    let now: Vec<Vec3> = (0..sys.node_count()).map(|n| sys.position(n)).collect();
    let share = share_along_free_motions(&sys.constraints, &now, loads);
    if share > ROUNDING {
        return Err(share);
    }
    let mut held: Constraints = sys.constraints.clone();
    hold_rigid_modes(&mut held, &now);
    for node in 0..now.len() {
        for axis in 0..3 {
            if held.is_held(node, axis) && !sys.constraints.is_held(node, axis) {
                sys.held_at[3 * node + axis] = sys.u[3 * node + axis];
            }
        }
    }
    sys.constraints = held;
    Ok(())
}

fn farthest_from_balance(sys: &System) -> usize {
    let forces = sys.unbalanced().map(|force| force.norm_squared()).enumerate();
    forces.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(node, _)| node)
}

fn gave_up(
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
    let grows = |tool: usize| match &stage.motions[tool] {
        Motion::Force(curve) => curve.rates(share)[1] > 0.0 && !sys.stops[tool].reached,
        _ => false,
    };
    let mut out = String::new();
    for tool in (0..sys.tools.len()).filter(|&tool| grows(tool)) {
        out += &format!(
            "`{}` pushes with {:.4e} N there, and is to push with more: the sheet may not carry it (a `travel_mm` goes past a largest force). ",
            sys.tools[tool].setup.name,
            sim.committed.pushes[tool] * sim.share
        );
    }
    out += match cause {
        NewtonError::Linear(LinearError::Unopposed { .. }) => "Let it push where the sheet is",
        NewtonError::Linear(_) => {
            "Nothing may hold the sheet there against its loads and tools (friction may have given way): hold it (`holds`, `symmetry`), or keep a tool at it"
        }
        _ => {
            "Try a finer blank mesh near that place, a smaller first_increment of the stage, or check the tools' clearance there"
        }
    };
    out
}
