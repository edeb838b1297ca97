//! Search for the divisions with the fewest patches.
//!
//! Divisions are raised on faces above their tolerance, along the chain of opposite edges with the largest reduction of
//! the error per added patch. They are then lowered and exchanged while every face stays within its tolerance.

mod moves;
mod saving;

use std::sync::Arc;

use rayon::prelude::*;
use rustc_hash::FxHashSet;

use super::face_error::FaceEvaluator;
use super::face_result::FaceResult;
use super::goal::Goal;
use super::state::State;
use kanagata_geometry::Vec3;
use kanagata_mesh::mapped::plan::Plan;

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
/// Work of growth and lowering from which the limit of the exchanges follows, where they evaluated fewer patches.
const EXCHANGE_WORK_MIN: u64 = 500;
/// Largest ratio of the work of exchanges to that of growth and lowering. With 1, a bracket of 119 faces takes 684
/// patches instead of 491. Doubled: as many patches on the bracket and on a pan of 31 faces, in about the same time.
const EXCHANGE_RATIO_MAX: u64 = 8;
/// Patches of a uniform division over those of the grown state up to which it is lowered. With 8, the lowering takes six
/// times the work of the growth on dies, and ends with more patches.
const UNIFORM_RATIO_MAX: usize = 2;
/// Patches for each face from which on the ratio is 8: growth divides faces of few edges too finely (a sphere of 200 patches
/// instead of 128). Doubled: as many patches on such faces as growth finds.
const DENSE_PATCHES_PER_FACE: usize = 16;
/// Number of raises without a reduction of the error of a face by 10 % after which the search ends. One more is allowed
/// for each edge of the face.
const STAGNANT_RAISES_MAX: usize = 12;
/// The same number for a face without valid patches, whose divisions grow by a third in each raise.
const INVALID_RAISES_MAX: usize = 8;
/// Number of faces above their tolerance for which moves are chosen at once. It does not change the moves, only how many
/// are chosen in vain.
const RAISES_AT_ONCE: usize = 16;
/// Number of patches up to which a face is evaluated before others whose result may not be needed.
const SMALL_FACE_PATCHES_MAX: usize = 32;

