//! Points of a face that are on one side of the curve for certain: the check of a cut, and the proof that there is none.
//!
//! The parameter rectangle of a face is divided into cells. The plan image of a cell lies within the hull of its control
//! points, so that a cell whose middle is farther from the curve than the hull reaches is on one side of it. Only cells
//! near the curve are divided, down to a small multiple of the tolerance or to a number of cells.

use std::collections::VecDeque;

use super::plan::PlanCurve;
use crate::model::Face;
use crate::trim_region::TrimRegion;
use kanagata_geometry::nurbs::Surface;
use kanagata_geometry::{Vec2, Vec3};

/// Cells of a face examined at most. Doubled: half the size of the largest fault of a cut that is not seen, twice the
/// time of a face that the curve crosses (about 0.1 s).
const CELLS_MAX: usize = 4_000;
/// Depth to which cells on one side of the curve are divided where a trimming loop passes them.
const TRIM_DEPTH_MAX: u32 = 7;

/// A point inside the trimmed region of a face, and whether it is inside the curve.
#[derive(Debug, Clone, Copy)]
pub(super) struct CertainPoint {
    pub uv: Vec2,
    pub inside: bool,
}

/// Points that are certain, and whether they decide the whole face: no cell near the curve is left.
pub(super) struct Certain {
    pub points: Vec<CertainPoint>,
    pub complete: bool,
}

/// A cell: a part of the surface.
struct Cell {
    surface: Surface,
    depth: u32,
}

/// The certain points of a face. Points within `tolerance` [mm] of the curve are on neither side.
pub(super) fn certain_points(
    face: &Face,
    region: &TrimRegion,
    curve: &PlanCurve,
    tolerance: f64,
) -> Certain {
    let mut found = Certain { points: Vec::new(), complete: true };
    let (low, high) = (region.low, region.high);
    let Ok(surface) = face.surface.trimmed([low.x, high.x], [low.y, high.y]) else {
        return Certain { complete: false, ..found };
    };
    let mut open = VecDeque::from([Cell { surface, depth: 0 }]);
    let mut examined = 0;
    while let Some(cell) = open.pop_front() {
        let [u, v] = cell.surface.domain();
        let (from, to) = (Vec2::new(u[0], v[0]), Vec2::new(u[1], v[1]));
        let middle = 0.5 * (from + to);
        let (is_trimmed, is_inside) = (region.touches(from, to), region.contains(middle));
        if !is_trimmed && !is_inside {
            continue;
        }
        examined += 1;
        let centre = cell.surface.point(middle).xy();
        let reach = cell.reach(&centre);
        let signed = curve.near(centre).signed;
        let is_certain = signed.abs() > reach + 2.0 * tolerance;
        if is_certain && is_inside {
            found.points.push(CertainPoint { uv: middle, inside: signed > 0.0 });
        }
        let divides = match is_certain {
            true => is_trimmed && cell.depth < TRIM_DEPTH_MAX,
            false => reach > 8.0 * tolerance,
        };
        found.complete &= is_certain || (divides && examined < CELLS_MAX);
        if divides && examined < CELLS_MAX {
            open.extend(cell.halves());
        }
    }
    found
}

impl Cell {
    /// Largest distance of the control points from `centre` in plan [mm]: no point of the cell is farther.
    fn reach(&self, centre: &Vec2) -> f64 {
        let distance = |p: &Vec3| (p.xy() - centre).norm();
        self.surface.points().iter().map(distance).fold(0.0, f64::max)
    }

    /// Both halves, across the direction that is longer in plan.
    fn halves(&self) -> Vec<Self> {
        let [u, v] = self.surface.domain();
        let (mid_u, mid_v) = (0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1]));
        let [along_u, along_v] = self.lengths();
        let parts = if along_u >= along_v {
            [([u[0], mid_u], v), ([mid_u, u[1]], v)]
        } else {
            [(u, [v[0], mid_v]), (u, [mid_v, v[1]])]
        };
        let half = |(u, v): ([f64; 2], [f64; 2])| {
            Some(Self { surface: self.surface.trimmed(u, v).ok()?, depth: self.depth + 1 })
        };
        parts.into_iter().filter_map(half).collect()
    }

    /// Largest lengths of the control polygons along u and v in plan [mm]; in space where the plan has none.
    fn lengths(&self) -> [f64; 2] {
        let [count_u, count_v] = self.surface.count();
        let points = self.surface.points();
        let largest = |length: &dyn Fn(usize, usize) -> f64| {
            let along_u = (0..count_v).map(|j| {
                (1..count_u).map(|i| length((i - 1) * count_v + j, i * count_v + j)).sum::<f64>()
            });
            let along_v = (0..count_u).map(|i| {
                (1..count_v).map(|j| length(i * count_v + j - 1, i * count_v + j)).sum::<f64>()
            });
            [along_u.fold(0.0, f64::max), along_v.fold(0.0, f64::max)]
        };
        let plan = largest(&|a, b| (points[b] - points[a]).xy().norm());
        if plan[0].max(plan[1]) > 0.0 {
            plan
        } else {
            largest(&|a, b| (points[b] - points[a]).norm())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// A small region in a large face is found, and every certain point is on its side.
    #[test]
    fn small_regions_are_not_missed_and_points_are_on_their_sides() {
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
            .join("fixtures/forming/cross_holder_144.igs");
        let (model, _) = crate::read(&path).unwrap();
        let face = &model.faces[0];
        let region = TrimRegion::new(face);
        let b = model.bbox();
        let p = 0.3 * b.min + 0.7 * b.max;
        for size in [20.0, 1.0, 0.05] {
            let corners = [[0.0, 0.0], [size, 0.0], [size, size], [0.0, size]];
            let curve = PlanCurve::polygon(&corners.map(|[x, y]| [p.x + x, p.y + y])).unwrap();
            let found = certain_points(face, &region, &curve, 1e-6);
            assert!(!found.complete, "a face that the curve crosses: {size}");
            let inside = found.points.iter().filter(|c| c.inside).count();
            assert!(inside > 10 && inside < found.points.len(), "{size}: {inside}");
            for c in &found.points {
                let q = face.surface.point(c.uv).xy() - p.xy();
                let within = q.min() > 0.0 && q.max() < size;
                assert_eq!(within, c.inside, "{size}: {q:?}");
            }
        }
        let far = PlanCurve::polygon(&[[1e4, 0.0], [1e4 + 1.0, 0.0], [1e4, 1.0]]).unwrap();
        let found = certain_points(face, &region, &far, 1e-6);
        assert!(found.complete && found.points.iter().all(|c| !c.inside));
    }
}
