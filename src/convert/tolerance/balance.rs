//! Vertices moved along their normals (on a crease with a flat: within it) so that the error of the patches around them has two sides.
//!
//! A Nagata patch on an arc stands out of it everywhere: half of that error is taken off by moving its vertices
//! inwards by the other half. Between a flat and another one a fillet's vertices slide within these ([`super::vertex_directions`]): the
//! curve is longer and passes nearer to the arc, one patch over 90 degrees to within 0.011 instead of 0.061 radii. The error at a
//! point of a patch is, to first order, `delta + sum_k N_k s_k` in the shifts `s`; [`super::minimax`] finds those that make it least.

use std::collections::BTreeSet;

use crate::audit::sample::PatchSamples;
use crate::audit::{Audit, AuditOptions, audit};
use crate::convert::{ConvertError, ConvertOptions, edges};
use crate::geometry::Aabb;
use crate::tool::build::{EdgeChoice, build};
use crate::tool::{ToolModel, side};

use super::error::ToleranceError;
use super::goal::Refined;
use super::minimax::{Row, least_shifts};
use super::scope::Work;
use super::vertex_directions::{Way, ways};

/// Patches of a model whose errors are followed as far as they fall.
const FEW: usize = 500;
/// Times such a model is audited and corrected: errors are not linear in slides.
const ROUNDS: usize = 8;
/// The same for others.
const STRAIGHT: usize = 3;
/// Share of a step below which no shorter one is tried.
const SHORTEST: f64 = 0.25;
/// Share of the error before below which it is worth another round.
const LESS: f64 = 0.995;
/// Share by which a slide is made shorter first where a patch turns over; twice as much each time.
const FIRST_CUT: f64 = 2e-3;

/// `plain` with its vertices balanced, or as it was when that does not lower its largest error.
///
/// # Errors
/// [`ToleranceError`] when the moved vertices make no tool, which only numbers beyond all bounds do.
pub(super) fn balanced(
    plain: Refined,
    found: Audit,
    work: &Work<'_>,
    options: &ConvertOptions,
    audit_options: &AuditOptions,
) -> Result<Refined, ToleranceError> {
    let ways = ways(&plain.tool, work.plan.model(), work.first);
    let mut shifts = vec![0.0; ways.len()];
    let (mut best, mut samples) = (plain.clone(), found.samples);
    let mut length = 1.0;
    let mut step: Option<Vec<f64>> = None;
    let few = plain.tool.patches.len() <= FEW;
    for _ in 0..if few { ROUNDS } else { STRAIGHT } {
        let more = match step.take() {
            Some(step) => step,
            None => least_shifts(&rows(&best.tool, &samples, &ways, options)?, &shifts, &ways),
        };
        let mut tried: Vec<f64> = shifts.iter().zip(&more).map(|(s, m)| s + length * m).collect();
        let tool = unfolded(&plain.tool, &mut tried, &ways, options)?;
        let found = audit(&tool, work.reference, audit_options)?;
        let folds = found.report.folded.len() > plain.audit.folded.len();
        if folds || found.report.worst_mm() >= best.audit.worst_mm() {
            if length <= SHORTEST || !few {
                break;
            }
            (length, step) = (0.5 * length, Some(more));
            continue;
        }
        length = (2.0 * length).min(1.0);
        let enough = found.report.worst_mm() > LESS * best.audit.worst_mm();
        let [moved_mm, slid_mm] = [false, true].map(|slides| farthest(&ways, &tried, slides));
        best = Refined { tool, audit: found.report, moved_mm, slid_mm, ..best };
        (samples, shifts) = (found.samples, tried);
        if enough {
            break;
        }
    }
    Ok(best)
}

/// The largest shift of a way that slides, or of one that does not [mm].
fn farthest(ways: &[Way], shifts: &[f64], slides: bool) -> f64 {
    let of = ways.iter().zip(shifts).filter(|(way, _)| way.slides == slides);
    of.fold(0.0, |most, (_, shift)| most.max(shift.abs()))
}

