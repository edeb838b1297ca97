//! What a body is foreseen to be at the end of an increment: the strains of its points, carried on from the last ones.

use std::sync::Arc;

use super::{Body, ElementFailure, Evaluation};
use crate::solver::element::Want;
use crate::solver::material::foreseen::Foreseen;

/// How an increment is foreseen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foresight {
    /// Length of the increment over that of the last one.
    pub factor: f64,
    /// With elastic tangents: flow stays what is foreseen, however the strains change.
    pub stiff: bool,
}

impl Body {
    /// Whether the material keeps what an increment can be foreseen from.
    #[must_use]
    pub fn can_foresee(&self) -> bool {
        self.material.memory().is_some()
    }

    /// As [`Body::evaluate`] with the tangent, the law linear about the strains foreseen; of a material that keeps none, the
    /// law itself. Not to be committed.
    ///
    /// # Errors
    /// As [`Body::evaluate`].
    pub fn evaluate_foreseen(
        &mut self,
        displacement: &[f64],
        foresight: Foresight,
        out: &mut Evaluation,
    ) -> Result<(), ElementFailure> {
        let Some(memory) = self.material.memory() else {
            return self.evaluate(displacement, Want::ResidualAndTangent, out);
        };
        let Foresight { factor, stiff } = foresight;
        let mut history = self.committed.clone();
        let mut before = self.before.chunks_exact(6);
        for point in self.strains_of(memory.strain) {
            let Some(before) = before.next() else { break };
            for (value, before) in history[point..point + 6].iter_mut().zip(before) {
                *value += factor * (*value - before);
            }
        }
        let law = Foreseen::new(Arc::clone(&self.material), &memory, stiff);
        self.evaluate_elements(displacement, Want::ResidualAndTangent, (&law, &history))?;
        self.gather_all(Want::ResidualAndTangent, out);
        Ok(())
    }

    /// Keeps the strains of the last commit, before the next one.
    pub(super) fn keep_strains(&mut self) {
        let Some(memory) = self.material.memory() else { return };
        let places = self.strains_of(memory.strain);
        for (kept, at) in self.before.chunks_exact_mut(6).zip(places) {
            kept.copy_from_slice(&self.committed[at..at + 6]);
        }
    }

    /// Where the strains of all points begin in the committed history, when they begin at `place` in a point's.
    fn strains_of(&self, place: usize) -> impl Iterator<Item = usize> + use<> {
        let (stride, len) = (self.stride(), self.material.state_len());
        let (elements, points) = (self.mesh.elements.len(), self.kind.point_count());
        (0..elements).flat_map(move |e| (0..points).map(move |p| e * stride + p * len + place))
    }
}
