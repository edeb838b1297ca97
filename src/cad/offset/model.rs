//! The offset of a model: every face moved along its outward normal.

use rayon::prelude::*;

use super::budget::{breaks_of, shares_of_spans};
use super::curvature::tightest;
use super::error::{FoldPlace, OffsetError};
use super::face::offset_face;
use super::joints::{OffsetGap, renew};
use super::overlaps::{distances, overlaps};
use super::sharp::sharp_places;
use crate::Model;
use crate::closest::ClosestPoint;
use crate::model::Face;
use crate::trim_region::TrimRegion;
use kanagata_geometry::Vec3;
use kanagata_progress::Progress;

/// Accuracy of fitted faces relative to the joining tolerance.
const FIT_PER_JOIN: f64 = 1e-2;
/// Accuracy of fitted faces [mm] at least: coordinates of large models have no more digits.
const FIT_TOLERANCE_MIN: f64 = 1e-9;
/// Smallest factor `1 + d k` of an offset that does not fold: curvatures of the offset are up to 1000 times those of the
/// face. Doubled: the largest permitted distance falls by 0.1 % of the radius.
const FACTOR_MIN: f64 = 1e-3;

/// A model and what is known of it as an offset.
#[derive(Debug, Clone)]
pub struct OffsetModel {
    /// The faces with the numbers, parameters and loops of the original model.
    pub model: Model,
    /// Figures.
    pub report: OffsetReport,
}

/// Figures of an offset.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OffsetReport {
    /// Distance along the outward normals [mm].
    pub distance_mm: f64,
    /// Faces whose surfaces are fitted; all others are exact.
    pub fitted: usize,
    /// Accuracy of the fitted faces [mm]; 0 without any.
    pub tolerance_mm: f64,
    /// Largest gap between faces at an edge. Faces that are tangent-continuous to within an angle `a` have the gap
    /// `|d| a`.
    pub gap: OffsetGap,
    /// Smallest radius of curvature on the side of the offset [mm], and its place; infinite where no face bends to it.
    pub radius_mm: f64,
    /// See [`Self::radius_mm`].
    pub radius_at: Vec3,
    /// Joining tolerance of the original model [mm].
    pub join_tolerance_mm: f64,
    /// Smallest and largest distance of points of the offset from the original model [mm].
    pub distances_mm: [f64; 2],
    /// False when the search for self-intersections reached its limit.
    pub complete: bool,
}

/// The offset of a model by `distance` [mm] along its outward normals (negative: against them). Edges remain joined where
/// the normals of their faces agree within `smooth_deg` [degrees].
///
/// Principal curvatures of the offset are `k / (1 + d k)`, with k positive where the surface bends away from its normal.
///
/// # Errors
/// [`OffsetError`] lists sharp edges, faces whose offset folds (`1 + d k <= 0`) and places where the offset passes through
/// itself.
pub fn offset_model(
    model: &Model,
    distance: f64,
    smooth_deg: f64,
) -> Result<OffsetModel, OffsetError> {
    offset_model_watched(model, distance, smooth_deg, &Progress::default())
}

/// As [`offset_model`], with its progress reported.
///
/// # Errors
/// As [`offset_model`].
pub fn offset_model_watched(
    model: &Model,
    distance: f64,
    smooth_deg: f64,
    progress: &Progress,
) -> Result<OffsetModel, OffsetError> {
    check_distance(distance)?;
    let _stage = progress.stage("offset, edges and radii", "", 0);
    let places = sharp_places(model, distance, smooth_deg.to_radians());
    if !places.is_empty() {
        return Err(OffsetError::Sharp { distance, smooth_deg, places });
    }
    let (radius_mm, radius_at) = smallest_radius(model, distance)?;
    let search = ClosestPoint::new(model);
    let found = overlaps(&search, distance, smooth_deg.to_radians(), progress);
    if !found.places.is_empty() {
        return Err(OffsetError::Overlaps { distance, places: found.places });
    }
    let Moved { model: offset, gap, fitted, tolerance_mm } = moved(model, distance, progress)?;
    let report = OffsetReport {
        distance_mm: distance,
        fitted,
        tolerance_mm,
        gap,
        radius_mm,
        radius_at,
        join_tolerance_mm: model.join_tolerance,
        distances_mm: distances(&search, &offset, progress),
        complete: found.complete,
    };
    Ok(OffsetModel { model: offset, report })
}

