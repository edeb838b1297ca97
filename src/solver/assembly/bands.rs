//! Element loop over bands: element matrices are assembled while they are in the cache.
//!
//! A band is a run of elements evaluated in parallel. After each band the rows of all nodes without later elements
//! are assembled, and only the element matrices needed for later rows are kept. Contributions to a node are summed in
//! element order, independent of the bands.

use std::ops::Range;

use rayon::prelude::*;

use super::condense::condense;
use super::evaluation::{ElementFailure, Evaluation};
use crate::element::{
    DOFS, ElementInput, ElementKind, ElementMatrices, PointFailure, PointGeometry, Want,
};
use crate::linear::pattern::{Gather, NodeUse};
use crate::material::Material;
use crate::material::RotatedLaw;
use crate::sheet::hanging_nodes::HangingCorners;
use crate::sheet::hex_mesh::HexMesh;
use kanagata_geometry::Mat3;

/// Elements of a band for each thread: the matrices of two bands fit into the cache.
const ELEMENTS_PER_THREAD: usize = 128;
/// Elements evaluated, and nodes assembled, by one task.
const ELEMENTS_PER_TASK: usize = 16;
const NODES_PER_TASK: usize = 32;

/// Partition of the elements into bands.
#[derive(Debug)]
pub(super) struct Bands {
    pub(crate) list: Vec<Band>,
    /// Number of element matrices kept, a multiple of the band length. The matrix of an element is stored at its
    /// number modulo this.
    pub(super) stored: usize,
}

/// A run of elements and the nodes, in order, that no later element touches.
#[derive(Debug)]
pub(crate) struct Band {
    pub(crate) elements: Range<usize>,
    pub(crate) nodes: Vec<Range<usize>>,
}

impl Bands {
    /// Bands for the current number of threads.
    pub(super) fn new(gather: &Gather, element_count: usize) -> Self {
        Self::of_length(gather, element_count, ELEMENTS_PER_THREAD * rayon::current_num_threads())
    }

    fn of_length(gather: &Gather, element_count: usize, length: usize) -> Self {
        let length = length.min(element_count.max(1));
        let ends =
            (0..element_count).step_by(length).map(|first| (first + length).min(element_count));
        let mut list: Vec<Band> = ends
            .map(|end| Band { elements: (end - 1) / length * length..end, nodes: Vec::new() })
            .collect();
        let mut stored_min = length;
        for node in 0..gather.use_ptr.len() - 1 {
            let around = gather.around(node);
            let [first, last] = [around.first(), around.last()]
                .map(|one| one.map_or(0, |one: &NodeUse| one.element as usize));
            let Some(band) = list.get_mut(last / length) else { continue };
            // Each band has storage for a full band, however short it is.
            stored_min = stored_min.max(band.elements.start + length - first);
            match band.nodes.last_mut() {
                Some(run) if run.end == node && run.len() < NODES_PER_TASK => run.end += 1,
                _ => band.nodes.push(node..node + 1),
            }
        }
        Self { list, stored: stored_min.div_ceil(length) * length }
    }
}

/// Sums over the elements.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    pub(super) elastic_energy: f64,
    pub(super) plastic_work: f64,
    pub(super) artificial_work: f64,
    pub(super) internal_residual: f64,
}

impl Sums {
    pub(crate) fn add(&mut self, block: &ElementMatrices) {
        self.elastic_energy += block.elastic_energy;
        self.plastic_work += block.plastic_work;
        self.artificial_work += block.artificial_work;
        self.internal_residual = self.internal_residual.max(block.internal_residual);
    }
}

/// Input of the element loop.
pub(super) struct Elements<'a> {
    pub(super) mesh: &'a HexMesh,
    pub(super) kind: ElementKind,
    pub(super) geometry: &'a [[PointGeometry; 8]],
    pub(super) rule: &'a [(f64, f64)],
    pub(super) material: &'a dyn Material,
    pub(super) axes: Option<&'a [Mat3]>,
    pub(super) history: &'a [f64],
    /// Length of the history of an element, and of its points' part.
    pub(super) history_lengths: [usize; 2],
    /// Hanging corners of each element, or empty.
    pub(super) hanging: &'a [Option<HangingCorners>],
    pub(super) displacement: &'a [f64],
    pub(super) want: Want,
}

