//! Divisions of an edge required by curvature and element size.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

use super::options::MappedOptions;
use super::sample::{Lifted, MeasuredCurve, angle};
use super::sides::Shape;
use kanagata_cad::Model;
use kanagata_cad::model::{Edge, Face, SurfaceKind};
use kanagata_geometry::{Vec2, Vec3};

/// Fraction of a division that is not rounded up: noise of CAD converters.
const ROUNDING_DIVISIONS: f64 = 0.02;
/// Relative accuracy of lengths.
const LENGTH_ROUNDING_REL: f64 = 1e-6;
/// Angle between adjacent faces at a crease, and turning angle of a curved edge [rad].
const CREASE_ANGLE_MIN_RAD: f64 = 0.01;
/// Maximum number of divisions of an edge.
const DIVISIONS_MAX: usize = 20_000;

/// Divisions of a curve of `length` [mm] and turning angle `turn` [rad] of its tangent or of the surface normal.
pub fn divisions(options: &MappedOptions, turn: f64, length: f64) -> usize {
    let [by_turn, by_size, by_sag] = required_divisions(options, turn, length);
    let by_size = by_size * (1.0 - LENGTH_ROUNDING_REL);
    ((by_turn - ROUNDING_DIVISIONS).max(by_size).max(by_sag - ROUNDING_DIVISIONS).ceil().max(1.0)
        as usize)
        .min(DIVISIONS_MAX)
}

/// Contribution of a part of a curve to its divisions.
pub fn fractional_divisions(options: &MappedOptions, turn: f64, length: f64) -> f64 {
    required_divisions(options, turn, length).into_iter().fold(0.0, f64::max)
}

/// Divisions by turning angle, by size and by chord error.
fn required_divisions(options: &MappedOptions, turn: f64, length: f64) -> [f64; 3] {
    let by_turn = turn / FRAC_PI_2 * options.arc_divisions as f64;
    let by_size = options.max_size.map_or(0.0, |size| length / size);
    // Sagitta of an arc: (length / n) (turn / n) / 8.
    let by_sag = options.chord_error.map_or(0.0, |sag| (length * turn / (8.0 * sag)).sqrt());
    [by_turn, by_size, by_sag]
}

/// Initial target length of interior sides relative to the largest size: most triangle sides become up to 1.5 times
/// longer than the target; the others are bisected.
pub const INITIAL_SIZE_RATIO: f64 = 1.0 / 1.5;

/// The initial ratio, where triangles are split into quadrilaterals with sides of half the length (`halved`) or not.
pub fn initial_size_ratio(halved: bool) -> f64 {
    if halved { 2.0 * INITIAL_SIZE_RATIO } else { INITIAL_SIZE_RATIO }
}

/// Division requirements of all edges.
pub struct EdgeDemand {
    /// Minimum divisions from the edge's own curve and the normals of the faces along it.
    pub minima: Vec<usize>,
    /// Minimum divisions that keep its chords from coinciding, for any size.
    pub floors: Vec<usize>,
    /// Lengths [mm].
    pub lengths: Vec<f64>,
    /// Curved edges between faces at an angle: the patches on both sides have a common curve along them. On tangent
    /// faces the normals do not determine it, and Eq. 8 uses the chord.
    pub curved: Vec<bool>,
}

/// Determines the requirements of every edge of the model.
pub fn edge_demand(model: &Model, options: &MappedOptions) -> EdgeDemand {
    use rayon::prelude::*;
    let found: Vec<(usize, f64, bool)> = model
        .edges
        .par_iter()
        .map(|edge| {
            let measured = MeasuredCurve::new(&edge.curve);
            let mut turn = measured.turn();
            let curved = turn > CREASE_ANGLE_MIN_RAD && is_crease(model, edge);
            for &[f, l, k] in &edge.uses {
                let side = model.faces.get(f).and_then(|f| f.loops.get(l)?.uses.get(k));
                if let Some(side) = side {
                    turn = turn.max(Lifted::new(&model.faces[f], side).normal_turn());
                }
            }
            (divisions(options, turn, measured.length()), measured.length(), curved)
        })
        .collect();
    let lengths = found.iter().map(|f| f.1).collect();
    let curved = found.iter().map(|f| f.2).collect();
    let closed = |e: &Edge| e.vertices[0] == e.vertices[1];
    let mut floors: Vec<usize> =
        model.edges.iter().map(|e| if closed(e) { 3 } else { 1 }).collect();
    separate_twins(model, &mut floors);
    let minima = found.iter().zip(&floors).map(|(f, &floor)| f.0.max(floor)).collect();
    EdgeDemand { minima, floors, lengths, curved }
}

