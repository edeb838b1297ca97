//! Closest-point searches of a conversion, with a work limit for each CAD face.

use rustc_hash::FxHashMap;

use super::error::ConvertError;
use kanagata_cad::Model;
use kanagata_cad::model::Face;
use kanagata_geometry::nurbs::SearchBudget;
use kanagata_geometry::{Vec2, Vec3};
use kanagata_mesh::SurfaceMesh;
use kanagata_progress::Progress;

/// Work limit of the searches on one face, in cells: `per_face + per_element * elements of the face`.
#[derive(Debug, Clone, Copy)]
pub(super) struct SearchLimits {
    per_face: u64,
    per_element: u64,
}

impl SearchLimits {
    /// Limit for normals and Nagata patches. The maximum over 1276 faces of 90 files is 26,153 cells with 11 elements.
    /// Surfaces with a degenerate line (`tests/creases.rs`) need 12,000 cells for each vertex on it.
    pub(super) const NAGATA: Self = Self { per_face: 2_000_000, per_element: 500 };
    /// Limit for Bezier patches. The largest needs of 399 faces of 60 files are 870,260 cells with 718 elements,
    /// 617,174 with 308 and 38,083 with 4. Surfaces that touch themselves along a line need 1.6 to 34 million and give
    /// folded patches with errors of millimetres; they are refused.
    pub(super) const BEZIER: Self = Self { per_face: 500_000, per_element: 5_000 };
}

/// Closest-point searches of one conversion.
pub(super) struct Searches<'a> {
    model: &'a Model,
    /// Budget of each face of the mesh.
    budgets: FxHashMap<u32, SearchBudget>,
    /// Where the progress of the conversion is reported.
    pub(super) progress: Progress,
}

/// A face and the budget of the searches on it.
#[derive(Clone, Copy)]
pub(super) struct SearchedFace<'s> {
    pub(super) face: &'s Face,
    budget: &'s SearchBudget,
}

impl<'a> Searches<'a> {
    /// Creates the budgets of the faces of `mesh`.
    pub(super) fn new(model: &'a Model, mesh: &SurfaceMesh, limits: SearchLimits) -> Self {
        let mut cells: FxHashMap<u32, u64> = FxHashMap::default();
        for element in &mesh.elements {
            *cells.entry(element.face).or_insert(limits.per_face) += limits.per_element;
        }
        let budgets = cells.into_iter().map(|(face, cells)| (face, SearchBudget::new(cells)));
        Self { model, budgets: budgets.collect(), progress: Progress::default() }
    }

    /// The same searches, whose progress is reported to `progress`.
    pub(super) fn watched(self, progress: &Progress) -> Self {
        Self { progress: progress.clone(), ..self }
    }

    /// Face `id` of the mesh, with its budget.
    pub(super) fn face(&self, id: u32) -> SearchedFace<'_> {
        self.face_on_budget(id, id as usize)
    }

    /// Face `other` of the model, with the budget of face `id` of the mesh.
    pub(super) fn face_on_budget(&self, id: u32, other: usize) -> SearchedFace<'_> {
        SearchedFace { face: &self.model.faces[other], budget: &self.budgets[&id] }
    }

    /// Cells examined so far.
    #[cfg(test)]
    pub(super) fn cells(&self) -> u64 {
        self.budgets.values().map(SearchBudget::used).sum()
    }

    /// Checks that no budget is exhausted. The results on such a face depend on the order of threads.
    ///
    /// # Errors
    /// [`ConvertError::Searches`] with the lowest-numbered face whose budget is exhausted.
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

    /// Foot point of a vertex on the face, at the parameters `start` where the mesher knows them: Newton's method from
    /// there finds a point within the squared distance `enough` [mm^2]. Otherwise the whole surface is searched.
    pub(super) fn foot(&self, p: &Vec3, start: Option<Vec2>, enough: f64) -> (Vec2, f64) {
        let near = start.map(|start| self.face.surface.descent(p, start));
        near.filter(|near| near.1 <= enough).unwrap_or_else(|| self.closest(p))
    }

    /// As [`Self::closest`], faster when `start` is near the foot point.
    pub(super) fn closest_from(&self, p: &Vec3, start: Vec2) -> (Vec2, f64) {
        self.budget.closest_from(&self.face.surface, p, start)
    }

    /// As `Surface::closest_near`; `start` is the foot point of a neighbouring point, `enough` a squared distance
    /// [mm^2].
    pub(super) fn closest_near(&self, p: &Vec3, start: Vec2, enough: f64) -> (Vec2, f64) {
        self.budget.closest_near(&self.face.surface, p, start, enough)
    }
}
