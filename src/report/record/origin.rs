//! The process that made a run, and the tool patches excluded from it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Patches of a tool that `--auto` excluded from the contact search.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ExcludedPatchesRecord {
    /// Tool.
    pub tool: String,
    /// Number of excluded patches.
    pub patches: usize,
    /// Number of all patches of the tool.
    #[serde(rename = "of")]
    pub total: usize,
}

/// The process that writes a run folder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Process {
    /// Process id.
    pub id: u32,
    /// Start time of the process as the system counts it (Linux: clock ticks since boot).
    pub started: u64,
    /// The host: its name, an identifier of its current boot, and the namespace of process ids.
    pub host: String,
}
