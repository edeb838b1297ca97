//! Vertices moved along their normals so that the error of the patches around them has two sides.
//!
//! A Nagata patch on an arc stands out of it everywhere: half of that error is taken off by moving its vertices
//! inwards by the other half. With vertex shifts `s` the error at a point of a patch is, to first order,
//! `delta + sum_k N_k(eta, zeta) s_k`, with the bilinear (or linear) weights of its corners; the shifts minimise the
//! sum of its P-th powers over all points, by Newton's method with conjugate gradients.

use crate::audit::sample::PatchSamples;
use crate::audit::{Audit, AuditOptions, CadReference, audit};
use crate::cad::Model;
use crate::convert::{ConvertError, ConvertOptions, edges};
use crate::mesh::mapped::is_flat;
use crate::tool::ToolModel;
use crate::tool::build::{EdgeChoice, build};

use super::{Refined, ToleranceError};

/// Power of the error whose sum is made least: near enough to its largest.
const POWER: i32 = 12;
/// Newton steps.
const STEPS: usize = 60;
/// Times the moved model is audited and corrected.
const ROUNDS: usize = 3;

/// `plain` with its vertices balanced, or as it was when that does not lower its largest error.
///
/// # Errors
/// [`ToleranceError`] when the moved vertices make no tool, which only numbers beyond all bounds do.
pub(super) fn balanced(
    plain: Refined,
    found: Audit,
    model: &Model,
    reference: &CadReference<'_>,
    options: &ConvertOptions,
    audit_options: &AuditOptions,
) -> Result<Refined, ToleranceError> {
    let free = free_vertices(&plain.tool, model);
    let mut shifts = vec![0.0; plain.tool.vertices.len()];
    let (mut best, mut samples) = (plain.clone(), found.samples);
    for _ in 0..ROUNDS {
        let more = least_shifts(&plain.tool, &samples, &free);
        shifts.iter_mut().zip(&more).for_each(|(s, m)| *s += m);
        let tool = moved(&plain.tool, &shifts, options)?;
        let found = audit(&tool, reference, audit_options)?;
        if found.report.worst_mm() >= 0.999 * best.audit.worst_mm() {
            break;
        }
        let moved_mm = shifts.iter().fold(0.0f64, |m, s| m.max(s.abs()));
        best = Refined { tool, report: plain.report.clone(), audit: found.report, moved_mm };
        samples = found.samples;
    }
    Ok(best)
}

/// Vertices that may move: one normal, and no face around that is a plane. A flat stays exactly flat.
fn free_vertices(tool: &ToolModel, model: &Model) -> Vec<bool> {
    let flat: Vec<bool> = model.faces.iter().map(is_flat).collect();
    let mut normal = vec![None; tool.vertices.len()];
    let mut free = vec![true; tool.vertices.len()];
    for p in &tool.corners {
        for (&v, &n) in p.vertices.iter().zip(&p.normals) {
            let v = v as usize;
            free[v] &= *normal[v].get_or_insert(n) == n && !flat[p.face as usize];
        }
    }
    free
}

/// The model with its vertices moved along their normals.
fn moved(
    tool: &ToolModel,
    shifts: &[f64],
    options: &ConvertOptions,
) -> Result<ToolModel, ConvertError> {
    let mut vertices = tool.vertices.clone();
    let mut done = vec![false; vertices.len()];
    for p in &tool.corners {
        for (&v, &n) in p.vertices.iter().zip(&p.normals) {
            let v = v as usize;
            if !std::mem::replace(&mut done[v], true) {
                vertices[v] += tool.normals[n as usize] * shifts[v];
            }
        }
    }
    let given = edges::moved(tool, &vertices);
    let (normals, corners) = (tool.normals.clone(), tool.corners.clone());
    let choice = EdgeChoice { rule: options.edges, given };
    let (tool, _) = build(tool.name.clone(), tool.kind, vertices, normals, corners, choice)?;
    Ok(tool)
}

/// A point's error and the weights of the vertices that move it.
struct Row {
    delta: f64,
    weights: [(usize, f64); 4],
}

