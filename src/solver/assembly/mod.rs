//! A deformable body: mesh, element formulation, material and history; internal force and tangent in CSR order.
//!
//! Elements are evaluated in parallel into separate element matrices; each row then sums its contributions in element
//! order. The sums do not depend on the number of threads.

mod axes;
mod bands;
pub(super) mod body;
mod condense;
pub(super) mod evaluate;
pub(super) mod evaluation;
mod flow_direction;
mod foresight;
mod saved;
mod states;
mod tensors;
mod volume;

pub use axes::AlongNormal;
pub use body::{Body, BodyError};
pub use evaluation::{ElementFailure, Evaluation};
pub use flow_direction::WorkError;
pub use foresight::Foresight;
pub use states::ElementState;
pub use tensors::{ElementTensors, Tensors};
