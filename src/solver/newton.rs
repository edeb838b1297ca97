//! One increment: semi-smooth Newton with plasticity, contact and friction in the same loop.

use super::assembly::ElementFailure;
use super::element::Want;
use super::linear::LinearError;
use super::stages::{IterationRecord, Limits};
use super::system::{Correction, Residual, Role, System};

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
}

/// A converged increment.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NewtonStats {
    /// Linear solves.
    pub iterations: usize,
    /// Contact states that changed on the way.
    pub changes: usize,
    /// Candidates whose state was changing back and forth and had to be damped.
    pub cycling: usize,
}

/// Changes of state after which a candidate waits before it may change again, longer each time.
const PATIENCE: u32 = 3;
const LONGEST_WAIT: u32 = 5;

/// Solves the increment from the present iterate of `sys`; `history` receives every iterate, also on failure.
///
/// # Errors
/// [`NewtonError`]; the caller restores the last converged state.
pub(super) fn solve(
    sys: &mut System,
    limits: &Limits,
    history: &mut Vec<IterationRecord>,
) -> Result<NewtonStats, NewtonError> {
    let mut stats = NewtonStats::default();
    let mut last: Option<Correction> = None;
    let mut settled = false;
    loop {
        evaluate_or_shorten(sys, &mut last)?;
        sys.search();
        let changes = revise(sys, last.as_ref(), settled, limits, &mut stats);
        let residual = sys.assemble();
        let record = record(sys, &residual, last.as_ref(), changes);
        settled = record.residual < 1e-3;
        history.push(record);
        stats.changes += changes;
        match verdict(sys, &residual, changes, stats.iterations, limits) {
            Verdict::Converged => return Ok(stats),
            Verdict::Continue => {}
            Verdict::Diverging | Verdict::Exhausted => {
                return Err(NewtonError::NotConverged {
                    iterations: stats.iterations,
                    residual: record.residual,
                    gap_mm: residual.length,
                    changes,
                    node: residual.worst_node,
                });
            }
        }
        let correction = sys.correct()?;
        let share = bounded_share(sys, &correction);
        apply(sys, &correction, share);
        stats.iterations += 1;
        last = Some(correction);
    }
}

fn verdict(
    sys: &System,
    residual: &Residual,
    changes: usize,
    iterations: usize,
    limits: &Limits,
) -> Verdict {
    let rounding = 1e-13 * sys.scales.normal * sys.lengths.shortest_edge;
    let force = limits.force_tolerance * residual.reference + rounding;
    let gap = limits.gap_tolerance * sys.lengths.shortest_edge;
    if changes == 0
        && iterations > 0
        && residual.force.max(sys.eval.internal_residual) <= force
        && residual.length <= gap
    {
        return Verdict::Converged;
    }
    if !residual.force.is_finite() || !residual.length.is_finite() {
        return Verdict::Diverging;
    }
    if iterations >= limits.iterations { Verdict::Exhausted } else { Verdict::Continue }
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
        correction: last.map_or(0.0, |c| c.u.iter().map(|v| v * v).sum::<f64>().sqrt()),
        contacts: sys.contact.active().count(),
        slipping: residual.slipping,
        changes,
    }
}

/// Evaluates the body; while an element fails, takes back half of the last correction.
fn evaluate_or_shorten(sys: &mut System, last: &mut Option<Correction>) -> Result<(), NewtonError> {
    const HALVINGS: usize = 6;
    let mut back = 0.5;
    for _ in 0..HALVINGS {
        match (sys.evaluate(Want::ResidualAndTangent), last.as_ref()) {
            (Ok(()), _) => return Ok(()),
            (Err(failure), None) => return Err(failure.into()),
            (Err(_), Some(correction)) => apply(sys, correction, -back),
        }
        back *= 0.5;
    }
    Ok(sys.evaluate(Want::ResidualAndTangent)?)
}

/// Share of the correction that moves no node farther than two element lengths.
fn bounded_share(sys: &System, correction: &Correction) -> f64 {
    let largest = correction.u.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let allowed = 2.0 * sys.lengths.longest_edge;
    if largest > allowed { allowed / largest } else { 1.0 }
}

fn apply(sys: &mut System, correction: &Correction, share: f64) {
    sys.u.iter_mut().zip(&correction.u).for_each(|(u, d)| *u += share * d);
    for &(tool, travel) in &correction.travels {
        sys.tools[tool].travel += share * travel;
    }
}

