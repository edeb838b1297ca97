//! Faces of a model that violate the goal, and the resulting errors.

use super::budget::Budget;
use super::error::ToleranceError;
use super::goal::{Goal, Refined};
use super::state::State;
use kanagata_audit::AuditReport;
use kanagata_audit::report::{FaceAudit, PatchAudit};
use kanagata_cad::Model;
use kanagata_geometry::Vec3;

/// Violations of the goal by a complete model. Faces have the numbers of the plan.
#[derive(Debug)]
pub(super) struct Faults {
    /// Faces above the tolerance, with error over tolerance.
    pub exceeding: Vec<(usize, f64)>,
    /// The same with all vertices on the CAD, and the position of the maximum error [mm].
    pub on_cad: Vec<(usize, f64, Option<Vec3>)>,
    /// Faces with folded patches.
    pub folded: Vec<usize>,
}

impl Faults {
    /// True when the model satisfies the goal.
    pub fn is_empty(&self) -> bool {
        self.exceeding.is_empty() && self.folded.is_empty()
    }
}

/// Data of a refinement for its errors.
pub(super) struct ErrorContext<'a> {
    pub model: &'a Model,
    /// Number of the first face of the model in the reference.
    pub first: u32,
    /// For each edge of the model, true at a free border.
    pub free_edges: &'a [bool],
    pub budget: &'a Budget,
}

impl ErrorContext<'_> {
    /// The error for a search that ended above the tolerance, with the face of the largest ratio of error to tolerance.
    pub(super) fn search_failed(&self, goal: &Goal, state: &State) -> ToleranceError {
        let worst = (0..self.model.faces.len())
            .max_by(|&a, &b| state.error_ratio(a).total_cmp(&state.error_ratio(b)))
            .unwrap_or(0);
        let (mm, deg) = state.errors(worst);
        if !mm.is_finite() {
            let source_entity = self.model.faces[worst].source.clone();
            let face = worst + self.first as usize;
            return ToleranceError::NoPatches { face, source_entity, alone: false };
        }
        let free = state.edge_deviations(worst).iter().filter(|d| self.free_edges[d.0]);
        let border = (free.map(|d| d.1).fold(0.0, f64::max), None);
        let at = state.worst_point(worst).map(Into::into);
        let errors = LargestErrors { shape: (mm, at), border, normal_deg: deg };
        self.not_reached(goal, worst, &errors, state.patches())
    }

    /// The error with the largest of the errors of a face, relative to their tolerances. `face` has the number of the
    /// plan.
    fn not_reached(
        &self,
        goal: &Goal,
        face: usize,
        errors: &LargestErrors,
        patches: usize,
    ) -> ToleranceError {
        let at_border = errors.border.0 > errors.shape.0;
        let (length, at) = if at_border { errors.border } else { errors.shape };
        let by_length = length / goal.tol_mm >= errors.normal_deg / goal.normal_deg;
        let is_border = by_length && at_border;
        ToleranceError::NotReached {
            face: face + self.first as usize,
            source_entity: self.model.faces[face].source.clone(),
            found: if by_length { length } else { errors.normal_deg },
            near: place_text(at.filter(|_| by_length)),
            allowed: if by_length { goal.tol_mm } else { goal.normal_deg },
            unit: match (by_length, is_border) {
                (true, true) => "mm of distance from its free border",
                (true, false) => "mm of shape error",
                _ => "degrees of normal error",
            },
            patches,
            spent: self.budget.is_exhausted().then(|| self.budget.total()),
        }
    }

    /// The error for a complete model: its face farthest above the tolerance, or a face with a folded patch.
    pub(super) fn model_failed(&self, goal: &Goal, refined: &Refined) -> ToleranceError {
        let above = faces_above_tolerance(&refined.audit, goal);
        let worst = above.iter().max_by(|a, b| a.1.total_cmp(&b.1)).map(|w| w.0);
        let worst = worst.or(folded_faces(refined).first().copied()).unwrap_or(self.first as usize);
        let audit = refined.audit.faces.iter().find(|f| f.face as usize == worst);
        let errors = audit.map_or_else(LargestErrors::default, |f| LargestErrors {
            shape: (f.max_mm.abs().max(f.min_mm.abs()), worst_point(&refined.audit, worst)),
            border: (f.border_mm, refined.audit.borders.at),
            normal_deg: f.normal_max_deg,
        });
        let of = worst - self.first as usize;
        let length = errors.shape.0.max(errors.border.0);
        if length <= goal.tol_mm && errors.normal_deg <= goal.normal_deg {
            let source_entity = self.model.faces[of].source.clone();
            return ToleranceError::NoPatches { face: worst, source_entity, alone: true };
        }
        self.not_reached(goal, of, &errors, refined.tool.patches.len())
    }
}

/// Maximum errors of a face with their positions [mm], if known.
#[derive(Default)]
struct LargestErrors {
    /// Shape error [mm].
    shape: (f64, Option<[f64; 3]>),
    /// Distance from free borders [mm].
    border: (f64, Option<[f64; 3]>),
    /// Normal error [degrees].
    normal_deg: f64,
}

/// Position of the maximum shape error of a face [mm].
pub(super) fn worst_point(report: &AuditReport, face: usize) -> Option<[f64; 3]> {
    let error = |p: &PatchAudit| p.max_mm.abs().max(p.min_mm.abs());
    let own = report.by_patch.iter().filter(|p| p.face as usize == face);
    own.max_by(|a, b| error(a).total_cmp(&error(b))).map(|p| p.worst_point)
}

/// Text with a position, empty if unknown.
fn place_text(place: Option<[f64; 3]>) -> String {
    place.map_or_else(String::new, |[x, y, z]| format!(" near ({x:.3}, {y:.3}, {z:.3}) mm"))
}

/// Faces above a tolerance of the goal, with the largest ratio of error to tolerance.
pub(super) fn faces_above_tolerance(report: &AuditReport, goal: &Goal) -> Vec<(usize, f64)> {
    let ratio = |f: &FaceAudit| {
        let mm = f.max_mm.abs().max(f.min_mm.abs()).max(f.border_mm) / goal.tol_mm;
        mm.max(f.normal_max_deg / goal.normal_deg)
    };
    let all = report.faces.iter().map(|f| (f.face as usize, ratio(f)));
    all.filter(|(_, r)| *r > 1.0).collect()
}

/// Faces with a folded patch, without duplicates.
pub(super) fn folded_faces(found: &Refined) -> Vec<usize> {
    let patches = found.report.folded.iter().chain(&found.audit.folded);
    let mut faces: Vec<usize> = patches.map(|&k| found.tool.faces[k as usize] as usize).collect();
    faces.sort_unstable();
    faces.dedup();
    faces
}
