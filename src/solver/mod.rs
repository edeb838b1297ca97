//! Implicit forming solver: sheet, elements, materials, contact, Newton's method, increments, stages.
//!
//! Imports point down this list:
//!
//! - [`simulation`]: the driver, with `snapshot`, `observe`, `remedy`, [`reach`], [`penetration`]
//! - [`stage`], `increment`: motions of the tools, and step sizes
//! - [`newton`], `active_set`: equilibrium of one step, and its contact states
//! - `system`: residual, matrix and correction at an iterate
//! - `contact`, [`tools`], [`sheet`]: contact conditions, tools, and the sheet
//! - [`assembly`], [`element`], [`material`]: internal force and tangent
//! - [`linear`], [`numbers`]: sparse linear equations; small tensors, SIMD lanes, shared tolerances

mod active_set;
pub mod assembly;
mod contact;
pub mod element;
pub mod error;
mod increment;
pub mod limits;
pub mod linear;
pub mod material;
pub mod newton;
pub mod numbers;
mod observe;
pub mod penetration;
pub mod reach;
mod remedy;
pub mod report;
pub mod sheet;
pub mod simulation;
pub mod snapshot;
pub mod stage;
mod system;
pub mod tools;

pub use contact::face_penetration::FacePenetration;
pub use error::SimulationError;
pub use limits::{ContactMethod, Limits};
pub use newton::record::{IterationRecord, convergence_order};
pub use report::{Control, IncrementReport, NodeContact, RunSummary, ToolReport};
pub use sheet::supports::Constraints;
pub use simulation::SimulationSetup;
pub use stage::description::Stage;
pub use stage::state::Simulation;
pub use system::timings::Timings;
pub use tools::motion::{Curve, Motion};
pub use tools::tool::{Placement, SheetSide, ToolSetup};

#[cfg(test)]
mod tests;

#[cfg(test)]
#[allow(dead_code)] // Some of these shapes are for the tests of other modules.
#[path = "../contact/test_tools.rs"]
mod test_tools;
