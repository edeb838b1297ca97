//! `report.html`: force over travel, thickness, the formed sheet and the tools in 3-D, audits.

mod sheet;
mod summary;
mod thickness;

use std::path::Path;

use super::fields;
use super::folder::RunFolder;
use crate::files::WriteError;
use crate::geometry::Vec3;
use crate::report::charts::{Series, ValuedSurface, lines, surfaces};
use crate::report::page::Page;
use crate::report::record::History;
use crate::report::vtu_read;
use crate::scene::Plan;
use crate::solver::Simulation;

/// Writes `report.html`. Audits beside the tool files (`NAME.audit.json`, `NAME.audit.vtu`) are included.
///
/// # Errors
/// [`WriteError`] when the folder is missing or full.
pub fn write(folder: &RunFolder, plan: &Plan, simulation: &Simulation) -> Result<(), WriteError> {
    let mesh = simulation.body().mesh();
    let positions = fields::positions(mesh, simulation.displacements());
    let thickness = fields::column_thickness(mesh, &positions);
    let mut page = Page::new(&plan.scene.name);
    page.doubts(&folder.record.doubts);
    summary::tables(&mut page, &folder.record, &plan.card.name);
    page.heading("Force against travel");
    let (travelled, title) = path(&folder.history);
    let series = force_series(&folder.history, &travelled);
    let (traces, layout) = lines(&series, &title, "force, whole process [N]");
    page.plot(&traces, &layout, 420);
    page.heading("Thickness");
    thickness::chart(&mut page, &plan.scene.blank.shape, mesh, &thickness);
    sheet::strains(&mut page, folder, simulation);
    sheet::formed(&mut page, simulation.body(), &positions, thickness);
    page.heading("The tools and their shape error");
    tools(&mut page, plan, simulation);
    page.write(&folder.path.join("report.html"))
}

/// Fraction of the longest stage travel above which a stage counts as moving a tool.
const STAGE_TRAVEL_MIN_REL: f64 = 0.01;

/// The abscissa of force curves and its title: travel of the moving tool. If stages move different tools, their travels
/// are added up.
fn path(history: &History) -> (Vec<f64>, String) {
    let stages = leading_tools(history);
    let travel = |row: usize, tool: usize| history.rows[row].travel_mm[tool];
    let longest = stages.iter().map(|s| s.2).fold(0.0, f64::max);
    let mut moving: Vec<usize> =
        stages.iter().filter(|s| s.2 > STAGE_TRAVEL_MIN_REL * longest).map(|s| s.1).collect();
    moving.dedup();
    if let &[tool] = moving.as_slice() {
        let travels = (0..history.rows.len()).map(|row| travel(row, tool)).collect();
        return (travels, format!("travel of {} [mm]", history.tools[tool]));
    }
    let mut travelled = Vec::with_capacity(history.rows.len());
    let mut far = 0.0;
    for (k, &(first, tool, stage_travel)) in stages.iter().enumerate() {
        let end = stages.get(k + 1).map_or(history.rows.len(), |next| next.0);
        for row in first..end {
            let step = if stage_travel > STAGE_TRAVEL_MIN_REL * longest {
                travel(row, tool) - travel_before(history, row, tool)
            } else {
                0.0
            };
            far += step.abs();
            travelled.push(far);
        }
    }
    let names: Vec<&str> = moving.iter().map(|&tool| history.tools[tool].as_str()).collect();
    (travelled, format!("travel of {} [mm]", names.join(", then ")))
}

/// Travel of a tool before a row of the history [mm].
fn travel_before(history: &History, row: usize, tool: usize) -> f64 {
    row.checked_sub(1).map_or(0.0, |row| history.rows[row].travel_mm[tool])
}

/// First row of each stage, the tool with the longest travel in it, and that travel [mm].
fn leading_tools(history: &History) -> Vec<(usize, usize, f64)> {
    let mut stages = Vec::new();
    let mut first = 0;
    for stage in history.rows.chunk_by(|a, b| a.stage == b.stage) {
        let last = &history.rows[first + stage.len() - 1];
        let travel =
            |tool: usize| (last.travel_mm[tool] - travel_before(history, first, tool)).abs();
        let tools = 0..history.tools.len();
        let leading = tools.max_by(|&a, &b| travel(a).total_cmp(&travel(b)));
        let leading = leading.map_or((0, 0.0), |tool| (tool, travel(tool)));
        stages.push((first, leading.0, leading.1));
        first += stage.len();
    }
    stages
}

