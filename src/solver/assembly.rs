//! A deformable body: mesh, element formulation, material and history; forces and tangent in CSR order.
//!
//! Elements are evaluated in parallel into their own blocks; every row then gathers its contributions in
//! element order. The sums do not depend on the number of threads.

mod foresight;
mod saved;
mod volume;

use std::sync::Arc;

use rayon::prelude::*;

use super::blank::HexMesh;
use super::element::{
    DOFS, ElementInput, ElementKind, ElementMatrices, FailureReason, PointFailure, PointGeometry,
    Want, modes, reference_points,
};
use super::material::Material;
use super::pattern::{Gather, Pattern};
use crate::geometry::Vec3;

pub use foresight::Foresight;

/// Forces, tangent and energies of a body.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Evaluation {
    /// Internal force by degree of freedom (`3 node + direction`) [N].
    pub internal_force: Vec<f64>,
    /// Tangent values [N/mm] in the order of [`Body::pattern`]; untouched when only the residual is asked.
    pub tangent: Vec<f64>,
    /// Stored elastic energy [N mm].
    pub elastic_energy: f64,
    /// Plastic work since the beginning [N mm].
    pub plastic_work: f64,
    /// Largest force [N] by which unconverged internal modes of an element disturb its nodal forces; zero for
    /// elements without internal modes. A step is converged only when this is small too.
    pub internal_residual: f64,
}

/// An element that could not be evaluated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("element {element}, point {point}: {reason}")]
pub struct ElementFailure {
    /// Element number.
    pub element: usize,
    /// Material point inside it.
    pub point: usize,
    /// Cause.
    pub reason: FailureReason,
}

/// Why a body could not be made or its state not be read.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BodyError {
    /// An element is flat or inside out before anything moved.
    #[error(
        "element {element}: Jacobian determinant {det} mm³ in the undeformed mesh, must be above zero: repair the mesh"
    )]
    BadElement {
        /// Element number.
        element: usize,
        /// Determinant found [mm³].
        det: f64,
    },
    /// An element names a node that does not exist.
    #[error("element {element}: node {node} does not exist, the mesh has {count} nodes")]
    BadNode {
        /// Element number.
        element: usize,
        /// Node id found.
        node: u32,
        /// Nodes in the mesh.
        count: usize,
    },
    /// A solid-shell with too few or too many points through its thickness.
    #[error("{found} points through the thickness, a solid-shell takes 2 to 9")]
    BadPointCount {
        /// Points asked for.
        found: u8,
    },
    /// Saved state of another size.
    #[error(
        "saved element state has {found} bytes, this model needs {expected}: it belongs to another model"
    )]
    StateSize {
        /// Bytes found.
        found: usize,
        /// Bytes needed.
        expected: usize,
    },
}

/// One deformable body.
#[derive(Debug)]
pub struct Body {
    mesh: HexMesh,
    kind: ElementKind,
    material: Arc<dyn Material>,
    gather: Gather,
    /// Of the eight Gauss points of every undeformed element.
    geometry: Vec<[PointGeometry; 8]>,
    thickness_rule: Vec<(f64, f64)>,
    /// Converged history of each element: its points', then the record of its internal modes.
    committed: Vec<f64>,
    trial: Vec<f64>,
    /// Logarithmic strains before the last commit, six a point; none where the material keeps no memory.
    before: Vec<f64>,
    blocks: Vec<ElementMatrices>,
}

/// History of so many elements before anything happened.
fn virgin(elements: usize, kind: ElementKind, material: &dyn Material) -> Vec<f64> {
    let (state_len, point_len) = (material.state_len(), kind.point_count() * material.state_len());
    let stride = point_len + modes::record_len(kind.mode_count());
    let mut history = vec![0.0; elements * stride];
    if state_len > 0 {
        for element in history.chunks_exact_mut(stride) {
            let (states, _) = element.split_at_mut(point_len);
            states.chunks_exact_mut(state_len).for_each(|state| material.initial_state(state));
        }
    }
    history
}

/// Nodes gathered by one task.
const NODES_PER_TASK: usize = 128;

