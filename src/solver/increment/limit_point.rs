//! Past a limit point. A sheet that snaps (oil-canning when it is let go, a buckle) has no balance near its last one. It
//! is followed to the next as a slow viscous motion at constant loads and tools, with ever less damping, until it is in
//! balance without any. The energy set free is what is left over, and is reported; no state accepted here has damping in it.
//! Where the balance it comes to does not last it is pushed along the motion in which it gives way, and followed again.

use super::attempt::{accept, attempt, restore};
use crate::geometry::{Aabb, Vec3};
use crate::solver::element::Want;
use crate::solver::newton::outcome::{NewtonError, NewtonStats, Patience};
use crate::solver::stage::energy::jumps;
use crate::solver::stage::plan::Plan;
use crate::solver::stage::state::{Committed, Simulation};
use crate::solver::stage::step_size::Endurance;
use crate::solver::system::damper::Damper;
use crate::solver::system::damping::{Continuation, GOOD_ITERATIONS, LIMIT_POINT};
use crate::solver::system::regime::Stabilisation;
use crate::solver::system::softest_motion::Push;
use crate::solver::system::system::System;
use crate::solver::tools::role::Role;

/// Iterations after which a step has failed.
const MAX_STEP_ITERATIONS: usize = 12;
/// Force of the dampers, over the largest before, at which the motion is all but over.
const MOTION_OVER_RATIO: f64 = 1e-3;
/// Force of the dampers, over what the sheet carried before, at which it is the dampers that tools which go ahead push
/// against: a step of the tools that the sheet cannot follow dents it.
const DAMPING_FORCE_RATIO_MAX: f64 = 2.0;
/// Damping at which a step hardly moves any node: one that fails there fails however it is held back.
const MAX_STIFFNESS: f64 = 100.0;
/// Damping of a sheet that is pushed, over that at which the push would neither grow nor fall, at least: with less than that it
/// would go the other way.
const PUSH_STIFFNESS_RATIO: f64 = 2.0;
/// Pushes in a row: of a balance on which the sheet gives way in several motions.
const MAX_PUSHES: usize = 3;
/// Way of a node over the size of the sheet before which it comes to rest, if at all: nothing balances one that runs away.
const RUNAWAY_REL: f64 = 1.0;

/// Goes from the last balance to the next one at share `target` of the stage, however far that is; also whether that lasts,
/// as it has to where it is to be `lasting`. `from`: the share of the last one, if there is a balance near it that only does
/// not last: the sheet is pushed out of that then, as it would be dented by a motion that its dampers hold back.
///
/// # Errors
/// [`NewtonError::StillMoving`]; the last converged state is back. `sim.history` must be empty before.
pub(in crate::solver) fn relax(
    sim: &mut Simulation,
    plan: &Plan,
    (from, target): (Option<f64>, f64),
    endurance: &Endurance,
    lasting: bool,
) -> Result<(NewtonStats, bool), NewtonError> {
    let before = sim.state();
    sim.dragged = 0.0;
    let found = come_to(sim, plan, (from, target), endurance.iterations).and_then(|stats| {
        let lasts = lasts_at_rest(&mut sim.sys)?;
        if lasts || !lasting {
            return Ok((stats, lasts));
        }
        buckle(sim, plan, target, endurance.iterations).map(|more| (stats.and(more), true))
    });
    // Whether a balance lasts is not known where that was interrupted.
    let stopped = sim.sys.cancel.is_requested();
    let found = if stopped { Err(NewtonError::Cancelled) } else { found };
    let Ok((_, lasts)) = found else {
        // It is of this very set-up.
        let _ = sim.go_back(before);
        return found;
    };
    sim.summary.unstable += usize::from(!lasts);
    sim.dragged += work_of_travel(sim, &sim.committed);
    accept(sim, None);
    sim.summary.snaps += 1;
    let rest = work_of_travel(sim, before.committed());
    let (old, now) = (before.energies(), &mut sim.energies);
    now.external += rest - std::mem::take(&mut sim.dragged);
    now.internal = old.internal + now.stored() - old.stored();
    let (given, friction) = (now.external - old.external, now.friction - old.friction);
    now.snaps = old.snaps + given - (now.internal - old.internal) - friction;
    found
}

