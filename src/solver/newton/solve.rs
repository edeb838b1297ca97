//! Solution of one increment: semi-smooth Newton method with plasticity, contact and friction in the same loop.

use super::convergence::{is_settled, record, size};
use super::cycling::Stabiliser;
use super::line_search;
use super::outcome::{NewtonError, NewtonStats, Patience, Verdict};
use super::record::{IterationRecord, STAGNATION_RATIO};
use crate::active_set::active_set::{iterate_active_set, revise};
use crate::active_set::driven_tools::opposed;
use crate::active_set::update::Pivoting;
use crate::assembly::ElementFailure;
use crate::assembly::Foresight;
use crate::limits::{ContactMethod, Limits};
use crate::numbers::tolerances::{
    ACCURACY_REL, NEAR_EQUILIBRIUM_REL, NEGLIGIBLE_REL, REPETITIONS_MAX,
};
use crate::system::correction::Correction;
use crate::system::damping::CONTINUATION_ITERATIONS_MAX;
use crate::system::system::{Residual, System};
use crate::tools::role::Role;
use crate::tools::way::FACING_COS_MIN;
use kanagata_geometry::Vec3;

/// Maximum active-set iterations on the linearised system, far from equilibrium. There the linearisation excludes most
/// of the plastic flow, and an active set that is exact for it is not that of the next iterate. With two, iterations
/// rise by 13 %; with six they stay the same, for more solves.
const ACTIVE_SET_ITERATIONS_MAX: usize = 3;
/// The same near equilibrium, where the linearisation is accurate and the active set usually final. With four,
/// iterations rise by 3 %; with sixteen they fall by 1 %.
const ACTIVE_SET_ITERATIONS_MAX_NEAR: usize = 8;

/// Solves the increment from the current iterate of `sys`; `history` receives a record of every iterate, also on
/// failure. `foreseen`: length of the increment over the last one, if the iterate was extrapolated; the first
/// correction then uses the predicted strains.
///
/// # Errors
/// [`NewtonError`]; the caller restores the last converged state.
pub(crate) fn solve(
    sys: &mut System,
    limits: &Limits,
    patience: Patience,
    mut foreseen: Option<f64>,
    history: &mut Vec<IterationRecord>,
) -> Result<NewtonStats, NewtonError> {
    let mut run = Run::new(sys, patience, limits);
    check_cancelled(sys)?;
    evaluate_first_iterate(sys, foreseen)?;
    loop {
        check_cancelled(sys)?;
        let (record, residual) = run.update_active_set(sys, limits, history);
        match run.verdict(sys, &record, &residual, limits) {
            Verdict::Converged if run.reduce_stabilisation(sys, limits)? => {}
            Verdict::Converged => return Ok(run.finish()),
            Verdict::Continue if run.cycles(sys, &record) => run.stabilise(sys)?,
            Verdict::Continue if patience != Patience::Hopeful || !is_hopeless(history) => {}
            _ if run.may_stabilise_stronger(sys) => run.stabilise(sys)?,
            _ => return Err(not_converged(run.stats.iterations, &record, residual.worst_node)),
        }
        let full_step = record.residual < NEAR_EQUILIBRIUM_REL;
        let (correction, solves) = match foreseen.take() {
            Some(factor) => first_iterate(sys, limits, factor, full_step)?,
            None => iterate(sys, limits, full_step)?,
        };
        run.stats.solves += solves;
        run.stats.iterations += 1;
        let stagnates = run.last.is_some_and(|last| size(&correction) >= 0.5 * size(&last));
        run.stagnant = if stagnates { run.stagnant + 1 } else { 0 };
        run.last = Some(correction);
    }
}

/// Returns [`NewtonError::Cancelled`] if cancellation was requested.
fn check_cancelled(sys: &System) -> Result<(), NewtonError> {
    if sys.cancel.is_requested() { Err(NewtonError::Cancelled) } else { Ok(()) }
}

/// Iteration of one increment.
struct Run {
    stats: NewtonStats,
    /// Maximum iterations between two changes of the augmentation or the viscous forces.
    allowed: usize,
    /// Iterations up to the last such change.
    before: usize,
    last: Option<Correction>,
    /// Number of consecutive corrections that did not halve.
    stagnant: usize,
    near_equilibrium: bool,
    pivoting: Pivoting,
    /// `None` if the sheet is already followed with viscous forces.
    stabiliser: Option<Stabiliser>,
}

