//! Parameters that continue a run from its folder.

use std::path::{Path, PathBuf};

use kanagata_report::record::RunRecord;

/// Parameters that continue a run from its folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Restart {
    /// Scene file.
    pub scene: PathBuf,
    /// Run folder.
    pub folder: PathBuf,
    /// Values of the scene set from outside, `PATH=VALUE`.
    pub set: Vec<String>,
    /// Whether unreachable patches are excluded (`RunOptions::auto`), as in the first part of the run.
    pub auto: bool,
}

impl Restart {
    /// Restart of the run with the given record and the scene file `scene`.
    pub(super) fn of(record: &RunRecord, scene: &Path, folder: &Path) -> Self {
        let auto = !record.excluded_patches.is_empty();
        let set = record.set.clone();
        Self { scene: scene.into(), folder: folder.into(), set, auto }
    }
}
