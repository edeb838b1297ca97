//! Hencky elasticity: isotropic, linear between logarithmic strain and its conjugate stress.

use super::error::MaterialDataError;
use super::law::{LogResponse, Material, MaterialError};
use crate::numbers::tensor::{Mandel, Mandel66, dot};

/// Isotropic elastic constants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elastic {
    /// Young's modulus [MPa].
    pub young: f64,
    /// Poisson's ratio, in (-1, 0.5).
    pub poisson: f64,
}

impl Elastic {
    /// Checks the constants.
    ///
    /// # Errors
    /// [`MaterialDataError::Elastic`] for the first constant out of range.
    pub fn check(&self) -> Result<(), MaterialDataError> {
        let out_of_range = |field: &str, found, allowed| {
            Err(MaterialDataError::Elastic { field: field.into(), found, allowed })
        };
        if !(self.young > 0.0 && self.young.is_finite()) {
            return out_of_range("young_mpa", self.young, "above zero");
        }
        if !(self.poisson > -1.0 && self.poisson < 0.5) {
            return out_of_range("poisson", self.poisson, "in (-1, 0.5)");
        }
        Ok(())
    }

    /// Shear modulus `μ` [MPa].
    #[must_use]
    pub fn shear_modulus(&self) -> f64 {
        self.young / (2.0 * (1.0 + self.poisson))
    }

    /// Bulk modulus `κ` [MPa].
    #[must_use]
    pub fn bulk_modulus(&self) -> f64 {
        self.young / (3.0 * (1.0 - 2.0 * self.poisson))
    }

    /// Stress `T = κ tr(e) 1 + 2 μ dev e` [MPa] of the elastic strain `e`.
    #[must_use]
    #[inline]
    pub fn stress(&self, strain: &Mandel) -> Mandel {
        let two_mu = 2.0 * self.shear_modulus();
        let trace = strain[0] + strain[1] + strain[2];
        let volumetric = (self.bulk_modulus() - two_mu / 3.0) * trace;
        std::array::from_fn(|i| two_mu * strain[i] + if i < 3 { volumetric } else { 0.0 })
    }

    /// Stiffness matrix [MPa].
    #[must_use]
    #[inline]
    pub fn stiffness(&self) -> Mandel66 {
        let two_mu = 2.0 * self.shear_modulus();
        let lambda = self.bulk_modulus() - two_mu / 3.0;
        let mut d = [[0.0; 6]; 6];
        for (i, row) in d.iter_mut().enumerate() {
            if i < 3 {
                row[..3].fill(lambda);
            }
            row[i] += two_mu;
        }
        d
    }
}

impl Material for Elastic {
    fn state_len(&self) -> usize {
        0
    }

    fn update(
        &self,
        strain: &Mandel,
        _old: &[f64],
        _new: &mut [f64],
        response: &mut LogResponse,
    ) -> Result<(), MaterialError> {
        response.stress = self.stress(strain);
        response.tangent = self.stiffness();
        response.elastic_energy = 0.5 * dot(&response.stress, strain);
        response.plastic_work = 0.0;
        response.plastic = false;
        Ok(())
    }
}
