//! What a run was made by, and without.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Patches of a tool that `--auto` left out of the contact search.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct LeftOutRecord {
    /// Tool.
    pub tool: String,
    /// Patches left out.
    pub patches: usize,
    /// Patches of the tool.
    pub of: usize,
}

/// The process that writes a run folder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Process {
    /// Its number.
    pub id: u32,
    /// When it began, as the system counts (Linux: clock ticks since the machine started).
    pub started: u64,
    /// The machine: its name, and what tells one start of it from another.
    pub host: String,
}
