//! The sheet for checks before a run: its counts, and for a large one a coarser mesh with the same outline.

use super::blank::tolerance_of;
use super::plan::Plan;
use super::types::{Blank, BlankShape, Region};
use kanagata_geometry::Aabb;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// Largest number of elements that are checked without coarsening. A check of 10 000 takes some 0.1 s and 30 MB; twice
/// as many take twice as much.
const CHECKED_ELEMENTS_MAX: usize = 10_000;

/// Counts of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SheetCounts {
    /// Elements.
    pub elements: usize,
    /// Nodes.
    pub nodes: usize,
    /// Columns of nodes along the two in-plane directions, the shorter first, for a grid with the same outline.
    pub columns: [f64; 2],
    /// Nodes through the thickness.
    pub levels: usize,
}

impl SheetCounts {
    /// Counts of a blank described in the scene; `None` for a mesh file or a refined blank.
    #[must_use]
    pub fn of_blank(blank: &Blank) -> Option<Self> {
        if !blank.refine.is_empty() {
            return None;
        }
        let (quads, columns, grid) = match blank.shape {
            BlankShape::Rectangle { elements: [nx, ny], .. } => {
                (nx * ny, (nx + 1) * (ny + 1), [nx + 1, ny + 1].map(|n| n as f64))
            }
            BlankShape::QuarterDisc { core, rings, .. } => {
                let columns = (core + 1) * (core + 1) + rings * (2 * core + 1);
                (core * core + 2 * core * rings, columns, [(columns as f64).sqrt(); 2])
            }
            BlankShape::Disc { core, rings, .. } => {
                let columns = (2 * core + 1) * (2 * core + 1) + 8 * core * rings;
                (4 * (core * core + 2 * core * rings), columns, [(columns as f64).sqrt(); 2])
            }
            BlankShape::Mesh { .. } => return None,
        };
        let levels = blank.layers + 1;
        let [a, b] = grid;
        Some(Self {
            elements: quads * blank.layers,
            nodes: columns * levels,
            columns: [a.min(b), a.max(b)],
            levels,
        })
    }

    /// Counts of a mesh, with the columns of a grid of the same number, length and width.
    #[must_use]
    pub fn of_mesh(mesh: &HexMesh) -> Self {
        let bounds = Aabb::of_points(&mesh.nodes);
        let mut sides: [f64; 3] = (bounds.max - bounds.min).into();
        sides.sort_by(f64::total_cmp);
        let ratio = (sides[1] / sides[2].max(f64::MIN_POSITIVE)).clamp(1e-3, 1.0);
        let count = mesh.column_count() as f64;
        let short = (count * ratio).sqrt().max(1.0);
        Self {
            elements: mesh.elements.len(),
            nodes: mesh.nodes.len(),
            columns: [short, count / short],
            levels: mesh.nodes_per_column,
        }
    }
}

impl Plan {
    /// The plan with a coarser mesh of the same outline, and the ratio of its element lengths to those of the scene.
    /// `None` if the mesh is small enough, refined, or read from a file.
    #[must_use]
    pub fn coarsened(&self) -> Option<(Self, f64)> {
        let counts = SheetCounts::of_blank(&self.scene.blank)?;
        if counts.elements <= CHECKED_ELEMENTS_MAX {
            return None;
        }
        let layers = self.scene.blank.layers;
        // With very many layers few elements would remain in plan: layers are reduced too.
        let kept_layers = layers.min(8);
        let quads = (counts.elements / layers) as f64;
        let ratio = (quads * kept_layers as f64 / CHECKED_ELEMENTS_MAX as f64).sqrt().max(1.0);
        let fewer = |n: usize| ((n as f64 / ratio).floor() as usize).max(1);
        let mut plan = self.clone();
        plan.scene.blank.layers = kept_layers;
        match &mut plan.scene.blank.shape {
            BlankShape::Rectangle { elements, .. } => {
                *elements = elements.map(fewer);
                let grids = [&self.scene.blank, &plan.scene.blank].map(Grid::of);
                let [Some(fine), Some(coarse)] = grids else { return None };
                let loads = plan.scene.loads.iter_mut().map(|load| &mut load.region);
                let holds = plan.scene.holds.iter_mut().map(|hold| &mut hold.region);
                holds.chain(loads).for_each(|region| *region = fine.moved(region, &coarse));
            }
            BlankShape::QuarterDisc { core, rings, .. } | BlankShape::Disc { core, rings, .. } => {
                (*core, *rings) = (fewer(*core), fewer(*rings));
            }
            BlankShape::Mesh { .. } => return None,
        }
        Some((plan, ratio))
    }
}

/// The planes of the nodes of a rectangle, for each axis.
struct Grid([Planes; 3]);

/// Equidistant planes.
#[derive(Clone, Copy)]
struct Planes {
    first: f64,
    size: f64,
    intervals: f64,
}

impl Planes {
    /// The plane nearest to a coordinate [mm].
    fn nearest(&self, at: f64) -> f64 {
        let share = ((at - self.first) / self.size * self.intervals).round();
        self.first + self.size * share.clamp(0.0, self.intervals) / self.intervals
    }

    /// A plane within a range, if any.
    fn within(&self, [low, high]: [f64; 2]) -> Option<f64> {
        let step = self.size / self.intervals;
        let first = self.nearest(low);
        [first, self.nearest(first + step)].into_iter().find(|at| (low..=high).contains(at))
    }
}

