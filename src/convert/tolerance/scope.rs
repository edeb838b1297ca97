//! Scope of a refinement: a complete model, or one face of it.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::budget::Budget;
use super::faults::ErrorContext;
use super::goal::Goal;
use super::results::{Closest, Evaluations, Models};
use super::slide_estimate::Neighbours;
use super::state::State;
use crate::ConvertOptions;
use kanagata_audit::local::LocalReference;
use kanagata_audit::{CadReference, ReferenceSurface};
use kanagata_cad::Model;
use kanagata_mesh::MeshError;
use kanagata_mesh::mapped::MappedOptions;
use kanagata_mesh::mapped::plan::Plan;
use kanagata_progress::Progress;
use kanagata_tool::ToolModel;

/// Scope of a refinement, with the data that do not change during the search.
pub(super) struct Scope<'a> {
    /// Mesh plan of the model or face.
    pub plan: Plan<'a>,
    /// Complete CAD model, against which the patches are audited.
    pub reference: &'a CadReference<'a>,
    /// Number of the first face of the plan in the reference.
    pub first: u32,
    /// Options of the coarsest mesh.
    pub mesh: MappedOptions,
    pub options: &'a ConvertOptions,
    /// For each edge of the plan, true at a free border.
    pub free_edges: Vec<bool>,
    /// True when normals have a tolerance.
    pub normals: bool,
    pub budget: Arc<Budget>,
    /// Adjacent faces, if vertices may slide within flats.
    pub neighbours: Option<&'a Neighbours>,
    /// Results of single faces.
    pub evaluations: Arc<Evaluations>,
    /// Complete models made.
    pub models: Arc<Models>,
    /// The model closest to the goal.
    pub closest: Arc<Closest>,
}

/// For each edge, true when exactly one face uses it and no other face contains it. Containment is tested at three
/// points.
fn free_edges(model: &Model, reference: &CadReference<'_>) -> Vec<bool> {
    const INSIDE: [f64; 3] = [0.23, 0.5, 0.81];
    let faces: BTreeSet<u32> = (0..model.faces.len() as u32).collect();
    let mut free = vec![false; model.edges.len()];
    for border in reference.border_edges(&faces).unwrap_or_default() {
        let [a, b] = border.curve.domain();
        let ends_here = |s: &f64| {
            !reference.continues(&border.curve.point(a + (b - a) * s), border.face, &faces)
        };
        free[border.edge] = INSIDE.iter().any(ends_here);
    }
    free
}

/// Shifts the face numbers of a tool by `first`, to those of the reference.
pub(super) fn shift_face_numbers(tool: &mut ToolModel, first: u32) {
    tool.faces.iter_mut().for_each(|face| *face += first);
    tool.corners.iter_mut().for_each(|c| c.face += first);
}

impl<'a> Scope<'a> {
    /// Scope of a complete model, with the coarsest mesh as its start.
    ///
    /// # Errors
    /// [`MeshError`] from [`Plan::new`].
    pub(super) fn new(
        model: &'a Model,
        reference: &'a CadReference<'a>,
        mesh: &MappedOptions,
        options: &'a ConvertOptions,
        neighbours: Option<&'a Neighbours>,
        normals: bool,
    ) -> Result<Self, MeshError> {
        let through_cad = options.through_cad;
        let coarse =
            MappedOptions { arc_divisions: 1, through_cad, by_turn: true, fewest: true, ..*mesh };
        let plan = Plan::new(model, &coarse)?;
        Ok(Self {
            plan,
            reference,
            first: 0,
            mesh: coarse,
            options,
            free_edges: free_edges(model, reference),
            normals,
            budget: Arc::new(Budget::of_faces(model.faces.len())),
            neighbours,
            evaluations: Arc::default(),
            models: Arc::default(),
            closest: Arc::default(),
        })
    }

    /// The same scope before its search, whose progress is reported to `progress`.
    pub(super) fn watched(self, progress: &Progress) -> Self {
        let budget = Budget::of_faces(self.plan.model().faces.len()).watched(progress);
        Self { budget: Arc::new(budget), ..self }
    }

    /// The same scope with triangles at poles and nodes inside flats with holes. Quadrilaterals at poles are not always
    /// more accurate, and flats without interior nodes fold sooner at arcs of their borders.
    pub(super) fn with_interior_nodes(&self) -> Result<Self, MeshError> {
        let mesh = MappedOptions { fewest: false, ..self.mesh };
        let plan = Plan::new(self.plan.model(), &mesh)?;
        let (free_edges, budget) = (self.free_edges.clone(), self.budget.clone());
        let (evaluations, models) = (self.evaluations.clone(), self.models.clone());
        let closest = self.closest.clone();
        Ok(Self { plan, mesh, free_edges, budget, evaluations, models, closest, ..*self })
    }

    /// True when the meshes of a state in this scope and in `other` differ.
    pub(super) fn meshes_differently(&self, other: &Self, state: &State) -> bool {
        let mesh = |scope: &Self| scope.plan.mesh(&state.minima, &state.density).ok();
        mesh(self) != mesh(other)
    }

    /// The CAD model as the fast reference of the search.
    pub(super) fn local_reference(&self) -> LocalReference<'_, 'a> {
        LocalReference(self.reference)
    }

    /// True unless the scope is one face of several. The border of such a face is not free where another face uses it.
    pub(super) fn is_whole(&self) -> bool {
        self.plan.model().faces.len() == self.reference.face_count()
    }

    /// Data of the scope for error reports.
    pub(super) fn error_context(&self) -> ErrorContext<'_> {
        let (model, budget) = (self.plan.model(), &*self.budget);
        ErrorContext { model, first: self.first, free_edges: &self.free_edges, budget }
    }

    /// Allowed distance of patch sides from each edge of the plan [mm]: the tolerance at free borders, infinite where
    /// faces meet.
    pub(super) fn border_tolerances(&self, goal: &Goal) -> Vec<f64> {
        self.free_edges.iter().map(|&free| if free { goal.tol_mm } else { f64::INFINITY }).collect()
    }
}
