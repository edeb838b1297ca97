//! Blank: a mesh of 8-node hexahedra with nodes grouped in through-thickness columns.

use std::collections::HashMap;
use std::f64::consts::FRAC_PI_2;

use super::hanging::Hanging;
use crate::linear::Groups;
use kanagata_geometry::{Vec2, Vec3};

/// Hexahedral mesh of a sheet.
///
/// Local nodes 0..4 of an element are its bottom face, counter-clockwise seen from the top; 4..8 are the nodes above
/// them. In a structured blank all nodes of a column are consecutive, bottom first: node
/// `column * nodes_per_column + level`.
#[derive(Debug, Clone, PartialEq)]
pub struct HexMesh {
    /// Node coordinates [mm].
    pub nodes: Vec<Vec3>,
    /// Node ids of each element.
    pub elements: Vec<[u32; 8]>,
    /// Nodes in each through-thickness column (levels); 1 for a mesh without columns.
    pub nodes_per_column: usize,
    /// Columns in the middle of the side of a coarser element.
    pub hanging: Hanging,
}

/// Rectangle `[0, size_x] x [0, size_y] x [0, thickness]` [mm] with `nx` x `ny` elements and `nz` layers.
///
/// Column `i * (ny + 1) + j` is at `(i, j)`. Counts of zero are treated as one.
#[must_use]
pub fn rectangle(
    size_x: f64,
    size_y: f64,
    thickness: f64,
    nx: usize,
    ny: usize,
    nz: usize,
) -> HexMesh {
    let (nx, ny, nz) = (nx.max(1), ny.max(1), nz.max(1));
    let levels = nz + 1;
    let mut nodes = Vec::with_capacity((nx + 1) * (ny + 1) * levels);
    let part = |size: f64, index: usize, count: usize| size * index as f64 / count as f64;
    for i in 0..=nx {
        for j in 0..=ny {
            for k in 0..=nz {
                nodes.push(Vec3::new(
                    part(size_x, i, nx),
                    part(size_y, j, ny),
                    part(thickness, k, nz),
                ));
            }
        }
    }
    let id = |i: usize, j: usize, k: usize| ((i * (ny + 1) + j) * levels + k) as u32;
    let mut elements = Vec::with_capacity(nx * ny * nz);
    for i in 0..nx {
        for j in 0..ny {
            for k in 0..nz {
                let layer =
                    |k: usize| [id(i, j, k), id(i + 1, j, k), id(i + 1, j + 1, k), id(i, j + 1, k)];
                let (low, high) = (layer(k), layer(k + 1));
                elements.push([low[0], low[1], low[2], low[3], high[0], high[1], high[2], high[3]]);
            }
        }
    }
    HexMesh { nodes, elements, nodes_per_column: levels, hanging: Hanging::default() }
}

/// Sheet of `layers` hexahedra over quadrilaterals (counter-clockwise seen from the top), which are its bottom face.
/// The thickness [mm] is along the mean normals at the corners.
#[must_use]
pub fn thickened(points: &[Vec3], quads: &[[u32; 4]], thickness: f64, layers: usize) -> HexMesh {
    let layers = layers.max(1);
    let levels = layers + 1;
    let mut normals = vec![Vec3::zeros(); points.len()];
    for quad in quads {
        let [a, b, c, d] = quad.map(|n| points[n as usize]);
        let area = (c - a).cross(&(d - b));
        quad.iter().for_each(|&n| normals[n as usize] += area);
    }
    let part = |level: usize| thickness * level as f64 / layers as f64;
    let column = |(x, n): (&Vec3, &Vec3)| {
        let (x, n) = (*x, n.normalize());
        (0..levels).map(move |level| x + n * part(level))
    };
    let nodes = points.iter().zip(&normals).flat_map(column).collect();
    let at = |quad: &[u32; 4], level: usize| quad.map(|n| n * levels as u32 + level as u32);
    let hexahedra = |quad: &[u32; 4]| -> Vec<[u32; 8]> {
        let stack = |k| {
            let ([a, b, c, d], [e, f, g, h]) = (at(quad, k), at(quad, k + 1));
            [a, b, c, d, e, f, g, h]
        };
        (0..layers).map(stack).collect()
    };
    let elements = quads.iter().flat_map(hexahedra).collect();
    HexMesh { nodes, elements, nodes_per_column: levels, hanging: Hanging::default() }
}

