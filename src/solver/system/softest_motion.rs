//! Softest motion of the sheet at an unstable equilibrium, and the perturbation along it. Without a perturbation a
//! sheet as symmetric as its loads would stay in equilibrium, unlike a real one.

use std::time::Instant;

use nalgebra::{DMatrix, SymmetricEigen};

use super::damper::shares;
use super::system::System;
use crate::linear::pattern::Pattern;
use crate::numbers::tolerances::{ACCURACY_REL, NEGLIGIBLE_REL, ROUNDING_REL};
use crate::sheet::rigid_motions::take_free_motions;
use kanagata_geometry::Vec3;

/// Dimension of the subspace of inverse iteration: the number of simultaneously unstable motions
/// that are distinguished.
pub(crate) const SUBSPACE_SIZE: usize = 4;

/// Number of inverse iterations. Each reduces the part of a motion outside the subspace by the ratio of its stiffness
/// to those beyond; only the sign of the lowest stiffness and the shape of its motion are needed, to about a per cent.
const INVERSE_ITERATIONS: usize = 8;

/// Largest nodal displacement of the perturbation over the thickness: far above rounding, and far below the
/// motion that follows, which is of the order of the thickness.
const PUSH_DISPLACEMENT_REL: f64 = 0.01;

/// Minimum fraction of deformation in a motion that is not rigid. Half a wave has 0.19, a rigid
/// motion none; half of the former lies between both.
const BENDING_SHARE_MIN: f64 = 0.1;

/// Perturbation along the softest motion.
#[derive(Debug, Clone)]
pub(crate) struct Push {
    /// Forces, three for each node [N].
    pub(crate) forces: Vec<f64>,
    /// Mean damper stiffness at which the motion neither grows nor decays [N/mm].
    pub(crate) stiffness: f64,
}

impl System {
    /// Perturbation along the softest motion at the last evaluated equilibrium, if its stiffness is negative. The
    /// motion is the lowest eigenvector of the projected tangent, by inverse iteration. Its sign is such that the
    /// first of the nodes with the largest displacement moves towards the top of the sheet. Overwrites the factors.
    pub(crate) fn push(&mut self) -> Option<Push> {
        if !self.body.is_symmetric() {
            return None;
        }
        let start = Instant::now();
        let found = self.softest_motion();
        self.timings.stability += start.elapsed().as_secs_f64();
        let (stiffness, mode) = found?;
        (stiffness < 0.0 && !self.glides_along(&mode)).then(|| self.push_along(mode, -stiffness))
    }

    /// Whether a motion is a rigid motion of the sheet along tools that do not hold it: the sheet may slide, but does
    /// not buckle.
    fn glides_along(&self, mode: &[f64]) -> bool {
        let mut touching = self.conditions.iter().filter(|c| c.candidate.is_some()).peekable();
        if touching.peek().is_none() || touching.any(|c| c.stuck) {
            return false;
        }
        let mut mode = mode.to_vec();
        self.body.mesh().set_means(&mut mode);
        let mut bends = mode.clone();
        take_free_motions(&self.constraints, &self.positions(), std::iter::empty(), &mut bends);
        dot(&bends, &bends) < BENDING_SHARE_MIN * dot(&mode, &mode)
    }

    /// Softest motion of unit length in the norm of the masses, with its stiffness [N/mm].
    fn softest_motion(&mut self) -> Option<(f64, Vec<f64>)> {
        self.soft_motions()?.into_iter().next()
    }

