//! One increment: semi-smooth Newton with plasticity, contact and friction in the same loop.

use super::active_set::{Pivoting, revise, settle};
use super::assembly::{ElementFailure, Foresight};
use super::line_search;
use super::linear::LinearError;
use super::linearised::Correction;
use super::stages::{ContactMethod, IterationRecord, Limits};
use super::system::{Residual, System};
use crate::geometry::Vec3;

/// What an iterate is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Balanced, no penetration, no contact state changed.
    Converged,
    /// Go on.
    Continue,
    /// The residual is not a number, or out of all proportion.
    Diverging,
    /// No iterations left.
    Exhausted,
}

/// Why an increment did not converge.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NewtonError {
    /// An element could not be evaluated, however short the step.
    #[error("{0}")]
    Element(#[from] ElementFailure),
    /// The linear system could not be solved.
    #[error("{0}")]
    Linear(#[from] LinearError),
    /// Iterations used up or diverged.
    #[error(
        "no balance after {iterations} iterations: residual {residual:e} of the contact forces, gap off by {gap_mm:e} mm, {changes} contact states still changing, worst at node {node}"
    )]
    NotConverged {
        /// Iterations done.
        iterations: usize,
        /// Residual over reference.
        residual: f64,
        /// Violation of the gap conditions [mm].
        gap_mm: f64,
        /// Changes in the last iteration.
        changes: usize,
        /// Node with the largest unbalanced force.
        node: usize,
    },
    /// Followed as a slow motion, the sheet did not come to rest.
    #[error("the sheet snaps, and is not at rest after {iterations} iterations of slow motion")]
    StillMoving {
        /// Iterations it was followed.
        iterations: usize,
    },
}

/// A converged increment.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NewtonStats {
    /// Iterations: element loops that were followed by a correction.
    pub iterations: usize,
    /// Linear solves, those that settled the active set included.
    pub solves: usize,
    /// Contact states that changed on the way.
    pub changes: usize,
}

impl NewtonStats {
    /// The sum of both.
    #[must_use]
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            iterations: self.iterations + other.iterations,
            solves: self.solves + other.solves,
            changes: self.changes + other.changes,
        }
    }
}

/// When an iteration is ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Patience {
    /// When it leads nowhere: a shorter step costs less.
    Hopeful,
    /// After the iterations allowed.
    All,
    /// After so many.
    UpTo(usize),
}

impl Patience {
    /// Iterations allowed.
    fn iterations(self, limits: &Limits) -> usize {
        if let Self::UpTo(iterations) = self { iterations } else { limits.iterations }
    }
}

/// Gap that an augmented method may leave, over the sheet's thickness.
const GAP: f64 = 1e-6;

