//! Convex features of a tool that may lie between nodes: radii small compared with the elements, sharp edges,
//! corners, borders.
//!
//! A patch with a convex radius below [`SAMPLED_RADIUS_REL`] element lengths is sampled on a grid. Of other patches,
//! which the points of the faces detect, only the sides on the border of the tool and between patches with different
//! normals are sampled.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::numbers::tolerances::ACCURACY_REL;
use kanagata_contact::ToolSurface;
use kanagata_geometry::{Aabb, Vec3};
use kanagata_tool::Patch;

/// Convex radius over the element length below which a patch is sampled. A face of width w on a radius of 2 w
/// penetrates by w/16 at its middle. The points of the face find this depth to within a quarter, for any contact
/// point of the arc.
const SAMPLED_RADIUS_REL: f64 = 2.0;
/// Spacing of samples over the element length. Normals rotate between samples by no more than over this spacing on
/// the largest sampled radius. Samples find the depth of an arc to 0.2 % of its radius; half the spacing needs up to
/// four times as many points.
const SAMPLE_SPACING_REL: f64 = 0.25;
/// Maximum number of samples of a tool, 48 bytes each (24 MB); beyond, the spacing is increased.
const SAMPLES_MAX: f64 = 5e5;

/// Sample points with the normals of their patches, in the frame of the tool [mm].
#[derive(Debug, Clone, Default)]
pub(crate) struct Features {
    pub(crate) points: Vec<(Vec3, Vec3)>,
}

/// Sampling of a patch: numbers of intervals along its two parameters on a grid, or along its sides.
#[derive(Debug, Clone, Copy)]
struct Plan {
    patch: usize,
    grid: Option<[f64; 2]>,
    sides: [Option<f64>; 4],
}

impl Plan {
    fn count(&self) -> f64 {
        let sides: f64 = self.sides.iter().flatten().map(|n| n + 1.0).sum();
        self.grid.map_or(sides, |[n, m]| (n + 1.0) * (m + 1.0))
    }
}

impl Features {
    /// Features of the searchable part of a tool for elements at most `longest_edge` [mm] long.
    pub(crate) fn of(surface: &ToolSurface, longest_edge: f64) -> Self {
        let patches = &surface.model().patches;
        let searchable: Vec<bool> = surface.patch_bounds().iter().map(|b| !b.is_empty()).collect();
        let edges = sharp_sides(patches, &searchable, surface.bounds());
        let plan = |patch: usize| {
            searchable[patch].then(|| plan_of(patches, patch, &edges[patch], longest_edge))
        };
        let plans: Vec<Plan> = (0..patches.len()).into_par_iter().filter_map(plan).collect();
        let count: f64 = plans.iter().map(Plan::count).sum();
        let coarser = (count / SAMPLES_MAX).max(1.0);
        let points: Vec<Vec<(Vec3, Vec3)>> =
            plans.par_iter().map(|plan| sample(&patches[plan.patch], plan, coarser)).collect();
        Self { points: points.concat() }
    }
}

/// Parameters of corner `k` of a patch.
fn corner(patch: &Patch, k: usize) -> [f64; 2] {
    let all: &[[f64; 2]] = if patch.sides() == 3 {
        &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]
    } else {
        &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    };
    all[k % all.len()]
}

fn on_side(patch: &Patch, k: usize, t: f64) -> [f64; 2] {
    let (a, b) = (corner(patch, k), corner(patch, k + 1));
    [0, 1].map(|i| a[i] + (b[i] - a[i]) * t)
}

/// Sides of every patch on the border of the tool or at an edge, identified by their midpoints.
fn sharp_sides(patches: &[Patch], searchable: &[bool], bounds: Aabb) -> Vec<[bool; 4]> {
    // Cells of this size identify equal midpoints. A midpoint on the border of two cells gives one side too many.
    let cell = (ACCURACY_REL * bounds.diagonal()).max(f64::MIN_POSITIVE);
    let middle = |patch: usize, side: usize| {
        let [eta, zeta] = on_side(&patches[patch], side, 0.5);
        let x = patches[patch].derivs(eta, zeta).s;
        let normal = patches[patch].normal(eta, zeta).unwrap_or_default();
        ([0, 1, 2].map(|k| ((x[k] - bounds.min[k]) / cell).round() as i64), normal)
    };
    let mut found: HashMap<[i64; 3], Vec<(usize, usize, Vec3)>> = HashMap::new();
    for patch in (0..patches.len()).filter(|&patch| searchable[patch]) {
        for side in 0..patches[patch].sides() {
            let (key, normal) = middle(patch, side);
            found.entry(key).or_default().push((patch, side, normal));
        }
    }
    let mut out = vec![[false; 4]; patches.len()];
    for sides in found.values() {
        let smooth = sides.len() == 2 && sides[0].2.dot(&sides[1].2) > sample_angle().cos();
        sides.iter().for_each(|(patch, side, _)| out[*patch][*side] = !smooth);
    }
    out
}

