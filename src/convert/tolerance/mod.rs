//! As few patches as a tolerance allows: divisions of each chain of opposite edges are raised where the audit of a
//! face says so, in the direction that buys most, lowered again where they are not needed, and the vertices are
//! balanced about the CAD so that the error has two sides.
//!
//! - [`slide_estimate`]: what moving its vertices will take off a face's error
//! - [`independent_borders`]: every face with divisions of its own, borders meeting to within the tolerance
//! - [`search`], [`state`], [`face_error`], [`figures`]: which divisions; every face is judged alone, by the audit of its own patches
//! - [`balance`], [`vertex_directions`], [`minimax`]: vertices moved along their normals, or within flats
//! - [`scope`], [`refine`]: a model, or one face, refined and audited as a whole
//! - [`faults`]: what keeps a model from the goal, and the errors that say so
//! - [`budget`]: how much work that may be
//! - [`uniform`]: meshes of one division of a quarter turn, taken where they have fewer patches
//!
//! Free borders keep the tolerance as well. The model is conforming unless asked otherwise; its largest error is the audit's,
//! of the finished model.

pub mod balance;
mod budget;
mod error;
mod face_error;
mod faults;
mod figures;
mod goal;
mod independent_borders;
mod minimax;
mod refine;
mod scope;
mod search;
mod slide_estimate;
mod state;
mod uniform;
mod vertex_directions;

pub use error::ToleranceError;
pub use goal::{Borders, Goal, Refined};

use crate::audit::CadReference;
use crate::cad::Model;
use crate::mesh::mapped::MappedOptions;

use super::ConvertOptions;
use face_error::Judge;
use scope::Work;
use slide_estimate::Neighbours;
use state::State;

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
    for (what, found) in [("tol_mm", goal.tol_mm), ("normal_deg", goal.normal_deg)] {
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
