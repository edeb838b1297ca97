//! Vertex motion that gives the shape error both signs and so reduces its maximum.
//!
//! A Nagata patch on an arc lies outside it everywhere. Moving its vertices inwards by half of the error halves the
//! maximum. The vertices of a fillet between two flats slide within these flats ([`super::vertex_directions`]). The
//! longer curve passes closer to the arc: one patch over 90 degrees deviates by 0.011 instead of 0.061 radii.
//!
//! The error at a point is, to first order, `delta + sum_k N_k s_k` with the shifts `s_k`. [`super::minimax`] minimises
//! it.

use std::collections::BTreeSet;

use crate::{ConvertError, ConvertOptions, edges};
use kanagata_audit::local::LocalReference;
use kanagata_audit::report::PatchAudit;
use kanagata_audit::sample::PatchSamples;
use kanagata_audit::{Audit, AuditOptions, AuditReport, audit_from};
use kanagata_cad::Model;
use kanagata_geometry::Aabb;
use kanagata_tool::build::{EdgeChoice, build};
use kanagata_tool::{ToolModel, side};

use super::error::ToleranceError;
use super::goal::Refined;
use super::minimax::{Row, minimax_shifts};
use super::starts::known_starts;
use super::vertex_directions::{VertexDirection, vertex_directions};

/// Number of patches up to which a model is corrected in up to [`ROUNDS_SMALL_MAX`] rounds.
const SMALL_PATCHES_MAX: usize = 500;
/// Maximum rounds of audit and correction of a small model. Errors are not linear in slides.
const ROUNDS_SMALL_MAX: usize = 8;
/// Maximum rounds of audit and correction of a large model.
const ROUNDS_LARGE_MAX: usize = 4;
/// Power of the errors of patches whose sum the rounds reduce. As the maximum, but a patch that cannot be improved does
/// not hold up all others.
const ERROR_POWER: i32 = 12;
/// Step length, relative to the full correction, at which a failed step is not halved again.
const STEP_LENGTH_MIN: f64 = 0.25;
/// Ratio of the error norm after a round to that before it above which the motion has converged.
const CONVERGED_ERROR_RATIO: f64 = 0.995;
/// Relative reduction of a slide in the first attempt to remove an inverted corner. It is doubled in every attempt.
const SLIDE_REDUCTION_FIRST: f64 = 2e-3;

/// Moves the vertices of `plain` to reduce its largest shape errors. Its audit is `found`; its faces are those of `model`,
/// numbered from `first`. Returns `plain` unchanged
/// when no motion reduces it without further folds.
///
/// # Errors
/// [`ToleranceError`] when the moved vertices give no tool model, which requires values that are not finite.
pub(super) fn balance_errors(
    (plain, found): (Refined, Audit),
    (model, first): (&Model, u32),
    reference: &LocalReference<'_, '_>,
    (options, audit_options): (&ConvertOptions, &AuditOptions),
) -> Result<Refined, ToleranceError> {
    let directions = vertex_directions(&plain.tool, model, first);
    let mut shifts = vec![0.0; directions.len()];
    let (mut best, mut samples) = (plain.clone(), found.samples);
    let mut length = 1.0;
    let mut step: Option<Vec<f64>> = None;
    let scale = plain.audit.worst_mm();
    for _ in 0..rounds_max(plain.tool.patches.len()) {
        let more = match step.take() {
            Some(step) => step,
            None => correction(&best.tool, &samples, (&shifts, &directions), options)?,
        };
        let mut tried: Vec<f64> = shifts.iter().zip(&more).map(|(s, m)| s + length * m).collect();
        let tool = move_without_inversion(&plain.tool, &mut tried, &directions, options)?;
        let found = audit_from(&tool, reference, audit_options, &known_starts(&samples))?;
        let folds = found.report.folded.len() > plain.audit.folded.len();
        let reduction = error_norm(&found.report, scale) / error_norm(&best.audit, scale);
        if folds || reduction.is_nan() || reduction >= 1.0 {
            if length <= STEP_LENGTH_MIN {
                break;
            }
            (length, step) = (0.5 * length, Some(more));
            continue;
        }
        length = (2.0 * length).min(1.0);
        let converged = reduction > CONVERGED_ERROR_RATIO;
        let [moved_mm, slid_mm] = [false, true].map(|s| largest_shift(&directions, &tried, s));
        best = Refined { tool, audit: found.report, moved_mm, slid_mm, ..best };
        (samples, shifts) = (found.samples, tried);
        if converged {
            break;
        }
    }
    Ok(best)
}

/// Limit of the rounds for a tool of `patches` patches.
fn rounds_max(patches: usize) -> usize {
    if patches <= SMALL_PATCHES_MAX { ROUNDS_SMALL_MAX } else { ROUNDS_LARGE_MAX }
}

/// Norm of the largest errors of the patches over `scale`, with the power [`ERROR_POWER`].
fn error_norm(report: &AuditReport, scale: f64) -> f64 {
    let error = |p: &PatchAudit| p.max_mm.abs().max(p.min_mm.abs()) / scale;
    let sum: f64 = report.by_patch.iter().map(|p| error(p).powi(ERROR_POWER)).sum();
    sum.powf(1.0 / f64::from(ERROR_POWER))
}

/// Changes of the shifts that minimise the linearised error of `tool`, which has the shifts `shifts`.
fn correction(
    tool: &ToolModel,
    samples: &[PatchSamples],
    (shifts, directions): (&[f64], &[VertexDirection]),
    options: &ConvertOptions,
) -> Result<Vec<f64>, ConvertError> {
    let rows = error_rows(tool, samples, directions, options)?;
    Ok(minimax_shifts(&rows, shifts, directions))
}

