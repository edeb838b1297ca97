//! A sequence of runs into a folder of results.

use std::path::Path;

use super::error::AccuracyError;
use super::publish::RUNS;
use super::runner::{Limits, Observer};
use super::sequence::run_to_accuracy;
use kanagata_report::record::RunRecord;
use kanagata_run::{RunOptions, lock_folder};
use kanagata_scene::accuracy::Accuracy;
use kanagata_scene::set_value::SetValue;

/// Runs the scene at `scene` (with `set`) to its accuracy, or to `accuracy` if given. The runs are in `output/accuracy`; the files
/// of the best one, with the estimated errors in `run.json`, are in `output`. The same call continues a sequence that was
/// stopped. No `report.html` is written.
///
/// # Errors
/// [`AccuracyError`]; a folder of other files, and one that another process works in, are those of [`kanagata_run::RunError`].
pub fn run_into(
    scene: &Path,
    set: &[SetValue],
    accuracy: Option<Accuracy>,
    output: &Path,
    limits: &Limits,
    observer: &mut dyn Observer,
) -> Result<RunRecord, AccuracyError> {
    let options = RunOptions {
        overwrite: limits.overwrite,
        break_lock: limits.break_lock,
        ..RunOptions::default()
    };
    let _lock = lock_folder(output, &options)?;
    run_to_accuracy(scene, set, accuracy, &output.join(RUNS), limits, observer)?.publish(output)
}
