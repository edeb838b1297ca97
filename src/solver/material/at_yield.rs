//! A law whose points at the yield surface flow, whichever way they went there: the tangent that tells whether a balance lasts.
//!
//! A sheet that has come to rest has points on their yield surface of which the last iterate says nothing: they moved by
//! rounding, or back by a hair. Hill (1958): the comparison solid whose points all flow there is the one that may give way first.

use std::sync::Arc;

use nalgebra::SMatrix;

use super::law::Memory;
use super::law::{LogResponse, LogResponses, Material, MaterialError, one_as_points};
use crate::solver::numbers::lanes::Eight;
use crate::solver::numbers::tensor::Mandel;

/// How near to its yield surface a point is taken to be there, over its stress.
const NEAR: f64 = 1e-3;

/// The law, with the tangent at a stress that is farther out by a hair.
#[derive(Debug)]
pub struct AtYield {
    law: Arc<dyn Material>,
    /// Elastic, [1/MPa].
    compliance: SMatrix<f64, 6, 6>,
}

impl AtYield {
    /// `None` where the elastic stiffness has no inverse.
    #[must_use]
    pub fn new(law: Arc<dyn Material>, memory: &Memory) -> Option<Self> {
        let stiffness = SMatrix::<f64, 6, 6>::from_fn(|i, j| memory.stiffness[i][j]);
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
        one_as_points(self, strain, (old, new), response)
    }

    fn update_points(
        &self,
        strains: &[Eight; 6],
        count: usize,
        (old, new): (&[f64], &mut [f64]),
        out: &mut LogResponses,
    ) -> Result<(), (usize, MaterialError)> {
        self.law.update_points(strains, count, (old, new), out)?;
        let mut farther = *strains;
        for i in 0..6 {
            for j in 0..6 {
                for point in 0..count {
                    farther[i][point] += NEAR * self.compliance[(i, j)] * out.stress[j][point];
                }
            }
        }
        let mut there = LogResponses::zero();
        self.law.update_points(&farther, count, (old, &mut new.to_vec()), &mut there)?;
        out.tangent = there.tangent;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::material::card;

    #[test]
    fn a_point_that_came_back_by_a_hair_flows_and_one_well_within_does_not() {
        let law = card::find("mild-steel-neto2012").unwrap().build(0.0).unwrap();
        let memory = law.memory().unwrap();
        let at_yield = AtYield::new(Arc::clone(&law), &memory).unwrap();
        let mut new = vec![0.0; law.state_len()];
        let (old, mut flowing) = (new.clone(), LogResponse::zero());
        let first = [0.02, -0.01, -0.01, 0.0, 0.0, 0.0];
        law.update(&first, &old, &mut new, &mut flowing).unwrap();
        let (old, mut trial) = (new.clone(), new.clone());
        // Back by a ten-thousandth, and by half of the elastic strain (1e-3 and more at its yield stress).
        for (back, flows) in [(1e-7, true), (5e-4, false)] {
            let strain =
                [first[0] - back, first[1] + 0.5 * back, first[2] + 0.5 * back, 0.0, 0.0, 0.0];
            let [mut elastic, mut found] = [LogResponse::zero(), LogResponse::zero()];
            law.update(&strain, &old, &mut trial, &mut elastic).unwrap();
            at_yield.update(&strain, &old, &mut trial, &mut found).unwrap();
            assert!(!elastic.plastic, "{back}");
            assert_eq!(found.stress, elastic.stress);
            let soft = found.tangent[0][0] < 0.9 * memory.stiffness[0][0];
            assert_eq!(soft, flows, "{back}: {:?}", found.tangent[0]);
        }
    }
}
