//! Stop of a tool driven by force.

/// Stop of a tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stop {
    /// Maximum travel [mm]; infinite without a stop.
    pub(crate) at: f64,
    /// The tool is at its stop.
    pub(crate) reached: bool,
}

impl Stop {
    /// No stop.
    pub(crate) const NONE: Self = Self { at: f64::INFINITY, reached: false };
}
