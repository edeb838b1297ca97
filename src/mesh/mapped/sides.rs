//! What a face is to the mesher: four sides, three sides, or anything else.

use std::f64::consts::FRAC_PI_2;

use super::sample::Lifted;
use crate::cad::model::{EdgeUse, Face, TrimLoop};
use crate::geometry::{Vec2, Vec3};

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
    let real: Vec<usize> =
        (0..outer.uses.len()).filter(|&k| !is_joint(face, &outer.uses[k])).collect();
    let count = real.len();
    let (mut starts, mut straight) = (Vec::new(), Vec::new());
    for k in 0..count {
        let turn = turn_between(face, outer, real[(k + count - 1) % count], real[k]);
        if turn < -CORNER {
            return Shape::Other;
        }
        if turn > CORNER {
            starts.push(k);
        } else if is_straight_corner(face, outer, real[(k + count - 1) % count], real[k]) {
            straight.push(k);
        }
    }
    if starts.len() + straight.len() == 4 {
        starts.extend(straight);
        starts.sort_unstable();
    }
    let side = |c: usize| -> Vec<usize> {
        let (from, to) = (starts[c], starts[(c + 1) % starts.len()]);
        let len = (to + count - from - 1) % count + 1;
        (0..len).map(|k| real[(from + k) % count]).collect()
    };
    match starts.len() {
        4 => Shape::Four([side(0), side(1), side(2), side(3)]),
        3 => Shape::Three([side(0), side(1), side(2)]),
        _ => Shape::Other,
    }
}

/// True for a use that only closes a gap between its neighbours: it is no side, not even a pole's. Its length in the
/// parameter plane is one of rounding, or it is short because the gap is, and not because the surface has no extent there.
pub fn is_joint(face: &Face, side: &EdgeUse) -> bool {
    const NONE: f64 = 1e-9;
    let [u, v] = face.surface.domain();
    let [a, b] = side.pcurve.domain();
    let start = side.pcurve.point(a);
    side.edge.is_none()
        && [0.5, 1.0].iter().all(|s| {
            let off = side.pcurve.point(a + (b - a) * s) - start;
            let rounding =
                off.x.abs() <= NONE * (u[1] - u[0]) && off.y.abs() <= NONE * (v[1] - v[0]);
            rounding || extends_along(face, start, off)
        })
}

/// True where the surface has an extent along `direction` at `uv`: at least a hundredth of what it has in the middle.
fn extends_along(face: &Face, uv: Vec2, direction: Vec2) -> bool {
    let speed = |uv: Vec2| {
        let d = face.surface.derivs(uv);
        (d.su * direction.x + d.sv * direction.y).norm()
    };
    let [u, v] = face.surface.domain();
    let middle = Vec2::new(0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1]));
    speed(uv).min(speed(uv + direction)) >= 0.01 * speed(middle)
}

/// Angle (rad) the loop turns by, to the left, from one use to the next; a quarter turn beside a pole.
fn turn_between(face: &Face, outer: &TrimLoop, before: usize, after: usize) -> f64 {
    let (before, after) = (&outer.uses[before], &outer.uses[after]);
    if before.edge.is_none() || after.edge.is_none() {
        return FRAC_PI_2;
    }
    let (before, after) = (Lifted::new(face, before), Lifted::new(face, after));
    let (into, out) = (before.end_tangent(true), after.end_tangent(false));
    let uv = after.uv(after.domain()[0]);
    let Some(normal) = face.surface.normal(uv) else { return FRAC_PI_2 };
    signed_angle(&into, &out, &normal)
}

/// Whether the loop has a corner in the parameter plane where it runs smoothly on in space: the surface's derivatives have
/// one direction there (the stem of a ship's bow runs on into its keel so).
fn is_straight_corner(face: &Face, outer: &TrimLoop, before: usize, after: usize) -> bool {
    let [before, after] = [before, after].map(|k| &outer.uses[k].pcurve);
    let (into, out) = (before.derivs(before.domain()[1]).d1, after.derivs(after.domain()[0]).d1);
    let uv = after.point(after.domain()[0]);
    let [u, v] = face.surface.domain();
    let size = Vec2::new(u[1] - u[0], v[1] - v[0]);
    let (into, out) = (into.component_div(&size), out.component_div(&size));
    into.perp(&out).atan2(into.dot(&out)) > CORNER && face.surface.has_degenerate_corner(uv)
}

/// Angle from `a` to `b` about `normal`, in (-pi, pi].
fn signed_angle(a: &Vec3, b: &Vec3, normal: &Vec3) -> f64 {
    normal.dot(&a.cross(b)).atan2(a.dot(b))
}