/// Largest angle between the normals of two samples, and between those of two patches whose common side is no edge
/// [rad]: that of the spacing on the largest sampled radius.
fn sample_angle() -> f64 {
    SAMPLE_SPACING_REL / SAMPLED_RADIUS_REL
}

/// Number of sampling intervals for a line of the given length and rotation of the normal.
fn steps(length: f64, rotation: f64, longest_edge: f64) -> f64 {
    (length / (SAMPLE_SPACING_REL * longest_edge))
        .max(rotation / sample_angle())
        .ceil()
        .clamp(1.0, SAMPLES_MAX)
}

/// Length [mm] of a line between two parameters and rotation of the normal along it [rad], from three points.
fn extent(patch: &Patch, from: [f64; 2], to: [f64; 2]) -> (f64, f64) {
    let at = |t: f64| {
        let [eta, zeta] = [0, 1].map(|i| from[i] + (to[i] - from[i]) * t);
        (patch.derivs(eta, zeta).s, patch.normal(eta, zeta).unwrap_or_default())
    };
    let points = [0.0, 0.5, 1.0].map(at);
    let (mut length, mut rotation) = (0.0, 0.0);
    for pair in points.windows(2) {
        length += (pair[1].0 - pair[0].0).norm();
        rotation += pair[0].1.dot(&pair[1].1).clamp(-1.0, 1.0).acos();
    }
    (length, rotation)
}

/// Smallest convex radius of a patch at its corners, midpoints of sides and inside [mm].
fn convex_radius(patch: &Patch) -> f64 {
    let at = |k: usize| [0.0, 0.5, 1.0][k];
    let mut curvature: f64 = 0.0;
    for (eta, zeta) in (0..9).map(|k| (at(k / 3), at(k % 3))) {
        if patch.sides() == 3 && zeta > eta {
            continue;
        }
        let d = patch.derivs(eta, zeta);
        let Some(n) = d.normal(eta, zeta) else { continue };
        // Fundamental forms; the larger convex curvature from Gaussian and mean curvature.
        let (e, f, g) = (d.d1.norm_squared(), d.d1.dot(&d.d2), d.d2.norm_squared());
        let (l, m, r) = (-n.dot(&d.d11), -n.dot(&d.d12), -n.dot(&d.d22));
        let det = e * g - f * f;
        if det > 1e-12 * e * g {
            let mean = 0.5 * (e * r - 2.0 * f * m + g * l) / det;
            let gauss = (l * r - m * m) / det;
            curvature = curvature.max(mean + (mean * mean - gauss).max(0.0).sqrt());
        }
    }
    1.0 / curvature
}

fn plan_of(patches: &[Patch], patch: usize, edges: &[bool; 4], longest_edge: f64) -> Plan {
    let surface = &patches[patch];
    let along = |from: [f64; 2], to: [f64; 2]| {
        let (length, rotation) = extent(surface, from, to);
        steps(length, rotation, longest_edge)
    };
    let side = |k: usize| {
        (k < surface.sides() && edges[k])
            .then(|| along(on_side(surface, k, 0.0), on_side(surface, k, 1.0)))
    };
    let small = convex_radius(surface) < SAMPLED_RADIUS_REL * longest_edge;
    let grid = small.then(|| {
        let lines = [0.0, 0.5, 1.0];
        if surface.sides() == 3 {
            let all = (0..3).map(|k| along(on_side(surface, k, 0.0), on_side(surface, k, 1.0)));
            [all.fold(1.0, f64::max); 2]
        } else {
            [
                lines.map(|t| along([0.0, t], [1.0, t])).into_iter().fold(1.0, f64::max),
                lines.map(|t| along([t, 0.0], [t, 1.0])).into_iter().fold(1.0, f64::max),
            ]
        }
    });
    Plan { patch, grid, sides: [0, 1, 2, 3].map(side) }
}

fn sample(patch: &Patch, plan: &Plan, coarser: f64) -> Vec<(Vec3, Vec3)> {
    let point = |[eta, zeta]: [f64; 2]| {
        let normal = patch.normal(eta, zeta)?;
        let s = patch.derivs(eta, zeta).s;
        s.iter().all(|x| x.is_finite()).then_some((s, normal))
    };
    let Some(grid) = plan.grid else {
        let mut out = Vec::new();
        for (k, steps) in plan.sides.iter().enumerate() {
            let Some(steps) = steps else { continue };
            let n = (steps / coarser).ceil() as usize;
            out.extend((0..=n).filter_map(|i| point(on_side(patch, k, i as f64 / n as f64))));
        }
        return out;
    };
    let [n, m] = grid.map(|steps| (steps / coarser.sqrt()).ceil() as usize);
    let triangle = patch.sides() == 3;
    let places = (0..=n).flat_map(|i| (0..=m).map(move |j| (i, j)));
    places
        .filter(|(i, j)| !triangle || j <= i)
        .filter_map(|(i, j)| point([i as f64 / n as f64, j as f64 / m as f64]))
        .collect()
}
