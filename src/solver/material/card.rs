//! Material cards: JSON with its source, embedded in the program or written into a scene.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Material;
use super::elastic::Elastic;
use super::hardening::Hardening;
use super::hill48::Hill48;
use super::plastic::{Backstress, MaterialDataError, Plastic};
use super::yield_function::{YieldError, YieldFunction};
use super::yld2004::Yld2004;
use crate::geometry::Mat3;

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
}

/// A yield criterion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "criterion", rename_all = "kebab-case", deny_unknown_fields)]
pub enum YieldCriterion {
    /// Von Mises.
    VonMises {},
    /// Hill 1948 by its parameters; scaled to `G + H = 1`.
    Hill48 {
        /// F
        f: f64,
        /// G
        g: f64,
        /// H
        h: f64,
        /// L
        l: f64,
        /// M
        m: f64,
        /// N
        n: f64,
    },
    /// Hill 1948 by its r values; L = M = 1.5.
    Hill48R {
        /// r along the rolling direction.
        r0: f64,
        /// r at 45 degrees.
        r45: f64,
        /// r across it.
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
    /// Modulus C [MPa].
    pub c_mpa: f64,
    /// Recovery gamma.
    pub gamma: f64,
}

impl BackstressCard {
    /// What it adds to the stress of tension that never turned, and to its slope [MPa], at plastic strain `p`.
    fn tension(&self, p: f64) -> (f64, f64) {
        let Self { c_mpa, gamma } = *self;
        let left = (-gamma * p).exp();
        let grown = if gamma > 0.0 { -(-gamma * p).exp_m1() / gamma } else { p };
        (c_mpa * grown, c_mpa * left)
    }
}

/// Why a card gives no material.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CardError {
    /// No such card in the library.
    #[error("no material card is called '{name}'; the library has: {known}")]
    Unknown {
        /// Name asked for.
        name: String,
        /// Names there are.
        known: String,
    },
    /// `yield` without `hardening` or the other way round, or backstresses without either.
    #[error(
        "material '{name}': {missing} is missing; a plastic material needs both yield and hardening, an elastic one neither, and no backstresses"
    )]
    Half {
        /// Card.
        name: String,
        /// Key that is missing.
        missing: &'static str,
    },
    /// Numbers out of range.
    #[error("material '{name}': {cause}")]
    Data {
        /// Card.
        name: String,
        /// What is wrong.
        cause: MaterialDataError,
    },
}

const LIBRARY: [&str; 11] = [
    include_str!("cards/mild-steel-neto2012.json"),
    include_str!("cards/mild-steel-numisheet93.json"),
    include_str!("cards/aluminium-numisheet93-cup.json"),
    include_str!("cards/aluminium-numisheet2002b.json"),
    include_str!("cards/sheet-ssnv501.json"),
    include_str!("cards/aa2090-t3-barlat2005.json"),
    include_str!("cards/aa6111-t4-barlat2005.json"),
    include_str!("cards/aa6016-t4-esaform2021.json"),
    include_str!("cards/aa6022-t4-tian2017.json"),
    include_str!("cards/aa5754-o-coer2018.json"),
    include_str!("cards/structural-steel-hartloper-uvc.json"),
];

/// The cards embedded in the program.
#[must_use]
pub fn library() -> Vec<MaterialCard> {
    // The texts are part of the program; a test reads every one of them.
    LIBRARY.iter().filter_map(|text| serde_json::from_str(text).ok()).collect()
}

/// The card called `name`.
///
/// # Errors
/// [`CardError::Unknown`] lists the names there are.
pub fn find(name: &str) -> Result<MaterialCard, CardError> {
    let cards = library();
    let known = cards.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", ");
    cards
        .into_iter()
        .find(|c| c.name == name)
        .ok_or_else(|| CardError::Unknown { name: name.to_owned(), known })
}