/// The model with its vertices moved by `shifts`; slides of vertices at which a patch turns over are made shorter.
fn unfolded(
    tool: &ToolModel,
    shifts: &mut [f64],
    ways: &[Way],
    options: &ConvertOptions,
) -> Result<ToolModel, ConvertError> {
    let mut shorter = FIRST_CUT;
    loop {
        let found = moved(tool, shifts, ways, options)?;
        let turned = turned_corners(&found);
        let slid = |way: &Way, shift: f64| {
            way.slides && shift != 0.0 && turned.contains(&(way.vertex as u32))
        };
        let mut any = false;
        for (way, shift) in ways.iter().zip(shifts.iter_mut()) {
            if slid(way, *shift) {
                *shift *= 1.0 - shorter;
                any = true;
            }
        }
        if !any {
            return Ok(found);
        }
        shorter = (2.0 * shorter).min(1.0);
    }
}

/// Vertices at which a patch turns over, against its normal there.
fn turned_corners(tool: &ToolModel) -> BTreeSet<u32> {
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

/// The model with its vertices moved along their ways.
fn moved(
    tool: &ToolModel,
    shifts: &[f64],
    ways: &[Way],
    options: &ConvertOptions,
) -> Result<ToolModel, ConvertError> {
    let mut vertices = tool.vertices.clone();
    ways.iter().zip(shifts).for_each(|(way, s)| vertices[way.vertex] += way.direction * *s);
    let given = edges::moved(tool, &vertices);
    let (normals, corners) = (tool.normals.clone(), tool.corners.clone());
    let choice = EdgeChoice { rule: options.edges, given };
    let (tool, _) = build(tool.name.clone(), tool.kind, vertices, normals, corners, choice)?;
    Ok(tool)
}

/// A colour for each way: no two of one colour are on the same patch.
fn colours(tool: &ToolModel, ways: &[Way]) -> Vec<usize> {
    let mut at = vec![Vec::new(); tool.vertices.len()];
    ways.iter().enumerate().for_each(|(k, way)| at[way.vertex].push(k));
    let mut beside = vec![Vec::new(); tool.vertices.len()];
    for p in &tool.corners {
        p.vertices.iter().for_each(|&v| beside[v as usize].extend_from_slice(&p.vertices));
    }
    let mut colours = vec![usize::MAX; ways.len()];
    for (k, way) in ways.iter().enumerate() {
        let near = || beside[way.vertex].iter().flat_map(|&v| &at[v as usize]);
        colours[k] = (0..).find(|&c| near().all(|&other| colours[other] != c)).unwrap_or(0);
    }
    colours
}

/// How far each point of the patches moves off the CAD with each way: patches depend on their vertices linearly, so
/// that one small step of all ways of a colour tells.
pub(super) fn rows(
    tool: &ToolModel,
    samples: &[PatchSamples],
    ways: &[Way],
    options: &ConvertOptions,
) -> Result<Vec<Row>, ConvertError> {
    let colours = colours(tool, ways);
    let step = 1e-6 * Aabb::of_points(&tool.vertices).diagonal();
    let all = samples.iter().flat_map(PatchSamples::valid);
    let mut rows: Vec<Row> = all.map(|s| Row { delta: s.normal_part, rates: Vec::new() }).collect();
    for colour in 0..colours.iter().map(|c| c + 1).max().unwrap_or(0) {
        let mut of = vec![None; tool.vertices.len()];
        let mut shifts = vec![0.0; ways.len()];
        for k in (0..ways.len()).filter(|&k| colours[k] == colour) {
            (of[ways[k].vertex], shifts[k]) = (Some(k), step);
        }
        let other = moved(tool, &shifts, ways, options)?;
        let mut rest = &mut rows[..];
        for (k, corners) in tool.corners.iter().enumerate() {
            let (own, after) = rest.split_at_mut(samples[k].valid().count());
            rest = after;
            let Some(way) = corners.vertices.iter().find_map(|&v| of[v as usize]) else { continue };
            for (row, s) in own.iter_mut().zip(samples[k].valid()) {
                let moved = other.patches[k].derivs(s.eta, s.zeta).s - s.point;
                row.rates.push((way, s.reference_normal.dot(&moved) / step));
            }
        }
    }
    Ok(rows)
}
