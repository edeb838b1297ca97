//! Law in rotated axes: strains are rotated into them, stresses and tangents back. The histories stay in these axes,
//! so that one law serves a body whose axes differ between elements.

use pulp::{Arch, Simd, WithSimd};

use super::law::{LogResponse, LogResponses, Material, MaterialError, update_single};
use crate::numbers::algebra::{rotate, rotate_back};
use crate::numbers::lanes::{Eight, Lane, POINTS};
use crate::numbers::tensor::{self, Mandel, Mandel66};
use kanagata_geometry::Mat3;

/// Law evaluated in global axes that computes in its own axes.
#[derive(Debug)]
pub(crate) struct RotatedLaw<'a> {
    law: &'a dyn Material,
    /// Rotation of global tensors into the axes.
    rotation: Mandel66,
}

impl<'a> RotatedLaw<'a> {
    /// Axes are the columns of the rotation `axes`.
    pub(crate) fn new(law: &'a dyn Material, axes: &Mat3) -> Self {
        let rows = std::array::from_fn(|i| std::array::from_fn(|j| axes[(j, i)]));
        Self { law, rotation: tensor::congruence(&rows) }
    }
}

impl Material for RotatedLaw<'_> {
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
        let (rotation, mut local) = (&self.rotation, [[0.0; POINTS]; 6]);
        Arch::new().dispatch(RotateStrains { rotation, strains, local: &mut local });
        self.law.update_points(&local, count, (old, new), out)?;
        Arch::new().dispatch(RotateResponses { rotation, out });
        Ok(())
    }
}

/// Strains rotated into the axes.
struct RotateStrains<'a> {
    rotation: &'a Mandel66,
    strains: &'a [Eight; 6],
    local: &'a mut [Eight; 6],
}

impl WithSimd for RotateStrains<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for first in Lane::<S>::groups() {
            let local = rotate(self.rotation, false, &Lane::load_all(simd, self.strains, first));
            for (value, to) in local.iter().zip(self.local.iter_mut()) {
                value.store(to, first);
            }
        }
    }
}

/// Stresses and tangents rotated back.
struct RotateResponses<'a> {
    rotation: &'a Mandel66,
    out: &'a mut LogResponses,
}

impl WithSimd for RotateResponses<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let LogResponses { stress, tangent, .. } = self.out;
        for first in Lane::<S>::groups() {
            let global = rotate(self.rotation, true, &Lane::load_all(simd, stress, first));
            for (value, to) in global.iter().zip(stress.iter_mut()) {
                value.store(to, first);
            }
            let mut rows = [global; 6];
            for (row, from) in rows.iter_mut().zip(tangent.iter()) {
                *row = Lane::load_all(simd, from, first);
            }
            rotate_back(self.rotation, &mut rows);
            for (row, to) in rows.iter().zip(tangent.iter_mut()) {
                for (value, to) in row.iter().zip(to.iter_mut()) {
                    value.store(to, first);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::material::card;

    /// The rolling direction at an angle in the plane: by the law itself, or by axes rotated about its normal.
    #[test]
    fn a_law_turned_from_outside_answers_as_one_turned_by_itself() {
        for name in ["mild-steel-neto2012", "aa2090-t3-barlat2005"] {
            let [local, flat] =
                [0.4, 0.0].map(|angle| card::find(name).unwrap().build(angle).unwrap());
            let (s, c) = 0.4_f64.sin_cos();
            let axes = Mat3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
            let rotate = RotatedLaw::new(flat.as_ref(), &axes);
            let old = vec![0.0; flat.state_len()];
            let strain = [0.02, -0.005, -0.015, 0.01, 0.003, -0.002];
            let answer = |law: &dyn Material| {
                let (mut new, mut out) = (old.clone(), LogResponse::zero());
                law.update(&strain, &old, &mut new, &mut out).unwrap();
                (out, new)
            };
            let ((a, by_itself), (b, from_outside)) = (answer(local.as_ref()), answer(&rotate));
            let of = |law: &Arc<dyn Material>, history: &[f64]| law.point_state(history).unwrap();
            let [a_state, b_state] = [of(&local, &by_itself), of(&flat, &from_outside)];
            let off = a_state.plastic_strain - b_state.plastic_strain;
            assert!(off.abs() < 1e-12 && a_state.plastic_strain > 0.01);
            assert!((a_state.equivalent_stress - b_state.equivalent_stress).abs() < 1e-9);
            for i in 0..6 {
                assert!((a.stress[i] - b.stress[i]).abs() < 1e-9, "{name} {i}");
                for k in 0..6 {
                    assert!((a.tangent[i][k] - b.tangent[i][k]).abs() < 1e-6, "{name} {i} {k}");
                }
            }
        }
    }
}
