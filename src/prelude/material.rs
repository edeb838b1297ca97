//! A sheet material.

use std::path::Path;

use super::error::{Error, ErrorKind};
use crate::files::{Input, read};
use crate::scene::read::parse_card;
use crate::solver::material::card::{MaterialCard, find, library};
use crate::solver::material::yield_function::YieldFunction;

/// A material card of the program or of a file, with its curves.
///
/// ```
/// use kanagata::prelude::Material;
///
/// let steel = Material::named("mild-steel-neto2012")?;
/// let (stress, _) = steel.tension(0.1)?;
/// assert!((stress - 529.5 * (0.00439_f64 + 0.1).powf(0.268)).abs() < 1e-9 * stress);
/// assert!(steel.limit_curve(1.0)?.is_some());
/// # Ok::<(), kanagata::prelude::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Material {
    card: MaterialCard,
    function: Option<YieldFunction>,
}

impl Material {
    /// Names of the cards in the program.
    #[must_use]
    pub fn names() -> Vec<String> {
        library().into_iter().map(|card| card.name).collect()
    }

    /// A card of the program.
    ///
    /// # Errors
    /// [`ErrorKind::Input`] lists the names that there are.
    pub fn named(name: &str) -> Result<Self, Error> {
        Self::of_card(find(name).map_err(Error::input)?)
    }

    /// A card in a JSON file.
    ///
    /// # Errors
    /// [`ErrorKind::Io`]; [`ErrorKind::Input`] with the key, what was found and what is allowed.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let text = read(path, Input::Description)
            .map_err(|e| Error::new(ErrorKind::Io, format!("{}: {e}", path.display())))?;
        let card = parse_card(&text)
            .map_err(|found| Error::input(format!("{}: {found}", path.display())))?;
        Self::of_card(card)
    }

    /// Checks a card.
    fn of_card(card: MaterialCard) -> Result<Self, Error> {
        card.build(0.0).map_err(Error::input)?;
        let function = card.yield_function().map_err(Error::input)?;
        Ok(Self { card, function })
    }

    /// The card.
    #[must_use]
    pub fn card(&self) -> &MaterialCard {
        &self.card
    }

    /// Stress and slope [MPa] of tension along the rolling direction at a plastic strain `strain >= 0`.
    ///
    /// # Errors
    /// [`ErrorKind::Input`] for an elastic card.
    pub fn tension(&self, strain: f64) -> Result<(f64, f64), Error> {
        self.card.tension(strain).ok_or_else(|| self.elastic())
    }

    /// Points (rolling, transverse) of the yield locus in plane stress without shear, every degree from 0 to 360, over the
    /// yield stress along the rolling direction.
    ///
    /// # Errors
    /// [`ErrorKind::Input`] for an elastic card.
    pub fn yield_locus(&self) -> Result<Vec<[f64; 2]>, Error> {
        let function = self.function.as_ref().ok_or_else(|| self.elastic())?;
        let point = |k: u32| {
            let (s, c) = f64::from(k).to_radians().sin_cos();
            let radius = function.locus_radius([c, s], 0.0);
            [radius * c, radius * s]
        };
        Ok((0..=360).map(point).collect())
    }

    /// r value of tension at an angle to the rolling direction [degrees].
    ///
    /// # Errors
    /// [`ErrorKind::Input`] for an elastic card.
    pub fn r_value(&self, angle_deg: f64) -> Result<f64, Error> {
        let function = self.function.as_ref().ok_or_else(|| self.elastic())?;
        Ok(function.r_value(angle_deg.to_radians()))
    }

    /// Points (minor, major logarithmic strain) of the forming limit curve of a sheet of `thickness_mm`; `None` for a card
    /// without one.
    ///
    /// # Errors
    /// [`ErrorKind::Input`] for a limit out of range.
    pub fn limit_curve(&self, thickness_mm: f64) -> Result<Option<Vec<[f64; 2]>>, Error> {
        let curve = self.card.limit_curve(thickness_mm).map_err(Error::input)?;
        Ok(curve.map(|curve| curve.points().to_vec()))
    }

    fn elastic(&self) -> Error {
        Error::input(format!(
            "{}: the card is elastic; allowed: one with `yield` and `hardening`",
            self.card.name
        ))
    }
}
