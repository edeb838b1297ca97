//! One increment: semi-smooth Newton with plasticity, contact and friction in the same loop.

use super::convergence::{is_settled, record, size};
use super::cycling::Stabiliser;
use super::line_search;
use super::outcome::{NewtonError, NewtonStats, Patience, Verdict};
use super::record::{IterationRecord, NEAR};
use crate::geometry::Vec3;
use crate::solver::active_set::active_set::{revise, settle};
use crate::solver::active_set::driven_tools::opposed;
use crate::solver::active_set::update::Pivoting;
use crate::solver::assembly::ElementFailure;
use crate::solver::assembly::Foresight;
use crate::solver::limits::{ContactMethod, Limits};
use crate::solver::system::correction::Correction;
use crate::solver::system::system::{Residual, System};
use crate::solver::tools::role::Role;
use crate::solver::tools::way::FACING_COS_MIN;

/// Corrections in a row that no longer halve from which on what is left is rounding: a single one may be of a node that begins to
/// stick or to flow.
const STAGNANT_CORRECTIONS: usize = 2;

/// Iterations of an increment, over those allowed between two augmentations: springs far too soft close no gap in any number.
const MAX_ITERATIONS_RATIO: usize = 40;

/// Gap that an augmented method may leave, over the sheet's thickness.
const AUGMENTED_GAP_REL: f64 = 1e-6;

/// Solves the increment from the present iterate of `sys`; `history` receives every iterate, also on failure. An iterate
/// that was extrapolated begins with what is foreseen: `foreseen` is the increment over the last one.
///
/// # Errors
/// [`NewtonError`]; the caller restores the last converged state.
pub(in crate::solver) fn solve(
    sys: &mut System,
    limits: &Limits,
    patience: Patience,
    mut foreseen: Option<f64>,
    history: &mut Vec<IterationRecord>,
) -> Result<NewtonStats, NewtonError> {
    let mut run = Run::new(sys, patience, limits);
    heed(sys)?;
    begin(sys, foreseen)?;
    loop {
        heed(sys)?;
        let (record, residual) = run.look(sys, limits, history);
        match run.verdict(sys, &record, &residual, limits) {
            Verdict::Converged if run.goes_on(sys, limits)? => {}
            Verdict::Converged => return Ok(run.done()),
            Verdict::Continue if run.cycles(sys, &record) => run.stabilise(sys)?,
            Verdict::Continue if patience != Patience::Hopeful || !hopeless(history) => {}
            _ if run.may_stabilise_more(sys) => run.stabilise(sys)?,
            _ => return Err(gave_up(run.stats.iterations, &record, residual.worst_node)),
        }
        let near = record.residual < NEAR;
        let (correction, solves) = match foreseen.take() {
            Some(factor) => first_iterate(sys, limits, factor, near)?,
            None => iterate(sys, limits, near)?,
        };
        run.stats.solves += solves;
        run.stats.iterations += 1;
        let stagnates = run.last.is_some_and(|last| size(&correction) >= 0.5 * size(&last));
        run.stagnant = if stagnates { run.stagnant + 1 } else { 0 };
        run.last = Some(correction);
    }
}

/// Stops where that has been requested.
fn heed(sys: &System) -> Result<(), NewtonError> {
    if sys.cancel.is_requested() { Err(NewtonError::Cancelled) } else { Ok(()) }
}

