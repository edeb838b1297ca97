//! Material cards: JSON with its source, embedded in the program or written into a scene.

mod forming;

use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::elastic::Elastic;
use super::error::MaterialDataError;
use super::forming_limit::{FormingLimit, LimitError};
use super::hardening::{Hardening, HardeningError};
use super::hill48::{Hill48, Hill48Error};
use super::law::Material;
use super::plastic::tension::along_rolling;
use super::plastic::{Backstress, Plastic};
use super::yield_function::{YieldError, YieldFunction};
use super::yld2004::{Yld2004, Yld2004Error};
use kanagata_geometry::Mat3;

/// A sheet material.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MaterialCard {
    /// Name.
    pub name: String,
    /// Where the numbers come from.
    #[serde(default)]
    pub source: String,
    /// Young's modulus [MPa], > 0.
    pub young_mpa: f64,
    /// Poisson's ratio, in (-1, 0.5).
    pub poisson: f64,
    /// Yield criterion; without one the material is elastic.
    #[serde(default, rename = "yield", skip_serializing_if = "Option::is_none")]
    pub criterion: Option<YieldCriterion>,
    /// Hardening law, in tension along the rolling direction; needed with `yield`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hardening: Option<Hardening>,
    /// Chaboche backstresses.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub backstresses: Vec<BackstressCard>,
    /// Forming limit curve; without one the margin to the limit is not judged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub forming_limit: Option<FormingLimit>,
}

/// A yield criterion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "criterion", rename_all = "kebab-case", deny_unknown_fields)]
pub enum YieldCriterion {
    /// Von Mises.
    VonMises {},
    /// Hill 1948 by its parameters; scaled to `G + H = 1`.
    Hill48 {
        /// F; sums of two of F, G and H, and F G + G H + H F, are > 0.
        f: f64,
        /// G
        g: f64,
        /// H
        h: f64,
        /// L (shear yz), > 0.
        l: f64,
        /// M (shear zx), > 0.
        m: f64,
        /// N (shear xy), > 0.
        n: f64,
    },
    /// Hill 1948 by its r values; L = M = 1.5.
    Hill48R {
        /// r along the rolling direction, > 0.
        r0: f64,
        /// r at 45 degrees, >= 0.
        r45: f64,
        /// r across it, > 0.
        r90: f64,
    },
    /// Hosford's isotropic non-quadratic function.
    Hosford {
        /// Exponent, in [2, 60]: 8 for face-centred, 6 for body-centred cubic metals.
        exponent: f64,
    },
    /// Yld2004-18p; scaled to tension along the rolling direction.
    #[serde(rename = "yld2004-18p")]
    Yld2004 {
        /// Exponent, in [2, 60].
        exponent: f64,
        /// c'12, c'13, c'21, c'23, c'31, c'32, c'44 (shear yz), c'55 (zx), c'66 (xy).
        first: [f64; 9],
        /// c''12, c''13, c''21, c''23, c''31, c''32, c''44, c''55, c''66.
        second: [f64; 9],
    },
}

/// One backstress of Chaboche's law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BackstressCard {
    /// Modulus C [MPa], >= 0.
    pub c_mpa: f64,
    /// Recovery gamma, >= 0; 0 is linear (Prager's) hardening.
    pub gamma: f64,
}

/// Reason why a card defines no valid material.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CardError {
    /// No such card in the library.
    #[error("no material card is called '{name}'; the library has: {known}")]
    Unknown {
        /// Requested name.
        name: String,
        /// Known names.
        known: String,
    },
    /// `yield` without `hardening` or vice versa, or backstresses without either.
    #[error(
        "material '{name}': {missing} is missing; a plastic material needs both yield and hardening, an elastic one neither, and no backstresses"
    )]
    Half {
        /// Card.
        name: String,
        /// Key that is missing.
        missing: &'static str,
    },
    /// A value out of range.
    #[error("material '{name}', {key}: found {found}; allowed: {allowed}")]
    Value {
        /// Card.
        name: String,
        /// Key of the card, or a quantity derived from several keys.
        key: String,
        /// Value found.
        found: f64,
        /// Allowed values.
        allowed: String,
    },
    /// Data that define no forming limit curve.
    #[error("material '{name}', {cause}")]
    FormingLimit {
        /// Card.
        name: String,
        /// Key, value found and values allowed.
        cause: LimitError,
    },
}

