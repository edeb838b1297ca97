//! Past a limit point. A sheet that snaps (oil-canning when it is let go, a buckle) has no balance near its last one. It
//! is followed to the next as a slow viscous motion at constant loads and tools, with ever less damping, until it is in
//! balance without any. What the damper has taken is reported, and no damping is left in any state.

use super::assembly::Evaluation;
use super::element::Want;
use super::newton::{NewtonError, NewtonStats, Patience};
use super::pattern::Pattern;
use super::simulation::Simulation;
use super::stages::Energies;
use super::stepping::{Plan, accept, attempt, restore};
use super::system::System;

/// Damping tried first: stiffness of a node's damper over the mesh's.
const FIRST: f64 = 1e-3;
/// Factor by which damping falls after steps that went well, and rises after those that failed.
const FACTOR: f64 = 4.0;
/// Iterations of a step that went very well (damping falls by the factor squared), and of one that went well.
const EASY: usize = 3;
const WELL: usize = 5;
/// Force of the dampers, over the largest before, at which balance without any is tried.
const SLOW: f64 = 1e-2;
/// Steps in all, and those of them that may fail.
const STEPS: usize = 100;
const FAILURES: usize = 6;

/// Forces that hold every node back towards where the step began.
#[derive(Debug, Clone)]
pub(super) struct Damper {
    from: Vec<f64>,
    /// Stiffness of every node's damper [N/mm].
    stiffness: Vec<f64>,
}

impl Damper {
    /// A damper in proportion to each node's volume; `share` of the mesh's stiffness in the mean.
    fn new(sys: &System, share: f64) -> Self {
        let mesh = sys.body.mesh();
        let mut volumes = vec![0.0; mesh.nodes.len()];
        for (element, volume) in mesh.elements.iter().zip(sys.body.volumes()) {
            element.iter().for_each(|&node| volumes[node as usize] += volume / 8.0);
        }
        let mean = volumes.iter().sum::<f64>() / volumes.len().max(1) as f64;
        let stiffness = volumes.iter().map(|v| share * sys.scales.tangential * v / mean).collect();
        Self { from: sys.u.clone(), stiffness }
    }

    /// Adds its forces and, where it is wanted, its tangent.
    pub(super) fn add(&self, u: &[f64], want: Want, pattern: &Pattern, eval: &mut Evaluation) {
        for (i, force) in self.forces(u).enumerate() {
            eval.internal_force[i] += force;
            if want == Want::ResidualAndTangent
                && let Some(place) = pattern.position(i, i)
            {
                eval.tangent[place] += self.stiffness[i / 3];
            }
        }
    }

    fn forces(&self, u: &[f64]) -> impl Iterator<Item = f64> {
        let moved = u.iter().zip(&self.from).map(|(now, from)| now - from);
        moved.enumerate().map(|(i, moved)| self.stiffness[i / 3] * moved)
    }
}

/// Goes from the last balance to the next one at share `target` of the stage, however far that is.
///
/// # Errors
/// What the last step said; the last converged state is back.
pub(super) fn relax(
    sim: &mut Simulation,
    plan: &Plan,
    target: f64,
) -> Result<NewtonStats, NewtonError> {
    let before = sim.state();
    let found = follow(sim, plan, target);
    if found.is_err() {
        // It is of this very set-up.
        let _ = sim.go_back(before);
        return found;
    }
    accept(sim, 0.0);
    sim.committed.last = None;
    sim.summary.snaps += 1;
    let stored = |e: &Energies| e.elastic + e.plastic;
    let (old, now) = (before.energies(), &mut sim.energies);
    now.internal = old.internal + stored(now) - stored(old);
    let (given, friction) = (now.external - old.external, now.friction - old.friction);
    now.snaps = old.snaps + given - (now.internal - old.internal) - friction;
    found
}

fn follow(sim: &mut Simulation, plan: &Plan, target: f64) -> Result<NewtonStats, NewtonError> {
    let mut total = NewtonStats::default();
    let (mut damping, mut failures, mut largest) = (FIRST, 0, 0.0);
    let mut last = None;
    for _ in 0..STEPS {
        match step(sim, plan, target, damping) {
            Ok((stats, force)) => {
                damping /= match stats.iterations {
                    n if n <= EASY => FACTOR * FACTOR,
                    n if n <= WELL => FACTOR,
                    _ => 1.0,
                };
                total = total.and(stats);
                largest = force.max(largest);
                if force <= SLOW * largest {
                    // Where many iterations lead is not what the motion leads to.
                    match attempt(sim, plan, [target; 2], Patience::Some(WELL)) {
                        Ok(stats) => return Ok(total.and(stats)),
                        Err(error) => last = Some(error),
                    }
                    restore(sim);
                }
            }
            Err(error) => {
                last = Some(error);
                failures += 1;
                damping *= FACTOR;
            }
        }
        if failures > FAILURES {
            break;
        }
    }
    Err(last.unwrap_or(NewtonError::StillMoving { steps: STEPS }))
}

/// One step of the motion; force that remains in the dampers [N].
fn step(
    sim: &mut Simulation,
    plan: &Plan,
    target: f64,
    damping: f64,
) -> Result<(NewtonStats, f64), NewtonError> {
    sim.committed.last = None;
    sim.sys.damper = Some(Damper::new(&sim.sys, damping));
    let found = attempt(sim, plan, [target; 2], Patience::All);
    let damper = sim.sys.damper.take();
    let (Ok(stats), Some(damper)) = (&found, damper) else {
        restore(sim);
        return found.map(|stats| (stats, 0.0));
    };
    let sys = &mut sim.sys;
    let mut squares = 0.0;
    for (f, damped) in sys.eval.internal_force.iter_mut().zip(damper.forces(&sys.u)) {
        *f -= damped;
        squares += damped * damped;
    }
    accept(sim, 0.0);
    sim.committed.last = None;
    Ok((stats.clone(), squares.sqrt()))
}