/// One increment's iteration.
struct Run {
    stats: NewtonStats,
    /// Iterations allowed before the springs of an augmented method or the viscous forces are moved again.
    allowed: usize,
    /// Iterations before they last were.
    before: usize,
    last: Option<Correction>,
    /// Corrections in a row, the last among them, that were no smaller than half the one before.
    stagnant: usize,
    near_balance: bool,
    pivoting: Pivoting,
    /// None where the sheet is being followed with viscous forces already.
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
            near_balance: false,
            pivoting: Pivoting::new(),
            stabiliser: may_stabilise.then(Stabiliser::default),
        }
    }

    /// Revises the active set at the iterate and assembles the residual.
    fn look(
        &mut self,
        sys: &mut System,
        limits: &Limits,
        history: &mut Vec<IterationRecord>,
    ) -> (IterationRecord, Residual) {
        let last = self.last.as_ref();
        let changes = revise(sys, last, self.near_balance, limits, &mut self.pivoting);
        let residual = sys.assemble();
        let record = record(sys, &residual, last, changes);
        self.near_balance = record.residual < 1e-3;
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
        let settled = record.changes == 0
            && is_settled(sys, residual, last, self.stagnant >= STAGNANT_CORRECTIONS, limits);
        if settled && iterations > 0 {
            return Verdict::Converged;
        }
        if !residual.force.is_finite() || !residual.length.is_finite() {
            return Verdict::Diverging;
        }
        let spent = iterations - self.before >= self.allowed
            || iterations >= MAX_ITERATIONS_RATIO * self.allowed;
        if spent { Verdict::Exhausted } else { Verdict::Continue }
    }

    /// At an equilibrium: moves what holds the sheet besides its tools, if anything does.
    fn goes_on(&mut self, sys: &mut System, limits: &Limits) -> Result<bool, ElementFailure> {
        let stabilised = sys.regime.is_stabilised();
        let since = self.stats.iterations - self.before;
        match &mut self.stabiliser {
            Some(stabiliser) if stabilised => stabiliser.weaken(sys, since)?,
            _ if !augments(sys, limits) => return Ok(false),
            _ => {}
        }
        self.begin_anew(sys);
        Ok(true)
    }

    /// Whether viscous forces are to be set, or set anew.
    fn cycles(&mut self, sys: &System, record: &IterationRecord) -> bool {
        let iterations = self.stats.iterations;
        let may = |s: &mut Stabiliser| s.may_stabilise(iterations) && s.cycles(sys, record);
        self.stabiliser.as_mut().is_some_and(may)
    }

    /// Whether stronger viscous forces may help an iteration that has some and leads nowhere.
    fn may_stabilise_more(&self, sys: &System) -> bool {
        let iterations = self.stats.iterations;
        sys.regime.is_stabilised()
            && self.stabiliser.as_ref().is_some_and(|s| s.may_stabilise(iterations))
    }

    fn stabilise(&mut self, sys: &mut System) -> Result<(), ElementFailure> {
        if let Some(stabiliser) = &mut self.stabiliser {
            stabiliser.stabilise(sys, self.stats.iterations)?;
        }
        self.begin_anew(sys);
        Ok(())
    }

    fn done(self) -> NewtonStats {
        let stabilised = self.stabiliser.is_some_and(|s| s.has_stabilised());
        NewtonStats { stabilised, ..self.stats }
    }

    fn begin_anew(&mut self, sys: &mut System) {
        self.before = self.stats.iterations;
        self.pivoting = Pivoting::new();
        sys.assemble();
    }
}

/// Evaluates and searches the first iterate. Where nothing is foreseen the strains are those of the last balance, where
/// points that flowed lie on their yield surface: rounding would say which of them yield, so none does.
fn begin(sys: &mut System, foreseen: Option<f64>) -> Result<(), ElementFailure> {
    let at_rest = Foresight { factor: 0.0, stiff: true };
    let carried_on = |factor| Foresight { factor, stiff: false };
    sys.evaluate_foreseen(foreseen.map_or(at_rest, carried_on))?;
    sys.search();
    Ok(())
}

/// Rounds in which the active set settles on the linearised system, farther off and near.
const ACTIVE_SET_ROUNDS: usize = 3;
const ACTIVE_SET_ROUNDS_NEAR: usize = 8;

/// Goes from one iterate to the next: the correction, and how many solves it took.
fn iterate(
    sys: &mut System,
    limits: &Limits,
    near: bool,
) -> Result<(Correction, usize), NewtonError> {
    let (correction, solves) = settled(sys, limits, near)?;
    go(sys, &correction, near)?;
    Ok((correction, solves))
}

