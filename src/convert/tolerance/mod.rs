//! Models with the fewest patches within a tolerance.
//!
//! Divisions of chains of opposite edges are raised where a face exceeds the tolerance and lowered where they are not
//! needed. The vertices are then moved so that the shape error has both signs.
//!
//! - [`search`], [`state`], [`face_error`], [`face_result`], [`results`]: search for the divisions; every face is evaluated alone,
//!   by the audit of its patches
//! - [`slide_estimate`]: estimated error of a face after the vertex motion
//! - [`balance`], [`vertex_directions`], [`minimax`]: vertex motion along normals or within flats
//! - [`scope`], [`refine`]: refinement of a complete model or of one face, with the audit of the result
//! - [`independent_borders`], [`single_face`]: faces divided independently, with border gaps within the tolerance
//! - [`uniform`]: comparison with uniform structured meshes
//! - [`faults`]: violations of the goal, and the resulting errors
//! - [`starts`]: starts of the closest-point searches of an audit
//! - [`closest`]: the model closest to the goal, where the goal is not reached
//! - [`budget`]: work limit and time limit
//!
//! The tolerance also applies to free borders. The model is conforming unless requested otherwise. The reported error
//! is that of the audit of the final model.

pub mod balance;
mod budget;
mod closest;
mod error;
mod face_error;
mod face_result;
mod faults;
mod goal;
mod independent_borders;
mod minimax;
mod refine;
mod results;
mod scope;
mod search;
mod single_face;
mod slide_estimate;
mod starts;
mod state;
mod uniform;
mod vertex_directions;

pub use error::ToleranceError;
pub use goal::{Aim, Borders, Goal, Refined};

use std::time::{Duration, Instant};

use kanagata_audit::CadReference;
use kanagata_cad::Model;
use kanagata_mesh::mapped::MappedOptions;

use super::ConvertOptions;
use closest::{goal_ratio, is_valid};
use face_error::FaceEvaluator;
use independent_borders::with_independent_faces;
use scope::Scope;
use slide_estimate::Neighbours;
use state::State;

/// Time kept for the complete model and its audit, in times of the default model. The complete model has its vertices
/// moved, which takes several audits. Doubled: less time for the search on large files.
const RESERVED_MODELS: u32 = 4;

/// Converts `model` to the model with the fewest patches found within `goal`. The search is made with and without nodes
/// inside flats and triangles at poles, and compared with uniform meshes.
///
/// # Errors
/// [`ToleranceError::Above`] has the model with the smallest error found, where no model is within the goal;
/// [`ToleranceError::NoPatches`] names a face that has no model at all.
pub fn to_tolerance(
    model: &Model,
    mesh: &MappedOptions,
    options: &ConvertOptions,
    goal: &Goal,
) -> Result<Refined, ToleranceError> {
    to_tolerance_in_time(model, mesh, options, goal, None)
}

/// As [`to_tolerance`], in about `time`. Models of uniform divisions are made first; the search ends in time for the audit
/// of its result. A time that is too short gives the default model. The result depends on the speed of the machine.
///
/// # Errors
/// As [`to_tolerance`].
pub fn to_tolerance_in_time(
    model: &Model,
    mesh: &MappedOptions,
    options: &ConvertOptions,
    goal: &Goal,
    time: Option<Duration>,
) -> Result<Refined, ToleranceError> {
    let start = Instant::now();
    check_goal(goal)?;
    let (progress, options) = (&options.progress, &options.unwatched());
    let reference = CadReference::new(model);
    let neighbours = Neighbours::new(model);
    let slides = (goal.two_sided && neighbours.allow_slides()).then_some(&neighbours);
    let normals = goal.normal_deg.is_finite();
    let scope = Scope::new(model, &reference, mesh, options, slides, normals)?.watched(progress);
    if let Some(time) = time {
        let limit = |reserve| scope.budget.limit_time(time.saturating_sub(reserve));
        scope.keep_uniform_models(goal, || limit(start.elapsed() * RESERVED_MODELS));
        limit(start.elapsed());
    }
    without_folds(&scope, goal).or_else(|why| scope.closest_or(why, goal))
}