/// Quadrilaterals of a quarter disc `x, y >= 0` of given radius [mm] about the origin: a core of `core` x `core`
/// cells and `rings` cells from the core to the rim.
#[must_use]
pub fn quarter_disc(radius: f64, core: usize, rings: usize) -> (Vec<Vec3>, Vec<[u32; 4]>) {
    let (core, rings) = (core.max(1), rings.max(1));
    let mut points = core_points(radius, core);
    let core_id = |i: usize, j: usize| (i * (core + 1) + j) as u32;
    let mut quads = Vec::with_capacity(core * core + 2 * core * rings);
    for i in 0..core {
        for j in 0..core {
            let (i1, j1) = (i + 1, j + 1);
            quads.push([core_id(i, j), core_id(i1, j), core_id(i1, j1), core_id(i, j1)]);
        }
    }
    let up = (0..=core).map(|j| core_id(core, j));
    let border: Vec<u32> = up.chain((0..core).rev().map(|i| core_id(i, core))).collect();
    let mut spokes: Vec<Vec<u32>> = Vec::with_capacity(border.len());
    for (k, &inner) in border.iter().enumerate() {
        let (s, c) = (FRAC_PI_2 * k as f64 / (2 * core) as f64).sin_cos();
        let last = k == 2 * core;
        let rim = Vec3::new(if last { 0.0 } else { c }, s, 0.0) * radius;
        let from = points[inner as usize];
        let first = points.len() as u32;
        let place = |r: usize| from + (rim - from) * (r as f64 / rings as f64);
        points.extend((1..=rings).map(place));
        spokes.push(std::iter::once(inner).chain(first..first + rings as u32).collect());
    }
    for pair in spokes.windows(2) {
        quads.extend((0..rings).map(|r| [pair[0][r], pair[0][r + 1], pair[1][r + 1], pair[1][r]]));
    }
    (points, quads)
}

/// Corners of the `core` x `core` cells in the core of a quarter disc: index `i * (core + 1) + j` at `(i, j)`.
fn core_points(radius: f64, core: usize) -> Vec<Vec3> {
    /// Half side of the core over the radius, and roundness of its outer border (0 square, 1 circle).
    const CORE_SIZE_REL: f64 = 0.4;
    const CORE_ROUNDNESS: f64 = 0.6;
    let inside = |i: usize, j: usize| {
        let (u, v) = (i as f64 / core as f64, j as f64 / core as f64);
        let out = u.max(v);
        let slant = if out > 0.0 { u.hypot(v) / out - 1.0 } else { 0.0 };
        Vec3::new(u, v, 0.0) * (CORE_SIZE_REL * radius / (1.0 + CORE_ROUNDNESS * slant * out))
    };
    (0..=core).flat_map(|i| (0..=core).map(move |j| (i, j))).map(|(i, j)| inside(i, j)).collect()
}

/// Quadrilaterals of a disc of given radius [mm] about the origin: four quarter discs with common nodes merged.
#[must_use]
pub fn disc(radius: f64, core: usize, rings: usize) -> (Vec<Vec3>, Vec<[u32; 4]>) {
    let (quarter, cells) = quarter_disc(radius, core, rings);
    let mut points: Vec<Vec3> = Vec::with_capacity(4 * quarter.len());
    let mut quads = Vec::with_capacity(4 * cells.len());
    // Nodes on the axes, bit-identical in both adjacent quarters; adding 0.0 removes the sign of zero.
    let mut on_axes: HashMap<[u64; 2], u32> = HashMap::new();
    for turns in 0..4 {
        let turned = |p: &Vec3| {
            let [x, y] = [[p.x, p.y], [-p.y, p.x], [-p.x, -p.y], [p.y, -p.x]][turns];
            Vec3::new(x + 0.0, y + 0.0, 0.0)
        };
        let ids: Vec<u32> = quarter
            .iter()
            .map(|p| {
                let (at, next) = (turned(p), points.len() as u32);
                let shared = p.x == 0.0 || p.y == 0.0;
                let key = [at.x.to_bits(), at.y.to_bits()];
                let id = if shared { *on_axes.entry(key).or_insert(next) } else { next };
                if id == next {
                    points.push(at);
                }
                id
            })
            .collect();
        quads.extend(cells.iter().map(|quad| quad.map(|n| ids[n as usize])));
    }
    (points, quads)
}

