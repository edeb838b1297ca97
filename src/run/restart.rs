//! What continues a run from its folder.

use std::path::{Path, PathBuf};

use crate::report::record::RunRecord;

/// What continues a run from its folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Restart {
    /// Scene file.
    pub scene: PathBuf,
    /// Run folder.
    pub folder: PathBuf,
    /// Patches were left out (`RunOptions::auto`), and are again.
    pub auto: bool,
}

impl Restart {
    /// Of the run of `record`, whose scene is in the file `scene`.
    pub(super) fn of(record: &RunRecord, scene: &Path, folder: &Path) -> Self {
        let auto = !record.excluded_patches.is_empty();
        Self { scene: scene.into(), folder: folder.into(), auto }
    }
}
