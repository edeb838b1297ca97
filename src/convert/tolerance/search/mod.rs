//! Which divisions: raised where a face is over its tolerance, along the chain that lowers its error most for the
//! patches it costs; then lowered, and exchanged, while every face keeps its tolerance.

mod saving;

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::face_error::Judge;
use super::figures::Figures;
use super::goal::Goal;
use super::state::State;
use crate::geometry::Vec3;
use crate::mesh::mapped::plan::{Divisions, Plan};

/// A way to make a face better.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Move {
    /// More divisions of a chain, named by its first edge.
    Chain(usize),
    /// More elements inside a face.
    Inside(usize),
}

/// Most divisions of an edge or a quarter turn.
const MOST: usize = 2000;
/// Divisions of a quarter turn of uniform meshes that are lowered.
const UNIFORM: [usize; 7] = [2, 3, 4, 6, 8, 12, 16];
/// Raises without a tenth less error, besides one for each of its edges, after which a face is given up.
const PATIENCE: usize = 12;
/// Raises after which a face without sound patches is given up.
const UNSOUND: usize = 8;
/// Edges of a face that is not mapped, nearest to its worst point, that are tried for raising.
const NEAREST: usize = 3;

/// A search with fixed tolerances.
pub(super) struct Search<'a> {
    pub plan: &'a Plan<'a>,
    pub judge: &'a Judge<'a>,
    pub goal: &'a Goal,
    /// Share of the tolerance each face is held to.
    pub shares: &'a [f64],
    /// How far the patches' sides on each edge may be from it [mm].
    pub borders: &'a [f64],
}