impl HexMesh {
    /// Number of through-thickness columns.
    #[must_use]
    pub fn column_count(&self) -> usize {
        self.nodes.len() / self.nodes_per_column.max(1)
    }

    /// Node ids of the bottom surface (first of each column), by column.
    #[must_use]
    pub fn bottom_nodes(&self) -> Vec<u32> {
        (0..self.column_count()).map(|column| (column * self.nodes_per_column) as u32).collect()
    }

    /// Node ids of the top surface (last of each column), by column.
    #[must_use]
    pub fn top_nodes(&self) -> Vec<u32> {
        (1..=self.column_count())
            .map(|column| (column * self.nodes_per_column - 1) as u32)
            .collect()
    }

    /// Unit normals of the mid-surfaces at the element centres, from the lower to the upper face.
    #[must_use]
    pub fn normals(&self) -> Vec<Vec3> {
        let normal = |element: &[u32; 8]| {
            let x = element.map(|n| self.nodes[n as usize]);
            let middle = |k: usize| 0.5 * (x[k] + x[k + 4]);
            let across = (middle(2) - middle(0)).cross(&(middle(3) - middle(1)));
            across.try_normalize(0.0).unwrap_or_default()
        };
        self.elements.iter().map(normal).collect()
    }

    /// Mean length of the columns [mm].
    #[must_use]
    pub fn mean_thickness(&self) -> f64 {
        let steps = self.nodes.chunks(self.nodes_per_column.max(1)).flat_map(|c| c.windows(2));
        let sum: f64 = steps.map(|w| (w[1] - w[0]).norm()).sum();
        sum / self.column_count().max(1) as f64
    }

    /// Volume of the sheet that belongs to each node [mm³]: an eighth of each adjacent element, whose volume is that at the
    /// Jacobian of its centre.
    #[must_use]
    pub fn node_volumes(&self) -> Vec<f64> {
        let mut volumes = vec![0.0; self.nodes.len()];
        for element in &self.elements {
            let x = element.map(|node| self.nodes[node as usize]);
            let mean = |ends: [[usize; 2]; 4]| -> Vec3 {
                ends.iter().map(|[from, to]| 0.25 * (x[*to] - x[*from])).sum()
            };
            let a = mean([[0, 1], [3, 2], [4, 5], [7, 6]]);
            let b = mean([[0, 3], [1, 2], [4, 7], [5, 6]]);
            let c = mean([[0, 4], [1, 5], [2, 6], [3, 7]]);
            let volume = a.cross(&b).dot(&c).abs();
            element.iter().for_each(|&node| volumes[node as usize] += 0.125 * volume);
        }
        volumes
    }

    /// Unknowns (three for each node) grouped by through-thickness column, or by node if the mesh has no columns.
    #[must_use]
    pub fn groups(&self) -> Groups {
        let levels = self.nodes_per_column.max(1);
        let centers = self
            .nodes
            .chunks(levels)
            .map(|column| column.iter().sum::<Vec3>() / column.len() as f64)
            .collect();
        Groups {
            of_unknown: (0..3 * self.nodes.len()).map(|i| (i / 3 / levels) as u32).collect(),
            centers,
        }
    }

