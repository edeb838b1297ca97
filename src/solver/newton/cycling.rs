//! Contact states that come round in a circle near balance: of some node, touching it is pulled and let go it penetrates. That
//! is so where the sheet, held by all other nodes, has a direction in which it is unstable (a flange that begins to wrinkle
//! between its tools): no balance is next to the iterate, and the one that the sheet moves on to is often a few micrometres
//! away.
//!
//! It is looked for within the same increment by dampers about the iterate, which make that direction stable. From every
//! balance with dampers the next is sought about it with weaker ones, as weak as they may be without another circle, until
//! they carry nothing and are taken away. What is accepted is a balance without any.

use super::record::IterationRecord;
use crate::solver::assembly::ElementFailure;
use crate::solver::element::Want;
use crate::solver::system::damper::Damper;
use crate::solver::system::damping::Continuation;
use crate::solver::system::system::System;

/// Residual below which a circle is one of contact states, not of what else has yet to settle.
const NEAR: f64 = 1e-2;
/// Share by which the residual has fallen at least between two iterates with the same nodes touching, if that is no circle.
const FALLS: f64 = 0.3;
/// Iterations with dampers in an increment.
pub(in crate::solver) const ITERATIONS: usize = 400;

/// Watches one increment's iterates.
#[derive(Debug, Default)]
pub(in crate::solver) struct Steadying {
    /// Nodes touching at iterates near balance since dampers were last set or taken away, with the residual there.
    seen: Vec<(Vec<usize>, f64)>,
    /// Iteration in which dampers were first set.
    began: Option<usize>,
    /// Controls the viscous stiffness.
    control: Option<Continuation>,
    /// Where dampers were last set or taken away: displacements, and travels of the tools [mm].
    from: [Vec<f64>; 2],
}

impl Steadying {
    /// Whether contact states have been met before that were changed since, or were wrong.
    pub(in crate::solver) fn is_circle(&mut self, sys: &System, now: &IterationRecord) -> bool {
        if now.residual > NEAR {
            return false;
        }
        let touching: Vec<usize> = sys.contact.active().map(|(k, _)| k).collect();
        let others = |since: usize| self.seen[since..].iter().any(|(other, _)| *other != touching);
        let met = |(at, (before, residual)): (usize, &(Vec<usize>, f64))| {
            let changed = now.changes > 0 || others(at);
            *before == touching && now.residual > FALLS * residual && changed
        };
        let found = self.seen.iter().enumerate().any(met);
        self.seen.push((touching, now.residual));
        found
    }

    /// Whether dampers may be set, or set anew, after so many iterations.
    pub(in crate::solver) fn may_go_on(&self, iterations: usize) -> bool {
        self.began.is_none_or(|began| iterations < began + ITERATIONS)
    }

    /// Whether there were dampers.
    pub(in crate::solver) fn has_steadied(&self) -> bool {
        self.began.is_some()
    }

    /// Sets dampers about the iterate. Where there are some, or were, goes back to where they were last set or taken away,
    /// with stronger ones, or with such as there were.
    ///
    /// # Errors
    /// An element that cannot be evaluated.
    pub(in crate::solver) fn damp(
        &mut self,
        sys: &mut System,
        iterations: usize,
    ) -> Result<(), ElementFailure> {
        self.began.get_or_insert(iterations);
        let Some(control) = &mut self.control else {
            self.control = Some(Continuation::new(None));
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

    /// From a balance with dampers that took so many `iterations`: sets weaker ones about it, or takes them away.
    ///
    /// # Errors
    /// An element that cannot be evaluated.
    pub(in crate::solver) fn go_on(
        &mut self,
        sys: &mut System,
        iterations: usize,
    ) -> Result<(), ElementFailure> {
        let Some(damper) = sys.regime.release() else { return Ok(()) };
        let Some(control) = &mut self.control else { return Ok(()) };
        let force = damper.forces(&sys.u).map(|f| f * f).sum::<f64>().sqrt();
        control.converged(iterations, force);
        if !control.may_release() {
            return self.set(sys);
        }
        self.begin_here(sys);
        sys.evaluate(Want::ResidualAndTangent)
    }

    /// Sets dampers about the iterate.
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
