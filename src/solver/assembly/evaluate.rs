//! Internal force and tangent of a body, assembled band by band.

use super::bands::{Assembly, Bands, Elements, Sums};
use super::body::{Body, EvaluationData};
use super::evaluation::{ElementFailure, Evaluation};
use crate::element::{ElementMatrices, Want};
use crate::linear::pattern::Gather;
use crate::material::Material;

impl Body {
    /// Evaluates and assembles all elements: with the material and the committed history, or with another law and
    /// history.
    pub(super) fn evaluate_elements(
        &mut self,
        displacement: &[f64],
        want: Want,
        other: Option<(&dyn Material, &[f64])>,
        out: &mut Evaluation,
    ) -> Result<(), ElementFailure> {
        let stride = self.stride();
        self.evaluation_data();
        let evaluation_data = self.evaluation_data.get_mut().expect("made on the line above");
        let EvaluationData { gather, geometry, committed, trial, bands, hanging, blocks, .. } =
            evaluation_data;
        let (material, history) = other.unwrap_or((self.material.as_ref(), &committed[..]));
        let all = Elements {
            mesh: &self.mesh,
            kind: self.kind,
            geometry,
            rule: &self.thickness_rule,
            material,
            axes: self.axes.as_deref(),
            history,
            history_lengths: [stride, self.kind.point_count() * self.material.state_len()],
            hanging,
            displacement,
            want,
        };
        let mut states = states_of(trial, self.mesh.elements.len(), stride);
        out.internal_force.resize(3 * self.mesh.nodes.len(), 0.0);
        if want == Want::ResidualAndTangent {
            out.tangent.resize(gather.pattern.nnz(), 0.0);
        }
        all.evaluate_bands((gather, bands), &mut states, blocks, out)
    }
}

impl Elements<'_> {
    /// Evaluates and assembles the elements band by band.
    ///
    /// # Errors
    /// The first element of the first band that failed; the assembled quantities are then incomplete.
    fn evaluate_bands(
        &self,
        (gather, bands): (&Gather, &Bands),
        states: &mut [&mut [f64]],
        blocks: &mut [ElementMatrices],
        out: &mut Evaluation,
    ) -> Result<(), ElementFailure> {
        let mut sums = Sums::default();
        // The modes of an element continue from its last evaluation. All elements are therefore evaluated even after
        // a failure, since the length of the bands depends on the number of threads.
        let mut failure = Ok(());
        for band in &bands.list {
            let first = band.elements.start % bands.stored;
            let own = &mut blocks[first..first + band.elements.len()];
            let done = self.evaluate(band.elements.start, &mut states[band.elements.clone()], own);
            failure = failure.and(done);
            if failure.is_err() {
                continue;
            }
            own.iter().for_each(|block| sums.add(block));
            let assembly = Assembly { gather, blocks, want: self.want };
            assembly.sum(&band.nodes, out);
        }
        out.set_sums(sums);
        failure
    }
}

/// Histories of the elements, `stride` values each.
fn states_of(trial: &mut [f64], elements: usize, stride: usize) -> Vec<&mut [f64]> {
    if stride == 0 {
        (0..elements).map(|_| <&mut [f64]>::default()).collect()
    } else {
        trial.chunks_exact_mut(stride).collect()
    }
}

impl Evaluation {
    /// Sets the sums over the elements.
    fn set_sums(&mut self, sums: Sums) {
        let Sums { elastic_energy, plastic_work, artificial_work, internal_residual } = sums;
        (self.elastic_energy, self.plastic_work) = (elastic_energy, plastic_work);
        self.artificial_work = artificial_work;
        self.internal_residual = internal_residual;
    }
}