fn rows(tool: &ToolModel, samples: &[PatchSamples], free: &[bool]) -> Vec<Row> {
    let mut rows = Vec::new();
    for (corners, grid) in tool.corners.iter().zip(samples) {
        if corners.vertices.iter().all(|&v| !free[v as usize]) {
            continue;
        }
        for s in grid.valid() {
            let (e, z) = (s.eta, s.zeta);
            let shares = if grid.sides == 3 {
                [1.0 - e, e - z, z, 0.0]
            } else {
                [(1.0 - e) * (1.0 - z), e * (1.0 - z), e * z, (1.0 - e) * z]
            };
            let mut weights = [(0, 0.0); 4];
            for ((slot, &v), w) in weights.iter_mut().zip(&corners.vertices).zip(shares) {
                let v = v as usize;
                *slot = (v, if free[v] { w } else { 0.0 });
            }
            rows.push(Row { delta: s.delta, weights });
        }
    }
    rows
}

/// Shifts that make the sum of `|delta + N s|^P` least.
fn least_shifts(tool: &ToolModel, samples: &[PatchSamples], free: &[bool]) -> Vec<f64> {
    let rows = rows(tool, samples, free);
    let mut shifts = vec![0.0; free.len()];
    let residuals = |shifts: &[f64]| -> Vec<f64> {
        let at = |r: &Row| r.delta + r.weights.iter().map(|&(v, w)| w * shifts[v]).sum::<f64>();
        rows.iter().map(at).collect()
    };
    let value = |r: &[f64], scale: f64| r.iter().map(|x| (x / scale).powi(POWER)).sum::<f64>();
    for _ in 0..STEPS {
        let r = residuals(&shifts);
        let scale = r.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        if scale < 1e-12 {
            break;
        }
        let step = newton_step(&rows, &r, scale, free.len());
        let now = value(&r, scale);
        let mut length = 1.0;
        let next = loop {
            let tried: Vec<f64> = shifts.iter().zip(&step).map(|(s, d)| s + length * d).collect();
            if value(&residuals(&tried), scale) < now {
                break Some(tried);
            }
            length *= 0.5;
            if length < 1e-4 {
                break None;
            }
        };
        let Some(next) = next else { break };
        shifts = next;
    }
    shifts
}

/// Newton's step of the sum of P-th powers: `(P - 1) J' W J d = -J' W r`, `W = |r|^(P - 2)`, by conjugate gradients.
fn newton_step(rows: &[Row], r: &[f64], scale: f64, count: usize) -> Vec<f64> {
    let weight: Vec<f64> = r.iter().map(|x| (x / scale).powi(POWER - 2)).collect();
    let mut gradient = vec![0.0; count];
    // A little stiffness keeps vertices that nothing asks to move where they are.
    let mut diagonal = vec![1e-9; count];
    for ((row, x), w) in rows.iter().zip(r).zip(&weight) {
        for &(v, n) in &row.weights {
            gradient[v] -= w * x * n / f64::from(POWER - 1);
            diagonal[v] += w * n * n;
        }
    }
    let apply = |d: &[f64]| -> Vec<f64> {
        let mut out: Vec<f64> = d.iter().map(|x| 1e-9 * x).collect();
        for (row, w) in rows.iter().zip(&weight) {
            let along: f64 = row.weights.iter().map(|&(v, n)| n * d[v]).sum();
            row.weights.iter().for_each(|&(v, n)| out[v] += w * n * along);
        }
        out
    };
    conjugate_gradients(apply, &gradient, &diagonal)
}

fn conjugate_gradients(
    apply: impl Fn(&[f64]) -> Vec<f64>,
    right: &[f64],
    diagonal: &[f64],
) -> Vec<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let scaled = |r: &[f64]| r.iter().zip(diagonal).map(|(x, d)| x / d).collect::<Vec<f64>>();
    let mut x = vec![0.0; right.len()];
    let mut r = right.to_vec();
    let mut z = scaled(&r);
    let mut p = z.clone();
    let mut rz = dot(&r, &z);
    let end = 1e-6 * rz;
    for _ in 0..200 {
        if rz <= end || rz <= 0.0 {
            break;
        }
        let q = apply(&p);
        let a = rz / dot(&p, &q);
        x.iter_mut().zip(&p).for_each(|(x, p)| *x += a * p);
        r.iter_mut().zip(&q).for_each(|(r, q)| *r -= a * q);
        z = scaled(&r);
        let next = dot(&r, &z);
        let b = next / rz;
        p.iter_mut().zip(&z).for_each(|(p, z)| *p = z + b * *p);
        rz = next;
    }
    x
}