/// Parts of the tolerance with which a search is repeated whose model folds at points that only its complete audit compares.
/// One file of the corpus needs a quarter and has two patches more with it; with a half it folds still.
const UNFOLDED_SHARES: [f64; 3] = [0.5, 0.25, 0.125];

/// The model of [`searched`], of a smaller tolerance where its complete audit finds folds and the work allows it.
fn without_folds(scope: &Scope<'_>, goal: &Goal) -> Result<Refined, ToleranceError> {
    let found = searched(scope, goal)?;
    if found.audit.folded.is_empty() || !goal.tol_mm.is_finite() {
        return Ok(found);
    }
    let finer = UNFOLDED_SHARES.map(|share| Goal { tol_mm: share * goal.tol_mm, ..*goal });
    let within = |other: &Refined| is_valid(other) && goal_ratio(other, goal) <= 1.0;
    let allowed = finer.iter().take_while(|_| !scope.budget.is_exhausted());
    let again = allowed.filter_map(|goal| searched(scope, goal).ok()).find(within);
    let Some(mut unfolded) = again else { return Ok(found) };
    unfolded.audit.tolerance_mm = found.audit.tolerance_mm;
    scope.with_full_audit(unfolded).or(Ok(found))
}

/// The model with the fewest patches of all searches in a scope.
fn searched(scope: &Scope<'_>, goal: &Goal) -> Result<Refined, ToleranceError> {
    let refined = refine_with_slides(scope, goal);
    let budget = &scope.budget;
    let open = if refined.is_err() { !budget.is_exhausted() } else { budget.allows_saving() };
    let again = scope.plan.may_save() && open;
    let other = again.then(|| scope.with_interior_nodes()).transpose()?;
    let differs = |other: &Scope<'_>| {
        refined.as_ref().map_or(true, |(_, state)| other.meshes_differently(scope, state))
    };
    let other = other.filter(differs);
    let mut refined = refined.map(|found| found.0);
    if let Some(other) = other {
        let evaluator = FaceEvaluator::new(&other, &other.free_edges, true);
        let limit = refined.as_ref().map_or(usize::MAX, |found| found.tool.patches.len());
        let borders = other.border_tolerances(goal);
        refined = match other.refine_below(&evaluator, goal, &borders, limit) {
            Ok(Some((found, _))) => Ok(found),
            _ => refined,
        };
    }
    let most = match &refined {
        Err(ToleranceError::NoPatches { alone: false, .. }) => uniform::REPAIRED_PATCHES_MAX
            .max(uniform::REPAIRED_PATCHES_PER_FACE * scope.plan.model().faces.len()),
        _ => uniform::UNIFORM_PATCHES_MAX,
    };
    let limit = refined.as_ref().map_or(most, |found| found.tool.patches.len());
    let mut conforming = scope.uniform(goal, limit).map_or(refined, Ok);
    if let Ok(found) = &mut conforming {
        found.saved_all = scope.budget.has_saved_all();
    }
    let conforming = conforming.and_then(|found| scope.with_full_audit(found));
    match goal.borders {
        Borders::Conforming => conforming,
        Borders::Independent => {
            let independent = with_independent_faces(scope, |faces| faces.refined(goal));
            fewer_patches(conforming, independent.and_then(|found| found))
        }
    }
}

/// Converts `model` to the model that comes closest to `aim`: where a goal is not reached, that with the smallest error found,
/// whose audit says so.
///
/// # Errors
/// As [`to_tolerance`] and [`to_patches`], without [`ToleranceError::Above`].
pub fn refined_to(
    model: &Model,
    mesh: &MappedOptions,
    options: &ConvertOptions,
    aim: &Aim,
) -> Result<Refined, ToleranceError> {
    let found = match *aim {
        Aim::Patches { patches, two_sided, borders } => {
            to_patches(model, mesh, options, patches, two_sided, borders)
        }
        Aim::Within(goal, time) => to_tolerance_in_time(model, mesh, options, &goal, time),
    };
    match found {
        Err(ToleranceError::Above { model, .. }) => Ok(*model),
        found => found,
    }
}

