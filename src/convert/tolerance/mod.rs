//! As few patches as a tolerance allows: divisions of each chain of opposite edges are raised where the audit of a
//! face says so, in the direction that buys most, lowered again where they are not needed, and the vertices are
//! balanced about the CAD so that the error has two sides.
//!
//! - [`slide_estimate`]: what moving its vertices will take off a face's error
//! - [`independent_borders`]: every face with divisions of its own, borders meeting to within the tolerance
//! - [`search`], [`state`]: which divisions; every face is judged alone, by the audit of its own patches
//! - [`balance`], [`vertex_directions`], [`minimax`]: vertices moved along their normals, or within flats
//! - [`refine`]: a model, or one face, refined and audited as a whole
//! - [`faults`]: what keeps a model from the goal, and the errors that say so
//! - [`budget`]: how much work that may be
//! - [`uniform`]: meshes of one division of a quarter turn, taken where they have fewer patches
//!
//! Free borders keep the tolerance as well. The model is conforming unless asked otherwise; its largest error is the audit's,
//! of the finished model.

pub mod balance;
mod budget;
mod face_error;
mod faults;
mod independent_borders;
mod minimax;
mod refine;
mod search;
mod slide_estimate;
mod state;
mod uniform;
mod vertex_directions;

use crate::audit::{AuditError, AuditReport, CadReference};
use crate::cad::Model;
use crate::mesh::MeshError;
use crate::mesh::mapped::MappedOptions;
use crate::tool::ToolModel;

use super::{ConvertError, ConvertOptions, ConvertReport};
use face_error::Judge;
use refine::Work;
use slide_estimate::Neighbours;
use state::State;

/// What a model is refined to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Largest |shape error| (Eq. 24) [mm], > 0; infinite = any.
    pub tol_mm: f64,
    /// Largest normal error [degrees], > 0; infinite = any.
    pub normal_deg: f64,
    /// Vertices may leave the CAD along their normals, so that the error has two sides. Those on planes stay.
    pub two_sided: bool,
    /// How faces meet.
    pub borders: Borders,
}

/// How the patches of neighbouring faces meet on the edge of the CAD between them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Borders {
    /// They share vertices and curves: no gap.
    #[default]
    Conforming,
    /// Every face has the divisions that its own error asks for; borders are no farther apart than the tolerance, nor
    /// than a thousandth of the model's size where there is no tolerance for lengths. Where that takes no fewer
    /// patches, as conforming.
    Independent,
}

/// A model refined to a goal.
#[derive(Debug, Clone)]
pub struct Refined {
    /// The model.
    pub tool: ToolModel,
    /// What its conversion found.
    pub report: ConvertReport,
    /// Its audit.
    pub audit: AuditReport,
    /// Largest distance that a vertex was moved off the CAD [mm].
    pub moved_mm: f64,
    /// Largest distance that a vertex was moved within a flat, off its smooth border [mm].
    pub slid_mm: f64,
    /// How its faces meet.
    pub borders: Borders,
    /// False where the search for fewer patches ended at its work limit.
    pub saved_all: bool,
}

/// Why there is no model within the tolerance.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum ToleranceError {
    /// A tolerance that is no positive number, or none at all.
    #[error("{what} is {found}; allowed: a number above zero")]
    Goal {
        /// Its name.
        what: &'static str,
        /// What was given.
        found: f64,
    },
    /// The tolerance was not reached.
    #[error(
        "{source_entity} (face {face}) still has {found:.3e} {unit}{near} with {patches} patches; asked: {allowed:.3e}{}; allow more, or repair the face in the CAD", spent_said(*.spent)
    )]
    NotReached {
        /// Face with the largest error.
        face: usize,
        /// Its entity in the CAD file.
        source_entity: String,
        /// Error found.
        found: f64,
        /// Where it is, as ` near (x, y, z) mm`; empty where that is not known.
        near: String,
        /// Error allowed.
        allowed: f64,
        /// Unit and kind of the error.
        unit: &'static str,
        /// Patches of the best model found.
        patches: usize,
        /// Patches judged, where the search ended because they were as many as it may judge.
        spent: Option<u64>,
    },
    /// A face of which no patches come out sound.
    #[error(
        "{source_entity} (face {face}): its patches fold or cannot be made, even with its border divided ten times as finely; repair the face in the CAD, or convert with --arc-divisions and --allow-folds to see where"
    )]
    NoPatches {
        /// The face.
        face: usize,
        /// Its entity in the CAD file.
        source_entity: String,
    },
    /// Faces divided independently whose borders do not meet.
    #[error(
        "borders of faces divided independently are {found:.3e} mm apart at ({:.3}, {:.3}, {:.3}) mm; allowed: {allowed:.3e}; convert with --borders conforming", at[0], at[1], at[2]
    )]
    Apart {
        /// Gap found [mm].
        found: f64,
        /// Gap allowed [mm].
        allowed: f64,
        /// Where it is [mm].
        at: [f64; 3],
    },
    /// So few patches are not possible.
    #[error("the coarsest model has {least} patches; allowed with --patches: at least so many")]
    TooFew {
        /// Patches of the coarsest model.
        least: usize,
    },
    /// No mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// No tool model.
    #[error(transparent)]
    Convert(#[from] ConvertError),
    /// No audit.
    #[error(transparent)]
    Audit(#[from] AuditError),
}

fn spent_said(spent: Option<u64>) -> String {
    spent.map_or_else(String::new, |n| {
        format!("; the search ended at its work limit, after {n} patches were judged")
    })
}

/// Converts `model` with as few patches as keep `goal`.
///
/// # Errors
/// [`ToleranceError::NotReached`] names the face that cannot be brought within it.
pub fn to_tolerance(
    model: &Model,
    mesh: &MappedOptions,
    options: &ConvertOptions,
    goal: &Goal,
) -> Result<Refined, ToleranceError> {
    for (what, found) in [("--tol", goal.tol_mm), ("--normal-tol", goal.normal_deg)] {
        if found.is_nan() || found <= 0.0 {
            return Err(ToleranceError::Goal { what, found });
        }
    }
    let reference = CadReference::new(model);
    let work = Work::new(model, &reference, mesh, options, goal.normal_deg.is_finite())?;
    let neighbours = Neighbours::new(model);
    let slides = (goal.two_sided && neighbours.slides()).then_some(&neighbours);
    let refined = searched(&work, goal, slides);
    let open = if refined.is_err() { !work.budget.is_spent() } else { work.budget.saves() };
    let again = work.plan.may_save() && open;
    let other = again.then(|| work.with_nodes_inside()).transpose()?;
    let differs = |other: &Work<'_>| {
        refined.as_ref().map_or(true, |(_, state)| other.differs_from(&work, state))
    };
    let other = other.filter(differs);
    let mut refined = refined.map(|found| found.0);
    if let Some(other) = other {
        refined = fewer(refined, other.refine(&Judge::new(&other, &other.free, slides), goal));
    }
    let limit = refined.as_ref().map_or(uniform::MOST, |found| found.tool.patches.len());
    let mut together = work.uniform(goal, limit).map_or(refined, Ok);
    if let Ok(found) = &mut together {
        found.saved_all = work.budget.saves();
    }
    match goal.borders {
        Borders::Conforming => together,
        Borders::Independent => {
            let apart = independent_borders::with(&work, |apart| apart.refined(goal));
            fewer(together, apart.and_then(|found| found))
        }
    }
}

