//! Spline approximation of an offset surface: adaptive bisection and interpolation.

use super::budget::{BYTES_PER_PATCH, Fineness, PATCHES_BASE, breaks_of};
use kanagata_geometry::nurbs::{Curve3, Surface};
use kanagata_geometry::{Vec2, Vec3};

/// Degree of fitted patches in each direction.
const DEGREE: usize = 5;
/// Maximum bisection depth of a fitted patch.
const BISECTION_DEPTH_MAX: u32 = 7;

/// Midpoints of the strips of direction `k` in which lines along that direction exceed the tolerance.
fn cells_to_halve(
    at: &dyn Fn(f64, f64) -> Vec3,
    breaks: &[Vec<f64>; 2],
    k: usize,
    tolerance: f64,
) -> Vec<f64> {
    let line = |s: f64, t: f64| if k == 0 { at(s, t) } else { at(t, s) };
    let follows = |w: &[f64], t: f64| {
        let piece = Curve3::through(&|s| line(s, t), w[0], w[1]);
        [0.05, 0.35, 0.65, 0.95].into_iter().all(|x| {
            let s = w[0] + (w[1] - w[0]) * x;
            (piece.point(s) - line(s, t)).norm() <= tolerance
        })
    };
    let across: Vec<f64> = breaks[1 - k]
        .windows(2)
        .flat_map(|w| [0.2, 0.7].map(|x| w[0] + (w[1] - w[0]) * x))
        .collect();
    let open = breaks[k].windows(2).filter(|w| !across.iter().all(|&t| follows(w, t)));
    open.map(|w| 0.5 * (w[0] + w[1])).collect()
}

/// The spline that interpolates the surface at its nodes in each cell.
fn through_points(
    at: &dyn Fn(f64, f64) -> Vec3,
    breaks: &[Vec<f64>; 2],
) -> Result<Surface, String> {
    // Control points along v at every node of u, then interpolation along u.
    let nodes: Vec<f64> = breaks[0]
        .windows(2)
        .enumerate()
        .flat_map(|(i, w)| {
            let own = Curve3::nodes_between(w[0], w[1]);
            own.into_iter().skip(usize::from(i > 0))
        })
        .collect();
    let rows: Vec<Vec<Vec3>> = nodes.iter().map(|&u| controls(&|v| at(u, v), &breaks[1])).collect();
    let count_v = rows.first().map_or(0, Vec::len);
    let mut points = vec![Vec3::zeros(); nodes.len() * count_v];
    for j in 0..count_v {
        for (cell, w) in breaks[0].windows(2).enumerate() {
            let values: [Vec3; DEGREE + 1] = std::array::from_fn(|i| rows[cell * DEGREE + i][j]);
            let column = Curve3::through_values(&values, w[0], w[1]);
            for (i, p) in column.points().iter().enumerate() {
                points[(cell * DEGREE + i) * count_v + j] = *p;
            }
        }
    }
    let knots = breaks.clone().map(|b| {
        let mut out = vec![b[0]; DEGREE + 1];
        b[1..].iter().for_each(|&t| out.extend([t; DEGREE]));
        out.push(b[b.len() - 1]);
        out
    });
    Surface::try_new([DEGREE; 2], knots, points, None).map_err(|e| format!("offset surface: {e}"))
}

/// Control points of a curve that interpolates `at` at its nodes in each cell.
fn controls(at: &dyn Fn(f64) -> Vec3, breaks: &[f64]) -> Vec<Vec3> {
    let mut out = Vec::new();
    for (i, w) in breaks.windows(2).enumerate() {
        let piece = Curve3::through(at, w[0], w[1]);
        out.extend(piece.points().iter().skip(usize::from(i > 0)));
    }
    out
}

/// Offset of a spline surface: biquintic patches over its spans, bisected until the tolerance is met.
pub(super) fn offset_spline(
    base: &Surface,
    distance: f64,
    tolerance: f64,
    fineness: &mut Fineness,
) -> Result<Surface, String> {
    let at = |u: f64, v: f64| {
        let uv = Vec2::new(u, v);
        base.point(uv) + base.normal(uv).unwrap_or_else(Vec3::zeros) * distance
    };
    let mut breaks = spans_to_fit(base, fineness.max_patches)?;
    for _ in 0..BISECTION_DEPTH_MAX {
        let split = [0, 1].map(|k| cells_to_halve(&at, &breaks, k, tolerance));
        if split.iter().all(Vec::is_empty) {
            break;
        }
        let [u, v] = [0, 1].map(|k| breaks[k].len() - 1 + split[k].len());
        if u * v > fineness.max_patches {
            fineness.coarse = true;
            break;
        }
        for (list, more) in breaks.iter_mut().zip(split) {
            list.extend(more);
            list.sort_by(f64::total_cmp);
        }
    }
    through_points(&at, &breaks)
}

/// Span boundaries of a spline surface to be offset, at most `limit` spans.
fn spans_to_fit(base: &Surface, limit: usize) -> Result<[Vec<f64>; 2], String> {
    let domain = base.domain();
    let breaks = [0, 1].map(|k| breaks_of(base.knots()[k], domain[k]));
    let middle = |r: [f64; 2]| 0.5 * (r[0] + r[1]);
    if base.normal(Vec2::new(middle(domain[0]), middle(domain[1]))).is_none() {
        return Err("an offset of a surface that has no normal".into());
    }
    let spans = (breaks[0].len() - 1) * (breaks[1].len() - 1);
    if spans > limit {
        return Err(format!(
            "an offset of a surface of {spans} spans; allowed: {limit} here (all offsets of a file together: {PATCHES_BASE}, \
             and one for every {BYTES_PER_PATCH} bytes)"
        ));
    }
    Ok(breaks)
}
