//! Law with the plastic tangent at every point on its yield surface, for the stability analysis of an equilibrium.
//!
//! At equilibrium, points lie on the yield surface whose last iterate was elastic by rounding or by a minute
//! unloading. Hill (1958): the comparison solid, in which all these points yield, is the first to become unstable.

use std::sync::Arc;

use nalgebra::SMatrix;

use super::law::HistoryLayout;
use super::law::{LogResponse, LogResponses, Material, MaterialError, update_single};
use crate::numbers::lanes::Eight;
use crate::numbers::tensor::Mandel;

/// Outward strain step over the elastic strain: points within this distance of the yield surface take the plastic
/// tangent.
const OUTWARD_STRAIN_REL: f64 = 1e-3;

/// Law whose tangent is taken at a stress scaled by 1 + [`OUTWARD_STRAIN_REL`].
#[derive(Debug)]
pub struct AtYield {
    law: Arc<dyn Material>,
    /// Elastic compliance [1/MPa].
    compliance: SMatrix<f64, 6, 6>,
}

impl AtYield {
    /// `None` if the elastic stiffness is singular.
    #[must_use]
    pub fn new(law: Arc<dyn Material>, history_layout: &HistoryLayout) -> Option<Self> {
        let stiffness = SMatrix::<f64, 6, 6>::from_fn(|i, j| history_layout.stiffness[i][j]);
        Some(Self { law, compliance: stiffness.try_inverse()? })
    }
}

impl Material for AtYield {
    fn state_len(&self) -> usize {
        self.law.state_len()
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
        self.law.update_points(strains, count, (old, new), out)?;
        let mut outward = *strains;
        for i in 0..6 {
            for j in 0..6 {
                for point in 0..count {
                    outward[i][point] +=
                        OUTWARD_STRAIN_REL * self.compliance[(i, j)] * out.stress[j][point];
                }
            }
        }
        let mut outward_response = LogResponses::zero();
        self.law.update_points(&outward, count, (old, &mut new.to_vec()), &mut outward_response)?;
        out.tangent = outward_response.tangent;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::card;

    #[test]
    fn a_point_that_came_back_by_a_hair_flows_and_one_well_within_does_not() {
        let law = card::find("mild-steel-neto2012").unwrap().build(0.0).unwrap();
        let history_layout = law.history_layout().unwrap();
        let at_yield = AtYield::new(Arc::clone(&law), &history_layout).unwrap();
        let mut new = vec![0.0; law.state_len()];
        let (old, mut flowing) = (new.clone(), LogResponse::zero());
        let first = [0.02, -0.01, -0.01, 0.0, 0.0, 0.0];
        law.update(&first, &old, &mut new, &mut flowing).unwrap();
        let (old, mut trial) = (new.clone(), new.clone());
        // Unloading by 1e-4, and by half of the elastic strain (at least 1e-3 at yield).
        for (back, flows) in [(1e-7, true), (5e-4, false)] {
            let strain =
                [first[0] - back, first[1] + 0.5 * back, first[2] + 0.5 * back, 0.0, 0.0, 0.0];
            let [mut elastic, mut found] = [LogResponse::zero(), LogResponse::zero()];
            law.update(&strain, &old, &mut trial, &mut elastic).unwrap();
            at_yield.update(&strain, &old, &mut trial, &mut found).unwrap();
            assert!(!elastic.plastic, "{back}");
            assert_eq!(found.stress, elastic.stress);
            let soft = found.tangent[0][0] < 0.9 * history_layout.stiffness[0][0];
            assert_eq!(soft, flows, "{back}: {:?}", found.tangent[0]);
        }
    }
}