/// What a card has, for messages about texts that are none.
pub const KEYS: &str = "a material card: `name`, `young_mpa` (above zero), `poisson` (in (-1, 0.5)), of a plastic material `yield` and \
     `hardening` too, with what they have in schemas/scene.schema.json (MaterialCard); `source`, `backstresses` and \
     `forming_limit` may be left out";

/// Key of the card, value found and values allowed.
fn keyed(cause: MaterialDataError) -> (String, f64, String) {
    match cause {
        MaterialDataError::Elastic { field, found, allowed } => (field, found, allowed.into()),
        MaterialDataError::Yield(YieldError::Hill48(Hill48Error { condition, found })) => {
            let term =
                |term: &str| format!("yield.{}", term.to_lowercase().replace(' ', " yield."));
            let key = condition.split(" + ").map(term).collect::<Vec<_>>().join(" + ");
            (key, found, "above zero, for a convex yield surface".into())
        }
        MaterialDataError::Yield(YieldError::Yld2004(Yld2004Error { field, found, allowed })) => {
            (format!("yield.{field}"), found, allowed.into())
        }
        MaterialDataError::Hardening(HardeningError { field, found, allowed }) => {
            (format!("hardening.{field}"), found, allowed.into())
        }
    }
}

const LIBRARY: [&str; 16] = [
    include_str!("../cards/mild-steel-neto2012.json"),
    include_str!("../cards/mild-steel-numisheet93.json"),
    include_str!("../cards/aluminium-numisheet93-cup.json"),
    include_str!("../cards/aluminium-numisheet2002b.json"),
    include_str!("../cards/sheet-ssnv501.json"),
    include_str!("../cards/aa2090-t3-barlat2005.json"),
    include_str!("../cards/aa6111-t4-barlat2005.json"),
    include_str!("../cards/aa6016-t4-esaform2021.json"),
    include_str!("../cards/aa6022-t4-tian2017.json"),
    include_str!("../cards/aa5754-o-coer2018.json"),
    include_str!("../cards/structural-steel-hartloper-uvc.json"),
    include_str!("../cards/dc04-nominal.json"),
    include_str!("../cards/dc06-nominal.json"),
    include_str!("../cards/dx56-nominal.json"),
    include_str!("../cards/dp780-nominal.json"),
    include_str!("../cards/if-steel-jeong.json"),
];

/// Cards embedded in the program.
#[must_use]
pub fn library() -> Vec<MaterialCard> {
    // The texts are part of the program; a test reads every one of them.
    LIBRARY.iter().filter_map(|text| serde_json::from_str(text).ok()).collect()
}

/// The card with the given name.
///
/// # Errors
/// [`CardError::Unknown`] lists the known names.
pub fn find(name: &str) -> Result<MaterialCard, CardError> {
    let cards = library();
    let known = cards.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", ");
    cards
        .into_iter()
        .find(|c| c.name == name)
        .ok_or_else(|| CardError::Unknown { name: name.to_owned(), known })
}

impl MaterialCard {
    /// Yield function; `None` for an elastic card.
    ///
    /// # Errors
    /// [`CardError::Value`] if it is not convex, not closed, or has a parameter out of range.
    pub fn yield_function(&self) -> Result<Option<YieldFunction>, CardError> {
        self.criterion.map(|criterion| self.function(criterion)).transpose()
    }

