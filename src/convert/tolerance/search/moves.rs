//! Moves of a search: candidates to raise the divisions of a face, their gain and cost.

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::{DIVISIONS_MAX, Move, Search};
use crate::tolerance::state::State;
use kanagata_geometry::Vec3;
use kanagata_mesh::mapped::plan::Divisions;

/// Number of edges closest to the worst point that are candidates for raising on a face that is not mapped.
const CANDIDATE_EDGES_MAX: usize = 3;

impl Search<'_> {
    /// Chains of the edges of face `f` whose patch sides are too far away. Only more divisions of these chains reduce
    /// the distance.
    pub(super) fn border_moves(&self, state: &State, f: usize) -> Vec<Move> {
        let too_far = |&&(e, deviation): &&(usize, f64)| {
            deviation > self.borders[e] * self.factors[f].min(1.0)
                && state.divisions.counts[e] < DIVISIONS_MAX
        };
        let far = state.edge_deviations(f).iter().filter(too_far);
        let chains: BTreeSet<usize> = far.map(|&(e, _)| self.plan.chains()[e]).collect();
        chains.into_iter().map(Move::Chain).collect()
    }

    /// Moves for face `f`: all chains whose sides are too far from their edges; otherwise the moves with the largest
    /// gain; without a gain, all candidate moves.
    pub(super) fn choose_moves(&self, state: &State, f: usize) -> Vec<Move> {
        let border_moves = self.border_moves(state, f);
        // If finer border divisions fold patches, the best of the candidate moves is used.
        if !border_moves.is_empty() && self.is_valid_after(state, f, &border_moves) {
            return border_moves;
        }
        let mut candidates = self.candidate_moves(state, f);
        candidates.truncate(self.affordable_moves(state, f));
        let gains: Vec<f64> = candidates.par_iter().map(|m| self.gain(state, f, m)).collect();
        match gains.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)) {
            Some((k, gain)) if *gain > 0.0 => candidates.swap_remove(k),
            // No candidate reduces the error: all moves together.
            _ => candidates.into_iter().flatten().collect::<BTreeSet<Move>>().into_iter().collect(),
        }
    }

    /// True when face `f` has valid patches after these moves, or none before them.
    pub(super) fn is_valid_after(&self, state: &State, f: usize, moves: &[Move]) -> bool {
        let (mut minima, mut density) = (state.minima.clone(), state.density.clone());
        moves.iter().for_each(|&m| self.raise(state, f, m, &mut minima, &mut density));
        let after = self.evaluator.evaluate(f, &self.plan.agree(&minima), density[f]);
        self.error_ratio(f, &after).is_finite() || !state.error_ratios[f].is_finite()
    }

    /// Number of moves of face `f` that the remaining work allows, at least one.
    pub(super) fn affordable_moves(&self, state: &State, f: usize) -> usize {
        let each = 1 + state.faces[f].patches as u64;
        usize::try_from(self.evaluator.budget().remaining() / each).unwrap_or(usize::MAX).max(1)
    }

    /// Candidates of face `f`, each one or more moves. On a face that is not mapped these are the edges closest to the
    /// worst point, and those closest to the worst points of all patches above the tolerance together.
    pub(super) fn candidate_moves(&self, state: &State, f: usize) -> Vec<Vec<Move>> {
        let is_open = |&e: &usize| state.divisions.counts[e] < DIVISIONS_MAX;
        let chain = |e: usize| Move::Chain(self.plan.chains()[e]);
        let points = &state.faces[f].worst_points;
        let mut all: Vec<Vec<Move>> = Vec::new();
        let mut singles: BTreeSet<Move> = BTreeSet::new();
        if let (Some(worst), false) = (points.first(), state.divisions.mapped[f]) {
            // Other edges have little effect on the error there.
            let nearest = |(p, _): &(Vec3, f64)| self.nearest_edges(f, p, 1);
            let exceeding = |p: &&(Vec3, f64)| p.1 > self.goal.tol_mm * self.factors[f];
            let edges = points.iter().filter(exceeding).flat_map(nearest).filter(is_open);
            let together: BTreeSet<Move> = edges.map(chain).collect();
            if together.len() <= CANDIDATE_EDGES_MAX {
                let near = self.nearest_edges(f, &worst.0, CANDIDATE_EDGES_MAX);
                singles.extend(near.into_iter().filter(is_open).map(chain));
            }
            if together.len() > 1 {
                all.push(together.into_iter().collect());
            }
        } else {
            singles.extend(self.edges(f).filter(is_open).map(chain));
        }
        if self.divides_inside(state, f) && self.denser(state, f).is_some() {
            singles.insert(Move::Inside(f));
        }
        all.extend(singles.into_iter().map(|m| vec![m]));
        all
    }

    /// The `count` edges of face `f` closest to a point.
    pub(super) fn nearest_edges(&self, f: usize, place: &Vec3, count: usize) -> Vec<usize> {
        let distance = |e: usize| (self.distance_to_edge(e, place), e);
        let mut near: Vec<(f64, usize)> = self.edges(f).map(distance).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.dedup_by_key(|n| n.1);
        near.into_iter().take(count).map(|n| n.1).collect()
    }

    /// Distance of a point from an edge [mm].
    pub(super) fn distance_to_edge(&self, e: usize, place: &Vec3) -> f64 {
        let curve = &self.plan.model().edges[e].curve;
        (curve.point(curve.closest(place).0) - place).norm()
    }

    /// True when divisions inside face `f` are independent of its edges.
    pub(super) fn divides_inside(&self, state: &State, f: usize) -> bool {
        self.plan.divides_inside(f, state.divisions.mapped[f])
    }

    /// The next density inside face `f` that changes its mesh: the smallest of those in steps that double. A surface of little
    /// curvature has no interior nodes at small densities, and a flat none at any.
    pub(super) fn denser(&self, state: &State, f: usize) -> Option<usize> {
        self.evaluator.denser(f, &state.divisions, state.density[f], DIVISIONS_MAX)
    }

    /// Applies a move for face `f`: one more division, or more when its error is far above the tolerance.
    pub(super) fn raise(
        &self,
        state: &State,
        f: usize,
        m: Move,
        minima: &mut [usize],
        density: &mut [usize],
    ) {
        // The error decreases at best with the fourth power of the divisions. Half of that increase is made.
        let excess = self.excess(state, f);
        let increase =
            if excess.is_finite() { ((excess.powf(0.25) - 1.0) / 2.0).min(1.0) } else { 1.0 / 3.0 };
        let raised = |n: usize| {
            if excess > 4.0 { n + ((n as f64 * increase) as usize).max(1) } else { n + 1 }
        };
        match m {
            Move::Chain(c) => minima[c] = minima[c].max(raised(state.divisions.counts[c])),
            Move::Inside(f) => {
                let denser = self.denser(state, f).unwrap_or(state.density[f]);
                density[f] = density[f].max(denser).max(raised(state.density[f]));
            }
        }
    }

    /// Gain of some moves: reduction of the logarithm of the error of face `f` per added patch. Instead of that reduction,
    /// 1 counts for the first valid patches.
    pub(super) fn gain(&self, state: &State, f: usize, moves: &[Move]) -> f64 {
        let (mut minima, mut density) = (state.minima.clone(), state.density.clone());
        moves.iter().for_each(|&m| self.raise(state, f, m, &mut minima, &mut density));
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
    pub(super) fn cost(&self, state: &State, divisions: &Divisions) -> f64 {
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
