//! How many divisions curvature and size ask of an edge.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

use super::options::MappedOptions;
use super::sample::{Lifted, Measured, angle};
use super::sides::Shape;
use crate::cad::Model;
use crate::cad::model::{Edge, Face, SurfaceKind};
use crate::geometry::{Vec2, Vec3};

/// Turns are rounded up to whole divisions only beyond this share of a division: noise of converters.
const SLACK: f64 = 0.02;
/// Lengths are right to this share.
const ROUNDING: f64 = 1e-6;
/// Angle at which faces meet in a crease, and turn of an edge that is curved [rad].
const CREASE: f64 = 0.01;
/// Most divisions one edge may be given.
const MOST: usize = 20_000;

/// Divisions for a curve of `length` (mm) that turns through `turn` (rad) (its own tangent or the normal).
pub fn divisions(options: &MappedOptions, turn: f64, length: f64) -> usize {
    let [by_turn, by_size, by_sag] = asked(options, turn, length);
    let by_size = by_size * (1.0 - ROUNDING);
    ((by_turn - SLACK).max(by_size).max(by_sag - SLACK).ceil().max(1.0) as usize).min(MOST)
}

/// What a part of a curve adds to its divisions.
pub fn shares(options: &MappedOptions, turn: f64, length: f64) -> f64 {
    asked(options, turn, length).into_iter().fold(0.0, f64::max)
}

/// Divisions by turn, by size and by sag.
fn asked(options: &MappedOptions, turn: f64, length: f64) -> [f64; 3] {
    let by_turn = turn / FRAC_PI_2 * options.arc_divisions as f64;
    let by_size = options.max_size.map_or(0.0, |size| length / size);
    // Sag of an arc: (length / n) (turn / n) / 8.
    let by_sag = options.chord_error.map_or(0.0, |sag| (length * turn / (8.0 * sag)).sqrt());
    [by_turn, by_size, by_sag]
}

/// Share of the largest size that inner sides are first asked to keep: triangles turn out half as long again as they are
/// asked, most of them; the others are halved.
pub const FIRST_SHARE: f64 = 1.0 / 1.5;

/// The share where triangles are to be split into quads with sides half as long, or are not.
pub fn first_share(halved: bool) -> f64 {
    if halved { 2.0 * FIRST_SHARE } else { FIRST_SHARE }
}

/// What every edge needs.
pub struct EdgeDemand {
    /// Least divisions from its own curve and the normals of the faces along it.
    pub minima: Vec<usize>,
    /// Least divisions without which its chords would fold onto each other, whatever the size asked.
    pub floors: Vec<usize>,
    /// Length (mm).
    pub lengths: Vec<f64>,
    /// Curved edges whose faces meet at an angle: the patches on both sides share a curve along it. Where they are
    /// tangent the normals say nothing of it, and Eq. 8 takes the chord.
    pub bent: Vec<bool>,
}

/// Measures every edge of the model.
pub fn edge_demand(model: &Model, options: &MappedOptions) -> EdgeDemand {
    use rayon::prelude::*;
    let found: Vec<(usize, f64, bool)> = model
        .edges
        .par_iter()
        .map(|edge| {
            let measured = Measured::new(&edge.curve);
            let mut turn = measured.turn();
            let bent = turn > CREASE && is_crease(model, edge);
            for &[f, l, k] in &edge.uses {
                let side = model.faces.get(f).and_then(|f| f.loops.get(l)?.uses.get(k));
                if let Some(side) = side {
                    turn = turn.max(Lifted::new(&model.faces[f], side).normal_turn());
                }
            }
            (divisions(options, turn, measured.length()), measured.length(), bent)
        })
        .collect();
    let lengths = found.iter().map(|f| f.1).collect();
    let bent = found.iter().map(|f| f.2).collect();
    let closed = |e: &Edge| e.vertices[0] == e.vertices[1];
    let mut floors: Vec<usize> =
        model.edges.iter().map(|e| if closed(e) { 3 } else { 1 }).collect();
    separate_twins(model, &mut floors);
    let minima = found.iter().zip(&floors).map(|(f, &floor)| f.0.max(floor)).collect();
    EdgeDemand { minima, floors, lengths, bent }
}

/// Edges between the same two vertices would share a chord: all but the shortest get a second division.
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
            let straight = Measured::new(&model.edges[e].curve).length() <= chord * (1.0 + 1e-9);
            if !straight {
                minima[e] = minima[e].max(2);
            }
        }
    }
}

/// Whether the faces of an edge meet at an angle in its middle.
pub fn is_crease(model: &Model, edge: &Edge) -> bool {
    let middle = |&[f, l, k]: &[usize; 3]| -> Option<Vec3> {
        let face = model.faces.get(f)?;
        let side = face.loops.get(l)?.uses.get(k)?;
        let lifted = Lifted::new(face, side);
        let [a, b] = lifted.domain();
        face.surface.normal(lifted.uv(0.5 * (a + b)))
    };
    let normals: Vec<Vec3> = edge.uses.iter().filter_map(middle).collect();
    // Faces may be turned either way.
    normals.windows(2).any(|w| w[0].cross(&w[1]).norm() > CREASE)
}

/// True when the normals of a face agree (to 1e-6 rad) over a grid on its surface.
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

/// Divisions the inside of a four-sided face asks along its first and its second pair of sides.
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

/// `n + 1` parameter points spread over the uses of a side.
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
