//! One increment: a step tried, made shorter, or, past a limit point, followed with damping.
//!
//! Called by `simulation`; calls `newton`, and `stage` for the size of the step.

pub(super) mod attempt;
pub(super) mod increment;
pub(super) mod limit_point;
pub(super) mod loose_sheet;
