//! What a material is to the elements: stress, moduli and history of a point.

use crate::solver::numbers::lanes::{Eight, POINTS};
use crate::solver::numbers::tensor::{Mandel, Mandel66};

/// What a material law answers at a point, in logarithmic strain space.
#[derive(Debug, Clone, Copy)]
pub struct LogResponse {
    /// Stress `T` conjugate to the logarithmic strain [MPa].
    pub stress: Mandel,
    /// Consistent tangent `dT/dE` [MPa].
    pub tangent: Mandel66,
    /// Stored elastic energy per reference volume [N mm / mm³].
    pub elastic_energy: f64,
    /// Plastic work per reference volume since the beginning [N mm / mm³].
    pub plastic_work: f64,
    /// Whether plastic flow took place in this increment.
    pub plastic: bool,
}

impl LogResponse {
    /// All zero.
    #[must_use]
    pub fn zero() -> Self {
        Self {
            stress: [0.0; 6],
            tangent: [[0.0; 6]; 6],
            elastic_energy: 0.0,
            plastic_work: 0.0,
            plastic: false,
        }
    }
}

/// What a material law answers at eight points side by side.
#[derive(Debug, Clone)]
pub struct LogResponses {
    /// Stresses `T` conjugate to the logarithmic strain [MPa].
    pub stress: [Eight; 6],
    /// Consistent tangents `dT/dE` [MPa].
    pub tangent: [[Eight; 6]; 6],
    /// Stored elastic energy per reference volume [N mm / mm³].
    pub elastic_energy: Eight,
    /// Plastic work per reference volume since the beginning [N mm / mm³].
    pub plastic_work: Eight,
    /// Whether plastic flow took place in this increment.
    pub plastic: [bool; POINTS],
}

impl LogResponses {
    /// All zero.
    #[must_use]
    pub fn zero() -> Self {
        const NONE: Eight = [0.0; POINTS];
        Self {
            stress: [NONE; 6],
            tangent: [[NONE; 6]; 6],
            elastic_energy: NONE,
            plastic_work: NONE,
            plastic: [false; POINTS],
        }
    }

    pub(in crate::solver) fn put(&mut self, point: usize, one: &LogResponse) {
        self.stress.iter_mut().zip(one.stress).for_each(|(to, from)| to[point] = from);
        let tangents = self.tangent.as_flattened_mut().iter_mut().zip(one.tangent.as_flattened());
        tangents.for_each(|(to, from)| to[point] = *from);
        self.elastic_energy[point] = one.elastic_energy;
        self.plastic_work[point] = one.plastic_work;
        self.plastic[point] = one.plastic;
    }

    pub(super) fn get(&self, point: usize) -> LogResponse {
        LogResponse {
            stress: self.stress.map(|of| of[point]),
            tangent: self.tangent.map(|row| row.map(|of| of[point])),
            elastic_energy: self.elastic_energy[point],
            plastic_work: self.plastic_work[point],
            plastic: self.plastic[point],
        }
    }
}

/// What a point has come to.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PointState {
    /// Equivalent plastic strain.
    pub plastic_strain: f64,
    /// What the yield function says of the stress `T` (not of its distance from backstresses) [MPa].
    pub equivalent_stress: f64,
    /// Pressure, a third of the trace of `-T` [MPa].
    pub pressure: f64,
}

/// Why a material point could not be updated. The remedy is always a smaller increment.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MaterialError {
    /// The deformation has lost its positive volume, or is not a number.
    #[error(
        "eigenvalue {value:.3e} of the right Cauchy-Green tensor, must be finite and above zero: the sheet is pressed to nothing there"
    )]
    Collapsed {
        /// The eigenvalue found.
        value: f64,
    },
    /// The scalar equation of the return mapping was not solved.
    #[error(
        "return mapping stopped at residual {residual:.3e} of the yield stress after {iterations} iterations: the strain of one step is out of all proportion"
    )]
    ReturnMapping {
        /// Residual relative to the yield stress.
        residual: f64,
        /// Iterations spent.
        iterations: usize,
    },
}

/// A material law in logarithmic strain space.
///
/// `update` is a pure function of strain and old history: calling it twice gives the same answer.
pub trait Material: Send + Sync + std::fmt::Debug {
    /// Number of history values a point keeps.
    fn state_len(&self) -> usize;

    /// Writes the history of the virgin material (all zero unless a law says otherwise).
    fn initial_state(&self, state: &mut [f64]) {
        state.fill(0.0);
    }

    /// Stress, consistent tangent and new history at the logarithmic strain `strain`.
    ///
    /// # Errors
    /// [`MaterialError`] when no admissible state was found; the caller cuts the increment.
    fn update(
        &self,
        strain: &Mandel,
        old: &[f64],
        new: &mut [f64],
        response: &mut LogResponse,
    ) -> Result<(), MaterialError>;

    /// [`Material::update`] of `count` points (at most eight, side by side in `strains`) whose histories follow one another.
    ///
    /// # Errors
    /// [`MaterialError`] with the first point that failed.
    fn update_points(
        &self,
        strains: &[Eight; 6],
        count: usize,
        (old, new): (&[f64], &mut [f64]),
        out: &mut LogResponses,
    ) -> Result<(), (usize, MaterialError)> {
        one_by_one(self, strains, count, (old, new), out)
    }

    /// What a history says of its point; `None` for laws that keep none.
    fn point_state(&self, history: &[f64]) -> Option<PointState> {
        let _ = history;
        None
    }

    /// What a history keeps that the next increment can be foreseen from; `None` for laws that need no such thing.
    fn memory(&self) -> Option<Memory> {
        None
    }

    /// Whether the tangent is symmetric (associated flow without recovery terms).
    fn is_symmetric(&self) -> bool {
        true
    }
}

/// One point of a law that is asked for points side by side.
pub fn one_as_points(
    law: &dyn Material,
    strain: &Mandel,
    histories: (&[f64], &mut [f64]),
    response: &mut LogResponse,
) -> Result<(), MaterialError> {
    let mut all = LogResponses::zero();
    let strains = strain.map(|value| [value; POINTS]);
    law.update_points(&strains, 1, histories, &mut all).map_err(|(_, error)| error)?;
    *response = all.get(0);
    Ok(())
}

/// Updates points by [`Material::update`].
pub fn one_by_one<M: Material + ?Sized>(
    material: &M,
    strains: &[Eight; 6],
    count: usize,
    (old, new): (&[f64], &mut [f64]),
    out: &mut LogResponses,
) -> Result<(), (usize, MaterialError)> {
    let len = material.state_len();
    let mut response = LogResponse::zero();
    for point in 0..count {
        let range = point * len..(point + 1) * len;
        let strain = strains.map(|of| of[point]);
        material
            .update(&strain, &old[range.clone()], &mut new[range], &mut response)
            .map_err(|error| (point, error))?;
        out.put(point, &response);
    }
    Ok(())
}

/// What a law keeps that an increment can be foreseen from.
#[derive(Debug, Clone, Copy)]
pub struct Memory {
    /// Where in a history the logarithmic strain begins (six values, in the axes in which the law was asked).
    pub strain: usize,
    /// Where the plastic part of it begins (six values; the axes may be the material's).
    pub plastic: usize,
    /// Elastic stiffness [MPa]; isotropic.
    pub stiffness: Mandel66,
}
