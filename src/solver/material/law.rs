//! Interface of a material law: stress, tangent and history of a point.

use crate::numbers::lanes::{Eight, POINTS};
use crate::numbers::tensor::{Mandel, Mandel66};

/// Response of a material law at a point, in logarithmic strain space.
#[derive(Debug, Clone, Copy)]
pub struct LogResponse {
    /// Stress `T` conjugate to the logarithmic strain [MPa].
    pub stress: Mandel,
    /// Consistent tangent `dT/dE` [MPa].
    pub tangent: Mandel66,
    /// Stored elastic energy per reference volume [N mm / mm³].
    pub elastic_energy: f64,
    /// Plastic work per reference volume since the start [N mm / mm³].
    pub plastic_work: f64,
    /// Whether the point yielded in this increment.
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

/// Response of a material law at eight points in SIMD lanes.
#[derive(Debug, Clone)]
pub struct LogResponses {
    /// Stresses `T` conjugate to the logarithmic strain [MPa].
    pub stress: [Eight; 6],
    /// Consistent tangents `dT/dE` [MPa].
    pub tangent: [[Eight; 6]; 6],
    /// Stored elastic energy per reference volume [N mm / mm³].
    pub elastic_energy: Eight,
    /// Plastic work per reference volume since the start [N mm / mm³].
    pub plastic_work: Eight,
    /// Whether the points yielded in this increment.
    pub plastic: [bool; POINTS],
}

impl LogResponses {
    /// All zero.
    #[must_use]
    pub fn zero() -> Self {
        const ZERO: Eight = [0.0; POINTS];
        Self {
            stress: [ZERO; 6],
            tangent: [[ZERO; 6]; 6],
            elastic_energy: ZERO,
            plastic_work: ZERO,
            plastic: [false; POINTS],
        }
    }

    pub(crate) fn set_point(&mut self, point: usize, one: &LogResponse) {
        self.stress.iter_mut().zip(one.stress).for_each(|(to, from)| to[point] = from);
        let tangents = self.tangent.as_flattened_mut().iter_mut().zip(one.tangent.as_flattened());
        tangents.for_each(|(to, from)| to[point] = *from);
        self.elastic_energy[point] = one.elastic_energy;
        self.plastic_work[point] = one.plastic_work;
        self.plastic[point] = one.plastic;
    }

    pub(super) fn point(&self, point: usize) -> LogResponse {
        LogResponse {
            stress: self.stress.map(|of| of[point]),
            tangent: self.tangent.map(|row| row.map(|of| of[point])),
            elastic_energy: self.elastic_energy[point],
            plastic_work: self.plastic_work[point],
            plastic: self.plastic[point],
        }
    }
}

/// State of a point for output.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PointState {
    /// Equivalent plastic strain.
    pub plastic_strain: f64,
    /// Equivalent stress of `T` itself, backstresses not subtracted [MPa].
    pub equivalent_stress: f64,
    /// Pressure `-tr(T)/3` [MPa].
    pub pressure: f64,
}

/// State of a point in logarithmic strain space, in the axes of the caller of the law.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LogState {
    /// Logarithmic strain `E = ½ ln C`.
    pub strain: Mandel,
    /// Stress `T` conjugate to it [MPa].
    pub stress: Mandel,
}

/// Failure of a constitutive update. The remedy is always a smaller increment.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MaterialError {
    /// `C` is not positive definite or not finite.
    #[error(
        "eigenvalue {value:.3e} of the right Cauchy-Green tensor, must be finite and above zero: the sheet is pressed to nothing there"
    )]
    Collapsed {
        /// The eigenvalue found.
        value: f64,
    },
    /// The return mapping did not converge.
    #[error(
        "return mapping stopped at residual {residual:.3e} of the yield stress after {iterations} iterations: the strain of one step is out of all proportion"
    )]
    ReturnMapping {
        /// Residual relative to the yield stress.
        residual: f64,
        /// Number of iterations.
        iterations: usize,
    },
}

/// Material law in logarithmic strain space.
///
/// `update` is a pure function of the strain and the old history.
pub trait Material: Send + Sync + std::fmt::Debug {
    /// Number of history values of a point.
    fn state_len(&self) -> usize;

    /// Initial history of the virgin material; zero by default.
    fn initial_state(&self, state: &mut [f64]) {
        state.fill(0.0);
    }

    /// Stress, consistent tangent and new history at the logarithmic strain `strain`.
    ///
    /// # Errors
    /// [`MaterialError`] if no admissible state was found; the caller then cuts the increment.
    fn update(
        &self,
        strain: &Mandel,
        old: &[f64],
        new: &mut [f64],
        response: &mut LogResponse,
    ) -> Result<(), MaterialError>;

    /// [`Material::update`] of `count` points (at most eight, in the lanes of `strains`) with contiguous histories.
    ///
    /// # Errors
    /// [`MaterialError`] with the index of the first point that failed.
    fn update_points(
        &self,
        strains: &[Eight; 6],
        count: usize,
        (old, new): (&[f64], &mut [f64]),
        out: &mut LogResponses,
    ) -> Result<(), (usize, MaterialError)> {
        update_each(self, strains, count, (old, new), out)
    }

    /// State of a point from its history; `None` for laws without history.
    fn point_state(&self, history: &[f64]) -> Option<PointState> {
        let _ = history;
        None
    }

    /// Strain and stress of a point from its history; `None` for laws without history.
    fn log_state(&self, history: &[f64]) -> Option<LogState> {
        let _ = history;
        None
    }

    /// Layout of the history for the prediction of an increment; `None` for laws that need no prediction.
    fn history_layout(&self) -> Option<HistoryLayout> {
        None
    }

    /// Whether the tangent is symmetric (associated flow without recovery of backstresses).
    fn is_symmetric(&self) -> bool {
        true
    }
}

/// Updates a single point of a law that implements [`Material::update_points`].
pub fn update_single(
    law: &dyn Material,
    strain: &Mandel,
    histories: (&[f64], &mut [f64]),
    response: &mut LogResponse,
) -> Result<(), MaterialError> {
    let mut all = LogResponses::zero();
    let strains = strain.map(|value| [value; POINTS]);
    law.update_points(&strains, 1, histories, &mut all).map_err(|(_, error)| error)?;
    *response = all.point(0);
    Ok(())
}

/// Updates each point by [`Material::update`].
pub fn update_each<M: Material + ?Sized>(
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
        out.set_point(point, &response);
    }
    Ok(())
}

/// Position of strains in a history, and the elastic stiffness.
#[derive(Debug, Clone, Copy)]
pub struct HistoryLayout {
    /// Index of the logarithmic strain (six values, in the axes of the caller).
    pub strain: usize,
    /// Index of the plastic strain (six values, possibly in material axes).
    pub plastic: usize,
    /// Isotropic elastic stiffness [MPa].
    pub stiffness: Mandel66,
}
