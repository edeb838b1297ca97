//! Closest-point searches of a conversion, counted by CAD face: a face that makes them too costly is refused by name.

use rustc_hash::FxHashMap;

use super::error::ConvertError;
use crate::cad::Model;
use crate::cad::model::Face;
use crate::geometry::nurbs::SearchBudget;
use crate::geometry::{Vec2, Vec3};
use crate::mesh::SurfaceMesh;

/// Cells that the searches of a conversion may examine: on each face, and besides for each of its elements.
#[derive(Debug, Clone, Copy)]
pub(super) struct SearchLimits {
    per_face: u64,
    per_element: u64,
}

impl SearchLimits {
    /// For normals and Nagata patches. Of 1276 faces of 90 files, the most costly needed 26,153 cells with 11 elements;
    /// surfaces that rest along a line (`tests/creases.rs`) need 12,000 for each vertex there.
    pub(super) const NAGATA: Self = Self { per_face: 2_000_000, per_element: 500 };
    /// For Bezier patches. Of 399 faces of 60 files, the most costly needed 870,260 cells with 718 elements, 617,174 with
    /// 308, and 38,083 with 4. Surfaces that rest along a line need 1.6 to 34 million there and give folded patches that
    /// are millimetres off; they are refused.
    pub(super) const BEZIER: Self = Self { per_face: 500_000, per_element: 5_000 };
}

/// Searches of one conversion.
pub(super) struct Searches<'a> {
    model: &'a Model,
    /// By face of the mesh.
    budgets: FxHashMap<u32, SearchBudget>,
}

/// A face whose searches are counted.
#[derive(Clone, Copy)]
pub(super) struct SearchedFace<'s> {
    pub(super) face: &'s Face,
    budget: &'s SearchBudget,
}

impl<'a> Searches<'a> {
    /// Budgets for the faces of `mesh`.
    pub(super) fn new(model: &'a Model, mesh: &SurfaceMesh, limits: SearchLimits) -> Self {
        let mut cells: FxHashMap<u32, u64> = FxHashMap::default();
        for element in &mesh.elements {
            *cells.entry(element.face).or_insert(limits.per_face) += limits.per_element;
        }
        let budgets = cells.into_iter().map(|(face, cells)| (face, SearchBudget::new(cells)));
        Self { model, budgets: budgets.collect() }
    }

    /// Face `id` of the mesh.
    pub(super) fn face(&self, id: u32) -> SearchedFace<'_> {
        self.on(id, id as usize)
    }

    /// Face `other` of the model, searched on the budget of face `id` of the mesh.
    pub(super) fn on(&self, id: u32, other: usize) -> SearchedFace<'_> {
        SearchedFace { face: &self.model.faces[other], budget: &self.budgets[&id] }
    }

    /// Refuses the first face whose budget is spent: its results depend on the order of threads.
    ///
    /// # Errors
    /// [`ConvertError::Searches`].
    pub(super) fn check(&self) -> Result<(), ConvertError> {
        let spent = self.budgets.iter().filter(|(_, budget)| budget.is_spent());
        match spent.min_by_key(|(face, _)| **face) {
            None => Ok(()),
            Some((&face, budget)) => Err(ConvertError::Searches {
                face: self.model.faces[face as usize].source.clone(),
                cells: budget.limit(),
            }),
        }
    }
}

impl SearchedFace<'_> {
    /// Closest point of the untrimmed surface: parameters and squared distance [mm^2].
    pub(super) fn closest(&self, p: &Vec3) -> (Vec2, f64) {
        self.budget.closest(&self.face.surface, p)
    }

    /// The same, quicker where `start` is near the foot.
    pub(super) fn closest_from(&self, p: &Vec3, start: Vec2) -> (Vec2, f64) {
        self.budget.closest_from(&self.face.surface, p, start)
    }

    /// As `Surface::closest_near`, for points whose neighbour's foot is `start`.
    pub(super) fn closest_near(&self, p: &Vec3, start: Vec2, enough: f64) -> (Vec2, f64) {
        self.budget.closest_near(&self.face.surface, p, start, enough)
    }
}