/// Edges between the same two vertices would have a common chord: all except the shortest get a second division.
fn separate_twins(model: &Model, minima: &mut [usize]) {
    let mut twins: BTreeMap<[usize; 2], Vec<usize>> = BTreeMap::new();
    for (e, edge) in model.edges.iter().enumerate() {
        let [a, b] = edge.vertices;
        twins.entry([a.min(b), a.max(b)]).or_default().push(e);
    }
    for group in twins.values().filter(|g| g.len() > 1) {
        for &e in group {
            let chord = (model.vertices[model.edges[e].vertices[0]]
                - model.vertices[model.edges[e].vertices[1]])
                .norm();
            let straight =
                MeasuredCurve::new(&model.edges[e].curve).length() <= chord * (1.0 + 1e-9);
            if !straight {
                minima[e] = minima[e].max(2);
            }
        }
    }
}

/// True when the faces of an edge meet at an angle at its middle.
pub fn is_crease(model: &Model, edge: &Edge) -> bool {
    let middle = |&[f, l, k]: &[usize; 3]| -> Option<Vec3> {
        let face = model.faces.get(f)?;
        let side = face.loops.get(l)?.uses.get(k)?;
        let lifted = Lifted::new(face, side);
        let [a, b] = lifted.domain();
        face.surface.normal(lifted.uv(0.5 * (a + b)))
    };
    let normals: Vec<Vec3> = edge.uses.iter().filter_map(middle).collect();
    // Faces may have either orientation.
    normals.windows(2).any(|w| w[0].cross(&w[1]).norm() > CREASE_ANGLE_MIN_RAD)
}

/// True when the normals of a face agree (to 1e-6 rad) on a grid over its surface.
pub fn is_flat(face: &Face) -> bool {
    if face.kind == SurfaceKind::Plane {
        return true;
    }
    const N: usize = 6;
    let [[u0, u1], [v0, v1]] = face.surface.domain();
    let mut first: Option<Vec3> = None;
    for k in 0..N * N {
        let (i, j) = ((k / N) as f64 / (N - 1) as f64, (k % N) as f64 / (N - 1) as f64);
        let uv = Vec2::new(u0 + (u1 - u0) * i, v0 + (v1 - v0) * j);
        let Some(normal) = face.surface.normal(uv) else { return false };
        if angle(first.get_or_insert(normal), &normal) > 1e-6 {
            return false;
        }
    }
    true
}

/// Divisions required inside a four-sided face along its first and second pair of sides.
pub fn inside_demand(face: &Face, shape: &Shape, options: &MappedOptions) -> [usize; 2] {
    const N: usize = 8;
    let Shape::Four(sides) = shape else { return [1, 1] };
    let line: Vec<Vec<Vec2>> = sides.iter().map(|s| side_points(face, s, N)).collect();
    let mut grid = vec![[None, None]; (N + 1) * (N + 1)];
    for i in 0..=N {
        for j in 0..=N {
            let (x, y) = (i as f64 / N as f64, j as f64 / N as f64);
            let (b, t) = (line[0][i], line[2][N - i]);
            let (r, l) = (line[1][j], line[3][N - j]);
            let corners = (line[0][0] * (1.0 - x) + line[0][N] * x) * (1.0 - y)
                + (line[2][N] * (1.0 - x) + line[2][0] * x) * y;
            let uv = b * (1.0 - y) + t * y + l * (1.0 - x) + r * x - corners;
            let point = face.surface.point(uv);
            grid[i * (N + 1) + j] = [Some(point), face.surface.normal(uv)];
        }
    }
    let run = |index: &dyn Fn(usize) -> usize| {
        let points: Vec<Vec3> = (0..=N).filter_map(|k| grid[index(k)][0]).collect();
        let normals: Vec<Vec3> = (0..=N).filter_map(|k| grid[index(k)][1]).collect();
        let turn = normals.windows(2).map(|w| angle(&w[0], &w[1])).sum();
        divisions(options, turn, points.windows(2).map(|w| (w[1] - w[0]).norm()).sum())
    };
    let along = (0..=N).map(|j| run(&|i| i * (N + 1) + j)).max().unwrap_or(1);
    let across = (0..=N).map(|i| run(&|j| i * (N + 1) + j)).max().unwrap_or(1);
    [along, across]
}

/// `n + 1` parameter points distributed over the uses of a side.
fn side_points(face: &Face, side: &[usize], n: usize) -> Vec<Vec2> {
    (0..=n)
        .map(|k| {
            let s = k as f64 / n as f64 * side.len() as f64;
            let which = (s.floor() as usize).min(side.len() - 1);
            let lifted = Lifted::new(face, &face.loops[0].uses[side[which]]);
            let [t0, t1] = lifted.domain();
            lifted.uv(t0 + (t1 - t0) * (s - which as f64))
        })
        .collect()
}
