//! Fields on the flat blank: values at columns of nodes, interpolated between them.

use kanagata_geometry::{Aabb, Vec2, Vec3};
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// A value at every column of a sheet, over the plan of the flat blank.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Field {
    /// Columns of the flat blank [mm].
    points: Vec<Vec2>,
    quads: Vec<[u32; 4]>,
    pub(super) values: Vec<f64>,
}

/// Largest coordinate outside the unit square at which a point counts as inside an element, where borders are curved and
/// the polygon of one mesh leaves that of the other.
const OUTSIDE_MAX: f64 = 0.5;

impl Field {
    /// The field of values at the nodes of a mesh (those of the lower face are taken).
    pub(super) fn new(mesh: &HexMesh, at_nodes: &[f64]) -> Self {
        let bottom = mesh.bottom_nodes();
        let mut column = vec![u32::MAX; mesh.nodes.len()];
        for (k, &node) in bottom.iter().enumerate() {
            column[node as usize] = k as u32;
        }
        let lower = mesh.elements.iter().map(|e| [e[0], e[1], e[2], e[3]]);
        let quads = lower.map(|quad| quad.map(|n| column[n as usize]));
        let points = bottom.iter().map(|&n| mesh.nodes[n as usize].xy());
        Self {
            points: points.collect(),
            quads: quads.filter(|quad| !quad.contains(&u32::MAX)).collect(),
            values: bottom.iter().map(|&n| at_nodes[n as usize]).collect(),
        }
    }

    /// Smallest value.
    pub(super) fn smallest(&self) -> Option<f64> {
        self.values.iter().copied().reduce(f64::min)
    }

    /// Root mean square over the area of the difference to a field on another mesh of the same blank, at the columns of
    /// the coarser mesh. `None` where the meshes have no common area.
    pub(super) fn rms_difference(&self, other: &Self) -> Option<f64> {
        let (coarse, fine) =
            if self.points.len() <= other.points.len() { (self, other) } else { (other, self) };
        let grid = Cells::new(fine);
        let (mut sum, mut area) = (0.0, 0.0);
        for ((point, value), weight) in coarse.points.iter().zip(&coarse.values).zip(coarse.areas())
        {
            let Some(there) = grid.value_at(fine, point) else { continue };
            sum += weight * (value - there).powi(2);
            area += weight;
        }
        (area > 0.0).then(|| (sum / area).sqrt())
    }

    /// A quarter of the area of the elements at each column.
    fn areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.points.len()];
        for quad in &self.quads {
            let [a, b, c, d] = quad.map(|k| self.points[k as usize]);
            let area = 0.5 * (c - a).perp(&(d - b)).abs();
            quad.iter().for_each(|&k| areas[k as usize] += 0.25 * area);
        }
        areas
    }

    fn corners(&self, quad: usize) -> [Vec2; 4] {
        self.quads[quad].map(|k| self.points[k as usize])
    }
}

/// Elements by the cells of a regular grid that they overlap.
struct Cells {
    low: Vec2,
    size: Vec2,
    counts: [usize; 2],
    quads: Vec<Vec<u32>>,
}

impl Cells {
    fn new(field: &Field) -> Self {
        let flat: Vec<Vec3> = field.points.iter().map(|p| p.push(0.0)).collect();
        let bounds = Aabb::of_points(&flat);
        let side = (field.quads.len() as f64).sqrt().ceil().max(1.0);
        let size = (bounds.max.xy() - bounds.min.xy()).map(|x| (x / side).max(f64::MIN_POSITIVE));
        let counts = [side as usize; 2];
        let mut cells = Self {
            low: bounds.min.xy(),
            size,
            counts,
            quads: vec![Vec::new(); counts[0] * counts[1]],
        };
        for quad in 0..field.quads.len() {
            let corners = field.corners(quad);
            let low = corners.iter().copied().reduce(|a, b| a.inf(&b)).unwrap_or_default();
            let high = corners.iter().copied().reduce(|a, b| a.sup(&b)).unwrap_or_default();
            let (from, to) = (cells.cell(&low), cells.cell(&high));
            for i in from[0]..=to[0] {
                for j in from[1]..=to[1] {
                    cells.quads[i * counts[1] + j].push(quad as u32);
                }
            }
        }
        cells
    }

