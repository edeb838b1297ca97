//! Scenes: blank, material, tools, stages, output. They are read, checked and completed with defaults.
//!
//! Scenes are JSON or TOML. [`types`] is the file format: unknown keys are errors, and every key is required or has a default. [`mod@read`] reads
//! and checks a file, loads tools and material, and returns a [`Plan`]. [`setup`] turns a plan into the input of the
//! solver.

pub mod accuracy;
pub mod blank;
pub mod check;
pub mod comments;
mod course;
mod drive;
pub mod error;
pub mod file_sheet;
pub mod follow;
pub mod large_sheet;
mod loads;
mod motions;
mod output;
pub mod plan;
pub mod preview;
pub mod read;
mod refine;
mod rolling;
pub mod set_value;
pub mod setup;
mod symmetry_faces;
mod toml_text;
mod tool_cad;
pub mod types;

pub use error::SceneError;
pub use plan::{Plan, PlannedFile, PlannedTool};
pub use read::read;
pub use types::Scene;

#[cfg(test)]
#[allow(dead_code)] // Some of these shapes are for the tests of other modules.
#[path = "../contact/test_tools.rs"]
mod test_tools;
