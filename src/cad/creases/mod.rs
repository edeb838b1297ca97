//! Creases inside faces: knot lines of full multiplicity (equal knots as many as the degree) across which the tangent
//! plane is discontinuous. Faces are split along them, because no smooth patch can cross a crease.

mod split;
#[cfg(test)]
mod tests;

use self::split::Line;
pub(super) use self::split::faces as nested_faces;
use super::loops::Side;
use kanagata_geometry::Vec2;
use kanagata_geometry::nurbs::Surface;

/// Angle between the normals on both sides of a knot line above which it is a crease [rad]: 10 degrees. Doubled: softer
/// creases remain inside a face.
const CREASE_ANGLE_MIN_RAD: f64 = std::f64::consts::PI / 18.0;
/// Kink of the control polygon at multiple knots below which the line is smooth [rad].
const KINK_ANGLE_MIN_RAD: f64 = 1e-3;
/// Number of points along a knot line at which the normals on both sides are compared.
const ANGLE_SAMPLES: usize = 32;
/// Maximum number of parts of a face. A face with more creases is faceted and is not split.
const PARTS_MAX: usize = 16;

/// A surface with its loops in the surface's parameters, outer loop first.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub surface: Surface,
    pub loops: Vec<Vec<Side>>,
}

/// A crease along which a face is split.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crease {
    /// Index of the constant parameter: 0 for u, 1 for v.
    pub axis: usize,
    /// Value of the constant parameter.
    pub at: f64,
    /// Largest angle between the normals on both sides [rad].
    pub angle: f64,
}

/// Splits a face along its creases and returns parts and creases. Points within `tolerance` [mm] coincide.
pub(super) fn cut(whole: Part, tolerance: f64) -> (Vec<Part>, Vec<Crease>) {
    let lines = kink_lines(&whole.surface);
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
        if next.len() > PARTS_MAX {
            return (vec![whole], Vec::new());
        }
        if angle > 0.0 {
            creases.push(Crease { axis, at, angle });
        }
        parts = next;
    }
    (parts, creases)
}

/// Interior knot lines (axis, parameter) at which a row of control points has a kink.
fn kink_lines(surface: &Surface) -> Vec<(usize, f64)> {
    let mut lines = Vec::new();
    for axis in 0..2 {
        let (p, knots, [low, high]) =
            (surface.degrees()[axis], surface.knots()[axis], surface.domain()[axis]);
        let mut first = 0;
        for group in knots.chunk_by(|a, b| a == b) {
            let (begin, last) = (first, first + group.len() - 1);
            first += group.len();
            let inside = group[0] > low && group[0] < high;
            if inside && group.len() >= p && has_kink(surface, axis, [begin - 1, last - p]) {
                lines.push((axis, group[0]));
            }
        }
    }
    lines
}

/// True when the control points before and after a knot line are not collinear with it. `begin` and `end` are the
/// indices of its control points, equal for a continuous surface.
fn has_kink(surface: &Surface, axis: usize, [begin, end]: [usize; 2]) -> bool {
    let count = surface.count();
    let stride = [count[1], 1];
    (0..count[1 - axis]).any(|j| {
        let at = |i: usize| surface.points()[i * stride[axis] + j * stride[1 - axis]];
        let (before, behind) = (at(begin) - at(begin - 1), at(end + 1) - at(end));
        let sine = before.cross(&behind).norm();
        sine > KINK_ANGLE_MIN_RAD * before.norm() * behind.norm() || before.dot(&behind) < 0.0
    })
}

impl Part {
    /// Splits along an isoparametric line; returns the parts and the largest angle between the normals on both sides
    /// [rad]. `None` where the line is no crease inside the face or the split fails.
    fn cut(&self, axis: usize, at: f64, tolerance: f64) -> Option<(Vec<Self>, f64)> {
        let [low, high] = self.surface.domain()[axis];
        if at <= low || at >= high {
            return None;
        }
        let line = Line { surface: &self.surface, axis, at, tolerance };
        let halves = line.split(&self.loops)?;
        let angle = halves.inside.iter().map(|r| self.angle(axis, at, *r)).fold(0.0, f64::max);
        if angle <= CREASE_ANGLE_MIN_RAD {
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

    /// Largest angle between the normals on both sides of a part of a line [rad].
    fn angle(&self, axis: usize, at: f64, [from, to]: [f64; 2]) -> f64 {
        let normal = |at: f64, k: usize| {
            let along = from + (to - from) * (k as f64 + 0.5) / ANGLE_SAMPLES as f64;
            let uv = if axis == 0 { Vec2::new(at, along) } else { Vec2::new(along, at) };
            self.surface.normal(uv)
        };
        let turn = |k: usize| {
            let (a, b) = (normal(at.next_down(), k)?, normal(at, k)?);
            Some(a.cross(&b).norm().atan2(a.dot(&b)))
        };
        (0..ANGLE_SAMPLES).filter_map(turn).fold(0.0, f64::max)
    }
}
