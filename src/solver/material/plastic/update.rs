//! Constitutive update: quadratic criteria in SIMD lanes, any other point by point.

use pulp::Arch;

use super::{BACKSTRESS, EQUIVALENT, LOG_STRAIN, Plastic, STRAIN, quadratic};
use crate::material::law::{
    HistoryLayout, LogResponse, LogResponses, LogState, Material, MaterialError, PointState,
    update_single,
};
use crate::material::yield_function::YieldFunction;
use crate::numbers::lanes::Eight;
use crate::numbers::tensor;
use crate::numbers::tensor::{Mandel, Mandel66};

impl Plastic {
    /// Stress `T` of a history, in material axes [MPa].
    fn stress_in_material_axes(&self, history: &[f64]) -> Mandel {
        let total: Mandel = std::array::from_fn(|i| history[LOG_STRAIN + i]);
        let total =
            self.to_material.as_ref().map_or(total, |rotation| tensor::apply(rotation, &total));
        let elastic = std::array::from_fn(|i| total[i] - history[STRAIN + i]);
        self.elastic.stress(&elastic)
    }
}

impl Material for Plastic {
    fn state_len(&self) -> usize {
        BACKSTRESS + 6 * self.backstresses.len()
    }

    fn update(
        &self,
        strain: &Mandel,
        old: &[f64],
        new: &mut [f64],
        response: &mut LogResponse,
    ) -> Result<(), MaterialError> {
        update_single(self, strain, (old, new), response)
    }

    fn update_points(
        &self,
        strains: &[Eight; 6],
        count: usize,
        (old, new): (&[f64], &mut [f64]),
        out: &mut LogResponses,
    ) -> Result<(), (usize, MaterialError)> {
        match &self.criterion {
            YieldFunction::Hill48(spectrum) => {
                let material = self;
                let to = &mut *new;
                let all =
                    quadratic::Update { material, spectrum, strains, count, old, new: to, out };
                Arch::new().dispatch(all)?;
            }
            YieldFunction::Yld2004(law) => {
                self.update_general(law, (strains, count), (old, new), out)?;
            }
        }
        let histories = new.chunks_exact_mut(self.state_len()).take(count);
        for (point, history) in histories.enumerate() {
            history[LOG_STRAIN..BACKSTRESS].copy_from_slice(&strains.map(|of| of[point]));
        }
        Ok(())
    }

    fn point_state(&self, history: &[f64]) -> Option<PointState> {
        let stress = self.stress_in_material_axes(history);
        Some(PointState {
            plastic_strain: history[EQUIVALENT],
            equivalent_stress: self.criterion.equivalent(&stress),
            pressure: -(stress[0] + stress[1] + stress[2]) / 3.0,
        })
    }

    fn log_state(&self, history: &[f64]) -> Option<LogState> {
        let stress = self.stress_in_material_axes(history);
        let back = |rotation: &Mandel66| tensor::apply(&tensor::transpose(rotation), &stress);
        Some(LogState {
            strain: std::array::from_fn(|i| history[LOG_STRAIN + i]),
            stress: self.to_material.as_ref().map_or(stress, back),
        })
    }

    fn history_layout(&self) -> Option<HistoryLayout> {
        let stiffness = self.elastic.stiffness();
        Some(HistoryLayout { strain: LOG_STRAIN, plastic: STRAIN, stiffness })
    }

    fn is_symmetric(&self) -> bool {
        self.backstresses.iter().all(|one| one.recovery == 0.0)
    }
}
