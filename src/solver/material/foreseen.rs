//! A law linearised at the strain that an increment is foreseen to end with.
//!
//! The first iterate of an increment is extrapolated, and extrapolated displacements turn parts of the sheet along straight
//! lines: their strains are off by the square of the angle, which a law that sits on its yield surface answers with
//! flow that never takes place. Logarithmic strains know no rotation; carried on from the last increments they say where
//! every point will be, and the law is linear about that: `T = T(E*) + D (E - E*)`.

use std::sync::Arc;

use super::law::{LogResponse, LogResponses, Material, MaterialError, Memory, one_as_points};
use crate::solver::numbers::lanes::Eight;
use crate::solver::numbers::tensor::{Mandel, Mandel66};

/// A law about the strains `E*` that histories hold in the place of the last ones.
#[derive(Debug)]
pub struct Foreseen {
    law: Arc<dyn Material>,
    strain: usize,
    /// In place of the law's own tangent.
    tangent: Option<Mandel66>,
}

impl Foreseen {
    /// With the law's tangent at the strain foreseen or, with `stiff`, the elastic one: flow stays what is foreseen.
    #[must_use]
    pub fn new(law: Arc<dyn Material>, memory: &Memory, stiff: bool) -> Self {
        Self { law, strain: memory.strain, tangent: stiff.then_some(memory.stiffness) }
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
        one_as_points(self, strain, (old, new), response)
    }

    fn update_points(
        &self,
        strains: &[Eight; 6],
        count: usize,
        (old, new): (&[f64], &mut [f64]),
        out: &mut LogResponses,
    ) -> Result<(), (usize, MaterialError)> {
        let len = self.state_len();
        let mut foreseen = *strains;
        for (point, old) in old.chunks_exact(len).take(count).enumerate() {
            for i in 0..6 {
                foreseen[i][point] = old[self.strain + i];
            }
        }
        self.law.update_points(&foreseen, count, (old, new), out)?;
        if let Some(tangent) = self.tangent {
            out.tangent = tangent.map(|row| row.map(|value| [value; _]));
        }
        for i in 0..6 {
            for j in 0..6 {
                for point in 0..count {
                    let off = strains[j][point] - foreseen[j][point];
                    out.stress[i][point] += out.tangent[i][j][point] * off;
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::material::card;
    use crate::solver::numbers::lanes::POINTS;

    /// A point of mild steel that flows, the strain it is foreseen to reach put in its history.
    fn foreseen() -> (Arc<dyn Material>, Vec<f64>, Mandel) {
        let law = card::find("mild-steel-neto2012").unwrap().build(0.4).unwrap();
        let at = law.memory().unwrap().strain;
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
    fn a_foreseen_law_is_the_law_there_and_linear_about_it() {
        let (law, old, there) = foreseen();
        let memory = law.memory().unwrap();
        let mut new = old.clone();
        let mut expected = LogResponse::zero();
        law.update(&there, &old, &mut new, &mut expected).unwrap();
        assert!(expected.plastic);
        let off = [1e-3, 2e-3, -5e-4, 1e-3, -2e-3, 3e-3];
        let strain: Mandel = std::array::from_fn(|i| there[i] + off[i]);
        for stiff in [false, true] {
            let tangent = if stiff { memory.stiffness } else { expected.tangent };
            let linear = Foreseen::new(Arc::clone(&law), &memory, stiff);
            let mut out = LogResponse::zero();
            linear.update(&strain, &old, &mut new, &mut out).unwrap();
            for i in 0..6 {
                let moved: f64 = (0..6).map(|j| tangent[i][j] * off[j]).sum();
                assert!((out.stress[i] - expected.stress[i] - moved).abs() < 1e-9, "{stiff} {i}");
                assert_eq!(out.tangent[i], tangent[i]);
            }
            let mut all = LogResponses::zero();
            let strains = strain.map(|value| [value; POINTS]);
            let histories = old.repeat(3);
            let to = &mut histories.clone()[..];
            linear.update_points(&strains, 3, (&histories, to), &mut all).unwrap();
            for point in 0..3 {
                let one = all.get(point);
                assert_eq!((one.stress, one.tangent), (out.stress, out.tangent));
            }
        }
    }
}
