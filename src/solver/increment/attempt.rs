//! One attempt at an increment: predict, set tools and loads, solve. The state is then accepted with its work, or
//! restored.

use super::loose_sheet::{Way, carry, reposition};
use crate::newton::outcome::{NewtonError, NewtonStats, Patience};
use crate::newton::solve::solve;
use crate::stage::energy::add_work;
use crate::stage::plan::Plan;
use crate::stage::start::{add_loads, set_targets};
use crate::stage::state::{Committed, Simulation};
use crate::system::system::System;

/// Solves the increment between two fractions of the stage; the caller accepts or restores the state.
pub(crate) fn attempt(
    sim: &mut Simulation,
    plan: &Plan,
    [share, target]: [f64; 2],
    patience: Patience,
) -> Result<NewtonStats, NewtonError> {
    let kept = sim.history.len();
    sim.sys.expect_as_last();
    aim(sim, plan, target);
    let (loose, idle) = (sim.sys.is_loose(), sim.sys.was_idle());
    let mut lost = None;
    if loose && idle {
        let mut again = |sim: &mut Simulation| {
            begin_anew(sim, kept);
            aim(sim, plan, target);
        };
        match carry(sim, patience, &mut again) {
            Ok(Way::Carried(stats)) => return checked(&sim.sys, stats),
            Ok(Way::Astray(error)) => return Err(error),
            Ok(Way::Pressed | Way::Unmoved) => {}
            Err(error) => lost = Some(error),
        }
        begin_anew(sim, kept);
    }
    let foreseen = predict(&mut sim.sys, &sim.committed, target - share);
    aim(sim, plan, target);
    let mut found = solve(&mut sim.sys, &sim.limits, patience, foreseen, &mut sim.history)?;
    if loose && sim.sys.is_idle() {
        if let Some(error) = lost {
            return Err(error);
        }
        if !idle && let Some(moved) = reposition(sim)? {
            found = found.and(moved);
        }
    }
    checked(&sim.sys, found)
}

/// Restores the last equilibrium within an attempt. Records after the first `kept` are removed from the history. For
/// a sheet followed as a viscous motion, the records of that motion remain, since they count towards its limit of
/// iterations.
fn begin_anew(sim: &mut Simulation, kept: usize) {
    sim.summary.iterations += sim.history.len().saturating_sub(kept + 1);
    sim.history.truncate(kept);
    sim.committed.forget_last();
    restore(sim);
    sim.sys.expect_as_last();
}

/// Sets tools and loads to the end of the increment.
fn aim(sim: &mut Simulation, plan: &Plan, target: f64) {
    let stage = &sim.stages[plan.stage];
    set_targets(&mut sim.sys, stage, plan, target, sim.share);
    add_loads(&mut sim.sys, &sim.loads, stage.load.at(target));
    let System { applied, regime, .. } = &mut sim.sys;
    let push = regime.push().unwrap_or_default();
    applied.iter_mut().zip(push).for_each(|(applied, push)| *applied += push);
}

/// Returns an equilibrium only if no element is inverted and no node has passed through a tool.
fn checked(sys: &System, found: NewtonStats) -> Result<NewtonStats, NewtonError> {
    sys.body.not_inside_out(&sys.u)?;
    match sys.passed_through() {
        Some(node) => Err(NewtonError::PassedThrough { node }),
        None => Ok(found),
    }
}

/// Extrapolates the last increment in proportion to the step. Returns the ratio of the steps if the strains can be
/// predicted too.
fn predict(sys: &mut System, committed: &Committed, step: f64) -> Option<f64> {
    let (last_step, du, dtravel) = committed.last.as_ref()?;
    let factor = step / last_step;
    sys.u.iter_mut().zip(du).for_each(|(u, d)| *u += factor * d);
    for (tool, d) in sys.tools.iter_mut().zip(dtravel) {
        tool.travel += factor * d;
    }
    sys.body.can_foresee().then_some(factor)
}

/// Makes the current iterate the last converged state; `step` is the fraction of the stage that led to it, for the
/// predictor. Returns whether a snap-through occurred.
pub(crate) fn accept(sim: &mut Simulation, step: Option<f64>) -> bool {
    let forces = sim.sys.candidate_forces();
    let jumped = add_work(sim, &forces);
    let sys = &mut sim.sys;
    sys.body.commit();
    sys.commit_contact(&forces);
    let old = &sim.committed;
    let last = step.map(|step| {
        let mut du: Vec<f64> = sys.u.iter().zip(&old.u).map(|(a, b)| a - b).collect();
        sys.remove_free_motions(&mut du);
        let travels = sys.tools.iter().zip(&old.travels).map(|(t, b)| t.travel - b).collect();
        (step, du, travels)
    });
    sim.committed = Committed { last, ..Committed::of(sys) };
    jumped
}

/// Moves a sheet without tools and loads to the position closest to that at the start of the stage.
pub(crate) fn place_at_rest(sim: &mut Simulation, plan: &Plan) {
    if plan.is_free() && sim.sys.is_without_loads() {
        sim.sys.move_closest_to(&plan.unsupported);
        sim.committed = Committed::of(&sim.sys);
    }
}

/// Restores the last converged state.
pub(crate) fn restore(sim: &mut Simulation) {
    let (sys, old) = (&mut sim.sys, &sim.committed);
    sys.regime.release();
    sys.body.restore();
    sys.contact.restore();
    sys.u.copy_from_slice(&old.u);
    sys.applied.copy_from_slice(&old.applied);
    sys.eval.internal_force.copy_from_slice(&old.internal_force);
    for (tool, travel) in sys.tools.iter_mut().zip(&old.travels) {
        tool.travel = *travel;
    }
    for (stop, reached) in sys.stops.iter_mut().zip(&old.on_stop) {
        stop.reached = *reached;
    }
}