/// As [`offset_model`], without the search for places where the offset is not defined: for a tool whose offset was made
/// before.
///
/// # Errors
/// [`OffsetError::Distance`] and [`OffsetError::Face`].
pub fn offset_model_again(model: &Model, distance: f64) -> Result<Model, OffsetError> {
    check_distance(distance)?;
    Ok(moved(model, distance, &Progress::default())?.model)
}

fn check_distance(distance: f64) -> Result<(), OffsetError> {
    let is_length = distance.is_finite() && distance != 0.0;
    if is_length { Ok(()) } else { Err(OffsetError::Distance(distance)) }
}

/// Smallest radius of curvature [mm] on the side of the offset, and its place.
fn smallest_radius(model: &Model, distance: f64) -> Result<(f64, Vec3), OffsetError> {
    let of_face = |face: &Face| tightest(face, &TrimRegion::new(face), distance);
    let found: Vec<_> = model.faces.par_iter().map(of_face).collect();
    let mut places: Vec<(f64, FoldPlace)> = Vec::new();
    let (mut radius, mut at) = (f64::INFINITY, Vec3::zeros());
    for (face, tightest) in found.into_iter().enumerate().filter_map(|(f, t)| Some((f, t?))) {
        let own = tightest.radius(distance);
        if own < radius {
            (radius, at) = (own, tightest.at);
        }
        if tightest.factor <= FACTOR_MIN {
            let source = model.faces[face].source.clone();
            let place = FoldPlace { face, source, at: tightest.at, radius: own };
            places.push((tightest.factor, place));
        }
    }
    if places.is_empty() {
        return Ok((radius, at));
    }
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    let places = places.into_iter().map(|p| p.1).collect();
    Err(OffsetError::Folds { distance, places })
}

/// A moved model: see [`OffsetReport`].
struct Moved {
    model: Model,
    gap: OffsetGap,
    fitted: usize,
    tolerance_mm: f64,
}

/// The moved faces with renewed edges.
fn moved(model: &Model, distance: f64, progress: &Progress) -> Result<Moved, OffsetError> {
    let tolerance = (FIT_PER_JOIN * model.join_tolerance).max(FIT_TOLERANCE_MIN);
    let accuracy = (tolerance, tolerance.max(model.join_tolerance));
    let spans = |face: &Face| {
        let domain = face.surface.domain();
        [0, 1].map(|k| breaks_of(face.surface.knots()[k], domain[k]).len() - 1).iter().product()
    };
    let patches = shares_of_spans(model.faces.iter().map(spans));
    let stage = progress.stage("offset, surfaces", "faces", model.faces.len() as u64);
    let made: Vec<Result<(Face, f64), String>> = model
        .faces
        .par_iter()
        .zip(patches)
        .map(|(face, patches)| {
            let made = offset_face(face, distance, accuracy, patches);
            stage.add(1);
            made
        })
        .collect();
    let (mut faces, mut fitted, mut tolerance_mm) = (Vec::with_capacity(made.len()), 0, 0.0_f64);
    for (f, face) in made.into_iter().enumerate() {
        let source_entity = model.faces[f].source.clone();
        let of_face = |reason| OffsetError::Face { face: f, source_entity, distance, reason };
        let (face, accuracy) = face.map_err(of_face)?;
        faces.push(face);
        fitted += usize::from(accuracy > 0.0);
        tolerance_mm = tolerance_mm.max(accuracy);
    }
    let mut offset = Model { faces, ..model.clone() };
    let gap = renew(&mut offset, model.join_tolerance);
    offset.join_tolerance = offset.join_tolerance.max(gap.distance);
    Ok(Moved { model: offset, gap, fitted, tolerance_mm })
}
