//! `report.html`: outcome and answers, the formed sheet in 3-D, forces, strains in the forming limit diagram, draw-in,
//! thickness, tools with audits, set-up, and folded at the end diagnostics of the solver. Its contents come from the
//! simulation at the end of a run, or later from the files of the run folder.

mod accuracy;
mod border;
mod clamping;
mod contents;
mod diagnostics;
mod error;
mod files;
mod grid;
mod outcome;
mod section;
mod setup;
mod sheet;
mod springback;
mod steps;
mod thickness;
mod tools;

use std::path::{Path, PathBuf};

use self::border::Drawn;
use super::folder::RunFolder;
use contents::Contents;
use kanagata_files::WriteError;
use kanagata_report::page::Page;
use kanagata_report::plot::{Plot, Series};
use kanagata_report::record::History;
use kanagata_scene::Plan;
use kanagata_solver::Simulation;

pub use error::ReportError;

/// File name of the page in a run folder.
const PAGE: &str = "report.html";

/// Writes `report.html`. Audits beside the tool files (`NAME.audit.json`, `NAME.audit.vtu`) are included.
///
/// # Errors
/// [`WriteError`] when the folder is missing or full.
pub fn write(folder: &RunFolder, plan: &Plan, simulation: &Simulation) -> Result<(), WriteError> {
    page(&Contents::of_simulation(folder, plan, simulation)).write(&folder.path.join(PAGE))
}

/// A page written from the files of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WrittenPage {
    /// The page.
    pub path: PathBuf,
    /// Parts that the page lacks, each with the reason.
    pub missing: Vec<String>,
}

/// Writes `report.html` of an ended, stopped or killed run from its files. `folder` is a run folder, or the folder of a
/// case, which contains the run folder `run`.
///
/// The files are `run.json`, `history.csv`, `steps/*.vtu`, and the scene with the files it names if they are unchanged.
/// The page then has the same bytes as one that [`write`] makes at the end of the run. Without the scene or the last
/// state of the sheet the page lacks parts and lists them.
///
/// # Errors
/// [`ReportError`] when the folder contains no run, the run is in progress, a file is invalid, or the page cannot be
/// written.
pub fn write_from_files(folder: &Path) -> Result<WrittenPage, ReportError> {
    let read = files::read(&files::run_folder(folder))?;
    let contents = read.contents();
    let path = read.folder.join(PAGE);
    page(&contents).write(&path)?;
    Ok(WrittenPage { path, missing: contents.missing })
}

/// The page with these contents.
fn page(contents: &Contents<'_>) -> Page {
    let Contents { record, history, .. } = *contents;
    let mut page = Page::new(&record.name);
    outcome::sentence(&mut page, record);
    page.doubts(&record.doubts);
    contents.missing.iter().for_each(|part| page.text(&format!("Not on this page: {part}.")));
    let drawn = contents.sheet.as_ref().map(|sheet| Drawn::new(record, sheet, &contents.symmetry));
    let drawn = drawn.unwrap_or_default();
    outcome::answers(&mut page, record, history, &drawn);
    if let Some(record) = &record.accuracy {
        accuracy::errors(&mut page, record);
    }
    if let Some(sheet) = &contents.sheet {
        sheet::formed(&mut page, contents, sheet, sheet.thickness());
    }
    page.heading("Force against travel");
    let (travelled, title) = path(history);
    let series = force_series(history, &travelled);
    page.plot(&Plot::lines(series, &title, "force, whole process [N]"), 420);
    clamping::pressures(&mut page, record, history, (&travelled, &title));
    if let Some(sheet) = &contents.sheet {
        sheet::strains(&mut page, sheet, record);
        border::draw_in(&mut page, &drawn);
        springback::table(&mut page, record);
        section::sections(&mut page, &record.sections);
        page.heading("Thickness");
        thickness::chart(&mut page, sheet.shape, &sheet.mesh, &sheet.thickness());
    }
    page.heading("The tools and their shape error");
    tools::views(&mut page, &contents.tools, &contents.symmetry);
    setup::tables(&mut page, record, contents.plan);
    page.folded("Solver diagnostics", |page| diagnostics::tables(page, record));
    page
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

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_report::record::HistoryRow;

    fn history(rows: &[(&str, [f64; 2])]) -> History {
        let row = |(stage, travels): &(&str, [f64; 2])| HistoryRow {
            increment: 1,
            stage: (*stage).into(),
            time: 0.0,
            travel_mm: travels.to_vec(),
            force_n: vec![0.0; 2],
            pressure_mpa: Vec::new(),
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
