//! What is refined: a model, or one face of it.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::budget::Budget;
use super::faults::Subject;
use super::goal::Goal;
use super::state::State;
use crate::audit::{CadReference, ReferenceSurface};
use crate::cad::Model;
use crate::convert::ConvertOptions;
use crate::mesh::MeshError;
use crate::mesh::mapped::MappedOptions;
use crate::mesh::mapped::plan::Plan;
use crate::tool::ToolModel;

/// What is refined: a model, or one face of it.
pub(super) struct Work<'a> {
    pub plan: Plan<'a>,
    pub reference: &'a CadReference<'a>,
    /// Number of the plan's first face in the reference.
    pub first: u32,
    pub mesh: MappedOptions,
    pub options: &'a ConvertOptions,
    /// Edges of the plan's model at free borders.
    pub free: Vec<bool>,
    /// Whether normals have a tolerance.
    pub normals: bool,
    pub budget: Arc<Budget>,
}

/// Edges that one face uses and no other face contains.
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

/// Gives faces of a tool their numbers in the reference.
pub(super) fn renumber(tool: &mut ToolModel, first: u32) {
    tool.faces.iter_mut().for_each(|face| *face += first);
    tool.corners.iter_mut().for_each(|c| c.face += first);
}

impl<'a> Work<'a> {
    pub(super) fn new(
        model: &'a Model,
        reference: &'a CadReference<'a>,
        mesh: &MappedOptions,
        options: &'a ConvertOptions,
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
            free: free_edges(model, reference),
            normals,
            budget: Arc::new(Budget::of_faces(model.faces.len())),
        })
    }

    /// The same with triangles at poles and nodes inside flats with holes: quads at poles are not better everywhere, and
    /// flats without nodes inside fold sooner beside arcs of their borders.
    pub(super) fn with_nodes_inside(&self) -> Result<Self, MeshError> {
        let mesh = MappedOptions { fewest: false, ..self.mesh };
        let plan = Plan::new(self.plan.model(), &mesh)?;
        let (free, budget) = (self.free.clone(), self.budget.clone());
        Ok(Self { plan, mesh, free, budget, ..*self })
    }

    /// True when it meshes a state in another way than `other` does.
    pub(super) fn differs_from(&self, other: &Self, state: &State) -> bool {
        let mesh = |work: &Self| work.plan.mesh(&state.minima, &state.density).ok();
        mesh(self) != mesh(other)
    }

    /// True unless it is one face of several: its border is not free where others use it.
    pub(super) fn is_whole(&self) -> bool {
        self.plan.model().faces.len() == self.reference.face_count()
    }

    /// The same for errors.
    pub(super) fn subject(&self) -> Subject<'_> {
        let (model, budget) = (self.plan.model(), &*self.budget);
        Subject { model, first: self.first, free: &self.free, budget }
    }

    /// How far sides may be from each edge of the plan's model [mm]: the tolerance at free borders, any distance where
    /// faces meet.
    pub(super) fn borders(&self, goal: &Goal) -> Vec<f64> {
        self.free.iter().map(|&free| if free { goal.tol_mm } else { f64::INFINITY }).collect()
    }
}
