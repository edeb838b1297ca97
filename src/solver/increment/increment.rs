//! Increments of a stage: tried, cut and tried again, followed past limit points.

use super::attempt::{accept, attempt, lay_down, restore};
use super::limit_point::relax;
use crate::solver::error::SimulationError;
use crate::solver::newton::cycling::MAX_STABILISED_ITERATIONS;
use crate::solver::newton::outcome::{NewtonStats, Patience};
use crate::solver::remedy::gave_up;
use crate::solver::report::{Control, IncrementReport};
use crate::solver::stage::branch::{Doubt, Found};
use crate::solver::stage::description::Stage;
use crate::solver::stage::energy::{jumps, work_left_behind};
use crate::solver::stage::start::{begin, let_go};
use crate::solver::stage::state::{Simulation, UnderWay};
use crate::solver::stage::step_size::{Endurance, Pace};

/// Steps shorter than this share of a stage's first one are taken for the approach to a limit point, and the next
/// balance is sought this share of the first step beyond it.
const LIMIT_POINT_STEP_RATIO: f64 = 0.02;
const STEP_BEYOND_RATIO: f64 = 0.1;

/// Attempts at an increment in which dampers led to no balance, after which there are none: a shorter step meets the same.
const MAX_STABILISED_ATTEMPTS: usize = 2;

/// Makes one increment, beginning the next stage where one has ended; false when all stages are done.
pub(in crate::solver) fn advance(
    sim: &mut Simulation,
    observer: &mut dyn FnMut(&IncrementReport<'_>) -> Control,
) -> Result<bool, SimulationError> {
    if sim.stage >= sim.stages.len() {
        return Ok(false);
    }
    if sim.under_way.is_none() {
        begin_stage(sim, observer)?;
    }
    let Some(mut now) = sim.under_way.take() else { return Ok(false) };
    let (stage, pace) = (now.plan.stage, now.pace.clone());
    let iterations = match increment(sim, &mut now) {
        Ok(stats) => stats.iterations,
        Err(error) => {
            // The stage stays under way at its last balance, from which it may be tried again.
            now.pace = pace;
            sim.under_way = Some(now);
            return Err(error);
        }
    };
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

/// Whether a balance is taken as it is: where the way there may have passed by another it is sought.
fn is_taken(found: Found, now: &UnderWay, tried: &Tried) -> bool {
    tried.followed || found.near && found.lasts || !now.doubt.may_find_another()
}

/// Tries shorter and shorter steps until one ends in a balance that lasts; past a limit point, the way to the next balance.
fn increment(sim: &mut Simulation, now: &mut UnderWay) -> Result<NewtonStats, SimulationError> {
    if now.plan.lets_go_at().is_some_and(|at| at <= now.share) {
        go_on_without(sim, now)?;
    }
    let least = sim.limits.smallest_step * sim.stages[now.plan.stage].first();
    let mut tried = Tried::default();
    loop {
        if sim.summary.increments >= sim.limits.increments {
            return Err(SimulationError::TooManyIncrements { limit: sim.limits.increments });
        }
        let (target, patience) = now.next(&sim.stages);
        let all = Patience::UpTo(sim.limits.iterations);
        let patience = if tried.lost < MAX_STABILISED_ATTEMPTS { patience } else { all };
        let (refused, error) = match attempt_and_judge(sim, now, &tried, target, patience)? {
            Attempt::Accepted(stats) => return Ok(stats),
            Attempt::Refused(found) => (Some(found), None),
            Attempt::NotConverged(error) => (None, Some(error)),
        };
        sim.summary.iterations += sim.history.len().saturating_sub(1);
        restore(sim);
        heed(sim)?;
        if let Some(stats) = try_again(sim, now, &mut tried, target, refused.as_ref()) {
            return Ok(stats);
        }
        heed(sim)?;
        if let Some(error) = error
            && now.pace.step < least
        {
            if now.plan.lets_go_at().is_none() {
                return Err(error);
            }
            go_on_without(sim, now)?;
            tried = Tried::default();
        }
    }
}

/// How an attempt at an increment ended.
enum Attempt {
    /// In a balance that is accepted.
    Accepted(NewtonStats),
    /// In a balance that is not accepted as it is.
    Refused(Found),
    /// In no balance.
    NotConverged(SimulationError),
}

/// Makes one attempt at an increment that ends at `target`, and accepts the balance where it may.
///
/// # Errors
/// [`SimulationError::Stopped`] where that is requested before the balance is judged.
fn attempt_and_judge(
    sim: &mut Simulation,
    now: &mut UnderWay,
    tried: &Tried,
    target: f64,
    patience: Patience,
) -> Result<Attempt, SimulationError> {
    let (stage, share) = (now.plan.stage, now.share);
    sim.history.clear();
    match attempt(sim, &now.plan, [share, target], patience) {
        Ok(stats) => {
            // What is interrupted says nothing of whether the balance lasts.
            let found = Found { lasts: sim.sys.lasts(), near: !jumps(sim) };
            heed(sim)?;
            if !is_taken(found, now, tried) {
                return Ok(Attempt::Refused(found));
            }
            take(sim, now, target, &stats, found);
            Ok(Attempt::Accepted(stats))
        }
        Err(cause) => Ok(Attempt::NotConverged(gave_up(sim, stage, share, target - share, cause))),
    }
}

/// Stops where that has been requested.
fn heed(sim: &Simulation) -> Result<(), SimulationError> {
    let increment = sim.summary.increments;
    if sim.sys.cancel.is_requested() { Err(SimulationError::Stopped { increment }) } else { Ok(()) }
}

/// Lets the tools go that have gone back with the sheet so far, at the share of the stage that is done.
fn go_on_without(sim: &mut Simulation, now: &mut UnderWay) -> Result<(), SimulationError> {
    let_go(sim, &mut now.plan, now.share)?;
    now.pace = pace_of(sim, now.plan.stage);
    Ok(())
}

fn pace_of(sim: &Simulation, stage: usize) -> Pace {
    let Stage { first_step, largest_step, .. } = sim.stages[stage];
    Pace::new(first_step, largest_step, sim.limits.wanted_iterations)
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
    tried.lost += usize::from(sim.history.len() > MAX_STABILISED_ITERATIONS);
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
    let shortest = if refused.is_some() { now.doubt.shortest } else { LIMIT_POINT_STEP_RATIO };
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
    let snapped = accept(sim, as_before.then_some(target - now.share));
    sim.summary.snaps += usize::from(snapped);
    sim.summary.stabilised += usize::from(stats.stabilised);
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
    let beyond = STEP_BEYOND_RATIO * stage.first();
    let pace = Pace::new(beyond, stage.largest_step, sim.limits.wanted_iterations);
    let near = (now.share + beyond).min(now.next_corner(&sim.stages));
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

/// Begins the next stage; `observer` sees the start of the first. It is under way also where the observer stops the run there.
fn begin_stage(
    sim: &mut Simulation,
    observer: &mut dyn FnMut(&IncrementReport<'_>) -> Control,
) -> Result<(), SimulationError> {
    let stage = sim.stage;
    let plan = begin(sim, stage)?;
    let seen = if stage == 0 { sim.report(0, 0.0, 0, observer) } else { Ok(()) };
    let (pace, endurance, doubt) = (pace_of(sim, stage), Endurance::FULL, Doubt::NONE);
    let start_time = sim.time;
    sim.under_way = Some(UnderWay { plan, pace, endurance, doubt, share: 0.0, start_time });
    seen
}
