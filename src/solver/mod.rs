//! The implicit forming solver: blank, elements, materials, contact, Newton, stepping.
//!
//! - [`blank`], [`element`], [`material`], [`assembly`]: the sheet; forces and tangent
//! - [`tools`], [`constraints`], `contact`, `conditions`, `stops`: what acts on it
//! - `system`, `matrix`: residual and condensed matrix; [`linear`]: its solution
//! - [`newton`], `trial`, `relaxation`, `stepping`, [`stages`]: increments; [`simulation`]: the driver

mod active_set;
mod ahead;
pub mod assembly;
mod balance;
pub mod blank;
mod buckling;
mod carried;
pub mod columns;
mod conditions;
pub mod constraints;
mod contact;
mod damper;
pub mod edges;
pub mod element;
mod floating;
mod forces;
mod giving_up;
mod held;
pub mod inside;
mod lanes;
mod lengths;
mod line_search;
pub mod linear;
mod linearised;
pub mod material;
mod matrix;
pub mod newton;
mod pace;
mod passage;
pub mod pattern;
pub mod penetration;
mod plan;
pub mod reach;
mod relaxation;
mod reports;
mod rigid;
mod search;
pub mod simulation;
mod stability;
pub mod stages;
pub mod state;
mod steadying;
mod stepping;
mod stops;
mod system;
pub mod tensor;
pub mod tools;
mod trial;
mod work;

pub use constraints::Constraints;
pub use simulation::{Control, Simulation, SimulationError, SimulationSetup};
pub use stages::{
    ContactMethod, IncrementReport, IterationRecord, Limits, RunSummary, Stage, ToolReport,
    convergence_order,
};
pub use tools::{Curve, Motion, Placement, SheetSide, ToolSetup};

#[cfg(test)]
mod tests;
