//! Increments of a stage: tried, cut and tried again, followed past limit points; how stages begin and end.

use super::active_set::{keep_pushed_tools, take_in};
use super::constraints::Constraints;
use super::contact::Candidate;
use super::giving_up::gave_up;
use super::newton::{NewtonStats, Patience};
use super::pace::Pace;
use super::relaxation::{Endurance, relax};
use super::rigid::{hold_rigid_modes, share_along_free_motions};
use super::simulation::{Control, Simulation, SimulationError};
use super::stability::Doubt;
use super::stages::{IncrementReport, Stage};
use super::steadying::ITERATIONS;
use super::system::{Role, System};
use super::tools::Motion;
use super::trial::{Plan, accept, add_loads, attempt, forces, lay_down, restore, set_targets};
use super::work::{jumps, work_left_behind};
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
    doubt: Doubt,
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

/// What has been tried of an increment.
#[derive(Default)]
struct Tried {
    /// The sheet was followed past a limit point.
    followed: bool,
    /// Attempts in which dampers led to no balance.
    lost: usize,
    /// The pace at which a balance was found that does not last.
    doubted: Option<Pace>,
}

/// A balance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    pub(super) lasts: bool,
    /// It follows from the last one; the sheet has not jumped to it.
    pub(super) near: bool,
}

impl Found {
    /// Whether it is taken as it is: where the way there may have passed by another it is sought.
    fn is_taken(self, now: &UnderWay, tried: &Tried) -> bool {
        tried.followed || self.near && self.lasts || !now.doubt.may_find_another()
    }
}

/// Tries shorter and shorter steps until one ends in a balance that lasts; past a limit point, the way to the next balance.
fn increment(sim: &mut Simulation, now: &mut UnderWay) -> Result<NewtonStats, SimulationError> {
    let (stage, share) = (now.plan.stage, now.share);
    let least = sim.limits.smallest_step * sim.stages[stage].first();
    let mut tried = Tried::default();
    loop {
        if sim.summary.increments >= sim.limits.increments {
            return Err(SimulationError::TooManyIncrements { limit: sim.limits.increments });
        }
        let (target, patience) = now.next(&sim.stages);
        let all = Patience::UpTo(sim.limits.iterations);
        let patience = if tried.lost < LOST { patience } else { all };
        sim.history.clear();
        let error = match attempt(sim, &now.plan, [share, target], patience) {
            Ok(stats) => {
                let found = Found { lasts: sim.sys.lasts(), near: !jumps(sim) };
                if found.is_taken(now, &tried) {
                    take(sim, now, target, &stats, found);
                    return Ok(stats);
                }
                Err(found)
            }
            Err(cause) => Ok(gave_up(sim, stage, share, target - share, cause)),
        };
        sim.summary.iterations += sim.history.len().saturating_sub(1);
        restore(sim);
        if let Some(stats) = try_again(sim, now, &mut tried, target, error.as_ref().err()) {
            return Ok(stats);
        }
        if let Ok(error) = error
            && now.pace.step < least
        {
            return Err(error);
        }
    }
}

/// After an attempt that ended at `target`, in no balance or in one that was not taken: makes the next one shorter, or
/// follows the sheet to its next balance.
fn try_again(
    sim: &mut Simulation,
    now: &mut UnderWay,
    tried: &mut Tried,
    target: f64,
    refused: Option<&Found>,
) -> Option<NewtonStats> {
    tried.lost += usize::from(sim.history.len() > ITERATIONS);
    if refused.is_some() {
        tried.doubted.get_or_insert_with(|| now.pace.clone());
    }
    // Shorter steps lead nowhere from a balance that does not last itself.
    let at_once = now.plan.lets_go(&sim.stages) || !now.doubt.lasted;
    let follow = refused.is_some_and(|found| !found.lasts) && at_once;
    if !follow {
        sim.summary.cuts += 1;
        now.pace.failed(target - now.share);
    }
    let shortest = if refused.is_some() { now.doubt.shortest } else { SNAPS };
    let short = now.pace.step < shortest * sim.stages[now.plan.stage].first();
    if tried.followed || !(follow || short) {
        return None;
    }
    tried.followed = true;
    let found = past_limit_point(sim, now, refused.is_some());
    if found.is_none()
        && let Some(pace) = tried.doubted.take()
    {
        // What was doubted is taken.
        now.pace = pace;
    }
    found
}

