//! Reduction of patches: divisions are lowered and exchanged while every face stays within its tolerance.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::{Move, Search};
use crate::convert::tolerance::state::State;

/// Maximum number of exchanges tried.
const EXCHANGES_MAX: usize = 96;

impl Search<'_> {
    /// Repeats [`Self::exchange`] until no exchange saves patches or the budget of the saving is used.
    pub(super) fn exchange_divisions(&self, mut state: State) -> State {
        let mut tried = 0;
        while tried < EXCHANGES_MAX && self.evaluator.budget().allows_saving() {
            let Some(better) = self.exchange(&state, &mut tried) else { break };
            state = better;
        }
        state
    }

    /// Lowers divisions while every face stays within its tolerance, those with the largest estimated saving first.
    pub(super) fn prune(&self, mut state: State) -> State {
        loop {
            let mut any = false;
            for m in self.lowering_moves(&state) {
                if !self.evaluator.budget().allows_saving() {
                    return state;
                }
                let Some(lower) = self.lower(&state, m) else { continue };
                if self.is_within_goal(&lower) && lower.patches() < state.patches() {
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

    /// The state with one division less of a chain, or a quarter less inside a face. `None` at the minimum.
    fn lower(&self, state: &State, m: Move) -> Option<State> {
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
        fresh.then(|| self.state(minima, density))
    }

    /// Lowers one chain or interior, keeps it and raises others instead; returns the first result with fewer patches.
    /// `tried` counts the attempts.
    fn exchange(&self, state: &State, tried: &mut usize) -> Option<State> {
        for m in self.lowering_moves(state) {
            *tried += 1;
            if *tried > EXCHANGES_MAX {
                return None;
            }
            let Some(lower) = self.lower(state, m) else { continue };
            let grown = self.prune(self.grow_without(lower, m)?);
            if self.is_within_goal(&grown) && grown.patches() < state.patches() {
                return Some(grown);
            }
        }
        None
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
            let mut moves = self.border_moves(&state, worst);
            if moves.is_empty() {
                moves = self.candidate_moves(&state, worst);
            }
            moves.retain(|m| *m != fixed);
            let gains: Vec<f64> = moves.par_iter().map(|m| self.gain(&state, worst, *m)).collect();
            let best = gains.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
            let Some((k, _)) = best.filter(|b| *b.1 > 0.0) else { break };
            let (mut minima, mut density) = (state.minima.clone(), state.density.clone());
            self.raise(&state, worst, moves[k], &mut minima, &mut density);
            state = self.state(minima, density);
        }
        Some(state)
    }
}