    /// Plan coordinates `(x, y)` [mm] of the bottom node of each column: input of nested dissection.
    #[must_use]
    pub fn column_coordinates(&self) -> Vec<Vec2> {
        self.bottom_nodes()
            .iter()
            .map(|&node| {
                let p = self.nodes[node as usize];
                Vec2::new(p.x, p.y)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangle_has_columns_of_consecutive_nodes() {
        let mesh = rectangle(3.0, 2.0, 0.5, 3, 2, 2);
        assert_eq!(mesh.nodes.len(), 4 * 3 * 3);
        assert_eq!(mesh.elements.len(), 12);
        let plan = mesh.column_coordinates();
        for (column, (&low, &high)) in mesh.bottom_nodes().iter().zip(&mesh.top_nodes()).enumerate()
        {
            for node in low..=high {
                let p = mesh.nodes[node as usize];
                assert_eq!(Vec2::new(p.x, p.y), plan[column]);
            }
            assert_eq!(mesh.nodes[low as usize].z, 0.0);
            assert_eq!(mesh.nodes[high as usize].z, 0.5);
        }
    }

    #[test]
    fn rectangle_elements_are_right_handed() {
        for element in &rectangle(3.0, 2.0, 0.5, 3, 2, 2).elements {
            let mesh = rectangle(3.0, 2.0, 0.5, 3, 2, 2);
            let p = |local: usize| mesh.nodes[element[local] as usize];
            let volume = (p(1) - p(0)).cross(&(p(3) - p(0))).dot(&(p(4) - p(0)));
            assert!((volume - 0.25).abs() < 1e-15);
        }
    }

    /// Consistent orientation, no node twice, area of the polygon between the spokes.
    #[test]
    fn a_thickened_quarter_disc_is_sound() {
        let (core, rings) = (5, 7);
        let (points, quads) = quarter_disc(60.0, core, rings);
        assert_eq!(points.len(), (core + 1) * (core + 1) + (2 * core + 1) * rings);
        check_sheet(&points, &quads, 2 * core);
    }

    #[test]
    fn a_thickened_disc_is_sound_and_its_quads_well_shaped() {
        for (core, rings) in [(1, 1), (2, 3), (5, 7), (12, 9)] {
            let (points, quads) = disc(60.0, core, rings);
            // Euler characteristic of a disc: one more node than sides minus quads.
            assert_eq!(points.len(), (2 * core + 1).pow(2) + 8 * core * rings);
            assert_eq!(quads.len(), 4 * core * core + 8 * core * rings);
            let mut sides = HashMap::new();
            for q in &quads {
                (0..4).for_each(|k| *sides.entry([q[k], q[(k + 1) % 4]]).or_insert(0) += 1);
                for k in 0..4 {
                    let [at, a, b] = [k, k + 1, k + 3].map(|k| points[q[k % 4] as usize]);
                    let angle = (a - at).angle(&(b - at)).to_degrees();
                    assert!((40.0..150.0).contains(&angle), "{angle} with {core} and {rings}");
                }
            }
            assert!(sides.values().all(|&n| n == 1));
            let border = sides.keys().filter(|[a, b]| !sides.contains_key(&[*b, *a])).count();
            assert_eq!(border, 8 * core);
            check_sheet(&points, &quads, 8 * core);
        }
    }

    /// Positive elements that fill the part of the polygon with `4 * spokes` sides, or `spokes` of a whole disc.
    fn check_sheet(points: &[Vec3], quads: &[[u32; 4]], spokes: usize) {
        let whole = points.iter().any(|p| p.x < 0.0);
        let mesh = thickened(points, quads, 0.8, 2);
        assert_eq!(mesh.column_count(), points.len());
        let mut volume = 0.0;
        for e in &mesh.elements {
            let p = e.map(|n| mesh.nodes[n as usize]);
            let area = (p[2] - p[0]).cross(&(p[3] - p[1])).z * 0.5;
            assert!(area > 0.0);
            volume += area * (p[4] - p[0]).z;
        }
        let spokes = spokes as f64;
        let turn = if whole { 4.0 * FRAC_PI_2 } else { FRAC_PI_2 };
        let polygon = spokes * 0.5 * 60.0 * 60.0 * (turn / spokes).sin();
        assert!((volume - 0.8 * polygon).abs() < 1e-9 * volume, "{volume} {polygon}");
    }
}