    /// Whether all motions of negative stiffness are resisted by friction, or are rigid sliding of a sheet loaded
    /// only by tools, which costs nothing. The negative stiffness of sliding is due to contact at nodes, which move
    /// along curved tools while the point of contact stays. Overwrites the matrix.
    pub(crate) fn tools_resist(&mut self) -> bool {
        if !self.conditions.iter().any(|c| c.candidate.is_some()) {
            return false;
        }
        let slipping = self.slipping();
        let unloaded = self.applied.iter().all(|force| *force == 0.0);
        let Some(motions) = self.soft_motions() else { return false };
        let amplitude = PUSH_DISPLACEMENT_REL * self.body.mesh().mean_thickness();
        motions.iter().filter(|(stiffness, _)| *stiffness < 0.0).all(|(stiffness, mode)| {
            let size = amplitude / largest_of(mode);
            friction_work(&slipping, mode, size) > 0.5 * stiffness.abs() * size * size
                || unloaded && self.glides_along(mode)
        })
    }

    /// Slipping nodes and the friction force on each [N].
    fn slipping(&self) -> Vec<(usize, Vec3)> {
        let slips = self.conditions.iter().filter(|c| c.candidate.is_some() && c.slipping);
        slips
            .map(|c| {
                let free = self.constraints.free_projector(c.node);
                let force = free * self.force_at(c.node);
                (c.node, force - c.normal * c.normal.dot(&force))
            })
            .collect()
    }

    /// Softest motions in ascending order, each of unit length, with their stiffnesses [N/mm].
    fn soft_motions(&mut self) -> Option<Vec<(f64, Vec<f64>)>> {
        self.project_tangent();
        let masses = shares(&self.body);
        let shift = self.make_definite(&masses)?;
        let mut motions: Vec<Vec<f64>> =
            (0..SUBSPACE_SIZE).map(|seed| disorder(self.u.len(), seed as u64)).collect();
        for _ in 0..INVERSE_ITERATIONS {
            // Solutions far larger than the sheet are rejected as those of a singular matrix. So far below the right-hand
            // sides that preserve the length of the motions, none is.
            motions.iter_mut().for_each(|motion| weigh(motion, &masses, ACCURACY_REL * shift));
            self.solver.solve_symmetric(&self.matrix.values, &mut motions).ok()?;
            orthonormalise(&mut motions, &masses);
        }
        let mut found = eigenmotions(self.body.pattern(), &self.matrix.values, &motions)?;
        found.iter_mut().for_each(|(stiffness, _)| *stiffness -= shift);
        Some(found)
    }

    /// Adds the masses to the matrix, times the smallest power of ten of a stiffness [N/mm] for which it is positive
    /// definite, from rounding on. Inverse iteration then converges to the softest motion.
    fn make_definite(&mut self, masses: &[f64]) -> Option<f64> {
        let mut shift = 0.0;
        for power in ROUNDING_REL.log10().round() as i32..=0 {
            let more = self.scales.normal * 10f64.powi(power) - shift;
            let pattern = self.body.pattern();
            for unknown in 0..pattern.dim() {
                let place = pattern.position(unknown, unknown)?;
                self.matrix.values[place] += more * masses[unknown / 3];
            }
            shift += more;
            if self.solver.is_definite(&self.matrix.values) {
                return Some(shift);
            }
        }
        None
    }

    fn push_along(&self, mut mode: Vec<f64>, stiffness: f64) -> Push {
        let largest = largest_of(&mode);
        let mut ways = mode.chunks_exact(3).map(Vec3::from_column_slice);
        let first =
            ways.position(|way| way.norm() > (1.0 - NEGLIGIBLE_REL) * largest).unwrap_or_default();
        let up = self.across(first).dot(&Vec3::from_column_slice(&mode[3 * first..3 * first + 3]));
        let way = PUSH_DISPLACEMENT_REL * self.body.mesh().mean_thickness();
        let factor = if up < 0.0 { -1.0 } else { 1.0 } * way * stiffness / largest;
        weigh(&mut mode, &shares(&self.body), factor);
        Push { forces: mode, stiffness }
    }

    /// Vector through the sheet at a node, from bottom to top [mm]; zero without columns.
    fn across(&self, node: usize) -> Vec3 {
        let levels = self.body.mesh().nodes_per_column.max(1);
        let bottom = node / levels * levels;
        self.position(bottom + levels - 1) - self.position(bottom)
    }
}

