//! What a run is: blank, material, tools, stages, output; read, checked, completed with defaults.
//!
//! [`types`] is the file as written (unknown keys are errors, every key has a default or is required);
//! [`mod@read`] turns a file into a [`Plan`]: checked, with tool files and material loaded; [`setup`] turns
//! that into what the solver runs.

pub mod blank;
pub mod check;
pub mod comments;
mod course;
mod cuts;
mod drive;
pub mod error;
pub mod file_sheet;
pub mod follow;
pub mod large_sheet;
mod loads;
mod motions;
pub mod plan;
pub mod preview;
pub mod read;
mod rolling;
pub mod setup;
pub mod types;

pub use error::SceneError;
pub use plan::{Plan, PlannedFile, PlannedTool};
pub use read::read;
pub use types::Scene;
