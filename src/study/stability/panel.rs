//! A map with a summary number.

use kanagata_report::drawing::HeatMap;

/// A map with a summary number.
pub(super) struct Panel {
    pub(super) map: HeatMap,
    /// Fraction of its cells in which the method succeeds.
    pub(super) sound: f64,
}
