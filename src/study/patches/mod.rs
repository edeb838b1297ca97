//! Patches over accuracy: shape and normal error of every method over its number of patches, with the times of
//! conversion and queries. A model that cannot be made is a row with its reason.
//!
//! - `description`: the file; `measure`: one model of a method; `output`: table, charts and page

mod description;
mod measure;
mod output;

use std::path::Path;

pub(super) use self::description::check;
pub use self::description::{Edges, FormatTag, Method, PatchStudy, Queries};
use self::measure::{Bench, Row, Size};
use super::StudyError;
use kanagata_cad::Model;

/// Makes and measures all models of `study` from the CAD `model`. Writes `patches.csv`, `fewest.csv`, `patches.html` and
/// the charts (SVG) into `folder`, and reports one line per model. Returns the number of models that could not be made.
///
/// # Errors
/// [`StudyError::Value`] when the CAD cannot be meshed for the query points, [`StudyError::Write`].
pub fn run(
    study: &PatchStudy,
    model: &Model,
    [file, folder]: [&Path; 2],
    say: &dyn Fn(&str),
) -> Result<usize, StudyError> {
    let bench = Bench::new(study, model).map_err(|e| StudyError::Value {
        path: file.to_path_buf(),
        place: "cad".into(),
        found: e.to_string(),
        allowed: "CAD whose faces can be meshed".into(),
    })?;
    let mut rows: Vec<Row<'_>> = Vec::new();
    for method in &study.methods {
        let divisions = method.divisions.iter().map(|&n| Size::Divisions(n));
        for size in divisions.chain(method.tolerances_mm.iter().map(|&t| Size::Tolerance(t))) {
            let row = bench.row(method, size);
            say(&row.to_string());
            rows.push(row);
        }
    }
    output::write(study, &rows, folder)?;
    Ok(rows.iter().filter(|r| r.sound().is_none()).count())
}
