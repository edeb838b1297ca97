//! The tools in `report.html`: shape errors of their audits, and a 3-D view.

use std::path::{Path, PathBuf};

use super::steps::Step;
use crate::fields;
use kanagata_geometry::Vec3;
use kanagata_report::page::Page;
use kanagata_report::record::History;
use kanagata_report::viewer::{Field, Frame, Surface, View, Visibility, connected, fans};
use kanagata_report::vtu_read::{self, GridArray};
use kanagata_scene::Plan;
use kanagata_scene::plan::PlannedTool;
use kanagata_scene::types::Tool;

/// Divisions of a patch in the 3-D view.
const DIVISIONS: usize = 4;

/// A tool on the page.
pub(super) struct ToolView {
    /// Cells of the table: name, patches, figures of the audit.
    row: Vec<String>,
    /// The surface at the end.
    pub(super) surface: Surface,
    /// Unit direction of travel; zero if unknown.
    direction: Vec3,
}

impl ToolView {
    /// The tools of a plan, each moved by its shift from the frame of its file [mm].
    pub(super) fn of_plan(plan: &Plan, shifts: &[Vec3]) -> Vec<Self> {
        let tools = plan.scene.tools.iter().zip(&plan.tools).zip(shifts);
        let view = |((tool, loaded), shift): ((&Tool, &PlannedTool), &Vec3)| {
            let direction = Vec3::from(tool.direction).normalize();
            Self { direction, ..Self::of_tool(&tool.name, loaded, shift) }
        };
        tools.map(view).collect()
    }

    fn of_tool(name: &str, tool: &PlannedTool, shift: &Vec3) -> Self {
        let model = tool.surface.model();
        let row = audit_row(name, model.patches.len(), &beside(&tool.path, "json"));
        let audited = audited_surface(name, &beside(&tool.path, "vtu"), shift);
        let surface = audited.unwrap_or_else(|| {
            let (points, triangles) = fields::tessellate(model, DIVISIONS, shift);
            uniform(name, points, triangles)
        });
        Self { row, surface, direction: Vec3::zeros() }
    }

    /// A tool from its file in the run folder; `None` if that cannot be read.
    pub(super) fn of_file(name: &str, path: &Path) -> Option<Self> {
        let grid = vtu_read::read(path).ok()?;
        let (triangles, _) = fans(grid.cells.iter().map(|(_, ids)| ids.as_slice()));
        let row = [name, "", "", "", "", "", ""].map(str::to_owned).into();
        let surface = uniform(name, grid.points, triangles);
        Some(Self { row, surface, direction: Vec3::zeros() })
    }

    /// The tool with the index `tool` in the history, at each step.
    pub(super) fn frames(&self, tool: usize, history: &History, steps: &[Step]) -> Vec<Frame> {
        let travel = |travels: &[f64]| travels.get(tool).copied().unwrap_or(0.0);
        let end = history.rows.last().map_or(0.0, |row| travel(&row.travel_mm));
        let frame = |step: &Step| Frame {
            shift: self.direction * (travel(&step.travel_mm) - end),
            ..Frame::default()
        };
        steps.iter().map(frame).collect()
    }
}

/// Writes the table and the 3-D view of the tools of a model with these symmetry planes.
pub(super) fn views(page: &mut Page, tools: &[ToolView], symmetry: &[(usize, f64)]) {
    let rows: Vec<Vec<String>> = tools.iter().map(|tool| tool.row.clone()).collect();
    let head = ["tool", "patches", "max [mm]", "min [mm]", "rms [mm]", "normal error [deg]", "CAD"];
    page.table(&head, &rows);
    if rows.iter().any(|row| row[2] == NOT_AUDITED) {
        page.text(HOW_TO_AUDIT);
    }
    let surfaces = tools.iter().map(|tool| tool.surface.clone()).collect();
    let symmetry = symmetry.to_vec();
    let title = "The tools at the end".into();
    page.view(&View { title, surfaces, symmetry, ..View::default() });
}

/// A surface in one colour. Patches have no common points.
fn uniform(name: &str, points: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Surface {
    Surface {
        name: name.to_owned(),
        cells: connected(&triangles, points.len()),
        cell_name: "patch",
        visibility: Visibility::Transparent,
        points,
        triangles,
        ..Surface::default()
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
    let audit = kanagata_files::read(path, kanagata_files::Input::Description)
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

/// The surface of a tool from its audit, moved by `shift`.
fn audited_surface(name: &str, path: &Path, shift: &Vec3) -> Option<Surface> {
    let grid = vtu_read::read(path).ok()?;
    let is_error = |a: &&GridArray| a.name.starts_with("shape_error") && a.components == 1;
    let error = grid.point_data.iter().find(is_error)?;
    let patches = grid.cell_data.iter().find(|a| a.name == "patch" && a.components == 1);
    let (triangles, owners) = fans(grid.cells.iter().map(|(_, ids)| ids.as_slice()));
    let patch = |cell: u32| patches.map_or(cell, |patches| patches.values[cell as usize] as u32);
    Some(Surface {
        name: name.to_owned(),
        points: grid.points.iter().map(|p| p + shift).collect(),
        cells: owners.into_iter().map(patch).collect(),
        triangles,
        cell_name: "patch",
        fields: vec![Field {
            name: "shape error [mm]".into(),
            signed: true,
            values: error.values.clone(),
            ..Field::default()
        }],
        ..Surface::default()
    })
}