/// Solves the increment from the present iterate of `sys`; `history` receives every iterate, also on failure. An iterate
/// that was extrapolated begins with what is foreseen: `foreseen` is the increment over the last one.
///
/// # Errors
/// [`NewtonError`]; the caller restores the last converged state.
pub(super) fn solve(
    sys: &mut System,
    limits: &Limits,
    patience: Patience,
    mut foreseen: Option<f64>,
    history: &mut Vec<IterationRecord>,
) -> Result<NewtonStats, NewtonError> {
    let allowed = patience.iterations(limits);
    let mut stats = NewtonStats::default();
    let mut last: Option<Correction> = None;
    let mut near_balance = false;
    let mut pivoting = Pivoting::new();
    // Iterations before the springs of an augmented method were last moved.
    let mut before = 0;
    begin(sys, foreseen)?;
    loop {
        let changes = revise(sys, last.as_ref(), near_balance, limits, &mut pivoting);
        let residual = sys.assemble();
        let record = record(sys, &residual, last.as_ref(), changes);
        near_balance = record.residual < 1e-3;
        history.push(record);
        stats.changes += changes;
        let settled = changes == 0 && is_settled(sys, &residual, last.as_ref(), limits);
        match verdict(&residual, settled, [stats.iterations - before, allowed]) {
            Verdict::Converged if augments(sys, limits) => {
                before = stats.iterations;
                pivoting = Pivoting::new();
                sys.assemble();
            }
            Verdict::Converged => return Ok(stats),
            Verdict::Continue if patience != Patience::Hopeful || !hopeless(history) => {}
            Verdict::Continue | Verdict::Diverging | Verdict::Exhausted => {
                return Err(gave_up(stats.iterations, &record, residual.worst_node));
            }
        }
        let near = record.residual < NEAR;
        let (correction, solves) = match foreseen.take() {
            Some(factor) => first_iterate(sys, limits, factor, near)?,
            None => iterate(sys, limits, near)?,
        };
        stats.solves += solves;
        stats.iterations += 1;
        last = Some(correction);
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

/// Residual below which the linearised system is what matters: corrections are taken whole.
const NEAR: f64 = 1e-2;
/// Rounds in which the active set settles on the linearised system, farther off and near.
const ROUNDS: usize = 3;
const ROUNDS_NEAR: usize = 8;

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
    let first = sys.correct()?;
    let rounds = if near { ROUNDS_NEAR } else { ROUNDS };
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
    augmented && sys.augment(GAP * sys.lengths.shortest_edge)
}

fn verdict(residual: &Residual, settled: bool, [iterations, allowed]: [usize; 2]) -> Verdict {
    if settled && iterations > 0 {
        return Verdict::Converged;
    }
    if !residual.force.is_finite() || !residual.length.is_finite() {
        return Verdict::Diverging;
    }
    if iterations >= allowed { Verdict::Exhausted } else { Verdict::Continue }
}

/// Whether forces and gaps are within the tolerances.
fn is_settled(
    sys: &System,
    residual: &Residual,
    last: Option<&Correction>,
    limits: &Limits,
) -> bool {
    let rounding = 1e-13 * sys.scales.normal * sys.lengths.shortest_edge;
    let force = limits.force_tolerance * residual.reference + rounding;
    let gap = limits.gap_tolerance * sys.lengths.shortest_edge;
    let unbalanced = residual.force.max(sys.eval.internal_residual);
    residual.length <= gap && (unbalanced <= force || is_rounding(sys, unbalanced, last))
}

/// Whether an iterate is the balance but for the rounding of the nodes' places: the last correction was no more than that,
/// and neither is what it leaves out of balance. A sheet that nothing holds has no other force to go by, and its
/// supports, which carry next to nothing, none that is worth a tolerance.
fn is_rounding(sys: &System, unbalanced: f64, last: Option<&Correction>) -> bool {
    const PLACES: f64 = 4.0;
    let places = PLACES * f64::EPSILON * sys.lengths.farthest * (sys.u.len() as f64).sqrt();
    unbalanced <= sys.scales.normal * places && last.is_some_and(|c| size(c) <= places)
}

/// Norm of the displacements of a correction [mm].
fn size(correction: &Correction) -> f64 {
    correction.u.iter().map(|v| v * v).sum::<f64>().sqrt()
}

fn record(
    sys: &System,
    residual: &Residual,
    last: Option<&Correction>,
    changes: usize,
) -> IterationRecord {
    let floor = 1e-12 * sys.scales.normal * sys.lengths.shortest_edge;
    IterationRecord {
        residual: residual.force / residual.reference.max(floor),
        gap: residual.length,
        penetration: residual.penetration,
        correction: last.map_or(0.0, size),
        contacts: sys.contact.active().count(),
        slipping: residual.slipping,
        stuck: residual.stuck,
        changes,
    }
}

/// True when the forces are still out of balance by as much as the contact forces themselves, although
/// corrections have been growing twice in a row or six iterations are done.
fn hopeless(history: &[IterationRecord]) -> bool {
    const OUT_OF_BALANCE: f64 = 0.3;
    let n = history.len();
    if n < 4 || history[n - 1].residual < OUT_OF_BALANCE {
        return false;
    }
    let grows = |k: usize| history[k].correction > history[k - 1].correction;
    let lately = history[n - 3..].iter().all(|r| r.residual > OUT_OF_BALANCE);
    lately && ((grows(n - 1) && grows(n - 2)) || n > 6)
}

/// Share of the correction that moves no node farther than two element lengths.
fn bounded_share(sys: &System, correction: &Correction) -> f64 {
    let moves = correction.u.chunks_exact(3).map(|du| Vec3::from_column_slice(du).norm());
    let largest = moves.fold(0.0, f64::max);
    let allowed = 2.0 * sys.lengths.longest_edge;
    if largest > allowed { allowed / largest } else { 1.0 }
}