impl Search<'_> {
    /// The fewest patches found that keep every face within its share of the tolerance.
    pub fn fewest(&self) -> State {
        let minima = self.plan.minima().to_vec();
        let density = vec![1; self.plan.model().faces.len()];
        let grown = self.grow(self.state(minima, density));
        let mut state = if self.keeps(&grown) { self.prune(grown) } else { grown };
        if let Some(uniform) = self.uniform(8 * state.patches() + 16) {
            let lowered = self.prune(uniform);
            if !self.keeps(&state) || lowered.patches() < state.patches() {
                state = lowered;
            }
        }
        if !self.keeps(&state) {
            return state;
        }
        self.exchanged(state)
    }

    /// The coarsest uniform divisions that keep every face within its share of the tolerance, with at most `limit`
    /// patches: to be lowered, where growth from the coarsest ones went astray.
    fn uniform(&self, limit: usize) -> Option<State> {
        let faces = self.plan.model().faces.len();
        for &n in &UNIFORM {
            if !self.judge.budget().saves() {
                return None;
            }
            let state = self.state(self.plan.minima_at(n), vec![n; faces]);
            if self.keeps(&state) {
                return Some(state);
            }
            if state.patches() > limit {
                return None;
            }
        }
        None
    }

    fn state(&self, minima: Vec<usize>, density: Vec<usize>) -> State {
        let divisions = self.plan.agree(&minima);
        let faces: Vec<Figures> = (0..self.plan.model().faces.len())
            .into_par_iter()
            .map(|f| self.judge.of(f, &divisions, density[f]))
            .collect();
        let badness = faces.iter().enumerate().map(|(k, f)| self.ratio(k, f)).collect();
        State { minima, density, divisions, faces, badness }
    }

    /// Error of face `k` over the tolerance; the sides' distance from its edges is no matter of its share, but where that is
    /// less than one.
    fn ratio(&self, k: usize, f: &Figures) -> f64 {
        let error = (f.error_mm / self.goal.tol_mm).max(f.normal_deg / self.goal.normal_deg);
        let error = error.max(self.shares[k].max(1.0) * f.cut_mm / self.goal.tol_mm);
        let off = f.off.iter().map(|&(e, off)| off / self.borders[e]);
        error.max(self.shares[k].max(1.0) * off.fold(0.0, f64::max))
    }

    /// Chains of edges that the sides of face `f` are too far from: more divisions of these bring them nearer, and none of
    /// others do.
    fn at_borders(&self, state: &State, f: usize) -> Vec<Move> {
        let too_far = |&&(e, off): &&(usize, f64)| {
            off > self.borders[e] * self.shares[f].min(1.0) && state.divisions.counts[e] < MOST
        };
        let far = state.off(f).iter().filter(too_far);
        let chains: BTreeSet<usize> = far.map(|&(e, _)| self.plan.chains()[e]).collect();
        chains.into_iter().map(Move::Chain).collect()
    }

    fn over(&self, state: &State, f: usize) -> f64 {
        state.badness[f] / self.shares[f]
    }

    /// True when every face is within its share of the tolerance.
    pub fn keeps(&self, state: &State) -> bool {
        (0..state.faces.len()).all(|f| self.over(state, f) <= 1.0)
    }

    /// Raises divisions until every face keeps its tolerance, nothing more can be raised, or a face no longer gets
    /// better: see [`Search::keeps`].
    pub fn grow(&self, mut state: State) -> State {
        // For each face the least error so far, and raises since then.
        let mut best: Vec<(f64, usize)> = state.badness.iter().map(|&b| (b, 0)).collect();
        loop {
            let worst = (0..state.faces.len())
                .max_by(|&a, &b| self.over(&state, a).total_cmp(&self.over(&state, b)));
            let Some(f) = worst.filter(|&f| self.over(&state, f) > 1.0) else { return state };
            // Without sound patches all divisions grow by a third at a time.
            let sound = state.badness[f].is_finite();
            let patience = if sound { PATIENCE + self.edges(f).count() } else { UNSOUND };
            if best[f].1 > patience || self.judge.budget().is_spent() {
                return state;
            }
            let chosen = self.chosen(&state, f);
            if chosen.is_empty() {
                return state;
            }
            let (mut minima, mut density) = (state.minima.clone(), state.density.clone());
            for m in chosen {
                self.raise(&state, f, m, &mut minima, &mut density);
            }
            state = self.state(minima, density);
            best[f].1 += 1;
            for (face, least) in best.iter_mut().enumerate() {
                if state.badness[face] < 0.9 * least.0 {
                    *least = (state.badness[face], 0);
                }
            }
        }
    }

    /// What is raised for face `f`: all edges that its sides are too far from, or what lowers its error most.
    fn chosen(&self, state: &State, f: usize) -> Vec<Move> {
        let at_borders = self.at_borders(state, f);
        // Where patches fold between nodes on a border, it is left to the moves below to find what helps.
        if !at_borders.is_empty() && self.is_sound_after(state, f, &at_borders) {
            return at_borders;
        }
        let mut moves = self.moves(state, f);
        moves.truncate(self.affordable(state, f));
        let gains: Vec<f64> = moves.par_iter().map(|m| self.gain(state, f, *m)).collect();
        match gains.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)) {
            Some((k, gain)) if *gain > 0.0 => vec![moves[k]],
            // None alone helps: all of them.
            _ => moves,
        }
    }

    /// Whether face `f` has sound patches after these moves, or has none before them.
    fn is_sound_after(&self, state: &State, f: usize, moves: &[Move]) -> bool {
        let (mut minima, mut density) = (state.minima.clone(), state.density.clone());
        moves.iter().for_each(|&m| self.raise(state, f, m, &mut minima, &mut density));
        let after = self.judge.of(f, &self.plan.agree(&minima), density[f]);
        self.ratio(f, &after).is_finite() || !state.badness[f].is_finite()
    }

    /// Moves of face `f` that can be tried with the work that is left, at least one.
    fn affordable(&self, state: &State, f: usize) -> usize {
        let each = 1 + state.faces[f].patches as u64;
        usize::try_from(self.judge.budget().left() / each).unwrap_or(usize::MAX).max(1)
    }

    /// For what a face alone does not know of: one division more on every side of faces that fold only beside their
    /// neighbours and inside them, and on the edges nearest to where others are off.
    pub fn finer(&self, state: &State, folded: &[usize], places: &[(usize, Vec3)]) -> State {
        let (mut minima, mut density) = (state.minima.clone(), state.density.clone());
        let mut more = |e: usize| {
            let chain = self.plan.chains()[e];
            let n = state.divisions.counts[e];
            minima[chain] = minima[chain].max(if n < MOST { n + 1 } else { n });
        };
        let nearest = |(f, place): &(usize, Vec3)| {
            let off = self.edges(*f).map(|e| (self.off(e, place), e));
            off.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map(|near| near.1)
        };
        places.iter().filter_map(nearest).for_each(&mut more);
        for &f in folded {
            self.edges(f).for_each(&mut more);
            if self.divides_inside(state, f) && density[f] < MOST {
                density[f] += 1;
            }
        }
        self.state(minima, density)
    }

    fn moves(&self, state: &State, f: usize) -> Vec<Move> {
        let mut edges: Vec<usize> = self.edges(f).collect();
        if let Some(worst) = state.faces[f].worst.filter(|_| !state.divisions.mapped[f]) {
            // No edge but those beside it can do much about it.
            let mut near: Vec<(f64, usize)> =
                edges.iter().map(|&e| (self.off(e, &worst), e)).collect();
            near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            near.truncate(NEAREST);
            edges = near.into_iter().map(|n| n.1).collect();
        }
        let mut all: BTreeSet<Move> = edges
            .into_iter()
            .filter(|&e| state.divisions.counts[e] < MOST)
            .map(|e| Move::Chain(self.plan.chains()[e]))
            .collect();
        if self.divides_inside(state, f) && state.density[f] < MOST {
            all.insert(Move::Inside(f));
        }
        all.into_iter().collect()
    }

    /// Distance of a place from an edge [mm].
    fn off(&self, e: usize, place: &Vec3) -> f64 {
        let curve = &self.plan.model().edges[e].curve;
        (curve.point(curve.closest(place).0) - place).norm()
    }

    fn divides_inside(&self, state: &State, f: usize) -> bool {
        self.plan.divides_inside(f, state.divisions.mapped[f])
    }

    fn edges(&self, f: usize) -> impl Iterator<Item = usize> + '_ {
        self.plan.model().faces[f].loops.iter().flat_map(|l| &l.uses).filter_map(|u| u.edge)
    }

    /// Applies a move made for face `f`: far from the tolerance in longer steps.
    fn raise(&self, state: &State, f: usize, m: Move, minima: &mut [usize], density: &mut [usize]) {
        // The error falls with the fourth power of the divisions at best.
        let over = self.over(state, f);
        let share =
            if over.is_finite() { ((over.powf(0.25) - 1.0) / 2.0).min(1.0) } else { 1.0 / 3.0 };
        let longer =
            |n: usize| if over > 4.0 { n + ((n as f64 * share) as usize).max(1) } else { n + 1 };
        match m {
            Move::Chain(c) => minima[c] = longer(state.divisions.counts[c]),
            Move::Inside(f) => density[f] = longer(density[f]),
        }
    }

    /// How much a move lowers the logarithm of the error of `f` for each patch it costs.
    fn gain(&self, state: &State, f: usize, m: Move) -> f64 {
        let (mut minima, mut density) = (state.minima.clone(), state.density.clone());
        self.raise(state, f, m, &mut minima, &mut density);
        let divisions = self.plan.agree(&minima);
        let after = self.judge.of(f, &divisions, density[f]);
        let before = state.badness[f];
        let won = if before.is_finite() {
            (before / self.ratio(f, &after).max(1e-12)).ln()
        } else if self.ratio(f, &after).is_finite() {
            1.0
        } else {
            0.0
        };
        won / self
            .cost(state, &divisions)
            .max(after.patches as f64 - state.faces[f].patches as f64)
            .max(1.0)
    }

    /// Patches that other divisions cost, about: a mapped face has the product of its two divisions, any other half
    /// a patch for each on its border.
    fn cost(&self, state: &State, divisions: &Divisions) -> f64 {
        let changed = divisions.counts.iter().zip(&state.divisions.counts).enumerate();
        let mut cost = 0.0;
        for (e, (&n, &old)) in changed.filter(|(_, (n, old))| n != old) {
            let share = n as f64 / old as f64 - 1.0;
            for &[f, _, _] in &self.plan.model().edges[e].uses {
                let patches = state.faces[f].patches as f64;
                cost += if divisions.mapped[f] {
                    // Both sides of the face change: half for each.
                    0.5 * patches * share
                } else {
                    0.5 * (n as f64 - old as f64)
                };
            }
        }
        cost
    }
}
