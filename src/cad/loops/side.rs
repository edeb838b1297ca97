//! A side of a boundary loop, a loop of sides, and the area it encloses in the parameter plane.

use crate::geometry::Vec2;
use crate::geometry::nurbs::{Curve2, Curve3};

/// One side of a loop: its curve in native parameters, in the loop's direction.
#[derive(Debug, Clone)]
pub(in crate::cad) struct Side {
    pub path: Curve2,
    /// The file's curve in space, in the same direction.
    pub curve: Option<Curve3>,
    /// The file's own edge.
    pub edge_id: Option<usize>,
}

impl Side {
    pub fn start(&self) -> Vec2 {
        self.path.points()[0]
    }

    pub fn end(&self) -> Vec2 {
        self.path.points()[self.path.points().len() - 1]
    }

    pub fn straight(from: Vec2, to: Vec2) -> Self {
        Self { path: Curve2::line(from, to), curve: None, edge_id: None }
    }

    pub fn shifted(&self, by: Vec2) -> Self {
        Self {
            path: self.path.mapped(|p| p + by),
            curve: self.curve.clone(),
            edge_id: self.edge_id,
        }
    }

    pub fn reversed(&self) -> Self {
        Self {
            path: self.path.reversed(),
            curve: self.curve.as_ref().map(Curve3::reversed),
            edge_id: self.edge_id,
        }
    }
}

/// A loop whose sides join end to start; after one turn it has moved by `winding` periods.
#[derive(Debug, Clone)]
pub(in crate::cad) struct Path {
    pub sides: Vec<Side>,
    pub winding: Vec2,
    /// A point of a slit that was taken out of it: there the face lies.
    pub on_slit: Option<Vec2>,
}

/// What could not be done well.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::cad) enum LoopFault {
    /// Neighbouring edges do not meet: the gap in space [mm].
    Gap(f64),
    /// The curve in space and the image of the parameter curve are `off` apart [mm].
    Contradiction {
        /// Largest distance [mm].
        off: f64,
        /// The parameter curve is the one that is used.
        parameter_kept: bool,
    },
    /// An edge without any curve.
    NoCurve,
}

/// Whether the outer one of a face's loops, that which encloses most, runs against the face's normal. Loops that wind
/// round a period enclose nothing.
pub(in crate::cad) fn are_inside_out(paths: &[Path], left_is_inside: bool) -> bool {
    let plain = paths.iter().filter(|p| p.winding.norm() == 0.0);
    let area = |p: &&Path| signed_area(&p.sides).abs();
    let outer = plain.max_by(|a, b| area(a).total_cmp(&area(b)));
    outer.is_some_and(|p| leaves_its_inside_out(&p.sides, left_is_inside))
}

/// Twice the signed area that a loop encloses in the parameter plane.
pub(in crate::cad) fn signed_area(sides: &[Side]) -> f64 {
    let mut sum = 0.0;
    for side in sides {
        let [a, b] = side.path.domain();
        let spans = side.path.knots().windows(2).filter(|w| w[0] < w[1]).count();
        let straight = side.path.points().len() == 2;
        let n = if straight { 1 } else { 8 * spans };
        let mut last = side.start();
        for k in 1..=n {
            let next = side.path.point(a + (b - a) * k as f64 / n as f64);
            sum += last.x * next.y - last.y * next.x;
            last = next;
        }
    }
    // The way back to the start, for loops that are not closed yet.
    if let (Some(first), Some(last)) = (sides.first(), sides.last()) {
        let (start, end) = (first.start(), last.end());
        sum += end.x * start.y - end.y * start.x;
    }
    sum
}

/// A B-rep's loop that runs clockwise about what it encloses: the face is all the rest of a closed surface. Without
/// the file's own edges nothing says that the loop's direction was meant.
pub(super) fn leaves_its_inside_out(sides: &[Side], left_is_inside: bool) -> bool {
    let extent = sides.iter().fold(0.0, |m: f64, s| m.max((s.end() - s.start()).norm()));
    let area = signed_area(sides) * if left_is_inside { 1.0 } else { -1.0 };
    area < -1e-6 * extent * extent && sides.iter().any(|s| s.edge_id.is_some())
}
