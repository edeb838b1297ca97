//! Interior nodes of doubly curved faces on isoparametric lines one division apart. Most elements are then
//! quadrilaterals along the lines of a revolved or extruded surface, except along the boundary.

use spade::Point2;

use super::plane::{crossings, segments};
use super::triangulator::{NODES_MAX, Triangulator};
use crate::mapped::patchwork::Node;

/// Distance from the boundary relative to the cell below which nodes are omitted.
const BOUNDARY_CLEARANCE_REL: f64 = 0.3;
/// Smallest cell in divisions between nodes of a boundary along a line that are used for lines ...
const CELL_DIVISIONS_MIN: f64 = 0.6;
/// ... and largest cell; wider ones are divided.
const CELL_DIVISIONS_MAX: f64 = 1.3;
/// Largest difference of the coordinates of a boundary along a line, relative to the cell.
const ALIGNED_TOLERANCE_REL: f64 = 1e-6;

impl Triangulator<'_> {
    /// Adds the nodes if the plane has cells.
    pub(super) fn add_lattice(&mut self, loops: &[Vec<Node>]) -> Result<(), String> {
        let Some(cell) = self.plane.cell else { return Ok(()) };
        let places: Vec<Vec<Point2<f64>>> =
            loops.iter().map(|l| l.iter().map(|n| self.plane.to_plane(n.uv)).collect()).collect();
        let extent = self.plane.extent();
        let [x, y] = [0, 1].map(|k| lines(&places, k, extent[k], cell));
        if x.len() * y.len() > NODES_MAX {
            return Ok(());
        }
        let blocked = near_border(&places, [&x, &y], BOUNDARY_CLEARANCE_REL * cell);
        for (j, &level) in y.iter().enumerate() {
            let crossings = crossings(&places, level);
            for (i, &at) in x.iter().enumerate() {
                let inside = crossings.partition_point(|&c| c <= at) % 2 == 1;
                if inside && !blocked[j * x.len() + i] {
                    let node = Node::inside(self.face, self.plane.to_uv(Point2::new(at, level)));
                    self.add(node, self.nodes.len().saturating_sub(1))?;
                }
            }
        }
        Ok(())
    }
}

fn coordinate(p: &Point2<f64>, k: usize) -> f64 {
    if k == 0 { p.x } else { p.y }
}

/// Coordinates `k` of the lines about one cell apart, through nodes of boundary parts along `k` where possible.
fn lines(loops: &[Vec<Point2<f64>>], k: usize, extent: f64, cell: f64) -> Vec<f64> {
    let mut stops = vec![0.0, extent];
    for ends in segments(loops) {
        let [a, b] = ends.map(|p| coordinate(&p, 1 - k));
        if (a - b).abs() <= ALIGNED_TOLERANCE_REL * cell {
            stops.extend(ends.map(|p| coordinate(&p, k)));
        }
    }
    stops.sort_by(f64::total_cmp);
    let mut lines: Vec<f64> = Vec::new();
    let mut last = stops[0];
    for &stop in &stops {
        let gap = (stop - last) / cell;
        let ends = extent - stop < ALIGNED_TOLERANCE_REL * cell;
        if gap < CELL_DIVISIONS_MIN && !ends {
            continue;
        }
        let parts = if gap <= CELL_DIVISIONS_MAX {
            1
        } else {
            (gap - ALIGNED_TOLERANCE_REL).ceil() as usize
        };
        lines.extend((1..=parts).map(|p| last + (stop - last) * p as f64 / parts as f64));
        last = stop;
        if ends {
            break;
        }
    }
    // The last line is the end itself.
    lines.pop();
    lines
}

/// Intersections of lines closer to a segment of the boundary than `clear`.
fn near_border(loops: &[Vec<Point2<f64>>], [x, y]: [&[f64]; 2], clear: f64) -> Vec<bool> {
    let mut blocked = vec![false; x.len() * y.len()];
    let range = |lines: &[f64], a: f64, b: f64| {
        let first = lines.partition_point(|&l| l < a.min(b) - clear);
        first..lines.partition_point(|&l| l <= a.max(b) + clear)
    };
    for [a, b] in segments(loops) {
        let along = [b.x - a.x, b.y - a.y];
        let square = along[0] * along[0] + along[1] * along[1];
        for j in range(y, a.y, b.y) {
            for i in range(x, a.x, b.x) {
                let off = [x[i] - a.x, y[j] - a.y];
                let fraction = (off[0] * along[0] + off[1] * along[1]) / square.max(1e-300);
                let fraction = fraction.clamp(0.0, 1.0);
                let foot = [off[0] - fraction * along[0], off[1] - fraction * along[1]];
                blocked[j * x.len() + i] |= foot[0].hypot(foot[1]) < clear;
            }
        }
    }
    blocked
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(side: f64, parts: usize) -> Vec<Point2<f64>> {
        let corner = [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)];
        let point_at = |k: usize, s: f64| {
            let ((ax, ay), (bx, by)) = (corner[k], corner[(k + 1) % 4]);
            Point2::new(ax + (bx - ax) * s, ay + (by - ay) * s)
        };
        (0..4).flat_map(|k| (0..parts).map(move |i| point_at(k, i as f64 / parts as f64))).collect()
    }

    #[test]
    fn lines_go_through_the_nodes_of_a_border_about_a_cell_apart() {
        let near = |found: Vec<f64>, count: usize| {
            assert_eq!(found.len(), count - 1, "{found:?}");
            for (k, at) in found.iter().enumerate() {
                assert!((at - (k + 1) as f64 / count as f64).abs() < 1e-12, "{found:?}");
            }
        };
        let cell = 0.1;
        near(lines(&[square(1.0, 10)], 0, 1.0, cell), 10);
        near(lines(&[square(1.0, 8)], 0, 1.0, cell), 8);
        near(lines(&[square(1.0, 5)], 1, 1.0, cell), 10);
        near(lines(&[square(1.0, 20)], 1, 1.0, cell), 10);
        near(lines(&[square(1.0, 1)], 0, 1.0, cell), 10);
    }

    #[test]
    fn nodes_beside_the_border_are_left_out() {
        let x: Vec<f64> = (1..10).map(|k| f64::from(k) / 10.0).collect();
        let hole = vec![Point2::new(0.48, 0.48), Point2::new(0.48, 0.52), Point2::new(0.52, 0.5)];
        let blocked = near_border(&[square(1.0, 3), hole], [&x, &x], 0.05);
        let found: Vec<usize> = (0..81).filter(|&k| blocked[k]).collect();
        assert_eq!(found, [4 * 9 + 4]);
    }
}
