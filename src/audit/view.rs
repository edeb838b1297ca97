//! Audit picture: patches divided into cells and coloured by shape error.

use super::sample::PatchSamples;
use kanagata_geometry::Vec3;
use kanagata_report::{CellKind, DataArray, Vtu};
use kanagata_tool::ToolModel;

/// Grid points of all patches and the cells between them; points without comparison are NaN.
pub(super) struct Cut {
    pub(super) points: Vec<Vec3>,
    pub(super) delta: Vec<f64>,
    normal: Vec<f64>,
    /// Patch index and point indices of each cell.
    pub(super) cells: Vec<(usize, Vec<usize>)>,
}

pub(super) fn cut(tool: &ToolModel, samples: &[PatchSamples]) -> Cut {
    let mut out = Cut { points: vec![], delta: vec![], normal: vec![], cells: vec![] };
    for (id, (patch, grid)) in tool.patches.iter().zip(samples).enumerate() {
        let start = out.points.len();
        for ([i, j], sample) in grid.coordinates().zip(&grid.points) {
            let at = |k: usize| k as f64 / grid.n as f64;
            out.points.push(sample.map_or_else(|| patch.derivs(at(i), at(j)).s, |s| s.point));
            out.delta.push(sample.map_or(f64::NAN, |s| s.delta));
            out.normal.push(sample.and_then(|s| s.normal_deg).unwrap_or(f64::NAN));
        }
        let shifted = |cell: Vec<usize>| cell.into_iter().map(|k| k + start).collect();
        out.cells.extend(grid.cells().into_iter().map(|c| (id, shifted(c))));
    }
    out
}

/// The patches as an unstructured grid: point data `shape_error_mm`, `normal_error_deg`; cell data `face`, `patch`.
#[must_use]
pub fn grid(tool: &ToolModel, samples: &[PatchSamples]) -> Vtu {
    let cut = cut(tool, samples);
    let mut vtu = Vtu::new(cut.points);
    for (_, cell) in &cut.cells {
        let kind = if cell.len() == 3 { CellKind::Triangle } else { CellKind::Quad };
        let ids: Vec<u32> = cell.iter().map(|&k| k as u32).collect();
        vtu.push_cell(kind, &ids);
    }
    let of_cells = |value: &dyn Fn(usize) -> i32| cut.cells.iter().map(|c| value(c.0)).collect();
    vtu.point_data.push(DataArray::scalar("shape_error_mm", cut.delta));
    vtu.point_data.push(DataArray::scalar("normal_error_deg", cut.normal));
    vtu.cell_data.push(DataArray::integer("face", of_cells(&|p| tool.faces[p] as i32)));
    vtu.cell_data.push(DataArray::integer("patch", of_cells(&|p| p as i32)));
    vtu
}