impl MaterialCard {
    /// The yield function; `None` for an elastic card.
    ///
    /// # Errors
    /// [`CardError::Data`] unless it is convex, closed and in range.
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
                YieldFunction::hill48(&Hill48::from_r_values(r0, r45, r90))
            }
            YieldCriterion::Hosford { exponent } => yld(Yld2004::hosford(exponent)),
            YieldCriterion::Yld2004 { exponent, first, second } => {
                yld(Yld2004::new(exponent, &first, &second))
            }
        }
        .map_err(|cause: YieldError| CardError::Data {
            name: self.name.clone(),
            cause: cause.into(),
        })
    }

    /// Stress and its slope [MPa] of tension that never turned, at plastic strain `p >= 0`: flow stress and backstresses. `None`
    /// for an elastic card. Of an anisotropic sheet with backstresses an estimate, as it flows a little off its axis.
    #[must_use]
    pub fn tension(&self, p: f64) -> Option<(f64, f64)> {
        let parts = self.backstresses.iter().map(|one| one.tension(p));
        let flow = self.hardening.as_ref()?.flow_stress(p);
        Some(parts.fold(flow, |(stress, slope), (own, rise)| (stress + own, slope + rise)))
    }

    /// Whether the material has no axes: elastic, or with a yield function that is the same in all of them.
    ///
    /// # Errors
    /// As [`MaterialCard::yield_function`].
    pub fn is_isotropic(&self) -> Result<bool, CardError> {
        Ok(self.yield_function()?.is_none_or(|function| function.is_isotropic()))
    }

    /// The material law, its rolling direction turned by `angle` [rad] from x about z.
    ///
    /// # Errors
    /// [`CardError`] names the value out of its range.
    pub fn build(&self, angle: f64) -> Result<Arc<dyn Material>, CardError> {
        let elastic = Elastic { young: self.young_mpa, poisson: self.poisson };
        let half = |missing| CardError::Half { name: self.name.clone(), missing };
        let data = |cause| CardError::Data { name: self.name.clone(), cause };
        let (criterion, hardening) = match (self.criterion, &self.hardening) {
            (None, None) if !self.backstresses.is_empty() => return Err(half("yield")),
            (None, None) => {
                elastic.check().map_err(data)?;
                return Ok(Arc::new(elastic));
            }
            (Some(_), None) => return Err(half("hardening")),
            (None, Some(_)) => return Err(half("yield")),
            (Some(criterion), Some(hardening)) => (criterion, hardening.clone()),
        };
        let function = self.function(criterion)?;
        let backstresses = self
            .backstresses
            .iter()
            .map(|b| Backstress { modulus: b.c_mpa, recovery: b.gamma })
            .collect();
        let plastic = Plastic::with_yield(elastic, function, hardening)
            .and_then(|p| p.with_backstresses(backstresses))
            .map_err(data)?;
        let (s, c) = angle.sin_cos();
        let axes = Mat3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
        Ok(Arc::new(if angle == 0.0 { plastic } else { plastic.with_axes(&axes) }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_embedded_card_is_read_names_its_source_and_builds() {
        let cards = library();
        assert_eq!(cards.len(), LIBRARY.len());
        for card in cards {
            assert!(!card.source.is_empty(), "{}", card.name);
            card.build(0.3).unwrap();
        }
    }

    #[test]
    fn isotropy_is_told_by_the_criterion() {
        let isotropic = |name: &str| find(name).unwrap().is_isotropic().unwrap();
        assert!(isotropic("sheet-ssnv501") && isotropic("structural-steel-hartloper-uvc"));
        assert!(!isotropic("mild-steel-neto2012") && !isotropic("aa2090-t3-barlat2005"));
        let steel = find("mild-steel-neto2012").unwrap();
        let with = |criterion| {
            let card = MaterialCard { criterion: Some(criterion), ..steel.clone() };
            card.is_isotropic().unwrap()
        };
        assert!(with(YieldCriterion::Hosford { exponent: 8.0 }));
        let mut first = [1.1; 9];
        assert!(with(YieldCriterion::Yld2004 { exponent: 6.0, first, second: [0.9; 9] }));
        first[8] = 1.101;
        assert!(!with(YieldCriterion::Yld2004 { exponent: 6.0, first, second: [0.9; 9] }));
        let elastic = MaterialCard { criterion: None, hardening: None, ..steel };
        assert!(elastic.is_isotropic().unwrap());
    }

    #[test]
    fn cards_that_cannot_be_used_say_why() {
        let steel = find("mild-steel-neto2012").unwrap();
        assert!(find("unobtainium").unwrap_err().to_string().contains("mild-steel-neto2012"));
        let half = MaterialCard { hardening: None, ..steel.clone() };
        assert!(matches!(half.build(0.0), Err(CardError::Half { missing: "hardening", .. })));
        let soft = MaterialCard { poisson: 0.6, ..steel.clone() };
        let elastic = |card| MaterialCard { criterion: None, hardening: None, ..card };
        for card in [soft.clone(), elastic(soft)] {
            assert!(card.build(0.0).unwrap_err().to_string().contains("poisson is 0.6"));
        }
        let backstresses = vec![BackstressCard { c_mpa: 1000.0, gamma: 10.0 }];
        let kinematic = MaterialCard { backstresses, ..elastic(steel) };
        assert!(matches!(kinematic.build(0.0), Err(CardError::Half { missing: "yield", .. })));
        assert!(serde_json::from_str::<MaterialCard>(r#"{"name":"x","young":1}"#).is_err());
    }
}