/// Maximum absolute shift over the slides, or over all other directions [mm].
fn largest_shift(directions: &[VertexDirection], shifts: &[f64], slides: bool) -> f64 {
    let selected = directions.iter().zip(shifts).filter(|(d, _)| d.slides == slides);
    selected.fold(0.0, |most, (_, shift)| most.max(shift.abs()))
}

/// The model with its vertices moved by `shifts`. Slides of vertices with an inverted corner are reduced until no such
/// vertex slides.
fn move_without_inversion(
    tool: &ToolModel,
    shifts: &mut [f64],
    directions: &[VertexDirection],
    options: &ConvertOptions,
) -> Result<ToolModel, ConvertError> {
    let mut reduction = SLIDE_REDUCTION_FIRST;
    loop {
        let found = move_vertices(tool, shifts, directions, options)?;
        let inverted = inverted_corners(&found);
        let slid = |d: &VertexDirection, shift: f64| {
            d.slides && shift != 0.0 && inverted.contains(&(d.vertex as u32))
        };
        let mut any = false;
        for (direction, shift) in directions.iter().zip(shifts.iter_mut()) {
            if slid(direction, *shift) {
                *shift *= 1.0 - reduction;
                any = true;
            }
        }
        if !any {
            return Ok(found);
        }
        reduction = (2.0 * reduction).min(1.0);
    }
}

/// Vertices with an inverted patch corner: `(S_eta x S_zeta) . n < 0` there.
fn inverted_corners(tool: &ToolModel) -> BTreeSet<u32> {
    let mut out = BTreeSet::new();
    for (patch, corners) in tool.patches.iter().zip(&tool.corners) {
        for (k, &(eta, zeta)) in side::corners(patch.sides()).iter().enumerate() {
            let d = patch.derivs(eta, zeta);
            let normal = tool.normals[corners.normals[k] as usize];
            if d.d1.cross(&d.d2).dot(&normal) < -1e-9 * d.d1.norm() * d.d2.norm() {
                out.insert(corners.vertices[k]);
            }
        }
    }
    out
}

/// The model with its vertices moved by `shifts` along their directions. The normals are kept.
fn move_vertices(
    tool: &ToolModel,
    shifts: &[f64],
    directions: &[VertexDirection],
    options: &ConvertOptions,
) -> Result<ToolModel, ConvertError> {
    let mut vertices = tool.vertices.clone();
    directions.iter().zip(shifts).for_each(|(d, s)| vertices[d.vertex] += d.vector * *s);
    let given = edges::curves_after_motion(tool, &vertices);
    let (normals, corners) = (tool.normals.clone(), tool.corners.clone());
    let choice = EdgeChoice { rule: options.edges, given };
    let (tool, _) = build(tool.name.clone(), tool.kind, vertices, normals, corners, choice)?;
    Ok(tool)
}

/// Greedy colouring of the directions: two directions on one patch have different colours.
fn colours(tool: &ToolModel, directions: &[VertexDirection]) -> Vec<usize> {
    let mut at = vec![Vec::new(); tool.vertices.len()];
    directions.iter().enumerate().for_each(|(k, d)| at[d.vertex].push(k));
    let mut neighbours = vec![Vec::new(); tool.vertices.len()];
    for p in &tool.corners {
        p.vertices.iter().for_each(|&v| neighbours[v as usize].extend_from_slice(&p.vertices));
    }
    let mut colours = vec![usize::MAX; directions.len()];
    for (k, direction) in directions.iter().enumerate() {
        let near = || neighbours[direction.vertex].iter().flat_map(|&v| &at[v as usize]);
        colours[k] = (0..).find(|&c| near().all(|&other| colours[other] != c)).unwrap_or(0);
    }
    colours
}

/// Errors of all valid samples and their derivatives `N_k = n_CAD . dS/ds_k`, by forward differences with a step of
/// 1e-6 of the model size. All directions of one colour are shifted together, since they affect different patches.
pub(super) fn error_rows(
    tool: &ToolModel,
    samples: &[PatchSamples],
    directions: &[VertexDirection],
    options: &ConvertOptions,
) -> Result<Vec<Row>, ConvertError> {
    let colours = colours(tool, directions);
    let step = 1e-6 * Aabb::of_points(&tool.vertices).diagonal();
    let all = samples.iter().flat_map(PatchSamples::valid);
    let mut rows: Vec<Row> = all.map(|s| Row { delta: s.normal_part, rates: Vec::new() }).collect();
    for colour in 0..colours.iter().map(|c| c + 1).max().unwrap_or(0) {
        let mut shifted = vec![None; tool.vertices.len()];
        let mut shifts = vec![0.0; directions.len()];
        for k in (0..directions.len()).filter(|&k| colours[k] == colour) {
            (shifted[directions[k].vertex], shifts[k]) = (Some(k), step);
        }
        let other = move_vertices(tool, &shifts, directions, options)?;
        let mut rest = &mut rows[..];
        for (k, corners) in tool.corners.iter().enumerate() {
            let (own, after) = rest.split_at_mut(samples[k].valid().count());
            rest = after;
            let mut of_corners = corners.vertices.iter();
            let Some(direction) = of_corners.find_map(|&v| shifted[v as usize]) else { continue };
            for (row, s) in own.iter_mut().zip(samples[k].valid()) {
                let displacement = other.patches[k].derivs(s.eta, s.zeta).s - s.point;
                row.rates.push((direction, s.reference_normal.dot(&displacement) / step));
            }
        }
    }
    Ok(rows)
}
