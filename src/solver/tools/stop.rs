//! Stop of a tool driven by force.

/// Stop of a tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::solver) struct Stop {
    /// Maximum travel [mm]; infinite without a stop.
    pub(in crate::solver) at: f64,
    /// The tool is at its stop.
    pub(in crate::solver) reached: bool,
}

impl Stop {
    /// No stop.
    pub(in crate::solver) const NONE: Self = Self { at: f64::INFINITY, reached: false };
}
