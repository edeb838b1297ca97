//! What a run is: blank, material, tools, stages, output; read, checked, completed with defaults.
//!
//! [`types`] is the file as written (unknown keys are errors, every key has a default or is required),
//! [`read`] turns a file into a [`Plan`]: the same with tool files loaded and everything checked.

pub mod read;
pub mod types;

pub use read::{Plan, PlannedTool, SceneError, read};
pub use types::Scene;