    fn cell(&self, point: &Vec2) -> [usize; 2] {
        let at = |k: usize| {
            let cell = (point[k] - self.low[k]) / self.size[k];
            (cell.max(0.0) as usize).min(self.counts[k] - 1)
        };
        [at(0), at(1)]
    }

    /// The field at a point: interpolated in the element that contains it, or that it is closest to in a cell.
    fn value_at(&self, field: &Field, point: &Vec2) -> Option<f64> {
        let [i, j] = self.cell(point);
        let near = self.quads[i * self.counts[1] + j].iter();
        let found = near.filter_map(|&quad| {
            let local = local_of(&field.corners(quad as usize), point)?;
            let outside = local.iter().map(|x| (-x).max(x - 1.0)).fold(0.0, f64::max);
            (outside <= OUTSIDE_MAX).then_some((outside, quad, local))
        });
        let (_, quad, local) = found.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let [u, v] = local.map(|x| x.clamp(0.0, 1.0));
        let value = field.quads[quad as usize].map(|k| field.values[k as usize]);
        let shares = [(1.0 - u) * (1.0 - v), u * (1.0 - v), u * v, (1.0 - u) * v];
        Some(shares.iter().zip(value).map(|(share, value)| share * value).sum())
    }
}

/// Local coordinates (0 to 1 inside) of a point in a bilinear quadrilateral, by Newton's method.
fn local_of([a, b, c, d]: &[Vec2; 4], point: &Vec2) -> Option<[f64; 2]> {
    let (mut u, mut v) = (0.5, 0.5);
    for _ in 0..12 {
        let at = (a * (1.0 - u) + b * u) * (1.0 - v) + (d * (1.0 - u) + c * u) * v;
        let (du, dv) = ((b - a) * (1.0 - v) + (c - d) * v, (d - a) * (1.0 - u) + (c - b) * u);
        let (off, det) = (point - at, du.perp(&dv));
        if det == 0.0 {
            return None;
        }
        (u, v) = (u + off.perp(&dv) / det, v + du.perp(&off) / det);
        if !(u.abs() < 10.0 && v.abs() < 10.0) {
            return None;
        }
    }
    Some([u, v])
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_solver::sheet::hex_mesh::{quarter_disc, rectangle, thickened};

    fn linear(mesh: &HexMesh) -> Field {
        let values: Vec<f64> = mesh.nodes.iter().map(|x| 1.0 + 0.1 * x.x - 0.2 * x.y).collect();
        Field::new(mesh, &values)
    }

    #[test]
    fn a_linear_field_is_the_same_on_all_meshes_of_a_blank() {
        let coarse = linear(&rectangle(10.0, 6.0, 1.0, 3, 5, 1));
        let fine = linear(&rectangle(10.0, 6.0, 1.0, 8, 7, 2));
        assert!(coarse.rms_difference(&fine).unwrap() < 1e-12);
        assert!(fine.rms_difference(&coarse).unwrap() < 1e-12);
        let disc = |core, rings| {
            let (points, quads) = quarter_disc(10.0, core, rings);
            linear(&thickened(&points, &quads, 1.0, 1))
        };
        // The rim is a polygon: its middle is off the circle by 1 - cos(90 / 16 degrees), 0.05 mm.
        assert!(disc(4, 5).rms_difference(&disc(9, 13)).unwrap() < 1e-3);
    }

    #[test]
    fn a_difference_is_weighted_by_the_area_where_it_is() {
        let mesh = rectangle(4.0, 4.0, 1.0, 4, 4, 1);
        let step = |x: &Vec3| if x.x > 3.5 { 1.0 } else { 0.0 };
        let at: Vec<f64> = mesh.nodes.iter().map(step).collect();
        let field = Field::new(&mesh, &at);
        let zero = Field::new(&mesh, &vec![0.0; mesh.nodes.len()]);
        // One of four rows of elements gives half its area to these columns.
        assert!((field.rms_difference(&zero).unwrap() - 0.125_f64.sqrt()).abs() < 1e-12);
        assert_eq!(field.smallest(), Some(0.0));
        assert_eq!(zero.rms_difference(&Field::default()), None);
    }
}