fn largest_of(mode: &[f64]) -> f64 {
    let ways = mode.chunks_exact(3).map(Vec3::from_column_slice);
    ways.map(|way| way.norm()).fold(f64::MIN_POSITIVE, f64::max)
}

/// Work of friction at slipping nodes in a motion of this size [N mm]. A motion against the slip reverses the
/// friction force t and costs the first-order work `2 t . u`, while the motion u releases the second-order work
/// `|k| / 2`. Both directions of the motion must be resisted, so the smaller work counts. It is compared at the
/// amplitude of the perturbation: a sheet that does not leave its equilibrium then does not buckle.
fn friction_work(slipping: &[(usize, Vec3)], mode: &[f64], size: f64) -> f64 {
    let work = |sign: f64| -> f64 {
        let of = |(node, friction): &(usize, Vec3)| {
            let way = Vec3::from_column_slice(&mode[3 * node..3 * node + 3]);
            (2.0 * sign * size * way.dot(friction)).max(0.0)
        };
        slipping.iter().map(of).sum()
    };
    work(1.0).min(work(-1.0))
}

/// Deterministic pseudo-random numbers between -1 and 1, so that no motion is orthogonal to all start vectors.
fn disorder(count: usize, seed: u64) -> Vec<f64> {
    let mut state = seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    (0..count).map(|_| next()).collect()
}

fn weigh(motion: &mut [f64], masses: &[f64], factor: f64) {
    motion.iter_mut().enumerate().for_each(|(i, x)| *x *= factor * masses[i / 3]);
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn add(to: &mut [f64], factor: f64, what: &[f64]) {
    to.iter_mut().zip(what).for_each(|(to, x)| *to += factor * x);
}

/// Gram-Schmidt orthonormalisation in the norm of the masses, applied twice.
fn orthonormalise(motions: &mut [Vec<f64>], masses: &[f64]) {
    for k in 0..motions.len() {
        let (before, rest) = motions.split_at_mut(k);
        let motion = &mut rest[0];
        for _ in 0..2 {
            for other in before.iter() {
                let weighed = motion.iter().enumerate().map(|(i, x)| masses[i / 3] * x * other[i]);
                let share: f64 = weighed.sum();
                add(motion, -share, other);
            }
        }
        let square: f64 = motion.iter().enumerate().map(|(i, x)| masses[i / 3] * x * x).sum();
        let length = square.sqrt().max(f64::MIN_POSITIVE);
        motion.iter_mut().for_each(|x| *x /= length);
    }
}

/// Ritz vectors in the span of the motions and their stiffnesses, ascending; `None` if rounding leaves none.
fn eigenmotions(
    pattern: &Pattern,
    values: &[f64],
    motions: &[Vec<f64>],
) -> Option<Vec<(f64, Vec<f64>)>> {
    let products: Vec<Vec<f64>> = motions.iter().map(|x| pattern.times(values, x)).collect();
    let of = |i: usize, j: usize| {
        0.5 * (dot(&motions[i], &products[j]) + dot(&motions[j], &products[i]))
    };
    let reduced = DMatrix::from_fn(motions.len(), motions.len(), of);
    if !reduced.iter().all(|x| x.is_finite()) {
        return None;
    }
    let found = SymmetricEigen::new(reduced);
    let mut order: Vec<usize> = (0..motions.len()).collect();
    order.sort_by(|&a, &b| found.eigenvalues[a].total_cmp(&found.eigenvalues[b]));
    let motion = |of: usize| {
        let mut mode = vec![0.0; motions[0].len()];
        let parts = motions.iter().enumerate();
        parts.for_each(|(k, x)| add(&mut mode, found.eigenvectors[(k, of)], x));
        (found.eigenvalues[of], mode)
    };
    Some(order.into_iter().map(motion).collect())
}
