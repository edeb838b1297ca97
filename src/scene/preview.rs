//! A scene as it is judged before it is run: the counts of its sheet, and a coarser sheet of the same outline where it is large.

use super::blank::near_of;
use super::plan::Plan;
use super::types::{Blank, BlankShape, Region};
use crate::geometry::Aabb;
use crate::solver::sheet::hex_mesh::HexMesh;

/// Elements of a sheet that is judged as it is; larger ones are judged on a coarser one of the same outline. At 10 000 a
/// judgement takes some 0.1 s and 30 MB; twice as many take twice as much.
const MAX_JUDGED_ELEMENTS: usize = 10_000;

/// Counts of a sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SheetCounts {
    /// Elements.
    pub elements: usize,
    /// Nodes.
    pub nodes: usize,
    /// Columns of nodes along the two directions of the sheet, the shorter first; those of a grid of the same outline.
    pub columns: [f64; 2],
    /// Nodes through the thickness.
    pub levels: usize,
}

impl SheetCounts {
    /// Of a blank that the scene describes; `None` of a mesh file.
    #[must_use]
    pub fn of_blank(blank: &Blank) -> Option<Self> {
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

    /// Of a mesh: a grid of as many columns, as long and wide as it is.
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
    /// The plan with a coarser sheet of the same outline, and the ratio of its elements' lengths to those of the scene; `None`
    /// where the sheet is small enough, or of a file: the elements of that are known to the file only.
    #[must_use]
    pub fn coarsened(&self) -> Option<(Self, f64)> {
        let counts = SheetCounts::of_blank(&self.scene.blank)?;
        if counts.elements <= MAX_JUDGED_ELEMENTS {
            return None;
        }
        let layers = self.scene.blank.layers;
        // Very many layers leave few elements in plan: they are fewer then, too.
        let kept_layers = layers.min(8);
        let quads = (counts.elements / layers) as f64;
        let ratio = (quads * kept_layers as f64 / MAX_JUDGED_ELEMENTS as f64).sqrt().max(1.0);
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

/// The planes that the nodes of a rectangle lie on, axis by axis.
struct Grid([Planes; 3]);

/// Planes at equal distances.
#[derive(Clone, Copy)]
struct Planes {
    first: f64,
    size: f64,
    intervals: f64,
}

impl Planes {
    /// The plane next to a coordinate [mm].
    fn nearest(&self, at: f64) -> f64 {
        let share = ((at - self.first) / self.size * self.intervals).round();
        self.first + self.size * share.clamp(0.0, self.intervals) / self.intervals
    }

    /// A plane in a range, if there is one.
    fn within(&self, [low, high]: [f64; 2]) -> Option<f64> {
        let step = self.size / self.intervals;
        let first = self.nearest(low);
        [first, self.nearest(first + step)].into_iter().find(|at| (low..=high).contains(at))
    }
}

impl Grid {
    /// Of a rectangle; `None` of any other blank.
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

    /// How far from a plane a node may be that is on it [mm].
    fn near(&self) -> f64 {
        let size = self.0.iter().map(|p| p.size).fold(0.0, f64::max);
        let far = |p: &Planes| p.first.abs().max((p.first + p.size).abs());
        near_of(size, self.0.iter().map(far).fold(0.0, f64::max))
    }

    /// The region of a coarser grid that stands for one of this grid: planes are moved to the nearest ones that have nodes. One
    /// without nodes of this grid has none there either.
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
    use crate::solver::sheet::hex_mesh::{disc, quarter_disc, rectangle, thickened};

    /// A plane and a box between nodes of the coarser grid, and between those of the finer one.
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
