//! Increments of a stage: attempts, step cuts, and continuation past limit points.

use super::attempt::{accept, attempt, place_at_rest, restore};
use super::limit_point::relax;
use crate::error::SimulationError;
use crate::newton::outcome::{NewtonStats, Patience};
use crate::remedy::gave_up;
use crate::report::{Control, IncrementReport};
use crate::stage::branch::{BRANCH_STEP_FACTOR, Doubt, Found, LIMIT_POINT_STEP_RATIO};
use crate::stage::description::Stage;
use crate::stage::energy::{jumps, released_forces_work};
use crate::stage::increment_error::{AllowedError, increment_error};
use crate::stage::start::{begin, release_tools};
use crate::stage::state::{Simulation, UnderWay};
use crate::stage::step_size::{Endurance, Pace};
use crate::system::damping::CONTINUATION_ITERATIONS_MAX;

/// Computes one increment and starts the next stage when one has ended; returns false when all stages are done.
pub(crate) fn advance(
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
            // The stage remains at its last equilibrium, from which it may be continued.
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
        place_at_rest(sim, &now.plan);
    }
    sim.report(stage, share, iterations, observer)?;
    Ok(true)
}

/// Attempts made at an increment.
#[derive(Default)]
struct Tried {
    /// The sheet was followed past a limit point.
    followed: bool,
    /// Viscous stabilisation did not converge. It is not used again: shorter steps have the same difficulty.
    lost: bool,
    /// The increment was repeated because its error was far above the allowed one.
    repeated: bool,
    /// Step-size control at the first equilibrium that was unstable or reached by a snap-through.
    doubted: Option<Pace>,
}

/// Whether an equilibrium is accepted as it is: it is stable and was reached without a jump, or no other branch is
/// searched for.
fn is_taken(found: Found, now: &UnderWay, tried: &Tried) -> bool {
    tried.followed || found.near && found.lasts || !now.doubt.may_find_another()
}

/// Reduces the step until an increment ends in a stable equilibrium; past a limit point, follows the sheet to the
/// next equilibrium.
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
        let patience = if tried.lost { all } else { patience };
        let (refused, error) = match attempt_and_judge(sim, now, &tried, target, patience)? {
            Attempt::Accepted(stats) => return Ok(stats),
            Attempt::TooLong(error) => {
                repeat_shorter(sim, now, (target, error), &mut tried)?;
                continue;
            }
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

/// Result of an attempt at an increment.
enum Attempt {
    /// Accepted equilibrium.
    Accepted(NewtonStats),
    /// Equilibrium that is unstable or was reached by a jump, not accepted so far.
    Refused(Found),
    /// Equilibrium with this error, far above the allowed one.
    TooLong(f64),
    /// No equilibrium.
    NotConverged(SimulationError),
}

/// Makes one attempt at an increment that ends at `target`, and accepts the equilibrium if admissible.
///
/// # Errors
/// [`SimulationError::Stopped`] if cancellation is requested before the stability test.
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
            // An interrupted stability test gives no result.
            let found = Found { lasts: sim.sys.lasts(), near: !jumps(sim) };
            heed(sim)?;
            if !is_taken(found, now, tried) {
                return Ok(Attempt::Refused(found));
            }
            let error = error_to_judge(sim, now);
            if let Some((allowed, error)) = error
                && !tried.repeated
                && allowed.is_far_exceeded(error)
            {
                return Ok(Attempt::TooLong(error));
            }
            take(sim, now, target, &stats, found);
            if let Some((allowed, error)) = error {
                limit_step(sim, now, allowed.next_step(target - share, error));
            }
            Ok(Attempt::Accepted(stats))
        }
        Err(cause) => Ok(Attempt::NotConverged(gave_up(sim, stage, share, target - share, cause))),
    }
}

/// Allowed error of an increment and that of the current one, if the length of the increments follows it.
fn error_to_judge(sim: &Simulation, now: &UnderWay) -> Option<(AllowedError, f64)> {
    let allowed = AllowedError(sim.limits.increment_error?);
    let is_prescribed = !sim.stages[now.plan.stage].ends.is_empty();
    let error = || increment_error(sim, &sim.sys.candidate_forces()).relative();
    (!is_prescribed).then(|| (allowed, error()))
}

