//! Classification of faces: four sides, three sides, or other.

use std::f64::consts::FRAC_PI_2;

use super::sample::Lifted;
use kanagata_cad::model::{EdgeUse, Face, TrimLoop};
use kanagata_geometry::{Vec2, Vec3};

/// Turning angle at a joint above which it is a corner, and below which it continues a side [rad].
const CORNER_ANGLE_MIN_RAD: f64 = 40.0 * std::f64::consts::PI / 180.0;

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
        if turn < -CORNER_ANGLE_MIN_RAD {
            return Shape::Other;
        }
        if turn > CORNER_ANGLE_MIN_RAD {
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

/// True for a use that only closes a gap between its neighbours and is neither a side nor a pole. It is short in the
/// parameter plane to within rounding, or short because of the gap, and not because the surface is degenerate.
pub fn is_joint(face: &Face, side: &EdgeUse) -> bool {
    const ZERO_LENGTH_REL: f64 = 1e-9;
    let [u, v] = face.surface.domain();
    let [a, b] = side.pcurve.domain();
    let start = side.pcurve.point(a);
    side.edge.is_none()
        && [0.5, 1.0].iter().all(|s| {
            let off = side.pcurve.point(a + (b - a) * s) - start;
            let rounding = off.x.abs() <= ZERO_LENGTH_REL * (u[1] - u[0])
                && off.y.abs() <= ZERO_LENGTH_REL * (v[1] - v[0]);
            rounding || extends_along(face, start, off)
        })
}

/// True where the derivative of the surface along `direction` at `uv` is at least 1 % of that in the middle.
fn extends_along(face: &Face, uv: Vec2, direction: Vec2) -> bool {
    let speed = |uv: Vec2| {
        let d = face.surface.derivs(uv);
        (d.su * direction.x + d.sv * direction.y).norm()
    };
    let [u, v] = face.surface.domain();
    let middle = Vec2::new(0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1]));
    speed(uv).min(speed(uv + direction)) >= 0.01 * speed(middle)
}

/// Turning angle [rad] of the loop from one use to the next, positive to the left; a quarter turn at a pole.
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

/// True where the loop has a corner in the parameter plane but is smooth in space, because the derivatives of the
/// surface are parallel (the stem and keel of a ship's bow).
fn is_straight_corner(face: &Face, outer: &TrimLoop, before: usize, after: usize) -> bool {
    let [before, after] = [before, after].map(|k| &outer.uses[k].pcurve);
    let (into, out) = (before.derivs(before.domain()[1]).d1, after.derivs(after.domain()[0]).d1);
    let uv = after.point(after.domain()[0]);
    let [u, v] = face.surface.domain();
    let size = Vec2::new(u[1] - u[0], v[1] - v[0]);
    let (into, out) = (into.component_div(&size), out.component_div(&size));
    into.perp(&out).atan2(into.dot(&out)) > CORNER_ANGLE_MIN_RAD
        && face.surface.has_degenerate_corner(uv)
}

/// Angle from `a` to `b` about `normal`, in (-pi, pi].
fn signed_angle(a: &Vec3, b: &Vec3, normal: &Vec3) -> f64 {
    normal.dot(&a.cross(b)).atan2(a.dot(b))
}