/// Checks that both tolerances are positive.
///
/// # Errors
/// [`ToleranceError::Goal`].
fn check_goal(goal: &Goal) -> Result<(), ToleranceError> {
    for (what, found) in [("tol_mm", goal.tol_mm), ("normal_deg", goal.normal_deg)] {
        if found.is_nan() || found <= 0.0 {
            return Err(ToleranceError::Goal { what, found });
        }
    }
    Ok(())
}

/// Refines with the errors of the faces as they are and, where vertices may slide, also with the errors estimated after
/// the vertex motion. Returns the model with fewer patches.
fn refine_with_slides(scope: &Scope<'_>, goal: &Goal) -> Result<(Refined, State), ToleranceError> {
    let borders = scope.border_tolerances(goal);
    let evaluator = FaceEvaluator::new(scope, &scope.free_edges, false);
    let plain = scope.refine_within(&evaluator, goal, &borders);
    if scope.neighbours.is_none() || !scope.budget.is_cheap() {
        return plain;
    }
    let evaluator = FaceEvaluator::new(scope, &scope.free_edges, true);
    let limit = plain.as_ref().map_or(usize::MAX, |found| found.0.tool.patches.len());
    match scope.refine_below(&evaluator, goal, &borders, limit) {
        Ok(Some(other)) => Ok(other),
        _ => plain,
    }
}

/// The model with fewer patches; `first` if both have equally many.
fn fewer_patches(
    first: Result<Refined, ToleranceError>,
    second: Result<Refined, ToleranceError>,
) -> Result<Refined, ToleranceError> {
    match (first, second) {
        (Ok(one), Ok(other)) if other.tool.patches.len() < one.tool.patches.len() => Ok(other),
        (Err(_), Ok(other)) => Ok(other),
        (first, _) => first,
    }
}

/// Converts `model` to at most `patches` patches with the smallest shape error found.
///
/// # Errors
/// [`ToleranceError::TooFew`] when the coarsest model has more patches.
pub fn to_patches(
    model: &Model,
    mesh: &MappedOptions,
    options: &ConvertOptions,
    patches: usize,
    two_sided: bool,
    borders: Borders,
) -> Result<Refined, ToleranceError> {
    let (progress, options) = (&options.progress, &options.unwatched());
    let reference = CadReference::new(model);
    let neighbours = Neighbours::new(model);
    let slides = two_sided && neighbours.allow_slides();
    let movable = slides.then_some(&neighbours);
    let scope = Scope::new(model, &reference, mesh, options, movable, false)?.watched(progress);
    let evaluator = FaceEvaluator::new(&scope, &scope.free_edges, false);
    let estimating = FaceEvaluator::new(&scope, &scope.free_edges, true);
    let goal = |tol_mm: f64| Goal { tol_mm, normal_deg: f64::INFINITY, two_sided, borders };
    let conforming = |tol_mm: f64| {
        let plain = scope.refine(&evaluator, &goal(tol_mm));
        if !slides {
            return plain;
        }
        fewer_patches(plain, scope.refine(&estimating, &goal(tol_mm)))
    };
    let size = kanagata_geometry::Aabb::of_points(&model.vertices).diagonal();
    let found = match borders {
        Borders::Conforming => smallest_error(conforming, size, patches),
        Borders::Independent => with_independent_faces(&scope, |faces| {
            let either = |tol_mm| fewer_patches(conforming(tol_mm), faces.refined(&goal(tol_mm)));
            smallest_error(either, size, patches)
        })?,
    }?;
    match found.borders {
        Borders::Conforming => scope.with_full_audit(found),
        Borders::Independent => Ok(found),
    }
}

/// Bisects the tolerance, from `high` [mm] down, for the smallest one with at most `patches` patches. Returns the model
/// with the smallest error among those found; stops at a relative interval of 2 % or after 20 steps.
///
/// # Errors
/// [`ToleranceError::TooFew`]; other errors of `refine` except those of a tolerance that was not reached.
fn smallest_error(
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
#[cfg(test)]
mod work_tests;
