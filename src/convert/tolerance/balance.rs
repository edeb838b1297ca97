//! Vertices moved along their normals (on a crease with a flat: within it) so that the error of the patches around them has two sides.
//!
//! A Nagata patch on an arc stands out of it everywhere: half of that error is taken off by moving its vertices
//! inwards by the other half. With vertex shifts `s` the error at a point of a patch is, to first order,
//! `delta + sum_k N_k(eta, zeta) s_k`, with the bilinear (or linear) weights of its corners; the shifts minimise the
//! sum of its P-th powers over all points, by Newton's method with conjugate gradients.

use crate::audit::sample::PatchSamples;
use crate::audit::{Audit, AuditOptions, audit};
use crate::cad::Model;
use crate::convert::{ConvertError, ConvertOptions, edges};
use crate::geometry::Vec3;
use crate::mesh::mapped::is_flat;
use crate::tool::ToolModel;
use crate::tool::build::{EdgeChoice, build};

use super::work::Work;
use super::{Refined, ToleranceError};

/// Power of the error whose sum is made least: near enough to its largest.
const POWER: i32 = 12;
/// Newton steps.
const STEPS: usize = 60;
/// Times the moved model is audited and corrected.
const ROUNDS: usize = 3;
/// Least sine of the angle between a curved face and a flat on whose crease a vertex moves.
const STEEPEST: f64 = 0.5;

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
    let mut shifts = vec![0.0; plain.tool.vertices.len()];
    let (mut best, mut samples) = (plain.clone(), found.samples);
    for _ in 0..ROUNDS {
        let more = least_shifts(&plain.tool, &samples, &ways);
        shifts.iter_mut().zip(&more).for_each(|(s, m)| *s += m);
        let tool = moved(&plain.tool, &shifts, &ways, options)?;
        let found = audit(&tool, work.reference, audit_options)?;
        if found.report.worst_mm() >= 0.999 * best.audit.worst_mm() {
            break;
        }
        let moved_mm = shifts.iter().fold(0.0f64, |m, s| m.max(s.abs()));
        let (report, audit) = (plain.report.clone(), found.report);
        best = Refined { tool, report, audit, moved_mm, borders: plain.borders };
        samples = found.samples;
    }
    Ok(best)
}

/// What faces ask of a vertex: normals of flats around it, and that of its curved faces.
#[derive(Default)]
struct Asked {
    flats: Vec<u32>,
    curved: Option<u32>,
    /// Curved faces meet in a crease.
    several: bool,
}

/// The direction each vertex may move along, if any: the normal of its curved faces, as far as that lies within the flats
/// around it. A flat stays exactly flat; its border on a crease follows the curved face. The model's faces have numbers
/// from `first` on.
fn ways(tool: &ToolModel, model: &Model, first: u32) -> Vec<Option<Vec3>> {
    let flat: Vec<bool> = model.faces.iter().map(is_flat).collect();
    let mut asked: Vec<Asked> = Vec::new();
    asked.resize_with(tool.vertices.len(), Asked::default);
    for p in &tool.corners {
        for (&v, &n) in p.vertices.iter().zip(&p.normals) {
            let vertex = &mut asked[v as usize];
            if flat[(p.face - first) as usize] {
                vertex.flats.push(n);
            } else {
                vertex.several |= *vertex.curved.get_or_insert(n) != n;
            }
        }
    }
    asked.iter().map(|vertex| way(vertex, &tool.normals)).collect()
}

fn way(asked: &Asked, normals: &[Vec3]) -> Option<Vec3> {
    let normal = asked.curved.filter(|_| !asked.several).map(|n| normals[n as usize])?;
    let mut flats: Vec<Vec3> = Vec::new();
    for &n in &asked.flats {
        let n = normals[n as usize];
        let rest = flats.iter().fold(n, |rest, f| rest - f * f.dot(&rest));
        // Flats that are nearly one leave a direction that rounding picks.
        if rest.norm() > 1e-3 {
            flats.push(rest.normalize());
        }
    }
    let rest = flats.iter().fold(normal, |rest, f| rest - f * f.dot(&rest));
    (rest.norm() >= STEEPEST).then(|| rest.normalize())
}

/// The model with its vertices moved along their ways.
fn moved(
    tool: &ToolModel,
    shifts: &[f64],
    ways: &[Option<Vec3>],
    options: &ConvertOptions,
) -> Result<ToolModel, ConvertError> {
    let ends = tool.vertices.iter().zip(ways).zip(shifts);
    let vertices: Vec<Vec3> =
        ends.map(|((x, way), s)| way.map_or(*x, |way| x + way * *s)).collect();
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

fn rows(tool: &ToolModel, samples: &[PatchSamples], ways: &[Option<Vec3>]) -> Vec<Row> {
    let mut rows = Vec::new();
    for (corners, grid) in tool.corners.iter().zip(samples) {
        // How far the patch moves along its normal with each of its vertices.
        let ends = corners.vertices.iter().zip(&corners.normals);
        let rates: Vec<f64> = ends
            .map(|(&v, &n)| ways[v as usize].map_or(0.0, |w| w.dot(&tool.normals[n as usize])))
            .collect();
        if rates.iter().all(|r| r.abs() < 1e-9) {
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
            let slots = weights.iter_mut().zip(&corners.vertices).zip(&rates).zip(shares);
            slots.for_each(|(((slot, &v), rate), w)| *slot = (v as usize, w * rate));
            rows.push(Row { delta: s.delta, weights });
        }
    }
    rows
}

/// Shifts that make the sum of `|delta + N s|^P` least.
fn least_shifts(tool: &ToolModel, samples: &[PatchSamples], ways: &[Option<Vec3>]) -> Vec<f64> {
    let rows = rows(tool, samples, ways);
    let mut shifts = vec![0.0; ways.len()];
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
        let step = newton_step(&rows, &r, scale, ways.len());
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
