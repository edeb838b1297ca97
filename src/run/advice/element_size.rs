//! In-plane sizes of the sheet's elements.

use kanagata_geometry::box_tree::BoxTree;
use kanagata_geometry::frame::unit;
use kanagata_geometry::{Aabb, Vec3};
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// Smallest in-plane component of a direction along which the element size is measured.
const IN_PLANE_MIN: f64 = 0.1;

/// Shape error over the thickness that is acceptable for any tool.
pub(super) const SHAPE_ERROR_TOLERANCE_REL: f64 = 0.01;

/// An unbounded box.
pub(super) const EVERYWHERE: Aabb = Aabb {
    min: Vec3::new(f64::MIN, f64::MIN, f64::MIN),
    max: Vec3::new(f64::MAX, f64::MAX, f64::MAX),
};

/// In-plane edges of the sheet's elements, with a search tree.
pub(super) struct Sizes {
    tree: BoxTree,
    boxes: Vec<Aabb>,
    /// Mean edge vectors of each element along its two directions [mm].
    edges: Vec<[Vec3; 2]>,
    /// Mean length of all edges [mm].
    pub mean: f64,
    /// Acceptable shape error of a tool [mm].
    pub tolerance: f64,
    /// Mean thickness of the sheet [mm].
    pub thickness: f64,
    /// Element length of this mesh over that of the sheet it represents.
    ratio: f64,
}

/// Size of an element along a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Size {
    /// Length of the element [mm].
    pub length: f64,
    /// Components of the direction along the two edges of the element; the sum of their squares is 1.
    pub edge_components: [f64; 2],
}

impl Sizes {
    /// Sizes of the lowest layer, which all layers share, of a sheet with elements shorter by `ratio`.
    pub(super) fn new(mesh: &HexMesh, ratio: f64) -> Self {
        let levels = mesh.nodes_per_column.max(1);
        let lowest = |e: &&[u32; 8]| levels == 1 || (e[0] as usize).is_multiple_of(levels);
        let elements: Vec<&[u32; 8]> = mesh.elements.iter().filter(lowest).collect();
        let corner = |e: &[u32; 8], k: usize| mesh.nodes[e[k] as usize];
        let edges: Vec<[Vec3; 2]> = elements
            .iter()
            .map(|e| {
                let [p, q, r, s] = [0, 1, 2, 3].map(|k| corner(e, k));
                [0.5 * (q - p + r - s), 0.5 * (s - p + r - q)]
            })
            .collect();
        let boxes: Vec<Aabb> =
            elements.iter().map(|e| Aabb::of_points(&[0, 1, 2, 3].map(|k| corner(e, k)))).collect();
        let sum: f64 = edges.iter().map(|[a, b]| 0.5 * (a.norm() + b.norm())).sum();
        let mean = sum / edges.len().max(1) as f64 / ratio;
        let thickness = mesh.mean_thickness();
        let tolerance = SHAPE_ERROR_TOLERANCE_REL * thickness;
        Self { tree: BoxTree::build(&boxes), boxes, edges, mean, tolerance, thickness, ratio }
    }

    /// Whether the sheet covers a point, seen along the axis nearest to `along`, with a margin to its rim.
    pub(super) fn covers(&self, at: &Vec3, along: &Vec3) -> bool {
        let near = 1e-3 * self.mean * self.ratio;
        let axis = along.iamax();
        let across = [(axis + 1) % 3, (axis + 2) % 3];
        let beside = across.into_iter().flat_map(|k| [near, -near].map(|by| (k, by)));
        beside.into_iter().all(|(k, by)| {
            let mut column = EVERYWHERE;
            for k in across {
                (column.min[k], column.max[k]) = (at[k], at[k]);
            }
            column.min[k] += by;
            column.max[k] += by;
            let mut found = false;
            let over = |b: &Aabb| {
                across.iter().all(|&k| b.min[k] <= column.min[k] && column.min[k] <= b.max[k])
            };
            self.tree.overlapping(&column, |k| found |= over(&self.boxes[k as usize]));
            found
        })
    }

    /// Size along `direction` of the element nearest to `at`. If `direction` is normal to the sheet (walls that it is
    /// drawn along), the size across `other`, the axis of the bend.
    pub(super) fn along(&self, at: &Vec3, direction: &Vec3, other: &Vec3) -> Option<Size> {
        let mut nearest = None;
        self.tree.nearest(at, f64::INFINITY, |k, best| {
            let distance = self.boxes[k as usize].distance_squared(at);
            if distance < best || nearest.is_none() {
                nearest = Some(k);
            }
            distance.min(best)
        });
        let [a, b] = self.edges[nearest? as usize];
        let normal = unit(a.cross(&b))?;
        let flat = |v: &Vec3| v - normal * v.dot(&normal);
        let mut wanted = flat(direction);
        if wanted.norm() < IN_PLANE_MIN {
            wanted = normal.cross(&flat(other));
        }
        let wanted = unit(wanted)?;
        // Components along the edges: wanted = alpha a + beta b.
        let (aa, ab, bb) = (a.norm_squared(), a.dot(&b), b.norm_squared());
        let (wa, wb) = (wanted.dot(&a), wanted.dot(&b));
        let whole = aa * bb - ab * ab;
        let parts = [(wa * bb - wb * ab) / whole, (wb * aa - wa * ab) / whole];
        let length = 1.0 / parts[0].hypot(parts[1]);
        let edge_components = parts.map(|p| (p * length).abs());
        length.is_finite().then(|| Size { length: length / self.ratio, edge_components })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_solver::sheet::hex_mesh::rectangle;

    #[test]
    fn elements_are_measured_along_directions() {
        assert!((Sizes::new(&rectangle(10.0, 20.0, 0.8, 5, 10, 2), 1.0).mean - 2.0).abs() < 1e-12);
        // 1 x 5 mm.
        let sizes = Sizes::new(&rectangle(10.0, 20.0, 0.8, 10, 4, 2), 1.0);
        let at = Vec3::new(3.0, 3.0, 40.0);
        let length = |d: Vec3, o: Vec3| sizes.along(&at, &d, &o).unwrap().length;
        let (x, y, z) = (Vec3::x(), Vec3::y(), Vec3::z());
        assert!((length(x, y) - 1.0).abs() < 1e-12 && (length(y, x) - 5.0).abs() < 1e-12);
        // Half-way down a shoulder, and at its lower end.
        assert!((length((x - z).normalize(), y) - 1.0).abs() < 1e-12);
        assert!((length(z, y) - 1.0).abs() < 1e-12);
        let askew = sizes.along(&at, &(x + y).normalize(), &z).unwrap();
        assert!(
            askew.length > 1.0
                && askew.length < 5.0
                && askew.edge_components[0] > askew.edge_components[1]
        );
    }

    #[test]
    fn the_element_at_the_place_is_measured() {
        let mut mesh = rectangle(10.0, 2.0, 0.8, 2, 1, 1);
        // Columns at 0, 2 and 10 mm.
        mesh.nodes.iter_mut().filter(|n| n.x == 5.0).for_each(|n| n.x = 2.0);
        let sizes = Sizes::new(&mesh, 1.0);
        let at =
            |x: f64| sizes.along(&Vec3::new(x, 1.0, 3.0), &Vec3::x(), &Vec3::y()).unwrap().length;
        assert!((at(1.0) - 2.0).abs() < 1e-12 && (at(9.0) - 8.0).abs() < 1e-12);
    }
}
