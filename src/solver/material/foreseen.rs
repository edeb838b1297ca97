//! Law linearised at the predicted strain at the end of an increment.
//!
//! The first iterate of an increment is extrapolated, and extrapolated displacements move rotating parts of the sheet
//! along straight lines. The strain error is of second order in the rotation angle, and a point on its yield surface
//! responds to it with spurious plastic flow. Logarithmic strains are rotation-invariant. Extrapolated from the last
//! increments they predict the strain `E*` of every point, and the law is linear around it: `T = T(E*) + D (E - E*)`.

use std::sync::Arc;

use super::law::{
    HistoryLayout, LogResponse, LogResponses, Material, MaterialError, update_single,
};
use crate::numbers::lanes::Eight;
use crate::numbers::tensor::{Mandel, Mandel66};

/// Law linearised at the strains `E*`, which the histories hold in place of the last strains.
#[derive(Debug)]
pub struct Foreseen {
    law: Arc<dyn Material>,
    strain: usize,
    /// Elastic tangent that replaces the tangent of the law.
    tangent: Option<Mandel66>,
}

impl Foreseen {
    /// Uses the tangent of the law at `E*` or, with `elastic`, the elastic tangent: the plastic flow is then that of
    /// `E*`.
    #[must_use]
    pub fn new(law: Arc<dyn Material>, history_layout: &HistoryLayout, elastic: bool) -> Self {
        Self {
            law,
            strain: history_layout.strain,
            tangent: elastic.then_some(history_layout.stiffness),
        }
    }
}

impl Material for Foreseen {
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
        let len = self.state_len();
        let mut predicted = *strains;
        for (point, old) in old.chunks_exact(len).take(count).enumerate() {
            for i in 0..6 {
                predicted[i][point] = old[self.strain + i];
            }
        }
        self.law.update_points(&predicted, count, (old, new), out)?;
        if let Some(tangent) = self.tangent {
            out.tangent = tangent.map(|row| row.map(|value| [value; _]));
        }
        for i in 0..6 {
            for j in 0..6 {
                for point in 0..count {
                    let deviation = strains[j][point] - predicted[j][point];
                    out.stress[i][point] += out.tangent[i][j][point] * deviation;
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::card;
    use crate::numbers::lanes::POINTS;

    /// A yielding point of mild steel, with the predicted strain in its history.
    fn predicted() -> (Arc<dyn Material>, Vec<f64>, Mandel) {
        let law = card::find("mild-steel-neto2012").unwrap().build(0.4).unwrap();
        let at = law.history_layout().unwrap().strain;
        let mut old = vec![0.0; law.state_len()];
        let mut new = old.clone();
        let first = [0.02, -0.005, -0.015, 0.01, 0.0, 0.0];
        law.update(&first, &old, &mut new, &mut LogResponse::zero()).unwrap();
        assert_eq!(new[at..at + 6], first);
        let next = first.map(|e| 1.1 * e);
        old.copy_from_slice(&new);
        old[at..at + 6].copy_from_slice(&next);
        (law, old, next)
    }

    #[test]
    fn a_predicted_law_is_the_linearisation_at_the_predicted_strain() {
        let (law, old, there) = predicted();
        let history_layout = law.history_layout().unwrap();
        let mut new = old.clone();
        let mut expected = LogResponse::zero();
        law.update(&there, &old, &mut new, &mut expected).unwrap();
        assert!(expected.plastic);
        let deviation = [1e-3, 2e-3, -5e-4, 1e-3, -2e-3, 3e-3];
        let strain: Mandel = std::array::from_fn(|i| there[i] + deviation[i]);
        for elastic in [false, true] {
            let tangent = if elastic { history_layout.stiffness } else { expected.tangent };
            let linear = Foreseen::new(Arc::clone(&law), &history_layout, elastic);
            let mut out = LogResponse::zero();
            linear.update(&strain, &old, &mut new, &mut out).unwrap();
            for i in 0..6 {
                let moved: f64 = (0..6).map(|j| tangent[i][j] * deviation[j]).sum();
                assert!((out.stress[i] - expected.stress[i] - moved).abs() < 1e-9, "{elastic} {i}");
                assert_eq!(out.tangent[i], tangent[i]);
            }
            let mut all = LogResponses::zero();
            let strains = strain.map(|value| [value; POINTS]);
            let histories = old.repeat(3);
            let to = &mut histories.clone()[..];
            linear.update_points(&strains, 3, (&histories, to), &mut all).unwrap();
            for point in 0..3 {
                let one = all.point(point);
                assert_eq!((one.stress, one.tangent), (out.stress, out.tangent));
            }
        }
    }
}
