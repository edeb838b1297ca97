//! Builds the model from the entities of a file: exact B-splines, closed trimming loops, joined edges.

use std::borrow::Cow;
use std::sync::Arc;

use rayon::prelude::*;

use super::analytic::Analytic;
use super::bodies::number_bodies;
use super::build_diagnostics::{coarse, creased, report, skipped};
use super::creases::{self, Part};
use super::loops::{
    LoopFault, Path, Side, closed_loops, outer_loop_is_reversed, paths_of, signed_area,
};
use super::model::{EdgeUse, Face, Model, TrimLoop};
use super::native::{Native, kind_of};
use super::numbers::usable_bounds;
use super::offset::{Fineness, Restricted, deviation, offset, restricted, shares};
use super::range::{ParameterMap, range_of};
use super::raw::{LostFace, RawFace, RawLoop, RawModel, RawSurface};
use super::sheets::{self, Sheet};
use super::topology::{Piece, join};
use super::{Diagnostic, Severity};
use kanagata_geometry::nurbs::{Curve2, Surface};
use kanagata_geometry::{Aabb, Vec3};

/// Tolerance for joining edges relative to the diagonal of the model, for files without a resolution. Doubled: gaps of
/// twice the width are closed.
const JOIN_TOLERANCE_REL: f64 = 1e-6;
/// Upper bound of the joining tolerance relative to the diagonal, whatever resolution a file states.
const JOIN_TOLERANCE_MAX_REL: f64 = 1e-4;
/// Largest distance of a profile's end from its axis, relative to the size of the face, at which the end is moved onto
/// the axis. Applied to faces that cannot be closed otherwise; single-precision writers miss the axis by 2e-3. Doubled:
/// faces with a small hole are mistaken for cones.
const AXIS_MISS_MAX_REL: f64 = 1e-2;
/// Builds the model. The diagnostics list the reader's messages first, then repairs and skipped faces.
#[must_use]
pub fn build(raw: RawModel, name: &str) -> (Model, Vec<Diagnostic>) {
    build_with(raw, name, Creases::Kept)
}

/// Treatment of creases inside a face: knot lines of a spline across which the tangent plane is discontinuous.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Creases {
    /// The face remains one, as in the file.
    Kept,
    /// The face is split along its creases; a note `face-creased` lists them.
    Cut,
}

/// A model with the data of the file, before its faces are built.
fn without_faces(raw: &mut RawModel, name: &str, join_tolerance: f64) -> Model {
    Model {
        name: name.to_owned(),
        unit: std::mem::take(&mut raw.unit),
        unit_mm: raw.unit_mm,
        entities: std::mem::take(&mut raw.entities),
        bodies: std::mem::take(&mut raw.bodies),
        lost: std::mem::take(&mut raw.lost),
        join_tolerance,
        ..Model::default()
    }
}

/// As [`build`], with a choice of the treatment of creases inside faces.
#[must_use]
pub fn build_with(mut raw: RawModel, name: &str, creases: Creases) -> (Model, Vec<Diagnostic>) {
    let mut diagnostics = std::mem::take(&mut raw.diagnostics);
    let boxes = drop_unusable(&mut raw, &mut diagnostics);
    let size = boxes.iter().fold(Aabb::EMPTY, |sum, b| sum.union(b)).diagonal();
    let tolerance =
        (2.0 * raw.resolution_mm).clamp(JOIN_TOLERANCE_REL * size, JOIN_TOLERANCE_MAX_REL * size);
    let mut model = without_faces(&mut raw, name, tolerance);
    let mut pieces = Vec::new();
    let parts: Vec<Option<Restricted>> =
        raw.faces.par_iter().map(|f| restricted(f, tolerance)).collect();
    let needed =
        raw.faces.iter().zip(&parts).map(|(f, p)| p.as_ref().map_or(&f.surface, |p| &p.surface));
    let offsets: Vec<_> = shares(needed, raw.bytes).into_iter().zip(&parts).collect();
    let one = |((face, bounds), offset): ((&RawFace, &Aabb), _)| {
        let mut messages = Vec::new();
        let parts =
            build_face(face, bounds.diagonal(), (tolerance, creases), offset, &mut messages);
        (parts, messages)
    };
    let built: Vec<_> = raw.faces.par_iter().zip(&boxes).zip(offsets).map(one).collect();
    for (face, (outcome, messages)) in raw.faces.iter().zip(built) {
        diagnostics.extend(messages);
        match outcome {
            Ok(parts) => pieces.extend(add_parts(&mut model, parts)),
            Err(text) => {
                model.lost.push(LostFace { source: face.source.clone(), reason: text.clone() });
                diagnostics.push(skipped(face, text));
            }
        }
    }
    diagnostics.extend(join(&mut model, pieces, tolerance));
    diagnostics.extend(super::orient::make_consistent(&mut model));
    number_bodies(&mut model);
    (model, diagnostics)
}

