//! A deformable body: mesh, element formulation and material.

use std::sync::{Arc, OnceLock};

use super::bands::Bands;

use super::evaluation::{ElementFailure, Evaluation};
use crate::element::{
    ElementKind, ElementMatrices, PointGeometry, ReferenceCheck, Want, reference_points,
};
use crate::linear::pattern::{Gather, Pattern};
use crate::material::Material;
use crate::sheet::hanging_nodes::HangingCorners;
use crate::sheet::hex_mesh::HexMesh;
use kanagata_geometry::Mat3;

/// Invalid model of a body, or saved state that does not fit it.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BodyError {
    /// An element is flat or inverted in the undeformed mesh.
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
    #[error("{found} points through the thickness, a solid-shell takes 3 to 10")]
    BadPointCount {
        /// Number of points requested.
        found: u8,
    },
    /// Saved state of another model.
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
    pub(crate) mesh: HexMesh,
    pub(crate) kind: ElementKind,
    pub(crate) material: Arc<dyn Material>,
    pub(crate) thickness_rule: Vec<(f64, f64)>,
    /// Material axes of each element if they differ between elements.
    pub(crate) axes: Option<Vec<Mat3>>,
    /// Data for evaluation, about 9 kB per element. Allocated at first use, so that a model can be checked before.
    pub(crate) evaluation_data: OnceLock<EvaluationData>,
}

/// Data for the evaluation of the elements.
#[derive(Debug)]
pub struct EvaluationData {
    pub(super) gather: Gather,
    /// Gauss point geometry of every undeformed element.
    pub(crate) geometry: Vec<[PointGeometry; 8]>,
    /// Converged history of each element: its points, then its further state variables.
    pub(crate) committed: Vec<f64>,
    pub(super) trial: Vec<f64>,
    /// Logarithmic strains before the last commit, six for each point; empty if the material needs no prediction.
    pub(crate) previous_strains: Vec<f64>,
    pub(super) bands: Bands,
    /// Hanging corners of each element; empty for a mesh without hanging nodes.
    pub(super) hanging: Vec<Option<HangingCorners>>,
    /// Element matrices whose rows are not yet assembled.
    pub(super) blocks: Vec<ElementMatrices>,
}

/// Initial history of `elements` elements.
pub fn initial_history(elements: usize, kind: ElementKind, material: &dyn Material) -> Vec<f64> {
    let (state_len, point_len) = (material.state_len(), kind.point_count() * material.state_len());
    let stride = point_len + kind.record_len();
    let mut history = vec![0.0; elements * stride];
    if state_len > 0 {
        for element in history.chunks_exact_mut(stride) {
            let (states, _) = element.split_at_mut(point_len);
            states.chunks_exact_mut(state_len).for_each(|state| material.initial_state(state));
        }
    }
    history
}

impl EvaluationData {
    /// For a mesh whose elements have been checked.
    pub(crate) fn new(mesh: &HexMesh, kind: ElementKind, material: &dyn Material) -> Self {
        let corners = |nodes: &[u32; 8]| nodes.map(|node| mesh.nodes[node as usize]);
        let points = |nodes| {
            reference_points(&corners(nodes)).expect("elements are checked when the body is made")
        };
        let committed = initial_history(mesh.elements.len(), kind, material);
        let count = if mesh.hanging.is_empty() { 0 } else { mesh.elements.len() };
        let hanging: Vec<_> = (0..count).map(|e| mesh.hanging_corners(e)).collect();
        let effective: Vec<[u32; 8]> = (0..count).map(|e| mesh.effective_nodes(e)).collect();
        let elements = if count > 0 { &effective } else { &mesh.elements };
        let gather = Gather::new(mesh.nodes.len(), elements);
        let bands = Bands::new(&gather, mesh.elements.len());
        let strain_len =
            if material.history_layout().is_some() { 6 * kind.point_count() } else { 0 };
        Self {
            geometry: mesh.elements.iter().map(points).collect(),
            trial: committed.clone(),
            previous_strains: vec![0.0; mesh.elements.len() * strain_len],
            blocks: vec![ElementMatrices::zero(); bands.stored],
            gather,
            committed,
            bands,
            hanging,
        }
    }
}

