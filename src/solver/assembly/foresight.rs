//! Prediction of the strains at the end of an increment by extrapolation of the last two increments.

use std::sync::Arc;

use super::body::{Body, EvaluationData};
use super::evaluation::{ElementFailure, Evaluation};
use crate::element::Want;
use crate::material::Material;
use crate::material::at_yield::AtYield;
use crate::material::foreseen::Foreseen;

/// Parameters of the prediction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foresight {
    /// Length of the increment over that of the last one.
    pub factor: f64,
    /// Use elastic tangents: plastic flow is then as predicted for any change of strain.
    pub stiff: bool,
}

impl Body {
    /// Whether the material stores the strains needed for a prediction.
    #[must_use]
    pub fn can_foresee(&self) -> bool {
        self.material.history_layout().is_some()
    }

    /// As [`Body::evaluate`] with tangent, for the law linearised at the predicted strains. A material that stores no
    /// strains is evaluated without linearisation. The trial history must not be committed.
    ///
    /// # Errors
    /// As [`Body::evaluate`].
    pub fn evaluate_foreseen(
        &mut self,
        displacement: &[f64],
        foresight: Foresight,
        out: &mut Evaluation,
    ) -> Result<(), ElementFailure> {
        let Some(history_layout) = self.material.history_layout() else {
            return self.evaluate(displacement, Want::ResidualAndTangent, out);
        };
        let Foresight { factor, stiff } = foresight;
        let mut history = self.evaluation_data().committed.clone();
        let mut before = self.evaluation_data().previous_strains.chunks_exact(6);
        for point in self.strain_indices(history_layout.strain) {
            let Some(before) = before.next() else { break };
            for (value, before) in history[point..point + 6].iter_mut().zip(before) {
                *value += factor * (*value - before);
            }
        }
        let law = Foreseen::new(Arc::clone(&self.material), &history_layout, stiff);
        let other: (&dyn Material, &[f64]) = (&law, &history);
        self.evaluate_elements(displacement, Want::ResidualAndTangent, Some(other), out)
    }

    /// As [`Body::evaluate`] with the plastic tangent at all points on the yield surface ([`AtYield`]). The trial
    /// history must not be committed.
    ///
    /// # Errors
    /// As [`Body::evaluate`].
    pub fn evaluate_at_yield(
        &mut self,
        displacement: &[f64],
        out: &mut Evaluation,
    ) -> Result<(), ElementFailure> {
        let law = self
            .material
            .history_layout()
            .and_then(|history_layout| AtYield::new(Arc::clone(&self.material), &history_layout));
        let Some(law) = law else {
            return self.evaluate(displacement, Want::ResidualAndTangent, out);
        };
        let history = self.evaluation_data().committed.clone();
        self.evaluate_elements(displacement, Want::ResidualAndTangent, Some((&law, &history)), out)
    }

    /// Stores the strains of the last commit before the next one.
    pub(super) fn store_previous_strains(&mut self) {
        let Some(history_layout) = self.material.history_layout() else { return };
        let indices = self.strain_indices(history_layout.strain);
        let EvaluationData { previous_strains, committed, .. } = self.evaluation_data_mut();
        for (kept, at) in previous_strains.chunks_exact_mut(6).zip(indices) {
            kept.copy_from_slice(&committed[at..at + 6]);
        }
    }

    /// Indices of the strains of all points in the committed history; `offset` is the index in the history of a point.
    fn strain_indices(&self, offset: usize) -> impl Iterator<Item = usize> + use<> {
        let (stride, len) = (self.stride(), self.material.state_len());
        let (elements, points) = (self.mesh.elements.len(), self.kind.point_count());
        (0..elements).flat_map(move |e| (0..points).map(move |p| e * stride + p * len + offset))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::ElementKind;
    use crate::material::card;
    use crate::sheet::hex_mesh::rectangle;
    use kanagata_geometry::{Mat3, Vec3};

    /// Displacements of a sheet of 2 x 2 elements, stretched in proportion to `step` and rotated by 0.1 rad per step.
    fn stretched_and_turned(body: &Body, step: f64) -> Vec<f64> {
        let (s, c) = (0.1 * step).sin_cos();
        let turn = Mat3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c);
        let [long, thin] = [0.01 * step, -0.005 * step].map(f64::exp);
        let moved = |x: &Vec3| turn * Vec3::new(long * x.x, thin * x.y, thin * x.z) - x;
        body.mesh().nodes.iter().flat_map(|x| <[f64; 3]>::from(moved(x))).collect()
    }

    fn largest_difference(a: &Evaluation, b: &Evaluation) -> f64 {
        let pairs = a.internal_force.iter().zip(&b.internal_force);
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    /// A sheet of 2 x 2 x 0.8 mm, with a rolling direction across the axes or without.
    fn square(kind: ElementKind, steel: &Arc<dyn Material>, rolling: bool) -> Body {
        let mesh = rectangle(2.0, 2.0, 0.8, 2, 2, 1);
        let mut body = Body::new(mesh, kind, Arc::clone(steel)).unwrap();
        if rolling {
            body.set_rolling_direction(&Vec3::new(1.0, 2.0, 0.5)).unwrap();
        }
        body
    }

    fn largest_force(out: &Evaluation) -> f64 {
        out.internal_force.iter().fold(0.0_f64, |m, f| m.max(f.abs()))
    }

    #[test]
    fn strains_are_carried_on_as_they_grow_however_the_sheet_turns() {
        let steel = card::find("mild-steel-neto2012").unwrap().build(0.0).unwrap();
        let kinds = [ElementKind::Hex8, ElementKind::SolidShell { points: 3, membrane: true }];
        // With the axes of the body, and with those of each element.
        for (kind, rolling) in kinds.into_iter().flat_map(|kind| [(kind, false), (kind, true)]) {
            let new = || square(kind, &steel, rolling);
            let mut body = new();
            let [mut out, mut foreseen] = [Evaluation::default(), Evaluation::default()];
            for step in [1.0, 2.0] {
                let u = stretched_and_turned(&body, step);
                body.evaluate(&u, Want::ResidualAndTangent, &mut out).unwrap();
                body.commit();
            }
            // The prediction is unchanged by a checkpoint.
            let saved = body.export_state();
            body = new();
            body.import_state(&saved).unwrap();
            let [before, last, next] =
                [1.0, 2.0, 3.5].map(|step| stretched_and_turned(&body, step));
            body.evaluate(&next, Want::ResidualAndTangent, &mut out).unwrap();
            let force = largest_force(&out);
            for stiff in [false, true] {
                let foresight = Foresight { factor: 1.5, stiff };
                body.evaluate_foreseen(&next, foresight, &mut foreseen).unwrap();
                let off = largest_difference(&foreseen, &out);
                assert!(off < 1e-9 * force, "{kind:?} {stiff}: {off} of {force}");
            }
            // Another factor gives another prediction; extrapolated displacements have a larger error than
            // extrapolated strains.
            let foresight = Foresight { factor: 1.0, stiff: false };
            body.evaluate_foreseen(&next, foresight, &mut foreseen).unwrap();
            assert!(largest_difference(&foreseen, &out) > 1e-3 * force);
            let carried: Vec<f64> =
                last.iter().zip(&before).map(|(u, b)| u + 1.5 * (u - b)).collect();
            body.evaluate(&carried, Want::ResidualAndTangent, &mut foreseen).unwrap();
            assert!(largest_difference(&foreseen, &out) > 0.1 * force);
        }
    }
}