/// Removes faces with inadmissible coordinates, with a warning each; returns the bounding boxes [mm] of the others.
fn drop_unusable(raw: &mut RawModel, diagnostics: &mut Vec<Diagnostic>) -> Vec<Aabb> {
    let mut boxes = Vec::with_capacity(raw.faces.len());
    let judged: Vec<_> = raw.faces.par_iter().map(usable_bounds).collect();
    let mut judged = judged.into_iter();
    raw.faces.retain(|face| match judged.next() {
        Some(Err(reason)) => {
            diagnostics.push(skipped(face, reason.clone()));
            raw.lost.push(LostFace { source: face.source.clone(), reason });
            false
        }
        bounds => {
            boxes.extend(bounds.and_then(Result::ok));
            true
        }
    });
    boxes
}

/// Builds the parts of a face of `size` [mm]; sides are joined later within `tolerance` [mm]. An offset surface is built
/// on the restricted spline if the loops stay within it.
fn build_face(
    face: &RawFace,
    size: f64,
    (tolerance, creases): (f64, Creases),
    (fineness, restricted): (Fineness, &Option<Restricted>),
    diagnostics: &mut Vec<Diagnostic>,
) -> Result<Vec<FaceWithSides>, String> {
    let on_part = restricted.as_ref().and_then(|part| {
        let mut messages = Vec::new();
        let raw = RawFace { surface: part.surface.clone(), ..face.clone() };
        let whole = whole_face(&raw, size, tolerance, fineness, &mut messages).ok()?;
        part.holds(whole.part.loops.iter().flatten()).then_some((whole, messages))
    });
    let whole = match on_part {
        Some((whole, messages)) => {
            diagnostics.extend(messages);
            whole
        }
        None => whole_face(face, size, tolerance, fineness, diagnostics)?,
    };
    let coarse = whole.coarse;
    let parts = parts_of(face, whole, creases, tolerance, diagnostics);
    if coarse { checked_offset(face, parts, tolerance) } else { Ok(parts) }
}

/// Adds the parts of a face to the model and returns their sides for joining.
fn add_parts(model: &mut Model, parts: Vec<FaceWithSides>) -> Vec<Piece> {
    let first = model.faces.len();
    if parts.len() > 1 {
        model.cut.push(first..first + parts.len());
    }
    let mut pieces = Vec::new();
    for (built, mut sides) in parts {
        let index = model.faces.len();
        sides.iter_mut().for_each(|p| p.at[0] = index);
        pieces.extend(sides);
        model.faces.push(built);
    }
    pieces
}

/// A face with closed loops before its sides are joined to edges.
struct ClosedFace {
    part: Part,
    analytic: Option<Analytic>,
    flipped: bool,
    /// The approximation of its offset surface exceeds the tolerance.
    coarse: bool,
}

/// Builds a face. If its loops cannot be closed, the profile of a surface of revolution that misses its axis is first
/// moved onto it.
fn whole_face(
    raw: &RawFace,
    size: f64,
    tolerance: f64,
    fineness: Fineness,
    diagnostics: &mut Vec<Diagnostic>,
) -> Result<ClosedFace, String> {
    let first = whole_face_on(raw, size, tolerance, fineness, diagnostics);
    let Err(reason) = first else { return first };
    let Some((surface, distance)) = with_ends_on_axis(&raw.surface, AXIS_MISS_MAX_REL * size)
    else {
        return Err(reason);
    };
    let moved = RawFace { surface, ..raw.clone() };
    let whole =
        whole_face_on(&moved, size, tolerance, fineness, diagnostics).map_err(|_| reason)?;
    let text = format!(
        "the profile ends {distance:.3e} mm from the axis of revolution; moved onto the axis"
    );
    let place = raw.source.clone();
    diagnostics.push(Diagnostic { severity: Severity::Warning, code: "axis-missed", place, text });
    Ok(whole)
}