/// The first correction of an increment, from what is foreseen. Where it leads too far, points that were foreseen to
/// flow no longer do: then one with all flow as foreseen, from the same iterate.
fn first_iterate(
    sys: &mut System,
    limits: &Limits,
    factor: f64,
    near: bool,
) -> Result<(Correction, usize), NewtonError> {
    let (correction, solves) = settled(sys, limits, near)?;
    if let Some(share) = line_search::fits(sys, &correction, bounded_share(sys, &correction))? {
        sys.expect(&correction, share);
        return Ok((correction, solves));
    }
    sys.evaluate_foreseen(Foresight { factor, stiff: true })?;
    sys.search();
    sys.assemble();
    let (correction, more) = settled(sys, limits, near)?;
    go(sys, &correction, true)?;
    Ok((correction, solves + more))
}

/// Takes a correction, whole or as much of it as is good, and the same share of the forces that it foretells.
fn go(sys: &mut System, correction: &Correction, whole: bool) -> Result<(), ElementFailure> {
    let share = line_search::go(sys, correction, bounded_share(sys, correction), whole)?;
    sys.expect(correction, share);
    Ok(())
}

/// The correction from the present iterate with its active set settled, and how many solves it took.
fn settled(
    sys: &mut System,
    limits: &Limits,
    near: bool,
) -> Result<(Correction, usize), NewtonError> {
    let found = sys.correct();
    let first = opposed(sys, found)?;
    let rounds = if near { ACTIVE_SET_ROUNDS_NEAR } else { ACTIVE_SET_ROUNDS };
    let (correction, solves) = settle(sys, first, limits, rounds)?;
    sys.remember_sliding();
    Ok((correction, 1 + solves))
}

fn gave_up(iterations: usize, last: &IterationRecord, node: usize) -> NewtonError {
    let &IterationRecord { residual, gap: gap_mm, changes, .. } = last;
    NewtonError::NotConverged { iterations, residual, gap_mm, changes, node }
}

/// Moves the springs of an augmented method while gaps are open; true when it did.
fn augments(sys: &mut System, limits: &Limits) -> bool {
    let augmented = matches!(limits.contact, ContactMethod::Augmented { .. });
    augmented && sys.augment(AUGMENTED_GAP_REL * sys.lengths.shortest_edge)
}

/// True when the forces are still out of balance by as much as the contact forces themselves, although
/// corrections have been growing twice in a row or six iterations are done.
fn hopeless(history: &[IterationRecord]) -> bool {
    const HOPELESS_RESIDUAL: f64 = 0.3;
    let n = history.len();
    if n < 4 || history[n - 1].residual < HOPELESS_RESIDUAL {
        return false;
    }
    let grows = |k: usize| history[k].correction > history[k - 1].correction;
    let lately = history[n - 3..].iter().all(|r| r.residual > HOPELESS_RESIDUAL);
    lately && ((grows(n - 1) && grows(n - 2)) || n > 6)
}

/// Share of the correction that moves no node farther than two element lengths, and no tool that a force pushes farther than a
/// node may go that it pushes with the steepest face there is: where nothing resists a tool, rounding says how far it goes.
pub(in crate::solver) fn bounded_share(sys: &System, correction: &Correction) -> f64 {
    let moves = correction.u.chunks_exact(3).map(|du| Vec3::from_column_slice(du).norm());
    let pushed =
        |tool: usize| matches!(sys.roles[tool], Role::Force(_)) && !sys.stops[tool].reached;
    let tools =
        correction.travels.iter().filter(|t| pushed(t.0)).map(|t| FACING_COS_MIN * t.1.abs());
    let largest = moves.chain(tools).fold(0.0, f64::max);
    let allowed = 2.0 * sys.lengths.longest_edge;
    if largest > allowed { allowed / largest } else { 1.0 }
}
