//! Zones of the forming limit diagram.
//!
//! The lines of uniaxial tension and pure shear, the margin of a tenth and the strain of 2 % are those of forming programs,
//! as in Heinzelmann et al. (2025), MATEC Web Conf. 408, 01090. The zone below pure shear, where the sheet thickens, is
//! divided by the line of uniaxial compression.

use super::curve::LimitCurve;

/// Margin to the limit below which a state is at risk: a tenth of the path to the limit, the usual safety margin of press
/// shops. Twice as much would put parts that press shops accept at risk.
pub const RISK_MARGIN: f64 = 0.1;
/// Logarithmic strain below which the sheet is hardly stretched: neither hardening nor shape is reliable there.
pub const STRETCH_MIN: f64 = 0.02;

/// A zone of the forming limit diagram, with its number in fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Zone {
    /// Stretched, and not judged: the card has no forming limit.
    NotJudged = 0,
    /// Beyond the limit curve.
    Crack = 1,
    /// Below the limit curve by less than [`RISK_MARGIN`] of the path.
    Risk = 2,
    /// None of the others.
    Safe = 3,
    /// Both principal strains below [`STRETCH_MIN`] in magnitude.
    InsufficientStretch = 4,
    /// Between uniaxial tension and pure shear: compression across the main stretch.
    WrinklingTendency = 5,
    /// Between pure shear and uniaxial compression: the sheet thickens.
    Thickening = 6,
    /// Beyond uniaxial compression: both principal stresses are compressive.
    StrongWrinkling = 7,
}

impl Zone {
    /// All zones, by number.
    pub const ALL: [Self; 8] = [
        Self::NotJudged,
        Self::Crack,
        Self::Risk,
        Self::Safe,
        Self::InsufficientStretch,
        Self::WrinklingTendency,
        Self::Thickening,
        Self::StrongWrinkling,
    ];
}

/// A forming limit diagram.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagram {
    /// The limit curve, if there is one.
    pub curve: Option<LimitCurve>,
    /// Minor over major strain in uniaxial tension, negative: `-r / (1 + r)`.
    tension: f64,
}

impl Default for Diagram {
    /// The diagram of an isotropic sheet without a limit curve.
    fn default() -> Self {
        Self::new(None, 1.0)
    }
}

impl Diagram {
    /// A diagram with a limit curve, if there is one, of a sheet with the mean r value `(r0 + 2 r45 + r90) / 4`.
    #[must_use]
    pub fn new(curve: Option<LimitCurve>, r: f64) -> Self {
        Self { curve, tension: -r / (1.0 + r) }
    }

    /// Margin to the limit: 1 less the [failure ratio](LimitCurve::failure_ratio). 1 is no strain, 0 is on the curve,
    /// below 0 is beyond it. `None` without a curve.
    #[must_use]
    pub fn margin(&self, minor: f64, major: f64) -> Option<f64> {
        Some(1.0 - self.curve.as_ref()?.failure_ratio(minor, major))
    }

    /// Zone of a state of logarithmic strains, by the first rule that holds: crack, risk, insufficient stretch, strong
    /// wrinkling, thickening, wrinkling tendency, safe.
    #[must_use]
    pub fn zone(&self, minor: f64, major: f64) -> Zone {
        let margin = self.margin(minor, major);
        if margin.is_some_and(|margin| margin < 0.0) {
            Zone::Crack
        } else if margin.is_some_and(|margin| margin < RISK_MARGIN) {
            Zone::Risk
        } else if major.abs().max(minor.abs()) < STRETCH_MIN {
            Zone::InsufficientStretch
        } else if major < self.tension * minor {
            Zone::StrongWrinkling
        } else if major < -minor {
            Zone::Thickening
        } else if minor < self.tension * major {
            Zone::WrinklingTendency
        } else if margin.is_some() {
            Zone::Safe
        } else {
            Zone::NotJudged
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::forming_limit::laws::keeler_brazier;

    #[test]
    fn zones_are_bounded_by_the_curve_and_by_stress_states() {
        // FLD0 = ln 1.3743 = 0.318; isotropic: tension at minor = -0.5 major.
        let diagram = Diagram::new(Some(keeler_brazier(1.0, 0.21)), 1.0);
        for (minor, major, zone) in [
            (0.0, 0.32, Zone::Crack),
            (0.0, 0.30, Zone::Risk),
            (0.0, 0.28, Zone::Safe),
            (-0.13, 0.27, Zone::Safe),
            (-0.14, 0.27, Zone::WrinklingTendency),
            (-0.26, 0.27, Zone::WrinklingTendency),
            (-0.28, 0.27, Zone::Thickening),
            (-0.53, 0.27, Zone::Thickening),
            (-0.55, 0.27, Zone::StrongWrinkling),
            (-0.2, -0.1, Zone::StrongWrinkling),
            (-0.019, 0.019, Zone::InsufficientStretch),
            (0.021, 0.021, Zone::Safe),
            (-0.4, 0.75, Zone::Crack),
        ] {
            assert_eq!(diagram.zone(minor, major), zone, "({minor}, {major})");
        }
        // The margin of a state is that of its straight path.
        let plane = 0.3743_f64.ln_1p();
        let margin = diagram.margin(0.0, 0.4 * plane).unwrap();
        assert!((margin - 0.6).abs() < 1e-14, "{margin}");
    }

    #[test]
    fn without_a_curve_stretched_states_are_not_judged() {
        let diagram = Diagram::new(None, 2.0);
        assert_eq!(diagram.margin(0.0, 0.9), None);
        assert_eq!(diagram.zone(0.0, 0.9), Zone::NotJudged);
        // r = 2: tension at minor = -2/3 major.
        assert_eq!(diagram.zone(-0.19, 0.3), Zone::NotJudged);
        assert_eq!(diagram.zone(-0.21, 0.3), Zone::WrinklingTendency);
        assert_eq!(diagram.zone(-0.3, 0.19), Zone::StrongWrinkling);
        assert_eq!(diagram.zone(-0.3, 0.21), Zone::Thickening);
    }

    #[test]
    fn numbers_of_zones_are_their_places_in_the_list() {
        for (k, zone) in Zone::ALL.into_iter().enumerate() {
            assert_eq!(zone as usize, k);
        }
    }
}