impl Body {
    /// A body at rest with the virgin material.
    ///
    /// # Errors
    /// [`BodyError::BadNode`], [`BodyError::BadElement`].
    pub fn new(
        mesh: HexMesh,
        kind: ElementKind,
        material: Arc<dyn Material>,
    ) -> Result<Self, BodyError> {
        let count = mesh.nodes.len();
        let mut geometry = Vec::with_capacity(mesh.elements.len());
        for (element, nodes) in mesh.elements.iter().enumerate() {
            if let Some(&node) = nodes.iter().find(|&&node| node as usize >= count) {
                return Err(BodyError::BadNode { element, node, count });
            }
            let corners = nodes.map(|node| mesh.nodes[node as usize]);
            geometry.push(
                reference_points(&corners).map_err(|det| BodyError::BadElement { element, det })?,
            );
        }
        if let ElementKind::SolidShell { points, .. } = kind
            && !(2..=9).contains(&points)
        {
            return Err(BodyError::BadPointCount { found: points });
        }
        let committed = virgin(mesh.elements.len(), kind, material.as_ref());
        let gather = Gather::new(count, &mesh.elements);
        let blocks = vec![ElementMatrices::zero(); mesh.elements.len()];
        let thickness_rule = kind.thickness_rule();
        let remembered = if material.memory().is_some() { 6 * kind.point_count() } else { 0 };
        let before = vec![0.0; mesh.elements.len() * remembered];
        Ok(Self {
            trial: committed.clone(),
            before,
            mesh,
            kind,
            material,
            gather,
            geometry,
            thickness_rule,
            committed,
            blocks,
        })
    }

    /// The mesh.
    #[must_use]
    pub fn mesh(&self) -> &HexMesh {
        &self.mesh
    }

    /// The element formulation.
    #[must_use]
    pub fn kind(&self) -> ElementKind {
        self.kind
    }

    /// Pattern of the tangent: three rows a node, symmetric, columns sorted.
    #[must_use]
    pub fn pattern(&self) -> &Pattern {
        &self.gather.pattern
    }

    /// Whether the tangent is symmetric.
    #[must_use]
    pub fn is_symmetric(&self) -> bool {
        self.material.is_symmetric()
    }

    /// Volumes of the undeformed elements [mm³].
    pub fn volumes(&self) -> impl Iterator<Item = f64> {
        self.geometry.iter().map(|points| points.iter().map(|point| point.weight).sum())
    }

    /// Forces, energies and (if wanted) tangent at `displacement` [mm] (three a node), from the last
    /// committed history. The trial history is kept for [`Body::commit`].
    ///
    /// # Errors
    /// [`ElementFailure`] of the lowest-numbered element that failed; cut the increment.
    pub fn evaluate(
        &mut self,
        displacement: &[f64],
        want: Want,
        out: &mut Evaluation,
    ) -> Result<(), ElementFailure> {
        self.evaluate_elements(displacement, want, None)?;
        self.gather_all(want, out);
        Ok(())
    }

    /// Sums of what the elements answered last.
    fn gather_all(&self, want: Want, out: &mut Evaluation) {
        out.internal_force.resize(3 * self.mesh.nodes.len(), 0.0);
        self.gather_forces(&mut out.internal_force);
        if want == Want::ResidualAndTangent {
            out.tangent.resize(self.gather.pattern.nnz(), 0.0);
            self.gather_tangent(&mut out.tangent);
        }
        out.elastic_energy = self.blocks.iter().map(|block| block.elastic_energy).sum();
        out.plastic_work = self.blocks.iter().map(|block| block.plastic_work).sum();
        out.internal_residual =
            self.blocks.iter().map(|block| block.internal_residual).fold(0.0, f64::max);
    }

    /// Makes the history of the last evaluation the converged one. Call it only after [`Body::evaluate`]
    /// at the accepted displacement.
    pub fn commit(&mut self) {
        self.keep_strains();
        self.committed.copy_from_slice(&self.trial);
    }

    /// Forgets everything since the last [`Body::commit`].
    pub fn restore(&mut self) {
        self.trial.copy_from_slice(&self.committed);
    }

    /// Equivalent plastic strain of each element at the last commit: mean over its points.
    #[must_use]
    pub fn equivalent_plastic_strain(&self) -> Vec<f64> {
        let state_len = self.material.state_len();
        let points = self.kind.point_count();
        if state_len == 0 {
            return vec![0.0; self.mesh.elements.len()];
        }
        let mean = |states: &[f64]| {
            let sum: f64 = states
                .chunks_exact(state_len)
                .map(|state| self.material.equivalent_plastic_strain(state))
                .sum();
            sum / points as f64
        };
        self.committed
            .chunks_exact(self.stride())
            .map(|element| mean(&element[..points * state_len]))
            .collect()
    }