/// Takes the balance found at this share of the stage.
fn take(sim: &mut Simulation, now: &mut UnderWay, target: f64, stats: &NewtonStats, found: Found) {
    let as_before = !sim.stages[now.plan.stage].turns(target);
    sim.energies.left_behind += work_left_behind(sim, &now.plan, [now.share, target]);
    let open = sim.energies.open();
    let mut snapped = accept(sim, as_before.then_some(target - now.share));
    if now.share == 0.0 && now.plan.dropped {
        // What pushed it is gone at once: the sheet springs back by itself.
        sim.energies.snaps += sim.energies.open() - open;
        snapped = true;
    }
    sim.summary.snaps += usize::from(snapped);
    sim.summary.steadied += usize::from(stats.steadied);
    sim.summary.unstable += usize::from(!found.lasts);
    now.doubt.took(found);
    now.share = target;
    now.pace.went_well(stats.iterations);
}

/// Follows the sheet to the next balance past a limit point, or to a balance that lasts. Tools that are let go stay behind
/// as forces that fall to nothing, and forces that no tool guides can fold a sheet as tools never would: it is then
/// followed to where it lies without any, where it comes to rest. `lasting`: a balance that does not last is none.
fn past_limit_point(
    sim: &mut Simulation,
    now: &mut UnderWay,
    lasting: bool,
) -> Option<NewtonStats> {
    let stage = &sim.stages[now.plan.stage];
    let beyond = BEYOND * stage.first();
    let pace = Pace::new(beyond, stage.largest_step, sim.limits.wanted_iterations);
    let near = (now.share + beyond).min(stage.next_corner(now.share));
    let lets_go = now.plan.lets_go(&sim.stages);
    let ways = [lets_go.then_some((None, 1.0)), Some((lasting.then_some(now.share), near))];
    for (from, target) in ways.into_iter().flatten() {
        sim.history.clear();
        let found = relax(sim, &now.plan, (from, target), &now.endurance, lasting);
        now.endurance = now.endurance.after(found.is_ok());
        if let Ok((stats, lasts)) = found {
            now.doubt.took(Found { lasts, near: true });
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
    Ok(UnderWay { plan, pace, endurance, doubt: Doubt::NONE, share: 0.0, start_time: sim.time })
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
        dropped: false,
    };
    sim.committed.forget_last();
    set_targets(sys, now, &plan, 0.0, sim.share);
    add_loads(sys, &sim.loads, now.load.at(0.0));
    sim.committed.applied.copy_from_slice(&sys.applied);
    plan.dropped = drop_absent(sys, &plan.released);
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

/// Parts the sheet from tools that are not there; whether one of them had pushed it, and left nothing behind.
fn drop_absent(sys: &mut System, released: &[f64]) -> bool {
    let gone = |c: &Candidate| c.active && sys.roles[c.tool] == Role::Absent;
    let pushed = |c: &&Candidate| {
        let left = Vec3::from_column_slice(&released[3 * c.node..3 * c.node + 3]);
        sys.scales.of_note((sys.contact_force(c) - left).norm()) > 0.0
    };
    let dropped = sys.contact.candidates.iter().filter(|c| gone(c)).any(|c| pushed(&c));
    for c in &mut sys.contact.candidates {
        c.active &= sys.roles[c.tool] != Role::Absent;
    }
    dropped
}

/// Forces on the nodes of the tools that are taken away (three a node) [N].
fn released(sys: &System, motions: &[Motion]) -> Vec<f64> {
    let mut out = vec![0.0; sys.u.len()];
    for (_, c) in sys.contact.active().filter(|(_, c)| motions[c.tool] == Motion::Release) {
        let force = sys.contact_force(c);
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