impl Elements<'_> {
    /// Evaluates the elements from `first`; each writes its new history and its matrices.
    pub(crate) fn evaluate(
        &self,
        first: usize,
        states: &mut [&mut [f64]],
        blocks: &mut [ElementMatrices],
    ) -> Result<(), ElementFailure> {
        let failure = states
            .par_iter_mut()
            .zip(blocks.par_iter_mut())
            .enumerate()
            .with_min_len(ELEMENTS_PER_TASK)
            .filter_map(|(k, (state, block))| self.evaluate_one(first + k, state, block).err())
            .min_by_key(|failure| failure.element);
        failure.map_or(Ok(()), Err)
    }

    fn evaluate_one(
        &self,
        element: usize,
        new_state: &mut [f64],
        block: &mut ElementMatrices,
    ) -> Result<(), ElementFailure> {
        let [stride, point_len] = self.history_lengths;
        let ids = self.mesh.elements[element];
        let nodes = ids.map(|node| self.mesh.nodes[node as usize]);
        let mut displacement = [0.0; DOFS];
        for (local, &node) in displacement.chunks_exact_mut(3).zip(&ids) {
            local.copy_from_slice(&self.displacement[3 * node as usize..3 * node as usize + 3]);
        }
        let rotated = self.axes.map(|axes| RotatedLaw::new(self.material, &axes[element]));
        let history = &self.history[element * stride..(element + 1) * stride];
        let (old_state, old_record) = history.split_at(point_len);
        let input = ElementInput {
            material: rotated.as_ref().map_or(self.material, |rotated| rotated),
            nodes: &nodes,
            displacement: &displacement,
            old_state,
            old_record,
            want: self.want,
        };
        let geometry = (&self.geometry[element], self.rule);
        let history = new_state.split_at_mut(point_len);
        let failed = |PointFailure { point, reason }| ElementFailure { element, point, reason };
        self.kind.evaluate(&input, geometry, history, block).map_err(failed)?;
        if let Some(Some(corners)) = self.hanging.get(element) {
            condense(corners, self.want, block);
        }
        Ok(())
    }
}

/// Element matrices that nodes still need.
pub(super) struct Assembly<'a> {
    pub(super) gather: &'a Gather,
    pub(super) blocks: &'a [ElementMatrices],
    pub(super) want: Want,
}

impl Assembly<'_> {
    /// Assembles forces and, if requested, rows of the tangent of `nodes`.
    pub(crate) fn sum(&self, nodes: &[Range<usize>], out: &mut Evaluation) {
        let row_ptr = &self.gather.pattern.row_ptr;
        let with_tangent = self.want == Want::ResidualAndTangent;
        let (mut forces, mut rows) = (&mut out.internal_force[..], &mut out.tangent[..]);
        let mut done = 0;
        let mut tasks = Vec::with_capacity(nodes.len());
        for run in nodes {
            let force = split_off(&mut forces, 3 * (run.start - done), 3 * run.len());
            let tangent = if with_tangent {
                let [done, start, end] = [done, run.start, run.end].map(|node| row_ptr[3 * node]);
                split_off(&mut rows, start - done, end - start)
            } else {
                Default::default()
            };
            tasks.push((run.clone(), force, tangent));
            done = run.end;
        }
        tasks.into_par_iter().for_each(|(run, force, tangent)| {
            self.sum_forces(run.clone(), force);
            if with_tangent {
                self.sum_rows(run, tangent);
            }
        });
    }

    fn block(&self, one: &NodeUse) -> &ElementMatrices {
        &self.blocks[one.element as usize % self.blocks.len()]
    }

    fn sum_forces(&self, nodes: Range<usize>, forces: &mut [f64]) {
        for (node, sum) in nodes.zip(forces.chunks_exact_mut(3)) {
            sum.fill(0.0);
            for one in self.gather.around(node) {
                let at = 3 * one.local as usize;
                let force = &self.block(one).force[at..at + 3];
                sum.iter_mut().zip(force).for_each(|(sum, force)| *sum += force);
            }
        }
    }

    fn sum_rows(&self, nodes: Range<usize>, values: &mut [f64]) {
        values.fill(0.0);
        let row_ptr = &self.gather.pattern.row_ptr;
        let base = row_ptr[3 * nodes.start];
        for node in nodes {
            let start = row_ptr[3 * node] - base;
            let width = row_ptr[3 * node + 1] - row_ptr[3 * node];
            let rows = &mut values[start..start + 3 * width];
            for one in self.gather.around(node) {
                let block = &self.block(one).tangent;
                for i in 0..3 {
                    let source = &block[3 * one.local as usize + i];
                    for (b, &slot) in one.slots.iter().enumerate() {
                        let at = i * width + 3 * slot as usize;
                        for (sum, value) in
                            rows[at..at + 3].iter_mut().zip(&source[3 * b..3 * b + 3])
                        {
                            *sum += value;
                        }
                    }
                }
            }
        }
    }
}

