//! Sides and loops in the parameter plane, and the area enclosed by a loop.

use kanagata_geometry::Vec2;
use kanagata_geometry::nurbs::{Curve2, Curve3};

/// One side of a loop: its curve in native parameters, in the direction of the loop.
#[derive(Debug, Clone)]
pub(crate) struct Side {
    pub path: Curve2,
    /// Space curve of the file, in the same direction.
    pub curve: Option<Curve3>,
    /// Edge identity in the file.
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

/// A chain of sides joined end to start; one traversal advances the parameters by `winding`.
#[derive(Debug, Clone)]
pub(crate) struct Path {
    pub sides: Vec<Side>,
    pub winding: Vec2,
    /// A point on a removed slit: the face lies on both sides of it.
    pub on_slit: Option<Vec2>,
}

/// Defects of boundary loops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum LoopFault {
    /// Consecutive edges do not meet: gap in space [mm].
    Gap(f64),
    /// The space curve and the image of the parameter curve differ by `off` [mm].
    Contradiction {
        /// Largest distance [mm].
        off: f64,
        /// True when the parameter curve is used.
        parameter_kept: bool,
    },
    /// An edge without any curve.
    NoCurve,
}

/// True when the outer loop of a face (the one with the largest enclosed area) is oriented against the face normal.
/// Winding loops enclose no area.
pub(crate) fn outer_loop_is_reversed(paths: &[Path], left_is_inside: bool) -> bool {
    let plain = paths.iter().filter(|p| p.winding.norm() == 0.0);
    let area = |p: &&Path| signed_area(&p.sides).abs();
    let outer = plain.max_by(|a, b| area(a).total_cmp(&area(b)));
    outer.is_some_and(|p| excludes_interior(&p.sides, left_is_inside))
}

/// Twice the signed area enclosed by a loop in the parameter plane.
pub(crate) fn signed_area(sides: &[Side]) -> f64 {
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
    // Close the polygon, for loops that are still open.
    if let (Some(first), Some(last)) = (sides.first(), sides.last()) {
        let (start, end) = (first.start(), last.end());
        sum += end.x * start.y - end.y * start.x;
    }
    sum
}

/// True for a loop with file edges that runs clockwise about the enclosed region: the face is the remainder of a closed
/// surface. Without edges of the file the orientation of the loop is unreliable.
pub(super) fn excludes_interior(sides: &[Side], left_is_inside: bool) -> bool {
    let extent = sides.iter().fold(0.0, |m: f64, s| m.max((s.end() - s.start()).norm()));
    let area = signed_area(sides) * if left_is_inside { 1.0 } else { -1.0 };
    area < -1e-6 * extent * extent && sides.iter().any(|s| s.edge_id.is_some())
}