impl Run {
    fn new(sys: &System, patience: Patience, limits: &Limits) -> Self {
        let may_stabilise = !sys.regime.is_stabilised() && !matches!(patience, Patience::UpTo(_));
        Self {
            stats: NewtonStats::default(),
            allowed: patience.iterations(limits),
            before: 0,
            last: None,
            stagnant: 0,
            near_equilibrium: false,
            pivoting: Pivoting::new(),
            stabiliser: may_stabilise.then(Stabiliser::default),
        }
    }

    /// Updates the active set at the iterate and assembles the residual.
    fn update_active_set(
        &mut self,
        sys: &mut System,
        limits: &Limits,
        history: &mut Vec<IterationRecord>,
    ) -> (IterationRecord, Residual) {
        let last = self.last.as_ref();
        let changes = revise(sys, last, self.near_equilibrium, limits, &mut self.pivoting);
        let residual = sys.assemble();
        let record = record(sys, &residual, last, changes);
        self.near_equilibrium = record.residual < NEGLIGIBLE_REL;
        self.stats.changes += changes;
        history.push(record);
        (record, residual)
    }

    fn verdict(
        &self,
        sys: &System,
        record: &IterationRecord,
        residual: &Residual,
        limits: &Limits,
    ) -> Verdict {
        let iterations = self.stats.iterations;
        let last = self.last.as_ref();
        let correction_with_active_set = record.changes == 0
            && is_settled(sys, residual, last, self.stagnant >= REPETITIONS_MAX, limits);
        if correction_with_active_set && iterations > 0 {
            return Verdict::Converged;
        }
        if !residual.force.is_finite() || !residual.length.is_finite() {
            return Verdict::Diverging;
        }
        // Springs that are far too soft close no gap in any number of augmentations.
        let spent = iterations - self.before >= self.allowed
            || iterations >= CONTINUATION_ITERATIONS_MAX.max(self.allowed);
        if spent { Verdict::Exhausted } else { Verdict::Continue }
    }

    /// At an equilibrium with viscous forces or contact springs: reduces them. Returns whether the iteration
    /// continues.
    fn reduce_stabilisation(
        &mut self,
        sys: &mut System,
        limits: &Limits,
    ) -> Result<bool, ElementFailure> {
        let stabilised = sys.regime.is_stabilised();
        let since = self.stats.iterations - self.before;
        match &mut self.stabiliser {
            Some(stabiliser) if stabilised => stabiliser.weaken(sys, since)?,
            _ if !augment(sys, limits) => return Ok(false),
            _ => {}
        }
        self.restart_iteration(sys);
        Ok(true)
    }

    /// Whether viscous forces must be set, or set again.
    fn cycles(&mut self, sys: &System, record: &IterationRecord) -> bool {
        let iterations = self.stats.iterations;
        let may = |s: &mut Stabiliser| s.may_stabilise(iterations) && s.cycles(sys, record);
        self.stabiliser.as_mut().is_some_and(may)
    }

    /// Whether an iteration with viscous forces that does not converge may be repeated with stronger ones.
    fn may_stabilise_stronger(&self, sys: &System) -> bool {
        let iterations = self.stats.iterations;
        sys.regime.is_stabilised()
            && self.stabiliser.as_ref().is_some_and(|s| s.may_stabilise(iterations))
    }

    fn stabilise(&mut self, sys: &mut System) -> Result<(), ElementFailure> {
        if let Some(stabiliser) = &mut self.stabiliser {
            stabiliser.stabilise(sys, self.stats.iterations)?;
        }
        self.restart_iteration(sys);
        Ok(())
    }

    fn finish(self) -> NewtonStats {
        let stabilised = self.stabiliser.is_some_and(|s| s.has_stabilised());
        NewtonStats { stabilised, ..self.stats }
    }

    fn restart_iteration(&mut self, sys: &mut System) {
        self.before = self.stats.iterations;
        self.pivoting = Pivoting::new();
        sys.assemble();
    }
}

/// Evaluates the first iterate and its contact search. Without a prediction the strains are those of the last
/// equilibrium, at which yielded points lie on their yield surface. Rounding would decide which of them yield, so
/// elastic tangents are used.
fn evaluate_first_iterate(sys: &mut System, foreseen: Option<f64>) -> Result<(), ElementFailure> {
    let at_rest = Foresight { factor: 0.0, stiff: true };
    let extended_projection = |factor| Foresight { factor, stiff: false };
    sys.evaluate_foreseen(foreseen.map_or(at_rest, extended_projection))?;
    sys.search();
    Ok(())
}

