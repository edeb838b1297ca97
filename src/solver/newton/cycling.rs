//! Active-set cycling near equilibrium.
//!
//! A node may alternate between contact (tensile reaction) and separation (penetration). This happens when the sheet,
//! with all other nodes fixed, is unstable in some direction, for example a flange that starts to wrinkle between its
//! tools. No equilibrium exists near the iterate; the one reached is often a few micrometres away.
//!
//! Remedy: pseudo-transient continuation within the increment (Gee, Kelley and Lehoucq 2009). Viscous forces about
//! the iterate make the unstable direction stable. About each viscous equilibrium the next one is computed with
//! weaker forces, until they are removed. Only an equilibrium without viscous forces is accepted.

use super::record::{IterationRecord, STAGNATION_RATIO};
use crate::assembly::ElementFailure;
use crate::element::Want;
use crate::numbers::tolerances::{NEAR_EQUILIBRIUM_REL, ROUNDING_REL};
use crate::system::damper::Damper;
use crate::system::damping::{CONTINUATION_ITERATIONS_MAX, Continuation, Rules};
use crate::system::system::System;

/// Detects cycling and controls viscous stabilisation in one increment.
#[derive(Debug, Default)]
pub(crate) struct Stabiliser {
    /// Active sets and residuals of iterates near equilibrium since viscous forces were last set or removed.
    active_sets: Vec<(Vec<usize>, f64)>,
    /// Iteration in which viscous forces were first set.
    first_iteration: Option<usize>,
    /// Controls the viscous stiffness.
    control: Option<Continuation>,
    /// State at which viscous forces were last set or removed: displacements and travels of the tools [mm].
    marked: [Vec<f64>; 2],
}

impl Stabiliser {
    /// Whether the active set has occurred before and was changed since or is wrong.
    pub(crate) fn cycles(&mut self, sys: &System, now: &IterationRecord) -> bool {
        if now.residual > NEAR_EQUILIBRIUM_REL {
            return false;
        }
        let touching: Vec<usize> = sys.contact.active().map(|(k, _)| k).collect();
        let others =
            |since: usize| self.active_sets[since..].iter().any(|(other, _)| *other != touching);
        let met = |(at, (before, residual)): (usize, &(Vec<usize>, f64))| {
            let changed = now.changes > 0 || others(at);
            *before == touching && now.residual > STAGNATION_RATIO * residual && changed
        };
        let found = self.active_sets.iter().enumerate().any(met);
        self.active_sets.push((touching, now.residual));
        found
    }

    /// Whether viscous forces may be set or set again after `iterations`.
    pub(crate) fn may_stabilise(&self, iterations: usize) -> bool {
        self.first_iteration.is_none_or(|first_iteration| {
            iterations < first_iteration + CONTINUATION_ITERATIONS_MAX
        })
    }

    /// Whether viscous forces were set in this increment.
    pub(crate) fn has_stabilised(&self) -> bool {
        self.first_iteration.is_some()
    }

    /// Sets viscous forces about the iterate. If they are or were set already, restores the state at which they were
    /// last set or removed, and sets stronger ones, or the same.
    ///
    /// # Errors
    /// [`ElementFailure`] if an element cannot be evaluated.
    pub(crate) fn stabilise(
        &mut self,
        sys: &mut System,
        iterations: usize,
    ) -> Result<(), ElementFailure> {
        self.first_iteration.get_or_insert(iterations);
        let Some(control) = &mut self.control else {
            self.control = Some(Continuation::new(Rules::Cycling, None));
            return self.set(sys);
        };
        if sys.regime.is_stabilised() {
            control.failed();
        } else {
            control.release_failed();
        }
        let [u, travels] = &self.marked;
        sys.u.copy_from_slice(u);
        sys.tools.iter_mut().zip(travels).for_each(|(tool, travel)| tool.travel = *travel);
        self.set(sys)
    }

    /// Reduces the viscous forces about a viscous equilibrium that took `iterations`, or removes them: when they are
    /// small, and at the latest when their stiffness over that of the mesh is rounding.
    ///
    /// # Errors
    /// [`ElementFailure`] if an element cannot be evaluated.
    pub(crate) fn weaken(
        &mut self,
        sys: &mut System,
        iterations: usize,
    ) -> Result<(), ElementFailure> {
        let Some(damper) = sys.regime.release() else { return Ok(()) };
        let Some(control) = &mut self.control else { return Ok(()) };
        let force = damper.forces(&sys.u).map(|f| f * f).sum::<f64>().sqrt();
        control.converged(iterations, force);
        if !control.may_release() && control.stiffness > ROUNDING_REL {
            return self.set(sys);
        }
        self.mark_state(sys);
        sys.evaluate(Want::ResidualAndTangent)
    }

    /// Sets viscous forces about the iterate.
    fn set(&mut self, sys: &mut System) -> Result<(), ElementFailure> {
        self.mark_state(sys);
        let Some(control) = &self.control else { return Ok(()) };
        let stiffness = control.stiffness * sys.scales.tangential;
        sys.regime.continue_with(Damper::new(&sys.body, &sys.u, stiffness));
        sys.evaluate(Want::ResidualAndTangent)?;
        sys.search();
        Ok(())
    }

    fn mark_state(&mut self, sys: &System) {
        self.active_sets.clear();
        self.marked = [sys.u.clone(), sys.tools.iter().map(|tool| tool.travel).collect()];
    }
}
