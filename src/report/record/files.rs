//! Files of a run, as `run.json` lists them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Files of a run, relative to its folder. `report.html` is beside them where it has been written.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct FilesRecord {
    /// One line per increment: travels and forces of the tools, iterations, nodes in contact, works.
    pub history: String,
    /// One line per Newton iteration.
    pub iterations: String,
    /// Sheet and tools at every step, as blocks of a time series for ParaView and PyVista.
    pub collection: String,
    /// Tools at their initial positions, in the order of the scene: VTU.
    pub tools: Vec<String>,
    /// Steps in time.
    pub steps: Vec<StepFilesRecord>,
    /// The sheet in the last converged state, of a run that has ended or was stopped: VTU.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last: Option<String>,
}

/// Files of a step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StepFilesRecord {
    /// Increment; 0 is the start.
    pub increment: usize,
    /// Process time: number of completed stages plus the completed fraction of the current stage.
    pub time: f64,
    /// The sheet: VTU with the arrays of `docs/reference/vtu.md`.
    pub sheet: String,
    /// The tools at their positions in this step, in the order of the scene: VTU. A tool that has not moved since an
    /// earlier step has the same file.
    pub tools: Vec<String>,
}

impl StepFilesRecord {
    /// The files, the sheet first.
    pub fn paths(&self) -> impl Iterator<Item = &String> {
        std::iter::once(&self.sheet).chain(&self.tools)
    }
}