/// Comes to a balance, as an increment does, where it does so without a jump, or as a slow motion.
fn come_to(
    sim: &mut Simulation,
    plan: &Plan,
    (from, target): (Option<f64>, f64),
    iterations: usize,
) -> Result<NewtonStats, NewtonError> {
    if let Some(from) = from {
        let patience = Patience::UpTo(sim.limits.iterations);
        match attempt(sim, plan, [from, target], patience) {
            Ok(stats) if !jumps(sim) => return Ok(stats),
            _ => restore(sim),
        }
        sim.summary.iterations += sim.history.len().saturating_sub(1);
        sim.history.clear();
    }
    follow(sim, plan, target, iterations, None)
}

/// Whether a balance lasts to which the sheet has come without flowing any more.
fn lasts_at_rest(sys: &mut System) -> Result<bool, NewtonError> {
    sys.evaluate_at_yield()?;
    let lasts = sys.lasts();
    sys.evaluate(Want::ResidualAndTangent)?;
    Ok(lasts)
}

/// Pushes the sheet out of a balance that does not last until it comes to one that does.
fn buckle(
    sim: &mut Simulation,
    plan: &Plan,
    target: f64,
    iterations: usize,
) -> Result<NewtonStats, NewtonError> {
    let mut total = NewtonStats::default();
    for _ in 0..MAX_PUSHES {
        sim.sys.evaluate_at_yield()?;
        let push = sim.sys.push();
        sim.sys.evaluate(Want::ResidualAndTangent)?;
        let Some(push) = push else { break };
        sim.dragged += work_of_travel(sim, &sim.committed);
        accept(sim, None);
        total = total.and(follow(sim, plan, target, iterations, Some(&push))?);
        if lasts_at_rest(&mut sim.sys)? {
            sim.summary.buckles += 1;
            return Ok(total);
        }
    }
    Err(NewtonError::StillMoving { iterations: sim.history.len() })
}

/// Follows the sheet from the last balance to one at share `target` of the stage, which is not accepted yet.
fn follow(
    sim: &mut Simulation,
    plan: &Plan,
    target: f64,
    iterations: usize,
    push: Option<&Push>,
) -> Result<NewtonStats, NewtonError> {
    let mut motion = DampedMotion::new(&sim.sys, push);
    let origin = Origin::of(&sim.committed);
    let mut last = f64::NAN;
    while sim.history.len() < iterations && motion.control.stiffness <= MAX_STIFFNESS {
        // The motion goes on as it went in the step before, if that was as long.
        if motion.control.stiffness != last {
            sim.committed.forget_last();
        }
        last = motion.control.stiffness;
        let before_step = sim.history.len() + 1;
        let Ok((stats, force)) = step(sim, plan, target, last, push) else {
            motion.failed(sim.history.len().saturating_sub(before_step));
            continue;
        };
        if origin.is_lost(&sim.sys, force) {
            break;
        }
        motion.converged(stats, force);
        let Some(most) = motion.iterations_to_rest(force) else { continue };
        match come_to_rest(sim, plan, target, most) {
            Ok(stats) => {
                sim.summary.iterations += motion.lost;
                return Ok(motion.stats.and(stats));
            }
            Err(lost) => motion.release_failed(lost),
        }
    }
    Err(NewtonError::StillMoving { iterations: sim.history.len() })
}

/// How a motion under dampers has gone so far.
struct DampedMotion {
    control: Continuation,
    /// Of the steps that converged.
    stats: NewtonStats,
    /// Largest force of the dampers at the end of a step [N].
    largest: f64,
    /// Iterations that led to no balance.
    lost: usize,
}

impl DampedMotion {
    fn new(sys: &System, push: Option<&Push>) -> Self {
        let least = push.map(|push| PUSH_STIFFNESS_RATIO * push.stiffness / sys.scales.tangential);
        let control = Continuation::new(LIMIT_POINT, least);
        Self { control, stats: NewtonStats::default(), largest: 0.0, lost: 0 }
    }

    /// Takes in a step that converged, in which this force remains in the dampers [N].
    fn converged(&mut self, stats: NewtonStats, force: f64) {
        self.control.converged(stats.iterations, force);
        self.stats = std::mem::take(&mut self.stats).and(stats);
        self.largest = force.max(self.largest);
    }

    /// A step did not converge, in this number of iterations.
    fn failed(&mut self, iterations: usize) {
        self.lost += iterations;
        self.control.failed();
    }

    /// Iterations in which the sheet may come to rest without dampers, whose force is `force` [N], if they may be left out
    /// yet. Where many iterations lead is not what the motion leads to, unless that is all but over.
    fn iterations_to_rest(&self, force: f64) -> Option<usize> {
        let over = force <= MOTION_OVER_RATIO * self.largest;
        let most = if over { MAX_STEP_ITERATIONS } else { GOOD_ITERATIONS };
        self.control.may_release().then_some(most)
    }

