//! Heights of tools over a grid in plan.

use kanagata_contact::ToolSurface;
use kanagata_geometry::{Aabb, Vec3};
use kanagata_tool::Patch;

/// Cells of a grid along each side. A cell of a part of 1 m is then 5 mm.
pub(super) const CELLS: usize = 200;
/// Intervals along a side of a patch; a quarter of a circle in one patch is flat to 0.5 % of its radius.
const INTERVALS: usize = 6;
/// Patches above which a patch is two triangles.
const FINE_PATCHES_MAX: usize = 5000;

/// The faces of a tool that are seen from one side of the sheet: the highest or the lowest point of each cell.
#[derive(Debug, Clone)]
pub(super) struct Heights {
    region: Aabb,
    /// Height of each cell [mm], and the vertical component of the unit normal there; NaN where there is no tool.
    cells: Vec<[f64; 2]>,
}

impl Heights {
    /// Heights of `surface` over `region` in plan. `from_above`: the highest points, otherwise the lowest.
    pub(super) fn new(surface: &ToolSurface, region: &Aabb, from_above: bool) -> Self {
        let mut out = Self { region: *region, cells: vec![[f64::NAN; 2]; CELLS * CELLS] };
        let patches = &surface.model().patches;
        let fine = if patches.len() > FINE_PATCHES_MAX { 1 } else { INTERVALS };
        for patch in patches {
            for triangle in triangles(patch, fine) {
                out.add(&triangle, from_above);
            }
        }
        out
    }

    /// Height [mm] and vertical component of the normal of a cell.
    pub(super) fn at(&self, cell: usize) -> Option<[f64; 2]> {
        self.cells[cell].iter().all(|v| v.is_finite()).then_some(self.cells[cell])
    }

    fn add(&mut self, [a, b, c]: &[Vec3; 3], from_above: bool) {
        let normal = (b - a).cross(&(c - a));
        let Some(unit) = normal.try_normalize(0.0) else { return };
        if unit.z == 0.0 {
            return;
        }
        let bounds = Aabb::of_points([a, b, c]);
        let size = |k: usize| (self.region.max[k] - self.region.min[k]) / CELLS as f64;
        let (wide, long) = (size(0), size(1));
        let range = |k: usize, step: f64| {
            let cell = |x: f64| ((x - self.region.min[k]) / step - 0.5).clamp(-1.0, CELLS as f64);
            // Rounding may put a bound on the other side of a cell's middle.
            let first = (cell(bounds.min[k]).ceil() - 1.0).max(0.0) as usize;
            first..(cell(bounds.max[k]).floor() + 2.0).clamp(0.0, CELLS as f64) as usize
        };
        let (columns, rows) = (range(0, wide), range(1, long));
        for row in rows {
            for column in columns.clone() {
                let x = self.region.min.x + (column as f64 + 0.5) * wide;
                let y = self.region.min.y + (row as f64 + 0.5) * long;
                if !inside([a, b, c], x, y) {
                    continue;
                }
                // Walls are nearly edge-on: beside them their plane is far above or below them.
                let z = a.z - (unit.x * (x - a.x) + unit.y * (y - a.y)) / unit.z;
                let z = z.clamp(bounds.min.z, bounds.max.z);
                let cell = &mut self.cells[row * CELLS + column];
                let better = cell[0].is_nan() || if from_above { z > cell[0] } else { z < cell[0] };
                if better {
                    *cell = [z, unit.z.abs()];
                }
            }
        }
    }
}

/// The highest point of a surface, or the lowest one [mm]: of points on it, so that curved patches reach no farther.
pub(super) fn extreme(surface: &ToolSurface, highest: bool) -> f64 {
    let patches = &surface.model().patches;
    let fine = if patches.len() > FINE_PATCHES_MAX { 1 } else { INTERVALS };
    let points = patches.iter().flat_map(|patch| triangles(patch, fine)).flatten();
    let sign = if highest { 1.0 } else { -1.0 };
    sign * points.map(|point| sign * point.z).fold(f64::NEG_INFINITY, f64::max)
}

/// Distance over the size of a triangle up to which points beside it are covered: sides that two triangles share leave no
/// cell out.
const BESIDE_REL: f64 = 1e-9;

/// Whether a triangle covers a point in plan.
fn inside(corners: [&Vec3; 3], x: f64, y: f64) -> bool {
    let size = (corners[1] - corners[0]).norm_squared() + (corners[2] - corners[0]).norm_squared();
    let near = BESIDE_REL * size;
    let side = |k: usize| {
        let (p, q) = (corners[k], corners[(k + 1) % 3]);
        (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x)
    };
    let sides = [side(0), side(1), side(2)];
    sides.iter().all(|s| *s >= -near) || sides.iter().all(|s| *s <= near)
}

/// Triangles between points of a patch.
fn triangles(patch: &Patch, n: usize) -> Vec<[Vec3; 3]> {
    let at = |i: usize, j: usize| patch.derivs(i as f64 / n as f64, j as f64 / n as f64).s;
    let mut out = Vec::with_capacity(2 * n * n);
    for i in 0..n {
        // A triangle has the parameters zeta <= eta.
        let end = if patch.sides() == 3 { i + 1 } else { n };
        for j in 0..end {
            let (a, b, c) = (at(i, j), at(i + 1, j), at(i + 1, j + 1));
            out.push([a, b, c]);
            if patch.sides() == 4 || j < i {
                out.push([a, c, at(i, j + 1)]);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_tools::{arc, plane, revolved};

    #[test]
    fn a_ball_is_as_high_as_its_equation_says() {
        use std::f64::consts::{FRAC_PI_2, TAU};
        let ball = revolved("b", 16, TAU, &[arc(8, [0.0, 0.0], 5.0, [-FRAC_PI_2, 0.0], 1.0)]);
        let region = Aabb { min: Vec3::new(-5.0, -5.0, 0.0), max: Vec3::new(5.0, 5.0, 0.0) };
        let found = Heights::new(&ToolSurface::new(ball), &region, false);
        let mut covered = 0;
        for row in 0..CELLS {
            for column in 0..CELLS {
                let place = |k: usize| -5.0 + (k as f64 + 0.5) * 10.0 / CELLS as f64;
                let r = place(row).hypot(place(column));
                let Some([z, slope]) = found.at(row * CELLS + column) else {
                    assert!(r > 4.9, "nothing at {r}");
                    continue;
                };
                covered += 1;
                if r < 4.5 {
                    let exact = -(25.0 - r * r).sqrt();
                    assert!((z - exact).abs() < 0.02, "{z} for {exact} at {r}");
                    assert!((slope + exact / 5.0).abs() < 0.03, "{slope} at {r}");
                }
            }
        }
        let expected = 0.25 * std::f64::consts::PI * (CELLS * CELLS) as f64;
        assert!((f64::from(covered) / expected - 1.0).abs() < 0.01, "{covered}");
    }

    #[test]
    fn of_two_planes_the_upper_or_the_lower_is_seen() {
        let mut both = plane("p", Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z());
        let other = plane("q", Vec3::z() * 2.0, Vec3::x(), Vec3::y(), Vec3::z());
        both.patches.extend(other.patches);
        both.faces.push(1);
        let surface = ToolSurface::new(both);
        let region = Aabb { min: Vec3::zeros(), max: Vec3::new(2.0, 1.0, 0.0) };
        let [high, low] = [true, false].map(|above| Heights::new(&surface, &region, above));
        assert_eq!((high.at(0), low.at(0)), (Some([2.0, 1.0]), Some([0.0, 1.0])));
        assert_eq!(high.at(CELLS - 1), None);
    }
}
