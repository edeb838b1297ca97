//! Stages of the process: motions, step sizes, energy.
//!
//! Used by `simulation` and `increment`.

pub(super) mod branch;
pub(super) mod description;
pub(super) mod energy;
pub(super) mod increment_error;
pub(super) mod plan;
pub(super) mod start;
pub(super) mod state;
pub(super) mod step_size;
