//! Continuation past a limit point.
//!
//! After a snap-through (oil-canning on release, buckling) no equilibrium exists near the last one. The sheet is
//! followed as a slow viscous motion at constant loads and tools, with decreasing damping, until it is in equilibrium
//! without damping. The released elastic energy is the remainder of the energy balance and is reported. No accepted
//! state contains damping. If the equilibrium is unstable, the sheet is perturbed along its softest motion and
//! followed again.

use super::attempt::{accept, attempt, restore};
use crate::element::Want;
use crate::limits::easy_iterations;
use crate::newton::outcome::{NewtonError, NewtonStats, Patience};
use crate::numbers::tolerances::NEGLIGIBLE_REL;
use crate::stage::energy::jumps;
use crate::stage::plan::Plan;
use crate::stage::state::{Committed, Simulation};
use crate::stage::step_size::Endurance;
use crate::system::damper::Damper;
use crate::system::damping::{Continuation, Rules, STIFFNESS_FACTOR};
use crate::system::regime::Stabilisation;
use crate::system::softest_motion::{Push, SUBSPACE_SIZE};
use crate::system::system::System;
use crate::tools::role::Role;
use kanagata_geometry::{Aabb, Vec3};

/// Maximum iterations of a step of a viscous motion. A step that needs more is too long; a stiffer one follows the motion
/// more closely.
const STEP_ITERATIONS_MAX: usize = 12;

/// Follows the sheet from the last equilibrium to the next one at the fraction `target` of the stage, at any
/// distance. Also returns whether it is stable, as required with `lasting`. `from` is the fraction of the last
/// equilibrium if an unstable equilibrium exists near it. The sheet is then perturbed from there, since a motion
/// slowed by dampers would dent it.
///
/// # Errors
/// [`NewtonError::StillMoving`]; the last converged state is restored. `sim.history` must be empty on entry.
pub(crate) fn relax(
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
    // After cancellation the stability is unknown.
    let stopped = sim.sys.cancel.is_requested();
    let found = if stopped { Err(NewtonError::Cancelled) } else { found };
    let Ok((_, lasts)) = found else {
        // The state belongs to this model.
        let _ = sim.go_back(before);
        return found;
    };
    sim.summary.unstable += usize::from(!lasts);
    sim.dragged += work_of_travel(sim, &sim.committed);
    accept(sim, None);
    sim.summary.snap_throughs += 1;
    let rest = work_of_travel(sim, before.committed());
    let (old, now) = (before.energies(), &mut sim.energies);
    now.external += rest - std::mem::take(&mut sim.dragged);
    now.internal = old.internal + now.stored() - old.stored();
    let (given, friction) = (now.external - old.external, now.friction - old.friction);
    now.released_elastic = old.released_elastic + given - (now.internal - old.internal) - friction;
    found
}

/// Finds an equilibrium by a normal increment if it involves no jump, otherwise by a viscous motion.
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

/// Stability of an equilibrium that was reached without further plastic flow, with the plastic tangent at all points
/// on the yield surface.
fn lasts_at_rest(sys: &mut System) -> Result<bool, NewtonError> {
    sys.evaluate_at_yield()?;
    let lasts = sys.lasts();
    sys.evaluate(Want::ResidualAndTangent)?;
    Ok(lasts)
}

