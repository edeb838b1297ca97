//! The tools in `report.html`: shape errors of their audits, and a 3-D view.

use std::path::{Path, PathBuf};

use crate::geometry::Vec3;
use crate::report::charts::{ValuedSurface, surfaces};
use crate::report::page::Page;
use crate::report::vtu_read;
use crate::run::fields;
use crate::scene::Plan;
use crate::scene::plan::PlannedTool;

/// Divisions of a patch in the 3-D view.
const DIVISIONS: usize = 4;

/// A tool on the page.
pub(super) struct ToolView {
    /// Cells of the table: name, patches, figures of the audit.
    row: Vec<String>,
    surface: ValuedSurface,
}

impl ToolView {
    /// The tools of a plan, each moved by its shift from the frame of its file [mm].
    pub(super) fn of_plan(plan: &Plan, shifts: &[Vec3]) -> Vec<Self> {
        let tools = plan.scene.tools.iter().zip(&plan.tools).zip(shifts);
        tools.map(|((tool, loaded), shift)| Self::of_tool(&tool.name, loaded, shift)).collect()
    }

    fn of_tool(name: &str, tool: &PlannedTool, shift: &Vec3) -> Self {
        let model = tool.surface.model();
        let row = audit_row(name, model.patches.len(), &beside(&tool.path, "json"));
        let audited = audited_surface(name, &beside(&tool.path, "vtu"), shift);
        let surface = audited.unwrap_or_else(|| {
            let (points, triangles) = fields::tessellate(model, DIVISIONS, shift);
            uniform(name, points, triangles)
        });
        Self { row, surface }
    }

    /// A tool from its file in the run folder; `None` if that cannot be read.
    pub(super) fn of_file(name: &str, path: &Path) -> Option<Self> {
        let grid = vtu_read::read(path).ok()?;
        let triangles = triangles(&grid);
        let row = [name, "", "", "", "", "", ""].map(str::to_owned).into();
        Some(Self { row, surface: uniform(name, grid.points, triangles) })
    }
}

/// Writes the table and the 3-D view of the tools.
pub(super) fn views(page: &mut Page, tools: &[ToolView]) {
    let rows: Vec<Vec<String>> = tools.iter().map(|tool| tool.row.clone()).collect();
    let head = ["tool", "patches", "max [mm]", "min [mm]", "rms [mm]", "normal error [deg]", "CAD"];
    page.table(&head, &rows);
    if rows.iter().any(|row| row[2] == NOT_AUDITED) {
        page.text(HOW_TO_AUDIT);
    }
    let parts: Vec<ValuedSurface> = tools.iter().map(|tool| tool.surface.clone()).collect();
    let (traces, layout) = surfaces(&parts);
    page.plot(&traces, &layout, 640);
}

/// A surface in one colour.
fn uniform(name: &str, points: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> ValuedSurface {
    ValuedSurface {
        name: name.to_owned(),
        points,
        triangles,
        opacity: 0.7,
        ..ValuedSurface::default()
    }
}

/// A file of the audit beside a tool file `NAME.tool.json`: `NAME.audit.EXTENSION`.
fn beside(tool: &Path, extension: &str) -> PathBuf {
    let name = tool.file_name().unwrap_or_default().to_string_lossy();
    let stem = name.strip_suffix(".tool.json").unwrap_or(&name).to_owned();
    tool.with_file_name(format!("{stem}.audit.{extension}"))
}

const NOT_AUDITED: &str = "not audited";
const HOW_TO_AUDIT: &str = "A tool counts as audited where its audit lies beside its file NAME.tool.json before the run: figures in \
     NAME.audit.json, the surface in NAME.audit.vtu.";

fn audit_row(name: &str, patches: usize, path: &Path) -> Vec<String> {
    let audit = crate::files::read(path, crate::files::Input::Description)
        .ok()
        .and_then(|bytes| serde_json::from_slice::<serde_json::Value>(&bytes).ok());
    let mut row = vec![name.to_owned(), patches.to_string()];
    let Some(audit) = audit else {
        row.extend([NOT_AUDITED, "", "", "", ""].map(str::to_owned));
        return row;
    };
    for key in ["max_mm", "min_mm", "rms_mm", "normal_max_deg"] {
        row.push(audit[key].as_f64().map_or_else(String::new, |v| format!("{v:.4}")));
    }
    row.push(audit["cad_file"].as_str().unwrap_or_default().to_owned());
    row
}

/// The surface of a tool from its audit, at the initial position of the tool.
fn audited_surface(name: &str, path: &Path, shift: &Vec3) -> Option<ValuedSurface> {
    let grid = vtu_read::read(path).ok()?;
    let error = grid.point_data.iter().find(|a| a.name.starts_with("shape_error"))?;
    Some(ValuedSurface {
        name: name.to_owned(),
        points: grid.points.iter().map(|p| p + shift).collect(),
        triangles: triangles(&grid),
        values: error.values.clone(),
        quantity: format!("{name}: shape error [mm]"),
        opacity: 1.0,
        signed: true,
        hidden: false,
    })
}

/// The cells of a grid of polygons as triangles.
fn triangles(grid: &vtu_read::Grid) -> Vec<[u32; 3]> {
    let of_cell = |ids: &Vec<u32>| -> Vec<[u32; 3]> {
        (2..ids.len()).map(|k| [ids[0], ids[k - 1], ids[k]]).collect()
    };
    grid.cells.iter().flat_map(|(_, ids)| of_cell(ids)).collect()
}
