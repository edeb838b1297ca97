//! Reduction of patches: divisions are lowered and exchanged while every face stays within its tolerance.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rayon::prelude::*;

use super::{Move, Search};
use crate::tolerance::state::State;

/// Maximum number of exchanges tried.
const EXCHANGES_MAX: usize = 96;

impl Search<'_> {
    /// Repeats [`Self::exchange`] until no exchange saves patches, `work` patches are evaluated or the budget of the saving
    /// is used.
    pub(super) fn exchange_divisions(&self, mut state: State, work: u64) -> State {
        let mut tried = 0;
        let budget = self.evaluator.budget();
        let limit = budget.evaluated() + work;
        let open = || budget.allows_saving() && budget.evaluated() < limit;
        while tried < EXCHANGES_MAX && open() {
            let Some(better) = self.exchange(&state, &mut tried, &open) else { break };
            state = better;
        }
        state
    }

    /// Lowers divisions while every face stays within its tolerance, those with the largest estimated saving first.
    pub(super) fn prune(&self, state: State) -> State {
        self.prune_where(state, |_| true)
    }

    /// As [`Self::prune`], by the moves that `allows`.
    fn prune_where(&self, mut state: State, allows: impl Fn(&Move) -> bool) -> State {
        loop {
            let mut any = false;
            for m in self.lowering_moves(&state).into_iter().filter(&allows) {
                if !self.evaluator.budget().allows_saving() {
                    return state;
                }
                let Some((minima, density)) = self.lower(&state, m) else { continue };
                let Some(lower) = self.changed_within_goal(&state, minima, density) else {
                    continue;
                };
                if lower.patches() < state.patches() {
                    state = lower;
                    any = true;
                }
            }
            if !any {
                return state;
            }
        }
    }

    /// Moves that can be reversed, those with the largest estimated saving of patches first.
    fn lowering_moves(&self, state: &State) -> Vec<Move> {
        let mut saved: BTreeMap<Move, f64> = BTreeMap::new();
        for f in 0..state.faces.len() {
            let patches = state.faces[f].patches as f64;
            for e in self.edges(f) {
                let c = self.plan.chains()[e];
                let saving = patches / state.divisions.counts[e] as f64;
                *saved.entry(Move::Chain(c)).or_default() += saving;
            }
            if self.divides_inside(state, f) && state.density[f] > 1 {
                *saved.entry(Move::Inside(f)).or_default() += patches;
            }
        }
        let mut order: Vec<(Move, f64)> = saved.into_iter().collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1));
        order.into_iter().map(|(m, _)| m).collect()
    }

    /// Minimum divisions and densities with one division less of a chain, or a quarter less inside a face. `None` at the
    /// minimum.
    fn lower(&self, state: &State, m: Move) -> Option<(Vec<usize>, Vec<usize>)> {
        let (mut minima, mut density) = (state.minima.clone(), state.density.clone());
        match m {
            Move::Chain(c) => {
                let count = state.divisions.counts[c];
                let floor = |e: usize| self.plan.minima()[e];
                let of_chain = (0..minima.len()).filter(|&e| self.plan.chains()[e] == c);
                for e in of_chain.collect::<Vec<_>>() {
                    minima[e] = minima[e].min(count.saturating_sub(1)).max(floor(e));
                }
            }
            Move::Inside(f) => density[f] = (density[f] * 3 / 4).max(1),
        }
        let fresh = minima != state.minima || density != state.density;
        fresh.then_some((minima, density))
    }

    /// Lowers one chain or interior, keeps it and raises others instead; returns the first result with fewer patches.
    /// `tried` counts the attempts; there are none once `open` is false.
    fn exchange(
        &self,
        state: &State,
        tried: &mut usize,
        open: &impl Fn() -> bool,
    ) -> Option<State> {
        for m in self.lowering_moves(state) {
            *tried += 1;
            if *tried > EXCHANGES_MAX || !open() {
                return None;
            }
            let Some((minima, density)) = self.lower(state, m) else { continue };
            let lower = self.changed(state, minima, density);
            let grown = self.grow_without(lower, m)?;
            if !self.is_within_goal(&grown) {
                continue;
            }
            // The state had nothing to lower: only moves of faces that changed are tried.
            let near = self.moves_of_changed_faces(state, &grown);
            let grown = self.prune_where(grown, |m| near.contains(m));
            if grown.patches() < state.patches() {
                return Some(grown);
            }
        }
        None
    }

    /// Moves of the faces whose results differ between two states.
    fn moves_of_changed_faces(&self, before: &State, after: &State) -> BTreeSet<Move> {
        let pairs = before.faces.iter().zip(&after.faces).enumerate();
        let changed = pairs.filter(|(_, (a, b))| !Arc::ptr_eq(a, b)).map(|(f, _)| f);
        let moves = |f: usize| {
            let chains = self.edges(f).map(|e| Move::Chain(self.plan.chains()[e]));
            chains.chain([Move::Inside(f)])
        };
        changed.flat_map(moves).collect()
    }

    /// Raises divisions as [`Search::grow`] does, except those of `fixed`. The result may be above the tolerance.
    fn grow_without(&self, mut state: State, fixed: Move) -> Option<State> {
        let limit = state.patches() * 2 + 16;
        for _ in 0..200 {
            let worst = (0..state.faces.len())
                .max_by(|&a, &b| self.excess(&state, a).total_cmp(&self.excess(&state, b)))?;
            if self.excess(&state, worst) <= 1.0
                || state.patches() > limit
                || !self.evaluator.budget().allows_saving()
            {
                break;
            }
            let border_moves = self.border_moves(&state, worst).into_iter().map(|m| vec![m]);
            let mut moves: Vec<Vec<Move>> = border_moves.collect();
            if moves.is_empty() {
                moves = self.candidate_moves(&state, worst);
            }
            moves.retain(|m| !m.contains(&fixed));
            let gains: Vec<f64> = moves.par_iter().map(|m| self.gain(&state, worst, m)).collect();
            let best = gains.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
            let Some((k, _)) = best.filter(|b| *b.1 > 0.0) else { break };
            let (mut minima, mut density) = (state.minima.clone(), state.density.clone());
            let raise = |&m: &Move| self.raise(&state, worst, m, &mut minima, &mut density);
            moves[k].iter().for_each(raise);
            state = self.changed(&state, minima, density);
        }
        Some(state)
    }
}
