//! The active set: which nodes count as touching in the next iteration.
//!
//! A primal-dual active set method in blocks: every node that is pulled is let go and every node that
//! penetrates is taken in, at once; when that no longer brings fewer wrong nodes, only the worst of them
//! (block principal pivoting, Judice & Pires 1994), which ends the going back and forth of large blocks.

use super::approach::NEAR;
use super::driven_tools::{keep_pushed_tools, opposed, switch};
use super::stops;
use crate::geometry::Vec3;
use crate::solver::contact::candidate::Candidate;
use crate::solver::limits::Limits;
use crate::solver::linear::LinearError;
use crate::solver::system::correction::{Correction, Foretold};
use crate::solver::system::system::System;

/// How the revision of the active set goes in one increment.
#[derive(Debug, Clone, Copy)]
pub(in crate::solver) struct Pivoting {
    /// Fewest wrong nodes so far.
    fewest: usize,
    /// Iterations since.
    since: usize,
}

/// Iterations without fewer wrong nodes before only a part of them is changed.
const PATIENCE: usize = 4;

impl Pivoting {
    pub(in crate::solver) fn new() -> Self {
        Self { fewest: usize::MAX, since: 0 }
    }

    /// How many of `wrong` nodes (of `total` in both lists) to change now.
    fn block(&self, wrong: usize) -> usize {
        if self.since <= PATIENCE { wrong } else { wrong.div_ceil(self.since.min(6)) }
    }

    /// Takes the number of wrong nodes; whether blocks of them go back and forth and are cut down now.
    fn count(&mut self, wrong: usize) -> bool {
        if wrong < self.fewest {
            (self.fewest, self.since) = (wrong, 0);
        } else if wrong > 0 {
            self.since += 1;
        }
        wrong > 0 && self.since > PATIENCE
    }
}

/// Lets go of nodes that are pulled, takes in nodes that penetrate; returns how many were wrong. To be
/// called at a new iterate, after the search.
pub(in crate::solver) fn revise(
    sys: &mut System,
    last: Option<&Correction>,
    near_balance: bool,
    limits: &Limits,
    pivoting: &mut Pivoting,
) -> usize {
    sys.contact.candidates.iter_mut().for_each(|c| c.fresh = false);
    let lost: Vec<usize> =
        sys.contact.active().map(|(k, _)| k).filter(|&k| !sys.can_touch(k)).collect();
    lost.iter().for_each(|&k| switch(sys, k, false));
    let pulled = pulled(sys, last, near_balance);
    // The first iterate is a guess: what penetrates there need not after the first correction.
    let inside = match last {
        Some(_) => penetrating(sys, touch(sys, limits), |c| c.foot.gap),
        None => Vec::new(),
    };
    let wrong = pivot(sys, pulled, inside, pivoting);
    let stops = if last.is_some() { stops::revise(sys) } else { 0 };
    lost.len() + wrong + stops + keep_pushed_tools(sys)
}

/// Settles the active set on the linearised system, where plasticity cannot interfere: corrects again until
/// the predicted forces push and the predicted gaps are open, or `rounds` times. Returns the last correction
/// and how often the system was solved again.
pub(in crate::solver) fn settle(
    sys: &mut System,
    mut correction: Correction,
    limits: &Limits,
    rounds: usize,
) -> Result<(Correction, usize), LinearError> {
    let mut pivoting = Pivoting::new();
    for solves in 0..rounds {
        let pulled = pulled(sys, Some(&correction), false);
        let inside = {
            let mut moves = vec![0.0; sys.tools.len()];
            correction.travels.iter().for_each(|&(tool, travel)| moves[tool] = travel);
            penetrating(sys, touch(sys, limits), |c| {
                let du = Vec3::from_column_slice(&correction.u[3 * c.node..3 * c.node + 3]);
                let tool = sys.tools[c.tool].setup.direction * moves[c.tool];
                c.foot.gap + c.foot.normal.dot(&(du - tool))
            })
        };
        let stops = stops::foresee(sys, &correction);
        if stops + pivot(sys, pulled, inside, &mut pivoting) == 0 {
            return Ok((correction, solves));
        }
        keep_pushed_tools(sys);
        sys.assemble();
        let found = sys.correct_again();
        correction = opposed(sys, found)?;
    }
    Ok((correction, rounds))
}

fn touch(sys: &System, limits: &Limits) -> f64 {
    -0.5 * limits.gap_tolerance * sys.lengths.shortest_edge
}