/// Splits off `len` values after `skipped` others.
pub(super) fn split_off<'a>(rest: &mut &'a mut [f64], skipped: usize, len: usize) -> &'a mut [f64] {
    let (_, after) = std::mem::take(rest).split_at_mut(skipped);
    let (taken, after) = after.split_at_mut(len);
    *rest = after;
    taken
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::assembly::Body;
    use crate::material::card;
    use crate::sheet::hex_mesh::rectangle;

    /// A sheet of 9 x 7 x 2 elements, renumbered by `place`.
    fn body(place: impl Fn(usize) -> usize, length: usize) -> Body {
        body_of(ElementKind::Hex8, place, length)
    }

    fn body_of(kind: ElementKind, place: impl Fn(usize) -> usize, length: usize) -> Body {
        let HexMesh { nodes, elements, nodes_per_column, hanging } =
            rectangle(9.0, 7.0, 0.8, 9, 7, 2);
        let elements = (0..elements.len()).map(|e| elements[place(e)]).collect();
        let mesh = HexMesh { nodes, elements, nodes_per_column, hanging };
        let steel = card::find("mild-steel-neto2012").unwrap().build(0.0).unwrap();
        let mut body = Body::new(mesh, kind, Arc::clone(&steel)).unwrap();
        let count = body.mesh.elements.len();
        let evaluation_data = body.evaluation_data_mut();
        evaluation_data.bands = Bands::of_length(&evaluation_data.gather, count, length);
        evaluation_data.blocks = vec![ElementMatrices::zero(); evaluation_data.bands.stored];
        body
    }

    #[test]
    fn sums_are_the_same_bits_in_bands_of_any_length_and_elements_of_any_order() {
        let orders: [fn(usize) -> usize; 2] = [|e| e, |e| 47 * e % 126];
        for place in orders {
            let mut whole = body(place, 126);
            let u: Vec<f64> = whole
                .mesh
                .nodes
                .iter()
                .flat_map(|x| [0.02 * x.x, 3e-3 * x.x * x.y, -0.02 * x.z])
                .collect();
            for want in [Want::Residual, Want::ResidualAndTangent] {
                let mut expected = Evaluation::default();
                whole.evaluate(&u, want, &mut expected).unwrap();
                assert!(expected.plastic_work > 0.0);
                for length in [1, 5, 16, 100, 1000] {
                    let mut out = Evaluation::default();
                    body(place, length).evaluate(&u, want, &mut out).unwrap();
                    assert_eq!(out, expected, "bands of {length}");
                }
            }
        }
    }

    /// Modes continue from the last evaluation, so results after a failed evaluation must not depend on where it
    /// stopped.
    #[test]
    fn after_an_element_has_failed_bands_of_any_length_go_on_alike() {
        for kind in [ElementKind::default(), ElementKind::Hex8Enhanced] {
            let after = |length: usize| {
                let mut body = body_of(kind, |e| e, length);
                let bent = |body: &Body, by: f64| -> Vec<f64> {
                    let nodes = body.mesh.nodes.iter();
                    nodes
                        .flat_map(|x| [0.02 * x.x, by * x.x * x.y, -0.1 * by * x.x * x.z])
                        .collect()
                };
                let mut out = Evaluation::default();
                let mut failing = bent(&body, 0.01);
                // A corner of an element in the middle, pushed through the opposite face.
                let node = body.mesh.elements[60][0] as usize;
                failing[3 * node + 2] += 5.0;
                let failed = body.evaluate(&failing, Want::ResidualAndTangent, &mut out);
                let element = failed.unwrap_err().element;
                body.evaluate(&bent(&body, 0.004), Want::ResidualAndTangent, &mut out).unwrap();
                (element, out)
            };
            let expected = after(126);
            for length in [1, 16, 100] {
                assert!(after(length) == expected, "{kind:?} in bands of {length}");
            }
        }
    }

    #[test]
    fn only_as_many_answers_are_kept_as_rows_need() {
        // The elements of a node are 2 x 7 apart along x, and 3 adjacent.
        assert_eq!(body(|e| e, 1).evaluation_data().bands.stored, 18);
        assert_eq!(body(|e| e, 16).evaluation_data().bands.stored, 32);
        assert_eq!(body(|e| 47 * e % 126, 16).evaluation_data().bands.stored, 128);
    }
}