    /// Distance [mm] from bottom to top node of every column at `displacement`: the sheet's thickness.
    #[must_use]
    pub fn column_thickness(&self, displacement: &[f64]) -> Vec<f64> {
        let place = |node: u32| {
            let at = 3 * node as usize;
            let u = &displacement[at..at + 3];
            self.mesh.nodes[node as usize] + Vec3::new(u[0], u[1], u[2])
        };
        let (low, high) = (self.mesh.bottom_nodes(), self.mesh.top_nodes());
        low.iter().zip(&high).map(|(&a, &b)| (place(b) - place(a)).norm()).collect()
    }

    /// Stored values of an element.
    fn stride(&self) -> usize {
        self.kind.point_count() * self.material.state_len()
            + modes::record_len(self.kind.mode_count())
    }

    /// Evaluates all elements into their blocks: with the material about the committed history, or another law about
    /// another.
    fn evaluate_elements(
        &mut self,
        displacement: &[f64],
        want: Want,
        other: Option<(&dyn Material, &[f64])>,
    ) -> Result<(), ElementFailure> {
        let (material, history) = other.unwrap_or((self.material.as_ref(), &self.committed[..]));
        let stride = self.stride();
        let point_len = self.kind.point_count() * self.material.state_len();
        let rule = &self.thickness_rule;
        let (mesh, geometry, kind) = (&self.mesh, &self.geometry, self.kind);
        let work = |element: usize, new_state: &mut [f64], block: &mut ElementMatrices| {
            let ids = mesh.elements[element];
            let nodes = ids.map(|node| mesh.nodes[node as usize]);
            let mut local = [0.0; DOFS];
            for (a, &node) in ids.iter().enumerate() {
                local[3 * a..3 * a + 3]
                    .copy_from_slice(&displacement[3 * node as usize..3 * node as usize + 3]);
            }
            let input = ElementInput {
                material,
                nodes: &nodes,
                displacement: &local,
                old_state: &history[element * stride..element * stride + point_len],
                want,
            };
            let (states, record) = new_state.split_at_mut(point_len);
            let result = kind.evaluate(&input, (&geometry[element], rule), (states, record), block);
            let failed = |PointFailure { point, reason }| ElementFailure { element, point, reason };
            result.err().map(failed)
        };
        let mut states: Vec<&mut [f64]> = if stride == 0 {
            (0..mesh.elements.len()).map(|_| <&mut [f64]>::default()).collect()
        } else {
            self.trial.chunks_exact_mut(stride).collect()
        };
        let failure = states
            .par_iter_mut()
            .zip(self.blocks.par_iter_mut())
            .enumerate()
            .with_min_len(16)
            .filter_map(|(element, (state, block))| work(element, state, block))
            .min_by_key(|failure| failure.element);
        failure.map_or(Ok(()), Err)
    }

    fn gather_forces(&self, force: &mut [f64]) {
        let (gather, blocks) = (&self.gather, &self.blocks);
        force.par_chunks_mut(3).with_min_len(NODES_PER_TASK).enumerate().for_each(|(node, sum)| {
            sum.fill(0.0);
            for one in &gather.uses[gather.use_ptr[node]..gather.use_ptr[node + 1]] {
                let block = &blocks[one.element as usize].force;
                for (i, value) in sum.iter_mut().enumerate() {
                    *value += block[3 * one.local as usize + i];
                }
            }
        });
    }

    fn gather_tangent(&self, values: &mut [f64]) {
        let (gather, blocks) = (&self.gather, &self.blocks);
        let node_count = self.mesh.nodes.len();
        let row_ptr = &gather.pattern.row_ptr;
        let mut tasks = Vec::with_capacity(node_count / NODES_PER_TASK + 1);
        let mut rest = values;
        for first in (0..node_count).step_by(NODES_PER_TASK) {
            let last = (first + NODES_PER_TASK).min(node_count);
            let (head, tail) = rest.split_at_mut(row_ptr[3 * last] - row_ptr[3 * first]);
            tasks.push((first..last, head));
            rest = tail;
        }
        tasks.into_par_iter().for_each(|(nodes, values)| {
            values.fill(0.0);
            let base = row_ptr[3 * nodes.start];
            for node in nodes {
                let start = row_ptr[3 * node] - base;
                let width = row_ptr[3 * node + 1] - row_ptr[3 * node];
                let rows = &mut values[start..start + 3 * width];
                for one in &gather.uses[gather.use_ptr[node]..gather.use_ptr[node + 1]] {
                    let block = &blocks[one.element as usize].tangent;
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
        });
    }
}