/// Perturbs the sheet from an unstable equilibrium until it reaches a stable one.
fn buckle(
    sim: &mut Simulation,
    plan: &Plan,
    target: f64,
    iterations: usize,
) -> Result<NewtonStats, NewtonError> {
    let mut total = NewtonStats::default();
    // One perturbation for each motion that is computed: equilibrium may be unstable in several.
    for _ in 0..SUBSPACE_SIZE {
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

/// Follows the sheet from the last equilibrium to one at the fraction `target` of the stage, which is not accepted
/// yet.
fn follow(
    sim: &mut Simulation,
    plan: &Plan,
    target: f64,
    iterations: usize,
    push: Option<&Push>,
) -> Result<NewtonStats, NewtonError> {
    let mut motion = DampedMotion::new(&sim.sys, sim.limits.wanted_iterations, push);
    let origin = Origin::of(&sim.committed);
    let mut last = f64::NAN;
    while sim.history.len() < iterations && !motion.control.is_stiffest() {
        // If the last step had the same damping, its motion is extrapolated.
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

/// State of a viscous motion.
struct DampedMotion {
    control: Continuation,
    /// Target number of iterations of an increment.
    wanted: usize,
    /// Statistics of the converged steps.
    stats: NewtonStats,
    /// Largest damping force at the end of a step [N].
    largest: f64,
    /// Iterations of steps that did not converge.
    lost: usize,
}

impl DampedMotion {
    fn new(sys: &System, wanted: usize, push: Option<&Push>) -> Self {
        // At the stiffness of the perturbation it neither grows nor decays; below, the sheet would move in the opposite
        // direction.
        let least = push.map(|push| STIFFNESS_FACTOR * push.stiffness / sys.scales.tangential);
        let control = Continuation::new(Rules::LimitPoint { wanted }, least);
        Self { control, wanted, stats: NewtonStats::default(), largest: 0.0, lost: 0 }
    }

    /// Registers a converged step with the remaining damping force `force` [N].
    fn converged(&mut self, stats: NewtonStats, force: f64) {
        self.control.converged(stats.iterations, force);
        self.stats = std::mem::take(&mut self.stats).and(stats);
        self.largest = force.max(self.largest);
    }

    /// Registers a step that did not converge after `iterations`.
    fn failed(&mut self, iterations: usize) {
        self.lost += iterations;
        self.control.failed();
    }

    /// Maximum iterations for an equilibrium without dampers, whose force is `force` [N]; `None` if the dampers must
    /// not be removed yet. Unless the motion has almost ended, an equilibrium that needs many iterations is not the
    /// one the motion leads to.
    fn iterations_to_rest(&self, force: f64) -> Option<usize> {
        let over = force <= NEGLIGIBLE_REL * self.largest;
        let most = if over { STEP_ITERATIONS_MAX } else { easy_iterations(self.wanted) };
        self.control.may_release().then_some(most)
    }

    /// Registers that no equilibrium without dampers was found in `iterations`.
    fn release_failed(&mut self, iterations: usize) {
        self.lost += iterations;
        self.control.release_failed();
    }
}

/// Equilibrium at the start of a motion.
struct Origin {
    /// Norm of the internal force [N].
    carried: f64,
    travels: Vec<f64>,
    u: Vec<f64>,
}

impl Origin {
    fn of(committed: &Committed) -> Self {
        let carried = norm(&committed.internal_force);
        Self { carried, travels: committed.travels.clone(), u: committed.u.clone() }
    }

    /// Whether the motion leads to no equilibrium: the sheet moves away, or tools advance and the force `damping` [N] of
    /// the dampers exceeds what the sheet carried. Such tools work against the dampers and dent the sheet.
    fn is_lost(&self, sys: &System, damping: f64) -> bool {
        damping > self.carried && goes_ahead(sys, &self.travels) || is_far(sys, &self.u)
    }
}

/// Computes the equilibrium without dampers at `target` in at most `most` iterations. On failure the last state of
/// the motion is restored.
///
/// # Errors
/// Number of iterations spent.
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

/// One step of the viscous motion, extrapolated from the last one if that is known (all steps have length one). Also
/// returns the remaining damping force [N].
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
    let found = attempt(sim, plan, [target - 1.0, target], Patience::UpTo(STEP_ITERATIONS_MAX));
    let stats = found.inspect_err(|_| restore(sim))?;
    let sys = &mut sim.sys;
    sys.regime.release();
    let damped: Vec<f64> = damper.forces(&sys.u).collect();
    sys.eval.internal_force.iter_mut().zip(&damped).for_each(|(f, damped)| *f -= damped);
    sim.dragged += work_of_travel(sim, &sim.committed);
    accept(sim, Some(1.0));
    Ok((stats, norm(&damped)))
}

/// Work since an equilibrium of the tools with prescribed travel, by the mean of their forces at both ends, for the
/// complete process [N mm]. Part of it is done on the dampers, not on the sheet.
fn work_of_travel(sim: &Simulation, old: &Committed) -> f64 {
    let sys = &sim.sys;
    let given = (0..sys.tools.len()).filter(|&tool| sys.roles[tool] == Role::Travel);
    let work = |tool: usize| {
        let moved = sys.tools[tool].travel - old.travels[tool];
        0.5 * (sys.push_of(tool) + old.pushes[tool]) * moved
    };
    sim.share * given.map(work).sum::<f64>()
}

/// Whether a node has moved by more than the size of the sheet; such a motion has no equilibrium.
fn is_far(sys: &System, from: &[f64]) -> bool {
    let way = sys.u.chunks_exact(3).zip(from.chunks_exact(3)).map(|(now, before)| {
        (Vec3::from_column_slice(now) - Vec3::from_column_slice(before)).norm()
    });
    way.fold(0.0, f64::max) > Aabb::of_points(&sys.body.mesh().nodes).diagonal()
}

/// Whether a tool with prescribed travel has moved.
fn goes_ahead(sys: &System, before: &[f64]) -> bool {
    let given = |tool: usize| sys.roles[tool] == Role::Travel;
    let moved = |tool: usize| sys.tools[tool].travel.to_bits() != before[tool].to_bits();
    (0..before.len()).any(|tool| given(tool) && moved(tool))
}

fn norm(forces: &[f64]) -> f64 {
    forces.iter().map(|f| f * f).sum::<f64>().sqrt()
}