/// A surface of revolution whose profile ends within `limit` [mm] of the axis are moved onto it, and the largest
/// distance moved [mm]. `None` for other surfaces and when no end is moved.
fn with_ends_on_axis(surface: &RawSurface, limit: f64) -> Option<(RawSurface, f64)> {
    let mut moved = surface.clone();
    let RawSurface::Revolution { generatrix, origin, axis, .. } = &mut moved else { return None };
    let foot = |p: Vec3| *origin + *axis * axis.dot(&(p - *origin));
    let points = generatrix.points();
    let (start, end) = (points[0], points[points.len() - 1]);
    let is_near = |p: Vec3| (1e-12 * limit..=limit).contains(&(foot(p) - p).norm());
    let mut distance = 0.0_f64;
    let mut profile = generatrix.clone();
    if is_near(start) {
        distance = (foot(start) - start).norm();
        profile = profile.with_start(foot(start));
    }
    if is_near(end) {
        distance = distance.max((foot(end) - end).norm());
        profile = profile.with_end(foot(end));
    }
    *generatrix = profile;
    (distance > 0.0).then_some((moved, distance))
}

fn whole_face_on(
    raw: &RawFace,
    size: f64,
    tolerance: f64,
    mut fineness: Fineness,
    diagnostics: &mut Vec<Diagnostic>,
) -> Result<ClosedFace, String> {
    let surface = explicit_surface(raw, 1e-2 * tolerance, &mut fineness, diagnostics)?;
    let sheets = sheets::of_face(&surface, &raw.loops, tolerance);
    let Outline { native, paths, faults, flipped, .. } =
        outline(&surface, &sheets, raw, (size, tolerance));
    report(raw, &faults, diagnostics);
    let is_closed = native.has_no_boundary() || has_poles_within(&native, raw, tolerance);
    let loops = closed_loops(&native, paths, !flipped, is_closed).ok_or(
        "the loops cannot be closed on the surface, and the surface has no natural boundary",
    )?;
    if !encloses_area(&loops) {
        return Err(
            "the loops enclose no area: the holes cover the outer loop, or the loop retraces itself"
                .into(),
        );
    }
    let range = range_of(&native, &loops)?;
    let (surface, angles) = native.to_nurbs(range);
    let analytic = Analytic::new(native.raw(), angles);
    let map =
        ParameterMap { angles, extent: [range[0][1] - range[0][0], range[1][1] - range[1][0]] };
    let mapped = |s: &Side| Side { path: map.curve(&s.path), ..s.clone() };
    let loops = loops.iter().map(|l| l.iter().map(mapped).collect()).collect();
    Ok(ClosedFace { part: Part { surface, loops }, analytic, flipped, coarse: fineness.coarse })
}

/// The surface of a face; for an offset surface its spline approximation within `tolerance` [mm].
fn explicit_surface<'a>(
    raw: &'a RawFace,
    tolerance: f64,
    fineness: &mut Fineness,
    diagnostics: &mut Vec<Diagnostic>,
) -> Result<Cow<'a, RawSurface>, String> {
    let RawSurface::Offset { base, distance } = &raw.surface else {
        return Ok(Cow::Borrowed(&raw.surface));
    };
    let made = offset(base, *distance, tolerance, fineness)?;
    if fineness.coarse {
        diagnostics.push(coarse(raw, fineness, tolerance));
    }
    Ok(Cow::Owned(made))
}

/// True for a surface between two poles when vertex loops place both poles inside the face.
fn has_poles_within(native: &Native<'_>, raw: &RawFace, tolerance: f64) -> bool {
    let vertices = || raw.loops.iter().filter(|l| l.edges.is_empty()).filter_map(|l| l.vertex);
    let poles = native.pole_points();
    let within = |pole: &Vec3| vertices().any(|v| (v - pole).norm() <= tolerance);
    poles.len() == 2 && (poles[0] - poles[1]).norm() > tolerance && poles.iter().all(within)
}

/// True when the loops (outer loop first, counter-clockwise) enclose a positive area.
fn encloses_area(loops: &[Vec<Side>]) -> bool {
    loops.iter().map(|sides| signed_area(sides)).sum::<f64>() > 0.0
}

/// Loops of a face in the parameters of its surface, before they are closed.
struct Outline<'a> {
    native: Native<'a>,
    paths: Vec<Path>,
    faults: Vec<LoopFault>,
    flipped: bool,
    /// The outer loop is oriented against the face normal.
    is_reversed: bool,
}

