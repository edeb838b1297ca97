//! Creases inside faces: lines of one parameter along which a spline with as many equal knots as its degree has another
//! tangent plane on either side. The face is cut there: on a crease no surface has one normal, and patches across it
//! fold or miss it however fine they are.

mod split;
#[cfg(test)]
mod tests;

use self::split::Line;
use super::loops::Side;
use crate::geometry::Vec2;
use crate::geometry::nurbs::Surface;

/// Normals on both sides of a line that differ somewhere by more make it a crease [rad]: 10 degrees.
const CREASE: f64 = std::f64::consts::PI / 18.0;
/// Lines of control points that turn by less at equal knots have no crease there [rad].
const SMOOTH: f64 = 1e-3;
/// Places along a line inside a face at which its sides are compared.
const PLACES: usize = 32;
/// Faces that one may be cut into: more creases than that are facets, which stay together.
const MOST: usize = 16;

/// A face's surface with its loops in the surface's parameters, the outer one first.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub surface: Surface,
    pub loops: Vec<Vec<Side>>,
}

/// A line along which a face was cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crease {
    /// 0: u, 1: v.
    pub axis: usize,
    /// Value of that parameter.
    pub at: f64,
    /// Largest angle between the normals on both sides [rad].
    pub angle: f64,
}

/// A face cut at its creases, and these; `tolerance`: what counts as touching [mm].
pub(super) fn cut(whole: Part, tolerance: f64) -> (Vec<Part>, Vec<Crease>) {
    let lines = bent_lines(&whole.surface);
    if lines.is_empty() {
        return (vec![whole], Vec::new());
    }
    let (mut parts, mut creases) = (vec![whole.clone()], Vec::new());
    for (axis, at) in lines {
        let mut angle = 0.0f64;
        let mut next = Vec::new();
        for part in parts {
            match part.cut(axis, at, tolerance) {
                Some((halves, found)) => {
                    angle = angle.max(found);
                    next.extend(halves);
                }
                None => next.push(part),
            }
        }
        if next.len() > MOST {
            return (vec![whole], Vec::new());
        }
        if angle > 0.0 {
            creases.push(Crease { axis, at, angle });
        }
        parts = next;
    }
    (parts, creases)
}

/// Parameters inside the domain at which a line of control points has a corner.
fn bent_lines(surface: &Surface) -> Vec<(usize, f64)> {
    let mut lines = Vec::new();
    for axis in 0..2 {
        let (p, knots, [low, high]) =
            (surface.degrees()[axis], surface.knots()[axis], surface.domain()[axis]);
        let mut first = 0;
        for group in knots.chunk_by(|a, b| a == b) {
            let (begin, last) = (first, first + group.len() - 1);
            first += group.len();
            let inside = group[0] > low && group[0] < high;
            if inside && group.len() >= p && is_bent(surface, axis, [begin - 1, last - p]) {
                lines.push((axis, group[0]));
            }
        }
    }
    lines
}

/// Whether the control points before and behind those of a line (of these numbers, equal where the surface does not tear)
/// lie off its tangent.
fn is_bent(surface: &Surface, axis: usize, [begin, end]: [usize; 2]) -> bool {
    let count = surface.count();
    let stride = [count[1], 1];
    (0..count[1 - axis]).any(|j| {
        let at = |i: usize| surface.points()[i * stride[axis] + j * stride[1 - axis]];
        let (before, behind) = (at(begin) - at(begin - 1), at(end + 1) - at(end));
        let sine = before.cross(&behind).norm();
        sine > SMOOTH * before.norm() * behind.norm() || before.dot(&behind) < 0.0
    })
}

impl Part {
    /// Cut along a line of one parameter, with the largest angle between the normals on both sides [rad]; `None` where
    /// that is no crease inside the face, or cannot be cut cleanly.
    fn cut(&self, axis: usize, at: f64, tolerance: f64) -> Option<(Vec<Self>, f64)> {
        let [low, high] = self.surface.domain()[axis];
        if at <= low || at >= high {
            return None;
        }
        let line = Line { surface: &self.surface, axis, at, tolerance };
        let halves = line.split(&self.loops)?;
        let angle = halves.inside.iter().map(|r| self.angle(axis, at, *r)).fold(0.0, f64::max);
        if angle <= CREASE {
            return None;
        }
        let mut parts = Vec::new();
        for (range, faces) in [([low, at], halves.lower), ([at, high], halves.upper)] {
            let mut ranges = self.surface.domain();
            ranges[axis] = range;
            let surface = self.surface.trimmed(ranges[0], ranges[1]).ok()?;
            parts.extend(faces.into_iter().map(|loops| Self { surface: surface.clone(), loops }));
        }
        Some((parts, angle))
    }

    /// Largest angle between the normals on both sides of a piece of a line [rad].
    fn angle(&self, axis: usize, at: f64, [from, to]: [f64; 2]) -> f64 {
        let normal = |at: f64, k: usize| {
            let along = from + (to - from) * (k as f64 + 0.5) / PLACES as f64;
            let uv = if axis == 0 { Vec2::new(at, along) } else { Vec2::new(along, at) };
            self.surface.normal(uv)
        };
        let turn = |k: usize| {
            let (a, b) = (normal(at.next_down(), k)?, normal(at, k)?);
            Some(a.cross(&b).norm().atan2(a.dot(&b)))
        };
        (0..PLACES).filter_map(turn).fold(0.0, f64::max)
    }
}