impl Body {
    /// A body in its undeformed state with the virgin material.
    ///
    /// # Errors
    /// [`BodyError::BadNode`], [`BodyError::BadElement`], [`BodyError::BadPointCount`].
    pub fn new(
        mesh: HexMesh,
        kind: ElementKind,
        material: Arc<dyn Material>,
    ) -> Result<Self, BodyError> {
        let count = mesh.nodes.len();
        let reference = ReferenceCheck::new();
        for (element, nodes) in mesh.elements.iter().enumerate() {
            if let Some(&node) = nodes.iter().find(|&&node| node as usize >= count) {
                return Err(BodyError::BadNode { element, node, count });
            }
            let corners = nodes.map(|node| mesh.nodes[node as usize]);
            reference.check(&corners).map_err(|det| BodyError::BadElement { element, det })?;
        }
        if let ElementKind::SolidShell { points, .. } = kind
            && !ElementKind::POINTS.contains(&points)
        {
            return Err(BodyError::BadPointCount { found: points });
        }
        let thickness_rule = kind.thickness_rule();
        Ok(Self {
            mesh,
            kind,
            material,
            thickness_rule,
            axes: None,
            evaluation_data: OnceLock::new(),
        })
    }

    pub(crate) fn evaluation_data(&self) -> &EvaluationData {
        self.evaluation_data
            .get_or_init(|| EvaluationData::new(&self.mesh, self.kind, self.material.as_ref()))
    }

    pub(crate) fn evaluation_data_mut(&mut self) -> &mut EvaluationData {
        self.evaluation_data();
        self.evaluation_data.get_mut().expect("made on the line above")
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

    /// Pattern of the tangent: three rows for each node, structurally symmetric, columns sorted. Rows of hanging nodes
    /// have a diagonal block only, whose values are zero.
    #[must_use]
    pub fn pattern(&self) -> &Pattern {
        &self.evaluation_data().gather.pattern
    }

    /// Whether the tangent is symmetric.
    #[must_use]
    pub fn is_symmetric(&self) -> bool {
        self.material.is_symmetric()
    }

    /// Volumes of the undeformed elements [mm³].
    pub fn volumes(&self) -> impl Iterator<Item = f64> {
        self.evaluation_data()
            .geometry
            .iter()
            .map(|points| points.iter().map(|point| point.weight).sum())
    }

    /// Forces, energies and (if requested) tangent at `displacement` [mm] (three for each node), starting from the
    /// last committed history. Hanging nodes must have the mean displacement of their masters, which get their forces. The trial history is kept for [`Body::commit`].
    ///
    /// # Errors
    /// [`ElementFailure`] of the failed element with the lowest number; the increment must be cut. `out` is then
    /// undefined.
    pub fn evaluate(
        &mut self,
        displacement: &[f64],
        want: Want,
        out: &mut Evaluation,
    ) -> Result<(), ElementFailure> {
        self.evaluate_elements(displacement, want, None, out)
    }

    /// Makes the trial history of the last evaluation the converged one. Call it only after [`Body::evaluate`] at the
    /// accepted displacement.
    pub fn commit(&mut self) {
        self.store_previous_strains();
        let EvaluationData { committed, trial, .. } = self.evaluation_data_mut();
        committed.copy_from_slice(trial);
    }

    /// Discards all changes since the last [`Body::commit`].
    pub fn restore(&mut self) {
        let EvaluationData { committed, trial, .. } = self.evaluation_data_mut();
        trial.copy_from_slice(committed);
    }

    /// Number of stored values of an element.
    pub(crate) fn stride(&self) -> usize {
        self.kind.point_count() * self.material.state_len() + self.kind.record_len()
    }
}
