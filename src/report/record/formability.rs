//! Formability of the part in `run.json`: thinning, margin to the forming limit, zones, strain paths.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::doubt::place_mm;

/// Formability in the last equilibrium with tools. Strains are logarithmic principal strains of the mid-surface of the
/// sheet, measured from the undeformed blank.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FormabilityRecord {
    /// Its increment.
    pub increment: usize,
    /// Initial area of the modelled part of the sheet [mm2].
    pub area_mm2: f64,
    /// Element with the largest thinning.
    pub thinning: ThinningRecord,
    /// Element with the largest thickening: its thinning is the smallest, negative where the sheet is thicker.
    pub thickening: ThinningRecord,
    /// Element with the smallest margin to the forming limit; absent if the card has no forming limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub margin: Option<LimitMarginRecord>,
    /// Shares of the initial area in the zones of the forming limit diagram.
    pub zones: ZoneShares,
    /// Elements whose strain path turned.
    pub turned_paths: TurnedPathsRecord,
    /// Points of the forming limit curve, minor and major logarithmic strain; empty if the card has none. To the left of
    /// the first point the curve continues with slope -1; to the right of the last one it is horizontal.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub limit_curve: Vec<[f64; 2]>,
}

/// Thinning of an element.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ThinningRecord {
    /// Thinning: decrease of the thickness over the initial thickness [%].
    pub percent: f64,
    /// Index of the element in the VTU files.
    pub element: usize,
    /// Current position of its centre [mm].
    pub at_mm: [f64; 3],
}

/// Margin of an element to the forming limit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LimitMarginRecord {
    /// 1 less the failure ratio: the strain over the limit strain on the straight path from the origin of the diagram. 0
    /// is on the curve, below 0 beyond it.
    pub margin: f64,
    /// Major strain.
    pub major: f64,
    /// Minor strain.
    pub minor: f64,
    /// Limit of the major strain at the same minor strain: less `major`, it is the vertical distance to the curve.
    pub limit_major: f64,
    /// Index of the element in the VTU files.
    pub element: usize,
    /// Current position of its centre [mm].
    pub at_mm: [f64; 3],
    /// Whether its strain path turned by more than the angle of `turned_paths`.
    pub turned: bool,
}

/// Shares of the initial area of the sheet in the zones of the forming limit diagram; their sum is 1. `crack`, `risk` and
/// `safe` are absent if the card has no forming limit, `not_judged` if it has one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ZoneShares {
    /// Beyond the limit curve.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crack: Option<f64>,
    /// Below the limit curve by a margin of less than 0.1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub risk: Option<f64>,
    /// In none of the other zones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub safe: Option<f64>,
    /// Stretched, and not judged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_judged: Option<f64>,
    /// Both principal strains below 0.02 in magnitude.
    pub insufficient_stretch: f64,
    /// Between uniaxial tension and pure shear.
    pub wrinkling_tendency: f64,
    /// Between pure shear and uniaxial compression.
    pub thickening: f64,
    /// Beyond uniaxial compression.
    pub strong_wrinkling: f64,
}

/// Elements whose strain path turned: limit curves hold for straight paths, and the verdict is weaker there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TurnedPathsRecord {
    /// Angle between a strain increment and the strain before it, above which a path has turned [degrees].
    pub angle_deg: f64,
    /// Number of these elements.
    pub elements: usize,
    /// Their share of the initial area.
    pub share: f64,
    /// Largest angle of any element [degrees].
    pub largest_deg: f64,
}

impl fmt::Display for ThinningRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.1} % at {}", self.percent, place_mm(&self.at_mm))
    }
}

impl fmt::Display for LimitMarginRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { margin, major, minor, limit_major, at_mm, .. } = self;
        write!(
            f,
            "{margin:.2} at {} (major {major:.3}, limit {limit_major:.3} at minor {minor:.3})",
            place_mm(at_mm)
        )
    }
}

impl ZoneShares {
    /// Name and share of each zone that is given, the most critical first.
    #[must_use]
    pub fn named(&self) -> Vec<(&'static str, f64)> {
        let all = [
            ("crack", self.crack),
            ("risk", self.risk),
            ("strong wrinkling", Some(self.strong_wrinkling)),
            ("thickening", Some(self.thickening)),
            ("wrinkling tendency", Some(self.wrinkling_tendency)),
            ("insufficient stretch", Some(self.insufficient_stretch)),
            ("safe", self.safe),
            ("not judged", self.not_judged),
        ];
        all.into_iter().filter_map(|(name, share)| Some((name, share?))).collect()
    }
}

impl fmt::Display for ZoneShares {
    /// The zones that contain a part of the sheet, with their shares of the area.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = self.named().into_iter().filter(|(_, share)| *share > 0.0);
        let parts: Vec<String> =
            parts.map(|(name, share)| format!("{:.1} % {name}", 100.0 * share)).collect();
        f.write_str(&parts.join(", "))
    }
}
