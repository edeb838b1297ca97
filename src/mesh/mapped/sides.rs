//! What a face is to the mesher: four sides, three sides, or anything else.

use std::f64::consts::FRAC_PI_2;

use super::sample::Lifted;
use crate::cad::model::{Face, TrimLoop};
use crate::geometry::Vec3;

/// A joint that turns less than this (rad) continues a side; one that turns more is a corner.
const CORNER: f64 = 40.0 * std::f64::consts::PI / 180.0;

/// Outer loop of a face grouped into sides between corners, as positions in the loop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Shape {
    /// Four corners, all convex, no holes.
    Four([Vec<usize>; 4]),
    /// Three corners, all convex, no holes.
    Three([Vec<usize>; 3]),
    /// Anything else.
    Other,
}

/// Groups the outer loop of `face` into sides.
pub fn shape(face: &Face) -> Shape {
    let [outer] = &face.loops[..] else { return Shape::Other };
    let count = outer.uses.len();
    let mut starts = Vec::new();
    for k in 0..count {
        let turn = turn_before(face, outer, k);
        if turn < -CORNER {
            return Shape::Other;
        }
        if turn > CORNER {
            starts.push(k);
        }
    }
    let side = |c: usize| -> Vec<usize> {
        let (from, to) = (starts[c], starts[(c + 1) % starts.len()]);
        let len = (to + count - from - 1) % count + 1;
        (0..len).map(|k| (from + k) % count).collect()
    };
    match starts.len() {
        4 => Shape::Four([side(0), side(1), side(2), side(3)]),
        3 => Shape::Three([side(0), side(1), side(2)]),
        _ => Shape::Other,
    }
}

/// Angle (rad) the loop turns by, to the left, where edge `k` begins; a quarter turn beside a pole.
fn turn_before(face: &Face, outer: &TrimLoop, k: usize) -> f64 {
    let count = outer.uses.len();
    let (before, after) = (&outer.uses[(k + count - 1) % count], &outer.uses[k]);
    if before.edge.is_none() || after.edge.is_none() {
        return FRAC_PI_2;
    }
    let (before, after) = (Lifted::new(face, before), Lifted::new(face, after));
    let (into, out) = (before.end_tangent(true), after.end_tangent(false));
    let uv = after.uv(after.domain()[0]);
    let Some(normal) = face.surface.normal(uv) else { return FRAC_PI_2 };
    signed_angle(&into, &out, &normal)
}

/// Angle from `a` to `b` about `normal`, in (-pi, pi].
fn signed_angle(a: &Vec3, b: &Vec3, normal: &Vec3) -> f64 {
    normal.dot(&a.cross(b)).atan2(a.dot(b))
}
