//! Where a tool that goes by force stops.

/// Where a tool is held up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::solver) struct Stop {
    /// Travel past which it does not go [mm]; infinite without a stop.
    pub(in crate::solver) at: f64,
    /// It rests there.
    pub(in crate::solver) reached: bool,
}

impl Stop {
    /// A tool that nothing holds up.
    pub(in crate::solver) const NONE: Self = Self { at: f64::INFINITY, reached: false };
}