/// One force curve per tool.
fn force_series(history: &History, travelled: &[f64]) -> Vec<Series> {
    let tools = history.tools.iter().enumerate();
    tools
        .map(|(k, name)| Series {
            name: name.clone(),
            x: travelled.to_vec(),
            y: history.rows.iter().map(|r| r.force_n[k]).collect(),
        })
        .collect()
}

fn tools(page: &mut Page, plan: &Plan, simulation: &Simulation) {
    let shifts = simulation.tool_shifts();
    let mut rows = Vec::new();
    let mut parts = Vec::new();
    for ((tool, loaded), shift) in plan.scene.tools.iter().zip(&plan.tools).zip(&shifts) {
        let beside = |extension: &str| {
            let name = loaded.path.file_name().unwrap_or_default().to_string_lossy();
            let stem = name.strip_suffix(".tool.json").unwrap_or(&name).to_owned();
            loaded.path.with_file_name(format!("{stem}.audit.{extension}"))
        };
        rows.push(audit_row(&tool.name, loaded.surface.model().patches.len(), &beside("json")));
        parts.push(audited_surface(&tool.name, &beside("vtu"), shift).unwrap_or_else(|| {
            let (points, triangles) = fields::tessellate(loaded.surface.model(), 4, shift);
            ValuedSurface {
                name: tool.name.clone(),
                points,
                triangles,
                opacity: 0.7,
                ..ValuedSurface::default()
            }
        }));
    }
    let head = ["tool", "patches", "max [mm]", "min [mm]", "rms [mm]", "normal error [deg]", "CAD"];
    page.table(&head, &rows);
    if rows.iter().any(|row| row[2] == NOT_AUDITED) {
        page.text(HOW_TO_AUDIT);
    }
    let (traces, layout) = surfaces(&parts);
    page.plot(&traces, &layout, 640);
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
    let mut triangles = Vec::new();
    for (_, ids) in &grid.cells {
        triangles.extend((2..ids.len()).map(|k| [ids[0], ids[k - 1], ids[k]]));
    }
    Some(ValuedSurface {
        name: name.to_owned(),
        points: grid.points.iter().map(|p| p + shift).collect(),
        triangles,
        values: error.values.clone(),
        quantity: format!("{name}: shape error [mm]"),
        opacity: 1.0,
        signed: true,
        hidden: false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::record::HistoryRow;

    fn history(rows: &[(&str, [f64; 2])]) -> History {
        let row = |(stage, travels): &(&str, [f64; 2])| HistoryRow {
            increment: 1,
            stage: (*stage).into(),
            time: 0.0,
            travel_mm: travels.to_vec(),
            force_n: vec![0.0; 2],
            iterations: 1,
            contacts: [0; 2],
            energy: Default::default(),
        };
        History { tools: vec!["one".into(), "two".into()], rows: rows.iter().map(row).collect() }
    }

    #[test]
    fn forces_are_drawn_over_the_tool_that_moves_and_over_one_way_after_the_other() {
        let mut rows = vec![("hold", [0.01, 0.0]), ("draw", [0.02, 5.0]), ("draw", [0.0, 9.0])];
        let (travelled, title) = path(&history(&rows));
        assert_eq!(travelled, [0.0, 5.0, 9.0]);
        assert_eq!(title, "travel of two [mm]");
        rows.extend([("back", [2.0, 9.0]), ("back", [6.0, 9.0])]);
        let (travelled, title) = path(&history(&rows));
        assert_eq!(travelled, [0.0, 5.0, 9.0, 11.0, 15.0]);
        assert_eq!(title, "travel of two, then one [mm]");
        assert!(path(&history(&[])).0.is_empty());
        assert!(path(&History::default()).0.is_empty());
    }
}
