//! What keeps a model from the goal, and the errors that say so.

use super::budget::Budget;
use super::error::ToleranceError;
use super::goal::{Goal, Refined};
use super::state::State;
use crate::audit::AuditReport;
use crate::audit::report::{FaceAudit, PatchAudit};
use crate::cad::Model;
use crate::geometry::Vec3;

/// What keeps a whole model from the goal; faces have the plan's numbers.
pub(super) struct Faults {
    /// Faces that exceed the tolerance, and how many times.
    pub over: Vec<(usize, f64)>,
    /// Faces that do with all vertices on the CAD, how many times, and where most.
    pub on_cad: Vec<(usize, f64, Option<Vec3>)>,
    /// Faces with folded patches.
    pub folded: Vec<usize>,
}

impl Faults {
    pub fn none(&self) -> bool {
        self.over.is_empty() && self.folded.is_empty()
    }
}

/// What is refined, for its errors.
pub(super) struct Subject<'a> {
    pub model: &'a Model,
    /// Number of its first face in the reference.
    pub first: u32,
    /// Its edges at free borders.
    pub free: &'a [bool],
    pub budget: &'a Budget,
}

impl Subject<'_> {
    /// Why the search ended before every face kept its share: the face that is farthest from the tolerance.
    pub(super) fn given_up(&self, goal: &Goal, state: &State) -> ToleranceError {
        let worst = (0..self.model.faces.len())
            .max_by(|&a, &b| state.badness(a).total_cmp(&state.badness(b)))
            .unwrap_or(0);
        let (mm, deg) = state.figures(worst);
        if !mm.is_finite() {
            let source_entity = self.model.faces[worst].source.clone();
            return ToleranceError::NoPatches { face: worst + self.first as usize, source_entity };
        }
        let free = state.off(worst).iter().filter(|o| self.free[o.0]);
        let border = (free.map(|o| o.1).fold(0.0, f64::max), None);
        let at = state.worst(worst).map(Into::into);
        let most = Most { shape: (mm, at), border, normal_deg: deg };
        self.missed(goal, worst, &most, state.patches())
    }

    /// The error of a face of the plan that is farthest above its tolerance.
    fn missed(&self, goal: &Goal, face: usize, most: &Most, patches: usize) -> ToleranceError {
        let (length, at) = if most.border.0 > most.shape.0 { most.border } else { most.shape };
        let by_length = length / goal.tol_mm >= most.normal_deg / goal.normal_deg;
        let is_border = by_length && most.border.0 > most.shape.0;
        ToleranceError::NotReached {
            face: face + self.first as usize,
            source_entity: self.model.faces[face].source.clone(),
            found: if by_length { length } else { most.normal_deg },
            near: near(at.filter(|_| by_length)),
            allowed: if by_length { goal.tol_mm } else { goal.normal_deg },
            unit: match (by_length, is_border) {
                (true, true) => "mm off its free border",
                (true, false) => "mm of shape error",
                _ => "degrees of normal error",
            },
            patches,
            spent: self.budget.is_spent().then(|| self.budget.spent()),
        }
    }

    /// Why a whole model is not what was asked for: its face farthest above the tolerance, or one that folds.
    pub(super) fn not_reached(&self, goal: &Goal, refined: &Refined) -> ToleranceError {
        let over = exceeding(&refined.audit, goal);
        let worst = over.iter().max_by(|a, b| a.1.total_cmp(&b.1)).map(|w| w.0);
        let worst = worst.or(folded(refined).first().copied()).unwrap_or(self.first as usize);
        let audit = refined.audit.faces.iter().find(|f| f.face as usize == worst);
        let most = audit.map_or_else(Most::default, |f| Most {
            shape: (f.max_mm.abs().max(f.min_mm.abs()), worst_place(&refined.audit, worst)),
            border: (f.border_mm, refined.audit.borders.at),
            normal_deg: f.normal_max_deg,
        });
        let of = worst - self.first as usize;
        let length = most.shape.0.max(most.border.0);
        if length <= goal.tol_mm && most.normal_deg <= goal.normal_deg {
            let source_entity = self.model.faces[of].source.clone();
            return ToleranceError::NoPatches { face: worst, source_entity };
        }
        self.missed(goal, of, &most, refined.tool.patches.len())
    }
}

/// Largest errors of a face, and where they are.
#[derive(Default)]
struct Most {
    /// Shape error [mm].
    shape: (f64, Option<[f64; 3]>),
    /// Distance from free borders [mm].
    border: (f64, Option<[f64; 3]>),
    normal_deg: f64,
}

/// Where the shape error of a face is largest.
pub(super) fn worst_place(report: &AuditReport, face: usize) -> Option<[f64; 3]> {
    let off = |p: &PatchAudit| p.max_mm.abs().max(p.min_mm.abs());
    let own = report.by_patch.iter().filter(|p| p.face as usize == face);
    own.max_by(|a, b| off(a).total_cmp(&off(b))).map(|p| p.worst_point)
}

fn near(place: Option<[f64; 3]>) -> String {
    place.map_or_else(String::new, |[x, y, z]| format!(" near ({x:.3}, {y:.3}, {z:.3}) mm"))
}

/// Faces above the tolerance, and how many times.
pub(super) fn exceeding(report: &AuditReport, goal: &Goal) -> Vec<(usize, f64)> {
    let ratio = |f: &FaceAudit| {
        let mm = f.max_mm.abs().max(f.min_mm.abs()).max(f.border_mm) / goal.tol_mm;
        mm.max(f.normal_max_deg / goal.normal_deg)
    };
    let all = report.faces.iter().map(|f| (f.face as usize, ratio(f)));
    all.filter(|(_, r)| *r > 1.0).collect()
}

/// Faces with a folded patch, each once.
pub(super) fn folded(found: &Refined) -> Vec<usize> {
    let patches = found.report.folded.iter().chain(&found.audit.folded);
    let mut faces: Vec<usize> = patches.map(|&k| found.tool.faces[k as usize] as usize).collect();
    faces.sort_unstable();
    faces.dedup();
    faces
}
