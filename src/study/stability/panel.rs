//! A map with a number for the summary.

use crate::report::drawing::HeatMap;

/// A map with a number for the summary.
pub(super) struct Panel {
    pub(super) map: HeatMap,
    /// Share of its cells where the method does what it should.
    pub(super) sound: f64,
}