/// Lets go of nodes that would be pulled, takes in nodes that penetrate; returns how many should change,
/// those that have to wait included.
///
/// The multiplier looked at is the one the linear system predicted: an active set method, not disturbed by
/// what plasticity left over. A candidate that changed too often waits a while, longer each time.
fn revise(
    sys: &mut System,
    last: Option<&Correction>,
    settled: bool,
    limits: &Limits,
    stats: &mut NewtonStats,
) -> usize {
    let mut changes = 0;
    for c in &mut sys.contact.candidates {
        c.wait = c.wait.saturating_sub(1);
    }
    let lambdas: Vec<(usize, f64)> = last.map_or_else(Vec::new, |c| c.lambdas.clone());
    let largest = lambdas.iter().fold(0.0, |m: f64, l| m.max(l.1.abs()));
    for (k, lambda) in lambdas {
        let lost = !sys.can_touch(k);
        let pulled = lambda < -1e-10 * largest && (!settled || sys.lambda(k) < 0.0);
        let waits = sys.contact.candidates[k].wait > 0;
        if lost || (pulled && !waits) {
            switch(sys, k, false, stats);
        }
        changes += usize::from(lost || pulled);
    }
    for (k, _) in active_list(sys) {
        if !sys.can_touch(k) {
            switch(sys, k, false, stats);
            changes += 1;
        }
    }
    let touch = -0.5 * limits.gap_tolerance * sys.lengths.shortest_edge;
    changes + take_in(sys, touch, stats) + keep_pushed_tools(sys, stats)
}

fn active_list(sys: &System) -> Vec<(usize, usize)> {
    sys.contact.active().map(|(k, c)| (k, c.node)).collect()
}

/// Takes in every free node whose gap is below `touch` [mm]; of two tools, the one it is deeper in.
pub(super) fn take_in(sys: &mut System, touch: f64, stats: &mut NewtonStats) -> usize {
    let mut busy = vec![false; sys.node_count()];
    for (_, node) in active_list(sys) {
        busy[node] = true;
    }
    let mut wanted: Vec<usize> = (0..sys.contact.candidates.len())
        .filter(|&k| {
            let c = &sys.contact.candidates[k];
            !c.active && !busy[c.node] && c.foot.gap < touch && sys.can_touch(k)
        })
        .collect();
    let set = &sys.contact.candidates;
    wanted.sort_by(|&a, &b| {
        set[a].node.cmp(&set[b].node).then(set[a].foot.gap.total_cmp(&set[b].foot.gap))
    });
    wanted.dedup_by_key(|k| set[*k].node);
    for &k in &wanted {
        if sys.contact.candidates[k].wait == 0 {
            switch(sys, k, true, stats);
        }
    }
    wanted.len()
}

/// A tool moved by force needs something to push against: its nearest node at least.
pub(super) fn keep_pushed_tools(sys: &mut System, stats: &mut NewtonStats) -> usize {
    let mut changes = 0;
    for tool in 0..sys.tools.len() {
        let pushed = matches!(sys.roles[tool], Role::Force(_));
        if !pushed || sys.contact.active().any(|(_, c)| c.tool == tool) {
            continue;
        }
        let busy: Vec<usize> = sys.contact.active().map(|(_, c)| c.node).collect();
        let nearest = (0..sys.contact.candidates.len())
            .filter(|&k| {
                let c = &sys.contact.candidates[k];
                c.tool == tool && sys.can_touch(k) && busy.binary_search(&c.node).is_err()
            })
            .min_by(|&a, &b| {
                let gap = |k: usize| sys.contact.candidates[k].foot.gap;
                gap(a).total_cmp(&gap(b))
            });
        if let Some(k) = nearest {
            switch(sys, k, true, stats);
            changes += 1;
        }
    }
    changes
}

fn switch(sys: &mut System, k: usize, active: bool, stats: &mut NewtonStats) {
    let c = &mut sys.contact.candidates[k];
    c.active = active;
    c.sliding = true;
    c.fresh = active;
    c.toggles += 1;
    if c.toggles > PATIENCE {
        c.wait = (c.toggles - PATIENCE).min(LONGEST_WAIT);
        stats.cycling += usize::from(c.toggles == PATIENCE + 1);
    }
}