/// Ratio of error to tolerance up to which the divisions at a place grow with it. Doubled: an error of 8 times the
/// tolerance doubles the divisions in one round, more than a side that follows the CAD needs.
const PLACE_RATIO_MAX: f64 = 4.0;

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
        let before = self.evaluator.budget().evaluated();
        let grown = self.grow(self.state(minima, density));
        let mut state = if self.is_within_goal(&grown) { self.prune(grown) } else { grown };
        if let Some(uniform) = self.uniform_state(self.uniform_limit(&state)) {
            let lowered = self.prune(uniform);
            if !self.is_within_goal(&state) || lowered.patches() < state.patches() {
                state = lowered;
            }
        }
        if !self.is_within_goal(&state) {
            return state;
        }
        let work = self.evaluator.budget().evaluated() - before;
        self.exchange_divisions(state, EXCHANGE_RATIO_MAX * work.max(EXCHANGE_WORK_MIN))
    }

    /// Number of patches up to which uniform divisions are a second start beside the grown `state`.
    fn uniform_limit(&self, state: &State) -> usize {
        let patches = state.patches();
        let dense = patches > DENSE_PATCHES_PER_FACE * state.faces.len();
        let ratio = if dense || !self.is_within_goal(state) { 8 } else { UNIFORM_RATIO_MAX };
        ratio * patches + 16
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
        let faces: Vec<Arc<FaceResult>> = (0..self.plan.model().faces.len())
            .into_par_iter()
            .map(|f| self.evaluator.evaluate(f, &divisions, density[f]))
            .collect();
        let error_ratios = faces.iter().enumerate().map(|(k, f)| self.error_ratio(k, f)).collect();
        State { minima, density, divisions, faces, error_ratios }
    }

    /// The state with these minimum divisions: faces whose divisions differ from those of `before` are evaluated.
    fn changed(&self, before: &State, minima: Vec<usize>, density: Vec<usize>) -> State {
        let mut state = self.divided(before, minima, density);
        let faces = self.faces_that_differ(before, &state);
        self.evaluate(&mut state, &faces);
        state
    }

    /// As [`Self::changed`]; `None` when a face is above its tolerance. Faces of few patches are evaluated first.
    fn changed_within_goal(
        &self,
        before: &State,
        minima: Vec<usize>,
        density: Vec<usize>,
    ) -> Option<State> {
        let mut state = self.divided(before, minima, density);
        let mut faces = self.faces_that_differ(before, &state);
        faces.sort_by_key(|&f| before.faces[f].patches);
        let small = faces.partition_point(|&f| before.faces[f].patches <= SMALL_FACE_PATCHES_MAX);
        for part in [&faces[..small], &faces[small..]] {
            self.evaluate(&mut state, part);
            if part.iter().any(|&f| self.excess(&state, f) > 1.0) {
                return None;
            }
        }
        Some(state)
    }

    /// The state `before` with other divisions, its faces not yet evaluated.
    fn divided(&self, before: &State, minima: Vec<usize>, density: Vec<usize>) -> State {
        let divisions = self.plan.agree(&minima);
        State { minima, density, divisions, ..before.clone() }
    }

    /// Faces with different divisions.
    fn faces_that_differ(&self, before: &State, after: &State) -> Vec<usize> {
        let differs = |&f: &usize| {
            let count = |e: usize| after.divisions.counts[e] != before.divisions.counts[e];
            after.density[f] != before.density[f]
                || after.divisions.mapped[f] != before.divisions.mapped[f]
                || self.edges(f).any(count)
        };
        (0..before.faces.len()).filter(differs).collect()
    }

    /// Evaluates some faces of a state.
    fn evaluate(&self, state: &mut State, faces: &[usize]) {
        let evaluate = |&f: &usize| self.evaluator.evaluate(f, &state.divisions, state.density[f]);
        let results: Vec<Arc<FaceResult>> = faces.par_iter().map(evaluate).collect();
        for (&f, result) in faces.iter().zip(results) {
            state.error_ratios[f] = self.error_ratio(f, &result);
            state.faces[f] = result;
        }
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

    /// Error of face `f` over its tolerance with the tolerance factor; within the tolerance up to 1.
    fn excess(&self, state: &State, f: usize) -> f64 {
        state.error_ratios[f] / self.factors[f]
    }

    /// True when every face is within its tolerance.
    pub fn is_within_goal(&self, state: &State) -> bool {
        (0..state.faces.len()).all(|f| self.excess(state, f) <= 1.0)
    }

    /// Raises divisions until every face is within its tolerance ([`Search::is_within_goal`]). It also ends when
    /// nothing can be raised, when a face no longer improves, or when the budget is exhausted.
    pub fn grow(&self, mut state: State) -> State {
        // For each face the minimum error and the number of raises since then.
        let mut best: Vec<(f64, usize)> = state.error_ratios.iter().map(|&b| (b, 0)).collect();
        loop {
            let exceeding = self.exceeding_faces(&state);
            let stagnates = |&f: &usize| {
                // Without valid patches all divisions grow by a third in each raise.
                let raises_max = if state.error_ratios[f].is_finite() {
                    STAGNANT_RAISES_MAX + self.edges(f).count()
                } else {
                    INVALID_RAISES_MAX
                };
                best[f].1 > raises_max
            };
            let ended = exceeding.is_empty() || exceeding.iter().any(stagnates);
            if ended || self.evaluator.budget().is_exhausted() {
                return state;
            }
            let raises = self.independent_raises(&state, &exceeding);
            if raises.is_empty() {
                return state;
            }
            let (mut minima, mut density) = (state.minima.clone(), state.density.clone());
            for (f, moves) in raises {
                moves.into_iter().for_each(|m| self.raise(&state, f, m, &mut minima, &mut density));
                best[f].1 += 1;
            }
            state = self.changed(&state, minima, density);
            for (face, least) in best.iter_mut().enumerate() {
                if state.error_ratios[face] < 0.9 * least.0 {
                    *least = (state.error_ratios[face], 0);
                }
            }
        }
    }

    /// Faces above their tolerance, the worst first.
    fn exceeding_faces(&self, state: &State) -> Vec<usize> {
        let excess = |f: usize| self.excess(state, f);
        let mut faces: Vec<usize> = (0..state.faces.len()).filter(|&f| excess(f) > 1.0).collect();
        faces.sort_by(|&a, &b| excess(b).total_cmp(&excess(a)).then(a.cmp(&b)));
        faces
    }

    /// Moves of faces above their tolerance that do not affect each other: no chain of one face's moves is on another
    /// of these faces. The worst faces come first.
    fn independent_raises(&self, state: &State, exceeding: &[usize]) -> Vec<(usize, Vec<Move>)> {
        let (mut of_faces, mut of_moves) = (FxHashSet::default(), FxHashSet::default());
        let mut raises: Vec<(usize, Vec<Move>)> = Vec::new();
        for batch in exceeding.chunks(RAISES_AT_ONCE) {
            let open =
                |f: &&usize| self.edges(**f).all(|e| !of_moves.contains(&self.plan.chains()[e]));
            let open: Vec<usize> = batch.iter().filter(open).copied().collect();
            let chosen: Vec<Vec<Move>> =
                open.par_iter().map(|&f| self.choose_moves(state, f)).collect();
            for (f, moves) in open.into_iter().zip(chosen) {
                let own = || self.edges(f).map(|e| self.plan.chains()[e]);
                let chains = |m: &Move| if let Move::Chain(c) = m { Some(*c) } else { None };
                let affects = moves.iter().filter_map(chains).any(|c| of_faces.contains(&c));
                if moves.is_empty() || affects || own().any(|c| of_moves.contains(&c)) {
                    continue;
                }
                of_faces.extend(own());
                of_moves.extend(moves.iter().filter_map(chains));
                raises.push((f, moves));
            }
        }
        raises
    }

    /// Refines for errors that the evaluation of single faces does not show. Faces in `folded` get one more division on
    /// all edges and inside; the edge closest to each of `places` (face, position, ratio of error to tolerance) gets more
    /// divisions. The error of a straight side decreases with the square of its divisions; half of that increase is made.
    pub fn refine_at(
        &self,
        state: &State,
        folded: &[usize],
        places: &[(usize, Vec3, f64)],
    ) -> State {
        let (mut minima, mut density) = (state.minima.clone(), state.density.clone());
        let mut more = |e: usize, growth: f64| {
            let chain = self.plan.chains()[e];
            let n = state.divisions.counts[e];
            let raised = n + ((n as f64 * growth) as usize).max(1);
            minima[chain] = minima[chain].max(raised.min(DIVISIONS_MAX.max(n)));
        };
        for (f, place, ratio) in places {
            let growth = (ratio.min(PLACE_RATIO_MAX).sqrt() - 1.0) / 2.0;
            self.nearest_edges(*f, place, 1).into_iter().for_each(|e| more(e, growth));
        }
        for &f in folded {
            self.edges(f).for_each(|e| more(e, 0.0));
            if self.divides_inside(state, f) && density[f] < DIVISIONS_MAX {
                density[f] = self.denser(state, f).unwrap_or(density[f] + 1);
            }
        }
        self.changed(state, minima, density)
    }

    /// Edges of a face.
    fn edges(&self, f: usize) -> impl Iterator<Item = usize> + '_ {
        self.plan.model().faces[f].loops.iter().flat_map(|l| &l.uses).filter_map(|u| u.edge)
    }
}
