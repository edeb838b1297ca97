//! One deformable body: a mesh, its kind of element and its material.

use std::sync::{Arc, OnceLock};

use super::bands::Bands;

use super::evaluation::{ElementFailure, Evaluation};
use crate::geometry::Mat3;
use crate::solver::element::{
    ElementKind, ElementMatrices, PointGeometry, ReferenceCheck, Want, reference_points,
};
use crate::solver::linear::pattern::{Gather, Pattern};
use crate::solver::material::Material;
use crate::solver::sheet::hex_mesh::HexMesh;

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
    #[error("{found} points through the thickness, a solid-shell takes 3 to 9")]
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
    pub(in crate::solver) mesh: HexMesh,
    pub(in crate::solver) kind: ElementKind,
    pub(in crate::solver) material: Arc<dyn Material>,
    pub(in crate::solver) thickness_rule: Vec<(f64, f64)>,
    /// Of the material in each element, where they differ from element to element.
    pub(in crate::solver) axes: Option<Vec<Mat3>>,
    /// What evaluation needs, about 9 kB an element: made when it is first asked for, so that a set-up can be judged before.
    pub(in crate::solver) built: OnceLock<Built>,
}

/// What the evaluation of a body needs of its elements.
#[derive(Debug)]
pub struct Built {
    pub(super) gather: Gather,
    /// Of the eight Gauss points of every undeformed element.
    pub(in crate::solver) geometry: Vec<[PointGeometry; 8]>,
    /// Converged history of each element: its points', then the record of its internal modes.
    pub(in crate::solver) committed: Vec<f64>,
    pub(super) trial: Vec<f64>,
    /// Logarithmic strains before the last commit, six a point; none where the material keeps no memory.
    pub(in crate::solver) before: Vec<f64>,
    pub(super) bands: Bands,
    /// What elements answered last, of those whose rows are not summed yet.
    pub(super) blocks: Vec<ElementMatrices>,
}

/// History of so many elements before anything happened.
pub fn virgin(elements: usize, kind: ElementKind, material: &dyn Material) -> Vec<f64> {
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

impl Built {
    /// Of a mesh whose elements have been checked.
    pub(in crate::solver) fn new(
        mesh: &HexMesh,
        kind: ElementKind,
        material: &dyn Material,
    ) -> Self {
        let corners = |nodes: &[u32; 8]| nodes.map(|node| mesh.nodes[node as usize]);
        let points = |nodes| {
            reference_points(&corners(nodes)).expect("elements are checked when the body is made")
        };
        let committed = virgin(mesh.elements.len(), kind, material);
        let gather = Gather::new(mesh.nodes.len(), &mesh.elements);
        let bands = Bands::new(&gather, mesh.elements.len());
        let remembered =
            if material.history_layout().is_some() { 6 * kind.point_count() } else { 0 };
        Self {
            geometry: mesh.elements.iter().map(points).collect(),
            trial: committed.clone(),
            before: vec![0.0; mesh.elements.len() * remembered],
            blocks: vec![ElementMatrices::zero(); bands.kept],
            gather,
            committed,
            bands,
        }
    }
}

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
        let reference = ReferenceCheck::new();
        for (element, nodes) in mesh.elements.iter().enumerate() {
            if let Some(&node) = nodes.iter().find(|&&node| node as usize >= count) {
                return Err(BodyError::BadNode { element, node, count });
            }
            let corners = nodes.map(|node| mesh.nodes[node as usize]);
            reference.check(&corners).map_err(|det| BodyError::BadElement { element, det })?;
        }
        if let ElementKind::SolidShell { points, .. } = kind
            && !(3..=9).contains(&points)
        {
            return Err(BodyError::BadPointCount { found: points });
        }
        let thickness_rule = kind.thickness_rule();
        Ok(Self { mesh, kind, material, thickness_rule, axes: None, built: OnceLock::new() })
    }

    pub(in crate::solver) fn built(&self) -> &Built {
        self.built.get_or_init(|| Built::new(&self.mesh, self.kind, self.material.as_ref()))
    }

    pub(in crate::solver) fn built_mut(&mut self) -> &mut Built {
        self.built();
        self.built.get_mut().expect("made on the line above")
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
        &self.built().gather.pattern
    }

    /// Whether the tangent is symmetric.
    #[must_use]
    pub fn is_symmetric(&self) -> bool {
        self.material.is_symmetric()
    }

    /// Volumes of the undeformed elements [mm³].
    pub fn volumes(&self) -> impl Iterator<Item = f64> {
        self.built().geometry.iter().map(|points| points.iter().map(|point| point.weight).sum())
    }

    /// Forces, energies and (if wanted) tangent at `displacement` [mm] (three a node), from the last
    /// committed history. The trial history is kept for [`Body::commit`].
    ///
    /// # Errors
    /// [`ElementFailure`] of the lowest-numbered element that failed; cut the increment. What is in `out` then is of no use.
    pub fn evaluate(
        &mut self,
        displacement: &[f64],
        want: Want,
        out: &mut Evaluation,
    ) -> Result<(), ElementFailure> {
        self.evaluate_elements(displacement, want, None, out)
    }

    /// Makes the history of the last evaluation the converged one. Call it only after [`Body::evaluate`]
    /// at the accepted displacement.
    pub fn commit(&mut self) {
        self.keep_strains();
        let Built { committed, trial, .. } = self.built_mut();
        committed.copy_from_slice(trial);
    }

    /// Forgets everything since the last [`Body::commit`].
    pub fn restore(&mut self) {
        let Built { committed, trial, .. } = self.built_mut();
        trial.copy_from_slice(committed);
    }

    /// Stored values of an element.
    pub(in crate::solver) fn stride(&self) -> usize {
        self.kind.point_count() * self.material.state_len() + self.kind.record_len()
    }
}
