//! Increments: attempts, step cuts, and continuation past a limit point with damping.
//!
//! Called by `simulation`; uses `newton`, and `stage` for the step size.

pub(super) mod attempt;
pub(super) mod increment;
pub(super) mod limit_point;
pub(super) mod loose_sheet;