/// Changes the state of wrong candidates: all, or the worst part of them; returns how many are wrong.
fn pivot(
    sys: &mut System,
    mut pulled: Vec<(usize, f64)>,
    mut inside: Vec<(usize, f64)>,
    pivoting: &mut Pivoting,
) -> usize {
    let wrong = pulled.len() + inside.len();
    sys.timings.cycling += usize::from(pivoting.count(wrong));
    worst_first(&mut pulled);
    worst_first(&mut inside);
    for &(k, _) in &pulled[..pivoting.block(pulled.len())] {
        switch(sys, k, false);
    }
    for &(k, _) in &inside[..pivoting.block(inside.len())] {
        switch(sys, k, true);
    }
    wrong
}

/// Sorts wrong candidates, the worst in front. Of those that are as wrong as each other but for rounding, as symmetric ones
/// are, the first in order comes first, whatever the axes of the model.
fn worst_first(wrong: &mut [(usize, f64)]) {
    wrong.sort_by(|a, b| (a.1 as f32).total_cmp(&(b.1 as f32)).then(a.0.cmp(&b.0)));
}

/// Touching candidates that would be pulled, with their normal force.
fn pulled(sys: &System, last: Option<&Correction>, near_balance: bool) -> Vec<(usize, f64)> {
    let Some(last) = last else { return Vec::new() };
    let largest = last.foretold.iter().fold(0.0, |m: f64, f| m.max(f.lambda.abs()));
    // A sheet that tools alone carry along is not pushed at all: of the forces there is only rounding, but with dampers.
    let damped = sys.carried && sys.damper.is_some();
    let of_note = -(1e-10 * largest).max(if damped { sys.rounding_of_forces() } else { 0.0 });
    let carried = !damped && sys.is_without_loads();
    let wrong = |f: &&Foretold| {
        sys.contact.candidates[f.candidate].active
            && f.lambda < of_note
            && !(carried && sys.scales.of_note(f.lambda) == 0.0)
            && (!near_balance || sys.lambda(f.candidate) < 0.0)
    };
    last.foretold.iter().filter(wrong).map(|f| (f.candidate, f.lambda)).collect()
}

/// Free nodes whose `gap` is below `touch` [mm], with it; of two tools, the one a node is deeper in.
fn penetrating(sys: &System, touch: f64, gap: impl Fn(&Candidate) -> f64) -> Vec<(usize, f64)> {
    let mut busy = vec![false; sys.node_count()];
    for (_, c) in sys.contact.active() {
        busy[c.node] = true;
    }
    let set = &sys.contact.candidates;
    let mut out: Vec<(usize, f64)> = (0..set.len())
        .filter(|&k| !set[k].active && !busy[set[k].node])
        .map(|k| (k, gap(&set[k])))
        .filter(|&(k, gap)| gap < touch && sys.can_touch(k))
        .collect();
    out.sort_by(|a, b| set[a.0].node.cmp(&set[b.0].node).then(a.1.total_cmp(&b.1)));
    out.dedup_by_key(|c| set[c.0].node);
    crests(sys, &out, touch.max(0.0))
}

/// Of penetrating nodes only those that are as deep as the deepest of their neighbours. Where a stretch of the
/// sheet dips into a tool its crest is what touches; all of it at once would have to be let go again one row of
/// nodes after the other. Depths are counted from the gap `from` [mm], so that nodes that just touch have one whatever
/// their rounding.
fn crests(sys: &System, inside: &[(usize, f64)], from: f64) -> Vec<(usize, f64)> {
    /// Share of the deepest neighbour's depth.
    const DEEP: f64 = 0.999;
    let set = &sys.contact.candidates;
    let mut depth = vec![0.0_f64; sys.node_count()];
    inside.iter().for_each(|&(k, gap)| depth[set[k].node] = from - gap);
    let deepest = |node: usize| sys.neighbours(node).map(|n| depth[n]).fold(0.0, f64::max);
    inside.iter().filter(|&&(k, gap)| from - gap >= DEEP * deepest(set[k].node)).copied().collect()
}

/// Takes in every free node that touches.
pub(in crate::solver) fn take_in(sys: &mut System) {
    for (k, _) in penetrating(sys, NEAR * sys.lengths.shortest_edge, |c| c.foot.gap) {
        switch(sys, k, true);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_that_go_back_and_forth_are_cut_down() {
        let mut pivoting = Pivoting::new();
        for _ in 0..=PATIENCE {
            assert!(!pivoting.count(12));
            assert_eq!(pivoting.block(12), 12);
        }
        assert!(pivoting.count(12));
        assert_eq!(pivoting.block(12), 3);
        assert!(pivoting.count(13));
        assert_eq!(pivoting.block(12), 2);
        // Fewer than ever: whole blocks again.
        assert!(!pivoting.count(5));
        assert_eq!(pivoting.block(5), 5);
        assert!(!pivoting.count(0));
    }
}
