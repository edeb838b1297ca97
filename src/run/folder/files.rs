//! Names of the files of a run, and what is kept of them between increments.

use serde::{Deserialize, Serialize};

use kanagata_report::record::{FilesRecord, HistoryRow};
use kanagata_solver::NodeContact;

pub(super) const HISTORY: &str = "history.csv";
pub(super) const ITERATIONS: &str = "iterations.csv";
/// The collection of all steps.
pub(super) const COLLECTION: &str = "run.pvd";
/// The sheet in the last converged state.
pub(super) const LAST: &str = "steps/last.vtu";

/// What the last report said that the simulation does not keep.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct LastReport {
    pub(super) row: HistoryRow,
    pub(super) contacts: Vec<NodeContact>,
    pub(super) face_depths: Vec<f64>,
}

/// The last file of a tool; without a name before the first is written.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(super) struct ToolFile {
    /// Its file in the folder.
    pub(super) file: String,
    /// Shift from the frame of the tool file that it has [mm].
    pub(super) shift: [f64; 3],
    /// The file at the initial position, and its shift.
    pub(super) first: (String, [f64; 3]),
}

/// The files of a run at its start.
pub(super) fn first_files() -> FilesRecord {
    FilesRecord {
        history: HISTORY.into(),
        iterations: ITERATIONS.into(),
        collection: COLLECTION.into(),
        ..FilesRecord::default()
    }
}
