//! The implicit forming solver: sheet, elements, materials, contact, Newton's method, increments, stages.
//!
//! An import points down this list:
//!
//! - [`simulation`]: the driver; `snapshot`, `observe`, `remedy`, [`reach`], [`penetration`] beside it
//! - [`stage`], `increment`: what moves, and the steps in which it does
//! - [`newton`], `active_set`: equilibrium of one step, and which conditions hold in it
//! - `system`: residual, matrix and correction at an iterate
//! - `contact`, [`tools`], [`sheet`]: what acts on the sheet, and the sheet
//! - [`assembly`], [`element`], [`material`]: forces and tangent
//! - [`linear`], [`numbers`]: sparse equations; small tensors and vector lanes

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
pub use report::{Control, IncrementReport, RunSummary, ToolReport};
pub use sheet::supports::Constraints;
pub use simulation::SimulationSetup;
pub use stage::description::Stage;
pub use stage::state::Simulation;
pub use system::timings::Timings;
pub use tools::motion::{Curve, Motion};
pub use tools::tool::{Placement, SheetSide, ToolSetup};

#[cfg(test)]
mod tests;
