//! Results of an earlier run where a command fails before it writes its own: they are not taken for these.

use std::path::Path;

use super::exit::{Exit, Failure};
use super::terminal::err;
use crate::files::{Input, read};
use crate::report::record::RunRecord;
use crate::run::RunError;

/// Removes the metrics of an earlier run, which a program that calls this one would take for those of the new run.
///
/// # Errors
/// Exit code 4 when the file cannot be removed.
pub(super) fn forget_metrics(path: Option<&Path>) -> Result<(), Failure> {
    let Some(path) = path.filter(|path| path.is_file()) else { return Ok(()) };
    std::fs::remove_file(path).map_err(|error| {
        let what = format!("cannot remove the earlier metrics {}: {error}", path.display());
        Failure::new(Exit::Io, what)
    })
}

/// Says of which run the results in `folder` are, after a run has failed that did not touch them.
pub(super) fn note_results(folder: &Path, failure: &Failure) {
    let says_so = matches!(
        failure.error.downcast_ref::<RunError>(),
        Some(
            RunError::Busy { .. }
                | RunError::Unfinished { .. }
                | RunError::Foreign { .. }
                | RunError::AlreadyComplete { .. }
        )
    );
    if failure.exit != Exit::Input || says_so {
        return;
    }
    let text = read(&folder.join("run.json"), Input::Description);
    let Some(record) = text.ok().and_then(|text| RunRecord::parse(&text).ok()) else { return };
    err!(
        "note: {} still holds the results of an earlier run, not of this one: {}, {}, {} increments",
        folder.display(),
        record.name,
        record.verdict,
        record.increments
    );
}
