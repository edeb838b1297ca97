//! Active-set cycling near equilibrium: a node that touches is in tension, and released it penetrates. That is so where the
//! sheet, held by all other nodes, has a direction in which it is unstable (a flange that begins to wrinkle between its
//! tools). No equilibrium is next to the iterate, and the one that the sheet moves to is often a few micrometres away.
//!
//! It is sought within the same increment by pseudo-transient continuation about the iterate: viscous forces make that
//! direction stable. About every equilibrium with viscous forces the next is sought with weaker ones, until they are removed.
//! What is accepted is an equilibrium without any.

use super::record::IterationRecord;
use crate::solver::assembly::ElementFailure;
use crate::solver::element::Want;
use crate::solver::system::damper::Damper;
use crate::solver::system::damping::{CYCLING, Continuation};
use crate::solver::system::system::System;

/// Residual below which cycling is one of the active set, not of what else has yet to converge.
const CYCLE_RESIDUAL: f64 = 1e-2;
/// Ratio of the residuals of two iterates with the same nodes touching below which they make no cycle.
const CYCLE_REDUCTION: f64 = 0.3;
/// Stiffness over the mesh's below which viscous forces are removed however large they are.
const STIFFNESS_MIN: f64 = 1e-10;
/// Iterations with viscous forces in an increment.
pub(in crate::solver) const MAX_STABILISED_ITERATIONS: usize = 400;

/// Watches one increment's iterates.
#[derive(Debug, Default)]
pub(in crate::solver) struct Stabiliser {
    /// Nodes touching at iterates near equilibrium since viscous forces were last set or removed, with the residual there.
    seen: Vec<(Vec<usize>, f64)>,
    /// Iteration in which viscous forces were first set.
    began: Option<usize>,
    /// Controls the viscous stiffness.
    control: Option<Continuation>,
    /// Where viscous forces were last set or removed: displacements, and travels of the tools [mm].
    from: [Vec<f64>; 2],
}

impl Stabiliser {
    /// Whether the active set has been met before, and was changed since or is wrong.
    pub(in crate::solver) fn cycles(&mut self, sys: &System, now: &IterationRecord) -> bool {
        if now.residual > CYCLE_RESIDUAL {
            return false;
        }
        let touching: Vec<usize> = sys.contact.active().map(|(k, _)| k).collect();
        let others = |since: usize| self.seen[since..].iter().any(|(other, _)| *other != touching);
        let met = |(at, (before, residual)): (usize, &(Vec<usize>, f64))| {
            let changed = now.changes > 0 || others(at);
            *before == touching && now.residual > CYCLE_REDUCTION * residual && changed
        };
        let found = self.seen.iter().enumerate().any(met);
        self.seen.push((touching, now.residual));
        found
    }

    /// Whether viscous forces may be set, or set anew, after so many iterations.
    pub(in crate::solver) fn may_stabilise(&self, iterations: usize) -> bool {
        self.began.is_none_or(|began| iterations < began + MAX_STABILISED_ITERATIONS)
    }

    /// Whether there were viscous forces.
    pub(in crate::solver) fn has_stabilised(&self) -> bool {
        self.began.is_some()
    }

    /// Sets viscous forces about the iterate. Where there are some, or were, goes back to where they were last set or removed,
    /// with stronger ones, or with the same.
    ///
    /// # Errors
    /// An element that cannot be evaluated.
    pub(in crate::solver) fn stabilise(
        &mut self,
        sys: &mut System,
        iterations: usize,
    ) -> Result<(), ElementFailure> {
        self.began.get_or_insert(iterations);
        let Some(control) = &mut self.control else {
            self.control = Some(Continuation::new(CYCLING, None));
            return self.set(sys);
        };
        if sys.regime.is_stabilised() {
            control.failed();
        } else {
            control.release_failed();
        }
        let [u, travels] = &self.from;
        sys.u.copy_from_slice(u);
        sys.tools.iter_mut().zip(travels).for_each(|(tool, travel)| tool.travel = *travel);
        self.set(sys)
    }

    /// From an equilibrium with viscous forces that took so many `iterations`: sets weaker ones about it, or removes them.
    ///
    /// # Errors
    /// An element that cannot be evaluated.
    pub(in crate::solver) fn weaken(
        &mut self,
        sys: &mut System,
        iterations: usize,
    ) -> Result<(), ElementFailure> {
        let Some(damper) = sys.regime.release() else { return Ok(()) };
        let Some(control) = &mut self.control else { return Ok(()) };
        let force = damper.forces(&sys.u).map(|f| f * f).sum::<f64>().sqrt();
        control.converged(iterations, force);
        if !control.may_release() && control.stiffness > STIFFNESS_MIN {
            return self.set(sys);
        }
        self.begin_here(sys);
        sys.evaluate(Want::ResidualAndTangent)
    }

    /// Sets viscous forces about the iterate.
    fn set(&mut self, sys: &mut System) -> Result<(), ElementFailure> {
        self.begin_here(sys);
        let Some(control) = &self.control else { return Ok(()) };
        let stiffness = control.stiffness * sys.scales.tangential;
        sys.regime.continue_with(Damper::new(&sys.body, &sys.u, stiffness));
        sys.evaluate(Want::ResidualAndTangent)?;
        sys.search();
        Ok(())
    }

    fn begin_here(&mut self, sys: &System) {
        self.seen.clear();
        self.from = [sys.u.clone(), sys.tools.iter().map(|tool| tool.travel).collect()];
    }
}