    fn function(&self, criterion: YieldCriterion) -> Result<YieldFunction, CardError> {
        let yld = |law: Result<Yld2004, _>| Ok(YieldFunction::Yld2004(Box::new(law?)));
        match criterion {
            YieldCriterion::VonMises {} => YieldFunction::hill48(&Hill48::MISES),
            YieldCriterion::Hill48 { f, g, h, l, m, n } => {
                YieldFunction::hill48(&Hill48 { f, g, h, l, m, n })
            }
            YieldCriterion::Hill48R { r0, r45, r90 } => {
                self.check_r_values(r0, r45, r90)?;
                YieldFunction::hill48(&Hill48::from_r_values(r0, r45, r90))
            }
            YieldCriterion::Hosford { exponent } => yld(Yld2004::hosford(exponent)),
            YieldCriterion::Yld2004 { exponent, first, second } => {
                yld(Yld2004::new(exponent, &first, &second))
            }
        }
        .map_err(|cause: YieldError| self.value_error(cause.into()))
    }

    fn value_error(&self, cause: MaterialDataError) -> CardError {
        let (key, found, allowed) = keyed(cause);
        CardError::Value { name: self.name.clone(), key, found, allowed }
    }

    /// Checks r values: others give no closed surface, or one that no sheet has.
    fn check_r_values(&self, r0: f64, r45: f64, r90: f64) -> Result<(), CardError> {
        let wrong = |key: &str, found, allowed: &str| {
            let (name, key) = (self.name.clone(), format!("yield.{key}"));
            Err(CardError::Value { name, key, found, allowed: allowed.into() })
        };
        let in_range = |r: f64| (0.0..1e6).contains(&r);
        for (key, r) in [("r0", r0), ("r90", r90)] {
            if !in_range(r) || r == 0.0 {
                return wrong(key, r, "above 0 and below 1e6");
            }
        }
        if in_range(r45) { Ok(()) } else { wrong("r45", r45, "0 or above and below 1e6") }
    }

    /// Stress and tangent modulus [MPa] of monotonic tension along the rolling direction at the plastic strain
    /// `strain >= 0`. `None` for an elastic or invalid card.
    #[must_use]
    pub fn tension(&self, strain: f64) -> Option<(f64, f64)> {
        let (criterion, hardening) = (self.yield_function().ok()??, self.hardening.as_ref()?);
        Some(along_rolling(&criterion, hardening, &self.chaboche(), strain))
    }

    fn chaboche(&self) -> Vec<Backstress> {
        let of = |one: &BackstressCard| Backstress { modulus: one.c_mpa, recovery: one.gamma };
        self.backstresses.iter().map(of).collect()
    }

    /// Whether the material is isotropic: elastic, or with an isotropic yield function.
    ///
    /// # Errors
    /// As [`MaterialCard::yield_function`].
    pub fn is_isotropic(&self) -> Result<bool, CardError> {
        Ok(self.yield_function()?.is_none_or(|function| function.is_isotropic()))
    }

    /// Material law with the rolling direction at `angle` [rad] from x about z.
    ///
    /// # Errors
    /// [`CardError`] names the first value out of range.
    pub fn build(&self, angle: f64) -> Result<Arc<dyn Material>, CardError> {
        let elastic = Elastic { young: self.young_mpa, poisson: self.poisson };
        let incomplete = |missing| CardError::Half { name: self.name.clone(), missing };
        let data = |cause| self.value_error(cause);
        let (criterion, hardening) = match (self.criterion, &self.hardening) {
            (None, None) if !self.backstresses.is_empty() => return Err(incomplete("yield")),
            (None, None) => {
                elastic.check().map_err(data)?;
                self.limit_curve(1.0)?;
                return Ok(Arc::new(elastic));
            }
            (Some(_), None) => return Err(incomplete("hardening")),
            (None, Some(_)) => return Err(incomplete("yield")),
            (Some(criterion), Some(hardening)) => (criterion, hardening.clone()),
        };
        let function = self.function(criterion)?;
        let plastic = Plastic::with_yield(elastic, function, hardening)
            .and_then(|p| p.with_backstresses(self.chaboche()))
            .map_err(data)?;
        self.limit_curve(1.0)?;
        let (s, c) = angle.sin_cos();
        let axes = Mat3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
        Ok(Arc::new(if angle == 0.0 { plastic } else { plastic.with_axes(&axes) }))
    }
}

#[cfg(test)]
mod tests;