/// Reads the loops on each sheet in turn and returns the first sheet with correct loop orientation, otherwise the first
/// sheet. Without sheets the surface itself is used.
fn outline<'a>(
    surface: &'a RawSurface,
    sheets: &'a [Sheet],
    raw: &RawFace,
    limits: (f64, f64),
) -> Outline<'a> {
    let mut on_first = None;
    for sheet in sheets {
        let found = outline_on(&sheet.surface, &sheet.loops, raw.flipped, limits);
        if !found.is_reversed {
            return found;
        }
        on_first.get_or_insert(found);
    }
    on_first.unwrap_or_else(|| outline_on(surface, &raw.loops, raw.flipped, limits))
}

fn outline_on<'a>(
    surface: &'a RawSurface,
    loops: &[RawLoop],
    flipped: bool,
    limits: (f64, f64),
) -> Outline<'a> {
    let native = Native::new(surface);
    let mut faults = Vec::new();
    let edged = loops.iter().filter(|l| !l.edges.is_empty());
    let flipped = flipped ^ native.swapped();
    let paths: Vec<Path> =
        edged.flat_map(|l| paths_of(&native, l, limits, !flipped, &mut faults)).collect();
    let is_reversed = outer_loop_is_reversed(&paths, !flipped);
    Outline { native, paths, faults, flipped, is_reversed }
}

/// A face and its sides, to be joined to edges.
type FaceWithSides = (Face, Vec<Piece>);

/// Checks the parts of a face with a coarse approximation of its offset surface.
///
/// # Errors
/// The distance to the exact offset surface exceeds `tolerance` [mm] inside the boundary.
fn checked_offset(
    raw: &RawFace,
    parts: Vec<FaceWithSides>,
    tolerance: f64,
) -> Result<Vec<FaceWithSides>, String> {
    let off = parts.iter().map(|(face, _)| deviation(&raw.surface, face)).fold(0.0, f64::max);
    if off <= tolerance {
        return Ok(parts);
    }
    Err(format!(
        "its offset surface self-intersects or is too strongly curved: its approximation deviates by {off:.3e} mm inside the \
         trimming loops; allowed: {tolerance:.1e} mm"
    ))
}

/// The face, or its parts when it is split along creases, each with its sides.
fn parts_of(
    raw: &RawFace,
    ClosedFace { part, analytic, flipped, .. }: ClosedFace,
    creases: Creases,
    tolerance: f64,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<FaceWithSides> {
    let (parts, found) = match analytic {
        None if creases == Creases::Cut => creases::cut(part, tolerance),
        _ => (vec![part], Vec::new()),
    };
    diagnostics.extend(creased(raw, &found, parts.len()));
    let face = |Part { surface, loops }| {
        let (loops, pieces) = trims_of(&loops, &surface, tolerance);
        let (kind, source) = (kind_of(&raw.surface), raw.source.clone());
        let (analytic, attributes) = (analytic.clone(), Arc::clone(&raw.attributes));
        let shell = raw.shell;
        (Face { surface, kind, analytic, loops, flipped, source, shell, attributes }, pieces)
    };
    parts.into_iter().map(face).collect()
}

/// Trimming loops in the parameters of `surface`, and the non-degenerate sides to be joined to edges.
fn trims_of(loops: &[Vec<Side>], surface: &Surface, tolerance: f64) -> (Vec<TrimLoop>, Vec<Piece>) {
    let (mut pieces, mut trims) = (Vec::new(), Vec::new());
    for (l, sides) in loops.iter().enumerate() {
        let mut uses = Vec::new();
        for side in sides {
            let pcurve = side.path.clone();
            if !is_point(surface, &pcurve, tolerance) {
                let curve = side.curve.clone();
                let at = [0, l, uses.len()];
                pieces.push(Piece { at, pcurve: pcurve.clone(), curve, edge_id: side.edge_id });
            }
            uses.push(EdgeUse { pcurve, edge: None, reversed: false });
        }
        trims.push(TrimLoop { uses });
    }
    (trims, pieces)
}

/// True when the image of a side lies within `tolerance` [mm] of its first point.
pub(super) fn is_point(surface: &Surface, pcurve: &Curve2, tolerance: f64) -> bool {
    let [a, b] = pcurve.domain();
    let at = |k: u32| surface.point(pcurve.point(a + (b - a) * f64::from(k) / 16.0));
    let first: Vec3 = at(0); // The middle is tested first: on limit sides it is the farthest point.
    std::iter::once(8).chain(1..=16).all(|k| (at(k) - first).norm() <= tolerance)
}