impl Grid {
    /// The grid of a rectangle; `None` for another blank.
    fn of(blank: &Blank) -> Option<Self> {
        let BlankShape::Rectangle { corner_mm, size_mm, elements } = blank.shape else {
            return None;
        };
        let plan = |k: usize| Planes {
            first: corner_mm[k],
            size: size_mm[k],
            intervals: elements[k] as f64,
        };
        let thickness =
            Planes { first: 0.0, size: blank.thickness_mm, intervals: blank.layers as f64 };
        Some(Self([plan(0), plan(1), thickness]))
    }

    /// Tolerance of the distance of nodes on a plane [mm].
    fn near(&self) -> f64 {
        let size = self.0.iter().map(|p| p.size).fold(0.0, f64::max);
        let far = |p: &Planes| p.first.abs().max((p.first + p.size).abs());
        tolerance_of(size, self.0.iter().map(far).fold(0.0, f64::max))
    }

    /// The equivalent region on a coarser grid: planes are moved to the nearest ones with nodes. A region without nodes
    /// on this grid has none there.
    fn moved(&self, region: &Region, coarse: &Self) -> Region {
        let near = self.near();
        match *region {
            Region::Plane(mut plane) => {
                let k = plane.normal.index();
                if (self.0[k].nearest(plane.at_mm) - plane.at_mm).abs() > near {
                    return Region::All(false);
                }
                plane.at_mm = coarse.0[k].nearest(plane.at_mm);
                Region::Plane(plane)
            }
            Region::Box { mut min_mm, mut max_mm } => {
                for k in 0..3 {
                    let range = [min_mm[k] - near, max_mm[k] + near];
                    let Some(at) = self.0[k].within(range) else { return Region::All(false) };
                    let at = coarse.0[k].nearest(at);
                    (min_mm[k], max_mm[k]) = (min_mm[k].min(at), max_mm[k].max(at));
                }
                Region::Box { min_mm, max_mm }
            }
            Region::All(_) | Region::BeyondRadiusMm(_) => *region,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_solver::sheet::hex_mesh::{disc, quarter_disc, rectangle, thickened};

    /// A plane and a box between nodes of the coarser grid, and between nodes of the finer one.
    #[test]
    fn regions_of_a_fine_grid_have_nodes_on_a_coarser_one() {
        let grid = |n: usize| {
            let shape = serde_json::json!(
                {"rectangle": {"corner_mm": [-50, 0], "size_mm": [100, 10], "elements": [n, 2]}}
            );
            let blank = serde_json::json!({"shape": shape, "thickness_mm": 1.0, "layers": 2});
            Grid::of(&serde_json::from_value(blank).unwrap()).unwrap()
        };
        let (fine, coarse) = (grid(1000), grid(7));
        let of = |text: &str| -> Region { serde_json::from_str(text).unwrap() };
        let moved = |text: &str| fine.moved(&of(text), &coarse);
        let Region::Plane(plane) = moved(r#"{"plane": {"normal": "x", "at_mm": 10.1}}"#) else {
            panic!("a plane stays one")
        };
        assert!((plane.at_mm - (-50.0 + 400.0 / 7.0)).abs() < 1e-9, "{}", plane.at_mm);
        let none = [
            r#"{"plane": {"normal": "x", "at_mm": 10.15}}"#,
            r#"{"box": {"min_mm": [10.11, 0, 0], "max_mm": [10.19, 10, 1]}}"#,
            r#"{"box": {"min_mm": [51, 0, 0], "max_mm": [60, 10, 1]}}"#,
        ];
        none.into_iter().for_each(|text| assert_eq!(moved(text), Region::All(false), "{text}"));
        let Region::Box { min_mm, max_mm } =
            moved(r#"{"box": {"min_mm": [10.05, 0, 0.5], "max_mm": [10.15, 10, 0.5]}}"#)
        else {
            panic!("a box stays one")
        };
        assert!(min_mm[0] < 7.2 && max_mm[0] == 10.15 && min_mm[2] == 0.5, "{min_mm:?} {max_mm:?}");
        assert_eq!(moved(r#"{"beyond_radius_mm": 3}"#), of(r#"{"beyond_radius_mm": 3}"#));
    }

    #[test]
    fn counts_are_those_of_the_meshes() {
        let blank = |shape: serde_json::Value| -> Blank {
            serde_json::from_value(
                serde_json::json!({"shape": shape, "thickness_mm": 1.0, "layers": 3}),
            )
            .unwrap()
        };
        let of = |shape| SheetCounts::of_blank(&blank(shape)).unwrap();
        let same = |counts: SheetCounts, mesh: &HexMesh| {
            assert_eq!((counts.elements, counts.nodes), (mesh.elements.len(), mesh.nodes.len()));
            assert_eq!(counts.levels, mesh.nodes_per_column);
        };
        let mesh = rectangle(2.0, 3.0, 1.0, 5, 7, 3);
        same(of(serde_json::json!({"rectangle": {"size_mm": [2, 3], "elements": [5, 7]}})), &mesh);
        let (points, quads) = quarter_disc(9.0, 4, 3);
        same(
            of(serde_json::json!({"quarter_disc": {"radius_mm": 9, "core": 4, "rings": 3}})),
            &thickened(&points, &quads, 1.0, 3),
        );
        let (points, quads) = disc(9.0, 4, 3);
        same(
            of(serde_json::json!({"disc": {"radius_mm": 9, "core": 4, "rings": 3}})),
            &thickened(&points, &quads, 1.0, 3),
        );
        let [a, b] = SheetCounts::of_mesh(&mesh).columns;
        assert!((a * b - 48.0).abs() < 1e-9 && (b / a - 1.5).abs() < 1e-9, "{a} {b}");
    }
}
