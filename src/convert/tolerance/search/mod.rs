//! Search for the divisions with the fewest patches.
//!
//! Divisions are raised on faces above their tolerance, along the chain of opposite edges with the largest reduction of
//! the error per added patch. They are then lowered and exchanged while every face stays within its tolerance.

mod saving;

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::face_error::FaceEvaluator;
use super::face_result::FaceResult;
use super::goal::Goal;
use super::state::State;
use crate::geometry::Vec3;
use crate::mesh::mapped::plan::{Divisions, Plan};

/// A refinement of a face.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Move {
    /// More divisions of a chain of opposite edges, given by its first edge.
    Chain(usize),
    /// More divisions inside a face.
    Inside(usize),
}

/// Maximum divisions of an edge or of a quarter turn.
const DIVISIONS_MAX: usize = 2000;
/// Divisions per quarter turn of the uniform meshes from which divisions are lowered.
const UNIFORM_DIVISIONS: [usize; 7] = [2, 3, 4, 6, 8, 12, 16];
/// Number of raises without a reduction of the error of a face by 10 % after which the search ends. One more is allowed
/// for each edge of the face.
const STAGNANT_RAISES_MAX: usize = 12;
/// The same number for a face without valid patches, whose divisions grow by a third in each raise.
const INVALID_RAISES_MAX: usize = 8;
/// Number of edges closest to the worst point that are candidates for raising on a face that is not mapped.
const CANDIDATE_EDGES_MAX: usize = 3;

/// A search with fixed tolerance factors.
pub(super) struct Search<'a> {
    pub plan: &'a Plan<'a>,
    pub evaluator: &'a FaceEvaluator<'a>,
    pub goal: &'a Goal,
    /// Allowed error of each face alone, over the tolerance.
    pub factors: &'a [f64],
    /// Allowed distance of patch sides from each edge [mm].
    pub borders: &'a [f64],
}