    /// The sheet did not come to rest without dampers, in this number of iterations.
    fn release_failed(&mut self, iterations: usize) {
        self.lost += iterations;
        self.control.release_failed();
    }
}

/// The balance that a motion begins at.
struct Origin {
    /// Internal force there [N].
    carried: f64,
    travels: Vec<f64>,
    u: Vec<f64>,
}

impl Origin {
    fn of(committed: &Committed) -> Self {
        let carried = norm(&committed.internal_force);
        Self { carried, travels: committed.travels.clone(), u: committed.u.clone() }
    }

    /// Whether the motion leads to no balance: tools go ahead against dampers, whose force is `damping` [N], or the sheet runs
    /// away.
    fn is_lost(&self, sys: &System, damping: f64) -> bool {
        damping > DAMPING_FORCE_RATIO_MAX * self.carried && goes_ahead(sys, &self.travels)
            || is_far(sys, &self.u)
    }
}

/// Seeks the balance without dampers at `target` in at most this many iterations. Where there is none the last state of the
/// motion is restored.
///
/// # Errors
/// The iterations that led to none.
fn come_to_rest(
    sim: &mut Simulation,
    plan: &Plan,
    target: f64,
    most: usize,
) -> Result<NewtonStats, usize> {
    sim.committed.forget_last();
    let before = sim.history.len() + 1;
    attempt(sim, plan, [target; 2], Patience::UpTo(most)).map_err(|_| {
        let lost = sim.history.len().saturating_sub(before);
        restore(sim);
        lost
    })
}

/// One step of the motion, which begins with the last one again where that is not forgotten (steps count as one long); force
/// that remains in the dampers [N].
fn step(
    sim: &mut Simulation,
    plan: &Plan,
    target: f64,
    damping: f64,
    push: Option<&Push>,
) -> Result<(NewtonStats, f64), NewtonError> {
    let stiffness = damping * sim.sys.scales.tangential;
    let damper = Damper::new(&sim.sys.body, &sim.sys.u, stiffness);
    let push = push.map(|push| push.forces.clone());
    sim.sys.regime.stabilisation = Stabilisation::Continuation { damper: damper.clone(), push };
    let found = attempt(sim, plan, [target - 1.0, target], Patience::UpTo(MAX_STEP_ITERATIONS));
    let stats = found.inspect_err(|_| restore(sim))?;
    let sys = &mut sim.sys;
    sys.regime.release();
    let damped: Vec<f64> = damper.forces(&sys.u).collect();
    sys.eval.internal_force.iter_mut().zip(&damped).for_each(|(f, damped)| *f -= damped);
    sim.dragged += work_of_travel(sim, &sim.committed);
    accept(sim, Some(1.0));
    Ok((stats, norm(&damped)))
}

/// Work of the tools whose travel is given since a balance, by their forces then and now, of the whole process [N mm]. While
/// dampers hold the sheet back they push against these too, which is no work on the sheet.
fn work_of_travel(sim: &Simulation, old: &Committed) -> f64 {
    let sys = &sim.sys;
    let given = (0..sys.tools.len()).filter(|&tool| sys.roles[tool] == Role::Travel);
    let work = |tool: usize| {
        let moved = sys.tools[tool].travel - old.travels[tool];
        0.5 * (sys.push_of(tool) + old.pushes[tool]) * moved
    };
    sim.share * given.map(work).sum::<f64>()
}

/// Whether a node has moved by more than the sheet is large.
fn is_far(sys: &System, from: &[f64]) -> bool {
    let way = sys.u.chunks_exact(3).zip(from.chunks_exact(3)).map(|(now, before)| {
        (Vec3::from_column_slice(now) - Vec3::from_column_slice(before)).norm()
    });
    way.fold(0.0, f64::max) > RUNAWAY_REL * Aabb::of_points(&sys.body.mesh().nodes).diagonal()
}

/// Whether a tool whose travel is given is not where it was.
fn goes_ahead(sys: &System, before: &[f64]) -> bool {
    let given = |tool: usize| sys.roles[tool] == Role::Travel;
    let moved = |tool: usize| sys.tools[tool].travel.to_bits() != before[tool].to_bits();
    (0..before.len()).any(|tool| given(tool) && moved(tool))
}

fn norm(forces: &[f64]) -> f64 {
    forces.iter().map(|f| f * f).sum::<f64>().sqrt()
}