/// One iteration. Returns the correction and the number of linear solves.
fn iterate(
    sys: &mut System,
    limits: &Limits,
    full_step: bool,
) -> Result<(Correction, usize), NewtonError> {
    let (correction, solves) = correction_with_active_set(sys, limits, full_step)?;
    go(sys, &correction, full_step)?;
    Ok((correction, solves))
}

/// First correction of an increment, with the predicted strains. If it overshoots, points predicted to yield unload;
/// the correction is then repeated from the same iterate with the predicted plastic flow and elastic tangents.
fn first_iterate(
    sys: &mut System,
    limits: &Limits,
    factor: f64,
    full_step: bool,
) -> Result<(Correction, usize), NewtonError> {
    let (correction, solves) = correction_with_active_set(sys, limits, full_step)?;
    if let Some(length) =
        line_search::try_step(sys, &correction, step_length_limit(sys, &correction))?
    {
        sys.expect(&correction, length);
        return Ok((correction, solves));
    }
    sys.evaluate_foreseen(Foresight { factor, stiff: true })?;
    sys.search();
    sys.assemble();
    let (correction, more) = correction_with_active_set(sys, limits, full_step)?;
    go(sys, &correction, true)?;
    Ok((correction, solves + more))
}

/// Applies a correction with line search, and the same fraction of its predicted contact forces.
fn go(sys: &mut System, correction: &Correction, full_step: bool) -> Result<(), ElementFailure> {
    let length = line_search::go(sys, correction, step_length_limit(sys, correction), full_step)?;
    sys.expect(correction, length);
    Ok(())
}

/// Correction from the current iterate after active-set iteration, and the number of linear solves.
fn correction_with_active_set(
    sys: &mut System,
    limits: &Limits,
    full_step: bool,
) -> Result<(Correction, usize), NewtonError> {
    let found = sys.correct();
    let first = opposed(sys, found)?;
    let rounds = if full_step { ACTIVE_SET_ITERATIONS_MAX_NEAR } else { ACTIVE_SET_ITERATIONS_MAX };
    let (correction, solves) = iterate_active_set(sys, first, limits, rounds)?;
    sys.remember_sliding();
    Ok((correction, 1 + solves))
}

fn not_converged(iterations: usize, last: &IterationRecord, node: usize) -> NewtonError {
    let &IterationRecord { residual, gap: gap_mm, changes, .. } = last;
    NewtonError::NotConverged { iterations, residual, gap_mm, changes, node }
}

/// Updates the multipliers of the augmented Lagrangian method while gaps are open; returns whether it did.
fn augment(sys: &mut System, limits: &Limits) -> bool {
    let augmented = matches!(limits.contact, ContactMethod::Augmented { .. });
    augmented && sys.augment(ACCURACY_REL * sys.lengths.shortest_edge)
}

/// Whether the residual is still comparable with the contact forces although corrections grew twice in succession or
/// six iterations are done.
fn is_hopeless(history: &[IterationRecord]) -> bool {
    let n = history.len();
    if n < 4 || history[n - 1].residual < STAGNATION_RATIO {
        return false;
    }
    let grows = |k: usize| history[k].correction > history[k - 1].correction;
    let lately = history[n - 3..].iter().all(|r| r.residual > STAGNATION_RATIO);
    lately && ((grows(n - 1) && grows(n - 2)) || n > 6)
}

/// Maximum step length of a correction: no node moves by more than two element lengths. A tool driven by force moves
/// no farther than a node pushed by its steepest face may; without resistance its travel would be determined by
/// rounding.
pub(crate) fn step_length_limit(sys: &System, correction: &Correction) -> f64 {
    let moves = correction.u.chunks_exact(3).map(|du| Vec3::from_column_slice(du).norm());
    let pushed =
        |tool: usize| matches!(sys.roles[tool], Role::Force(_)) && !sys.stops[tool].reached;
    let tools =
        correction.travels.iter().filter(|t| pushed(t.0)).map(|t| FACING_COS_MIN * t.1.abs());
    let largest = moves.chain(tools).fold(0.0, f64::max);
    let allowed = 2.0 * sys.lengths.longest_edge;
    if largest > allowed { allowed / largest } else { 1.0 }
}