/// Restores the start of an increment up to `target` with this error, and shortens the step.
fn repeat_shorter(
    sim: &mut Simulation,
    now: &mut UnderWay,
    (target, error): (f64, f64),
    tried: &mut Tried,
) -> Result<(), SimulationError> {
    sim.summary.iterations += sim.history.len().saturating_sub(1);
    sim.summary.cuts += 1;
    restore(sim);
    let allowed = AllowedError(sim.limits.increment_error.unwrap_or(f64::INFINITY));
    limit_step(sim, now, allowed.next_step(target - now.share, error));
    tried.repeated = true;
    heed(sim)
}

/// Limits the next step, but not below that of a limit point. Errors that do not fall with the step, as where the sheet
/// strikes tool after tool, would shorten it without end.
fn limit_step(sim: &Simulation, now: &mut UnderWay, step: f64) {
    now.pace.limit(step.max(LIMIT_POINT_STEP_RATIO * sim.stages[now.plan.stage].first()));
}

/// Returns [`SimulationError::Stopped`] if cancellation was requested.
fn heed(sim: &Simulation) -> Result<(), SimulationError> {
    let increment = sim.summary.increments;
    if sim.sys.cancel.is_requested() { Err(SimulationError::Stopped { increment }) } else { Ok(()) }
}

/// Releases tools that have moved back with the sheet, at the current fraction of the stage.
fn go_on_without(sim: &mut Simulation, now: &mut UnderWay) -> Result<(), SimulationError> {
    release_tools(sim, &mut now.plan, now.share)?;
    now.pace = pace_of(sim, now.plan.stage);
    Ok(())
}

fn pace_of(sim: &Simulation, stage: usize) -> Pace {
    let Stage { first_step, largest_step, .. } = sim.stages[stage];
    Pace::new(first_step, largest_step, sim.limits.wanted_iterations)
}

/// After an attempt up to `target` without an accepted equilibrium: reduces the step, or follows the sheet to its
/// next equilibrium.
fn try_again(
    sim: &mut Simulation,
    now: &mut UnderWay,
    tried: &mut Tried,
    target: f64,
    refused: Option<&Found>,
) -> Option<NewtonStats> {
    tried.lost |= sim.history.len() > CONTINUATION_ITERATIONS_MAX;
    if refused.is_some() {
        tried.doubted.get_or_insert_with(|| now.pace.clone());
    }
    // From an unstable equilibrium shorter steps do not help.
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
        // The refused equilibrium will be accepted.
        now.pace = pace;
    }
    found
}

/// Accepts the equilibrium at `target`.
fn take(sim: &mut Simulation, now: &mut UnderWay, target: f64, stats: &NewtonStats, found: Found) {
    let as_before = !sim.stages[now.plan.stage].turns(target);
    sim.energies.released_forces += released_forces_work(sim, &now.plan, [now.share, target]);
    let snapped = accept(sim, as_before.then_some(target - now.share));
    sim.summary.snap_throughs += usize::from(snapped);
    sim.summary.stabilised += usize::from(stats.stabilised);
    sim.summary.unstable += usize::from(!found.lasts);
    now.doubt.took(found);
    now.share = target;
    now.pace.went_well(stats.iterations);
}

/// Follows the sheet past a limit point to the next equilibrium. Released tools are replaced by forces that decrease
/// to zero; such forces, not guided by a tool, may fold a sheet as tools would not. The sheet is then followed to its
/// equilibrium without any force. With `lasting` only a stable equilibrium is accepted.
fn past_limit_point(
    sim: &mut Simulation,
    now: &mut UnderWay,
    lasting: bool,
) -> Option<NewtonStats> {
    let stage = &sim.stages[now.plan.stage];
    let beyond = LIMIT_POINT_STEP_RATIO * BRANCH_STEP_FACTOR * stage.first();
    let pace = Pace::new(beyond, stage.largest_step, sim.limits.wanted_iterations);
    let near = (now.share + beyond).min(now.next_corner(&sim.stages));
    let lets_go = now.plan.lets_go(&sim.stages);
    let ways = [lets_go.then_some((None, 1.0)), Some((lasting.then_some(now.share), near))];
    for (from, target) in ways.into_iter().flatten() {
        sim.history.clear();
        let found = relax(sim, &now.plan, (from, target), &now.endurance, lasting);
        now.endurance = now.endurance.after(found.is_ok(), sim.limits.iterations);
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

/// Starts the next stage; `observer` receives the start of the first one. The stage is active even if the observer
/// stops the run there.
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
