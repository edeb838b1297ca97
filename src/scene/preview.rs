//! A scene as it is judged before it is run: the counts of its sheet, and a coarser sheet of the same outline where it is large.

use super::read::Plan;
use super::types::{Blank, BlankShape};
use crate::geometry::Aabb;
use crate::solver::blank::HexMesh;

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
            BlankShape::Rectangle { elements, .. } => *elements = elements.map(fewer),
            BlankShape::QuarterDisc { core, rings, .. } | BlankShape::Disc { core, rings, .. } => {
                (*core, *rings) = (fewer(*core), fewer(*rings));
            }
            BlankShape::Mesh { .. } => return None,
        }
        Some((plan, ratio))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::blank::{disc, quarter_disc, rectangle, thickened};

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