impl Search<'_> {
    /// The state with the fewest patches found that has every face within its tolerance. Without such a state: the last
    /// one of the search.
    pub fn minimise_patches(&self) -> State {
        let minima = self.plan.minima().to_vec();
        let density = vec![1; self.plan.model().faces.len()];
        let grown = self.grow(self.state(minima, density));
        let mut state = if self.is_within_goal(&grown) { self.prune(grown) } else { grown };
        if let Some(uniform) = self.uniform_state(8 * state.patches() + 16) {
            let lowered = self.prune(uniform);
            if !self.is_within_goal(&state) || lowered.patches() < state.patches() {
                state = lowered;
            }
        }
        if !self.is_within_goal(&state) {
            return state;
        }
        self.exchange_divisions(state)
    }

    /// The coarsest uniform divisions with every face within its tolerance and about `limit` patches at most. They are
    /// a second start for lowering, beside the growth from the coarsest mesh.
    fn uniform_state(&self, limit: usize) -> Option<State> {
        let faces = self.plan.model().faces.len();
        for &n in &UNIFORM_DIVISIONS {
            if !self.evaluator.budget().allows_saving() {
                return None;
            }
            let state = self.state(self.plan.minima_at(n), vec![n; faces]);
            if self.is_within_goal(&state) {
                return Some(state);
            }
            if state.patches() > limit {
                return None;
            }
        }
        None
    }

    /// Evaluates all faces for these minimum divisions.
    fn state(&self, minima: Vec<usize>, density: Vec<usize>) -> State {
        let divisions = self.plan.agree(&minima);
        let faces: Vec<FaceResult> = (0..self.plan.model().faces.len())
            .into_par_iter()
            .map(|f| self.evaluator.evaluate(f, &divisions, density[f]))
            .collect();
        let error_ratios = faces.iter().enumerate().map(|(k, f)| self.error_ratio(k, f)).collect();
        State { minima, density, divisions, faces, error_ratios }
    }

    /// Largest ratio of error to tolerance of face `k`. Distances from edges and creases are not reduced by the vertex
    /// motion: a tolerance factor above 1 is therefore not applied to them.
    fn error_ratio(&self, k: usize, f: &FaceResult) -> f64 {
        let factor = self.factors[k].max(1.0);
        let error = (f.error_mm / self.goal.tol_mm).max(f.normal_deg / self.goal.normal_deg);
        let error = error.max(factor * f.crease_deviation_mm / self.goal.tol_mm);
        let ratio = |&(e, deviation): &(usize, f64)| deviation / self.borders[e];
        error.max(factor * f.edge_deviations.iter().map(ratio).fold(0.0, f64::max))
    }

    /// Chains of the edges of face `f` whose patch sides are too far away. Only more divisions of these chains reduce
    /// the distance.
    fn border_moves(&self, state: &State, f: usize) -> Vec<Move> {
        let too_far = |&&(e, deviation): &&(usize, f64)| {
            deviation > self.borders[e] * self.factors[f].min(1.0)
                && state.divisions.counts[e] < DIVISIONS_MAX
        };
        let far = state.edge_deviations(f).iter().filter(too_far);
        let chains: BTreeSet<usize> = far.map(|&(e, _)| self.plan.chains()[e]).collect();
        chains.into_iter().map(Move::Chain).collect()
    }

    /// Error of face `f` over its tolerance with the tolerance factor; within the tolerance up to 1.
    fn excess(&self, state: &State, f: usize) -> f64 {
        state.error_ratios[f] / self.factors[f]
    }

    /// True when every face is within its tolerance.
    pub fn is_within_goal(&self, state: &State) -> bool {
        (0..state.faces.len()).all(|f| self.excess(state, f) <= 1.0)
    }

    /// Raises divisions until every face is within its tolerance ([`Search::is_within_goal`]). It also ends when
    /// nothing can be raised, when the worst face no longer improves, or when the budget is exhausted.
    pub fn grow(&self, mut state: State) -> State {
        // For each face the minimum error and the number of raises since then.
        let mut best: Vec<(f64, usize)> = state.error_ratios.iter().map(|&b| (b, 0)).collect();
        loop {
            let worst = (0..state.faces.len())
                .max_by(|&a, &b| self.excess(&state, a).total_cmp(&self.excess(&state, b)));
            let Some(f) = worst.filter(|&f| self.excess(&state, f) > 1.0) else { return state };
            // Without valid patches all divisions grow by a third in each raise.
            let raises_max = if state.error_ratios[f].is_finite() {
                STAGNANT_RAISES_MAX + self.edges(f).count()
            } else {
                INVALID_RAISES_MAX
            };
            if best[f].1 > raises_max || self.evaluator.budget().is_exhausted() {
                return state;
            }
            let chosen = self.choose_moves(&state, f);
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
                if state.error_ratios[face] < 0.9 * least.0 {
                    *least = (state.error_ratios[face], 0);
                }
            }
        }
    }

    /// Moves for face `f`: all chains whose sides are too far from their edges; otherwise the move with the largest
    /// gain; without a gain, all candidate moves.
    fn choose_moves(&self, state: &State, f: usize) -> Vec<Move> {
        let border_moves = self.border_moves(state, f);
        // If finer border divisions fold patches, the best of the candidate moves is used.
        if !border_moves.is_empty() && self.is_valid_after(state, f, &border_moves) {
            return border_moves;
        }
        let mut moves = self.candidate_moves(state, f);
        moves.truncate(self.affordable_moves(state, f));
        let gains: Vec<f64> = moves.par_iter().map(|m| self.gain(state, f, *m)).collect();
        match gains.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)) {
            Some((k, gain)) if *gain > 0.0 => vec![moves[k]],
            // No single move reduces the error: all moves together.
            _ => moves,
        }
    }

    /// True when face `f` has valid patches after these moves, or none before them.
    fn is_valid_after(&self, state: &State, f: usize, moves: &[Move]) -> bool {
        let (mut minima, mut density) = (state.minima.clone(), state.density.clone());
        moves.iter().for_each(|&m| self.raise(state, f, m, &mut minima, &mut density));
        let after = self.evaluator.evaluate(f, &self.plan.agree(&minima), density[f]);
        self.error_ratio(f, &after).is_finite() || !state.error_ratios[f].is_finite()
    }

    /// Number of moves of face `f` that the remaining work allows, at least one.
    fn affordable_moves(&self, state: &State, f: usize) -> usize {
        let each = 1 + state.faces[f].patches as u64;
        usize::try_from(self.evaluator.budget().remaining() / each).unwrap_or(usize::MAX).max(1)
    }

    /// Refines for errors that the evaluation of single faces does not show. Faces in `folded` get one more division on
    /// all edges and inside; the edge closest to each of `places` (face, position) gets one more division.
    pub fn refine_at(&self, state: &State, folded: &[usize], places: &[(usize, Vec3)]) -> State {
        let (mut minima, mut density) = (state.minima.clone(), state.density.clone());
        let mut more = |e: usize| {
            let chain = self.plan.chains()[e];
            let n = state.divisions.counts[e];
            minima[chain] = minima[chain].max(if n < DIVISIONS_MAX { n + 1 } else { n });
        };
        let nearest = |(f, place): &(usize, Vec3)| {
            let distances = self.edges(*f).map(|e| (self.distance_to_edge(e, place), e));
            distances.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map(|near| near.1)
        };
        places.iter().filter_map(nearest).for_each(&mut more);
        for &f in folded {
            self.edges(f).for_each(&mut more);
            if self.divides_inside(state, f) && density[f] < DIVISIONS_MAX {
                density[f] += 1;
            }
        }
        self.state(minima, density)
    }

    /// Candidate moves of face `f`. On a face that is not mapped only the edges closest to the worst point are
    /// candidates.
    fn candidate_moves(&self, state: &State, f: usize) -> Vec<Move> {
        let mut edges: Vec<usize> = self.edges(f).collect();
        if let Some(worst) = state.faces[f].worst_point.filter(|_| !state.divisions.mapped[f]) {
            // Other edges have little effect on the error there.
            let distance = |&e: &usize| (self.distance_to_edge(e, &worst), e);
            let mut near: Vec<(f64, usize)> = edges.iter().map(distance).collect();
            near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            near.truncate(CANDIDATE_EDGES_MAX);
            edges = near.into_iter().map(|n| n.1).collect();
        }
        let mut all: BTreeSet<Move> = edges
            .into_iter()
            .filter(|&e| state.divisions.counts[e] < DIVISIONS_MAX)
            .map(|e| Move::Chain(self.plan.chains()[e]))
            .collect();
        if self.divides_inside(state, f) && state.density[f] < DIVISIONS_MAX {
            all.insert(Move::Inside(f));
        }
        all.into_iter().collect()
    }

    /// Distance of a point from an edge [mm].
    fn distance_to_edge(&self, e: usize, place: &Vec3) -> f64 {
        let curve = &self.plan.model().edges[e].curve;
        (curve.point(curve.closest(place).0) - place).norm()
    }

    /// True when divisions inside face `f` are independent of its edges.
    fn divides_inside(&self, state: &State, f: usize) -> bool {
        self.plan.divides_inside(f, state.divisions.mapped[f])
    }

    /// Edges of a face.
    fn edges(&self, f: usize) -> impl Iterator<Item = usize> + '_ {
        self.plan.model().faces[f].loops.iter().flat_map(|l| &l.uses).filter_map(|u| u.edge)
    }

    /// Applies a move for face `f`: one more division, or more when its error is far above the tolerance.
    fn raise(&self, state: &State, f: usize, m: Move, minima: &mut [usize], density: &mut [usize]) {
        // The error decreases at best with the fourth power of the divisions. Half of that increase is made.
        let excess = self.excess(state, f);
        let increase =
            if excess.is_finite() { ((excess.powf(0.25) - 1.0) / 2.0).min(1.0) } else { 1.0 / 3.0 };
        let raised = |n: usize| {
            if excess > 4.0 { n + ((n as f64 * increase) as usize).max(1) } else { n + 1 }
        };
        match m {
            Move::Chain(c) => minima[c] = raised(state.divisions.counts[c]),
            Move::Inside(f) => density[f] = raised(density[f]),
        }
    }

    /// Gain of a move: reduction of the logarithm of the error of face `f` per added patch. Instead of that reduction,
    /// 1 counts for the first valid patches.
    fn gain(&self, state: &State, f: usize, m: Move) -> f64 {
        let (mut minima, mut density) = (state.minima.clone(), state.density.clone());
        self.raise(state, f, m, &mut minima, &mut density);
        let divisions = self.plan.agree(&minima);
        let after = self.evaluator.evaluate(f, &divisions, density[f]);
        let before = state.error_ratios[f];
        let reduction = if before.is_finite() {
            (before / self.error_ratio(f, &after).max(1e-12)).ln()
        } else if self.error_ratio(f, &after).is_finite() {
            1.0
        } else {
            0.0
        };
        reduction
            / self
                .cost(state, &divisions)
                .max(after.patches as f64 - state.faces[f].patches as f64)
                .max(1.0)
    }

    /// Estimated number of patches that new divisions add. A mapped face has the product of its two divisions; any
    /// other face gets half a patch per division of its border.
    fn cost(&self, state: &State, divisions: &Divisions) -> f64 {
        let changed = divisions.counts.iter().zip(&state.divisions.counts).enumerate();
        let mut cost = 0.0;
        for (e, (&n, &old)) in changed.filter(|(_, (n, old))| n != old) {
            let increase = n as f64 / old as f64 - 1.0;
            for &[f, _, _] in &self.plan.model().edges[e].uses {
                let patches = state.faces[f].patches as f64;
                cost += if divisions.mapped[f] {
                    // Both opposite sides of the face change: half for each.
                    0.5 * patches * increase
                } else {
                    0.5 * (n as f64 - old as f64)
                };
            }
        }
        cost
    }
}