/// The search with faces judged as they are and, where there are flats for vertices to slide in, with what that takes off
/// their errors.
fn searched(
    work: &Work<'_>,
    goal: &Goal,
    slides: Option<&Neighbours>,
) -> Result<(Refined, State), ToleranceError> {
    let judge = Judge::new(work, &work.free, None);
    let plain = work.refine_within(&judge, goal, &work.borders(goal));
    let Some(neighbours) = slides.filter(|_| work.budget.is_easy()) else { return plain };
    let judge = Judge::new(work, &work.free, Some(neighbours));
    match (plain, work.refine_within(&judge, goal, &work.borders(goal))) {
        (Ok(one), Ok(other)) if one.0.tool.patches.len() <= other.0.tool.patches.len() => Ok(one),
        (plain, Err(_)) => plain,
        (_, other) => other,
    }
}

/// The model with fewer patches; the conforming one when the other has as many.
fn fewer(
    together: Result<Refined, ToleranceError>,
    apart: Result<Refined, ToleranceError>,
) -> Result<Refined, ToleranceError> {
    match (together, apart) {
        (Ok(one), Ok(other)) if other.tool.patches.len() < one.tool.patches.len() => Ok(other),
        (Err(_), Ok(other)) => Ok(other),
        (together, _) => together,
    }
}

/// Converts `model` with at most `patches` patches and as small an error as it can.
///
/// # Errors
/// [`ToleranceError::TooFew`] when even the coarsest model has more.
pub fn to_patches(
    model: &Model,
    mesh: &MappedOptions,
    options: &ConvertOptions,
    patches: usize,
    two_sided: bool,
    borders: Borders,
) -> Result<Refined, ToleranceError> {
    let reference = CadReference::new(model);
    let work = Work::new(model, &reference, mesh, options, false)?;
    let neighbours = Neighbours::new(model);
    let slides = two_sided && neighbours.slides();
    let judge = Judge::new(&work, &work.free, None);
    let foreseeing = Judge::new(&work, &work.free, Some(&neighbours));
    let goal = |tol_mm: f64| Goal { tol_mm, normal_deg: f64::INFINITY, two_sided, borders };
    let together = |tol_mm: f64| {
        let plain = work.refine(&judge, &goal(tol_mm));
        if slides { fewer(plain, work.refine(&foreseeing, &goal(tol_mm))) } else { plain }
    };
    let size = crate::geometry::Aabb::of_points(&model.vertices).diagonal();
    match borders {
        Borders::Conforming => least_error(together, size, patches),
        Borders::Independent => independent_borders::with(&work, |apart| {
            let either = |tol_mm| fewer(together(tol_mm), apart.refined(&goal(tol_mm)));
            least_error(either, size, patches)
        })?,
    }
}

/// The model of the least tolerance found that has at most so many patches, of tolerances below `high` [mm].
fn least_error(
    refine: impl Fn(f64) -> Result<Refined, ToleranceError>,
    mut high: f64,
    patches: usize,
) -> Result<Refined, ToleranceError> {
    let mut best = refine(high)?;
    if best.tool.patches.len() > patches {
        return Err(ToleranceError::TooFew { least: best.tool.patches.len() });
    }
    high = best.audit.deviation_mm();
    let mut low = 0.0;
    for _ in 0..20 {
        if high <= 1e-9 {
            break;
        }
        let tol = if low > 0.0 { (low * high).sqrt() } else { high / 8.0 };
        match refine(tol) {
            Ok(found) if found.tool.patches.len() <= patches => {
                high = tol;
                if found.audit.deviation_mm() < best.audit.deviation_mm() {
                    best = found;
                }
            }
            Ok(_) | Err(ToleranceError::NotReached { .. } | ToleranceError::NoPatches { .. }) => {
                low = tol
            }
            Err(other) => return Err(other),
        }
        if low > 0.0 && high < 1.02 * low {
            break;
        }
    }
    Ok(best)
}

#[cfg(test)]
mod border_tests;
