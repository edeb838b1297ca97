//! Fewer patches: divisions lowered, and exchanged, while every face keeps its tolerance.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::{Move, Search};
use crate::convert::tolerance::state::State;

/// Chains that are tried for exchange, at most.
const EXCHANGES: usize = 96;

impl Search<'_> {
    /// Exchanges one chain after the other until none saves patches, or the work for that is done.
    pub(super) fn exchanged(&self, mut state: State) -> State {
        let mut tried = 0;
        while tried < EXCHANGES && self.judge.budget().saves() {
            let Some(better) = self.exchange(&state, &mut tried) else { break };
            state = better;
        }
        state
    }

    /// Lowers divisions, those that save most first, while every face keeps its tolerance.
    pub(super) fn prune(&self, mut state: State) -> State {
        loop {
            let mut any = false;
            for m in self.lowerings(&state) {
                if !self.judge.budget().saves() {
                    return state;
                }
                let Some(lower) = self.lowered(&state, m) else { continue };
                if self.keeps(&lower) && lower.patches() < state.patches() {
                    state = lower;
                    any = true;
                }
            }
            if !any {
                return state;
            }
        }
    }

    /// Chains and insides that can be lowered, those on faces with most patches first.
    fn lowerings(&self, state: &State) -> Vec<Move> {
        let mut saved: BTreeMap<Move, f64> = BTreeMap::new();
        for f in 0..state.faces.len() {
            let patches = state.faces[f].patches as f64;
            for e in self.edges(f) {
                let c = self.plan.chains()[e];
                let share = patches / state.divisions.counts[e] as f64;
                *saved.entry(Move::Chain(c)).or_default() += share;
            }
            if self.divides_inside(state, f) && state.density[f] > 1 {
                *saved.entry(Move::Inside(f)).or_default() += patches;
            }
        }
        let mut order: Vec<(Move, f64)> = saved.into_iter().collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1));
        order.into_iter().map(|(m, _)| m).collect()
    }

    fn lowered(&self, state: &State, m: Move) -> Option<State> {
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

    /// One chain lowered and kept so, others raised for it: the first exchange that saves patches.
    fn exchange(&self, state: &State, tried: &mut usize) -> Option<State> {
        for m in self.lowerings(state) {
            *tried += 1;
            if *tried > EXCHANGES {
                return None;
            }
            let Some(lower) = self.lowered(state, m) else { continue };
            let grown = self.prune(self.grow_without(lower, m)?);
            if self.keeps(&grown) && grown.patches() < state.patches() {
                return Some(grown);
            }
        }
        None
    }

    /// Grows without raising `fixed`; as it was when nothing else can be raised.
    fn grow_without(&self, mut state: State, fixed: Move) -> Option<State> {
        let limit = state.patches() * 2 + 16;
        for _ in 0..200 {
            let worst = (0..state.faces.len())
                .max_by(|&a, &b| self.over(&state, a).total_cmp(&self.over(&state, b)))?;
            if self.over(&state, worst) <= 1.0
                || state.patches() > limit
                || !self.judge.budget().saves()
            {
                break;
            }
            let at_borders = self.at_borders(&state, worst);
            let mut moves =
                if at_borders.is_empty() { self.moves(&state, worst) } else { at_borders };
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
