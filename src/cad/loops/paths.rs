//! Reads the edges of a loop as sides joined end to start.

use super::periods::{collapsed_direction, is_pole, one_turn, turns, whole_periods};
use super::project::side_of;
use super::side::{LoopFault, Path, Side, excludes_interior, signed_area};
use super::slits;
use crate::native::Native;
use crate::raw::{RawEdge, RawLoop};
use kanagata_geometry::nurbs::Curve3;
use kanagata_geometry::{Vec2, Vec3};

/// Reads one loop as a path, or several where slits connect them. `size` is the extent of the face [mm]; points within
/// `tolerance` [mm] coincide.
pub(crate) fn paths_of(
    native: &Native<'_>,
    raw: &RawLoop,
    (size, tolerance): (f64, f64),
    left_is_inside: bool,
    faults: &mut Vec<LoopFault>,
) -> Vec<Path> {
    let Some(path) = path_of(native, raw, (size, tolerance), left_is_inside, faults) else {
        return Vec::new();
    };
    slits::without_slits(native, &path.sides, tolerance).unwrap_or_else(|| vec![path])
}

fn path_of(
    native: &Native<'_>,
    raw: &RawLoop,
    (size, tolerance): (f64, f64),
    left_is_inside: bool,
    faults: &mut Vec<LoopFault>,
) -> Option<Path> {
    let mut found_faults = Vec::new();
    let limits = (size, tolerance);
    let path = path_from(native, raw, limits, (None, left_is_inside), &mut found_faults)?;
    let elsewhere = start_on_other_sheet(native, &path, tolerance);
    if let Some(end) = elsewhere {
        let mut again = Vec::new();
        let other = path_from(native, raw, limits, (Some(end), left_is_inside), &mut again);
        if let Some(other) = other.filter(|o| start_on_other_sheet(native, o, tolerance).is_none())
        {
            faults.extend(again);
            return Some(other);
        }
    }
    faults.extend(found_faults);
    Some(path)
}

/// End of a loop whose first side begins at the same point but at other parameters, unexplained by periods. On a
/// self-overlapping surface (a profile revolved about an axis that it crosses) the first side may be on either sheet.
fn start_on_other_sheet(native: &Native<'_>, path: &Path, tolerance: f64) -> Option<Vec2> {
    let last =
        path.sides.last().filter(|s| s.curve.is_none() && native.is_inverted_iteratively())?;
    let (end, start) = (last.start(), last.end());
    let one_place = (native.point(end) - native.point(start)).norm() <= tolerance;
    let middle = native.point(0.5 * (end + start));
    let apart = (middle - native.point(start)).norm() > 10.0 * tolerance;
    (one_place && apart && native.is_regular(end) && native.is_regular(start)).then_some(end)
}

/// Reads one loop; its first side starts at `begin`, if known.
fn path_from(
    native: &Native<'_>,
    raw: &RawLoop,
    (size, tolerance): (f64, f64),
    (begin, left_is_inside): (Option<Vec2>, bool),
    faults: &mut Vec<LoopFault>,
) -> Option<Path> {
    let (mut sides, behind_pole) = joined_sides(native, raw, (size, tolerance), begin, faults);
    let (first, last) = (sides.first()?.start(), sides.last()?.end());
    let winding = match behind_pole {
        Some(k) => {
            determine_turn(native, &mut sides, k, left_is_inside, tolerance);
            Vec2::zeros()
        }
        None => turns(native, first, last, tolerance),
    };
    let last = sides.last()?.end();
    let gap = last - first - winding;
    if gap.norm() > 0.0 {
        close(native, &mut sides, first + winding, tolerance, faults);
    }
    Some(Path { sides, winding, on_slit: None })
}

/// Sides of a loop, each starting at the end of its predecessor, and the index of the first one after the last pole on
/// the loop.
fn joined_sides(
    native: &Native<'_>,
    raw: &RawLoop,
    (size, tolerance): (f64, f64),
    begin: Option<Vec2>,
    faults: &mut Vec<LoopFault>,
) -> (Vec<Side>, Option<usize>) {
    let mut sides: Vec<Side> = Vec::with_capacity(raw.edges.len());
    let mut behind_pole = None;
    for edge in &cut_at_poles(native, &raw.edges, tolerance) {
        let before = sides.last().map(Side::end).or(begin);
        let after = before.filter(|&uv| !is_pole(native, uv, tolerance));
        let Some(side) = side_of(native, edge, (size, tolerance), after, faults) else {
            faults.push(LoopFault::NoCurve);
            continue;
        };
        let Some(end) = sides.last().map(Side::end) else {
            sides.push(side);
            continue;
        };
        let pole = collapsed_direction(native, end, tolerance);
        let side = after_pole(native, &side, end, pole);
        if pole.is_some() && is_pole(native, side.start(), tolerance) {
            // Insert a side even if it has zero length: its turn about the pole is determined at the end.
            sides.push(Side::straight(end, side.start()));
            behind_pole = Some(sides.len());
            sides.push(side);
        } else {
            sides.extend(join(native, end, side, tolerance, faults));
        }
    }
    (sides, behind_pole)
}

/// A side shifted by whole periods to start at `end`; at a pole not along the collapsed direction.
fn after_pole(native: &Native<'_>, side: &Side, end: Vec2, collapsed: Option<usize>) -> Side {
    let Some(k) = collapsed else { return align(native, side, end) };
    let mut shift = whole_periods(native, end - side.start());
    shift[k] = 0.0;
    side.shifted(shift)
}

/// Determines the turn about the last pole, side `k - 1`, which may be wrong by a full turn: then the loop winds,
/// retraces itself, or has the face on the wrong side.
fn determine_turn(
    native: &Native<'_>,
    sides: &mut [Side],
    k: usize,
    left_is_inside: bool,
    tolerance: f64,
) {
    let (Some(first), Some(last)) = (sides.first(), sides.last()) else { return };
    let (first, last) = (first.start(), last.end());
    let ends_at_pole = is_pole(native, first, tolerance) && is_pole(native, last, tolerance);
    let off = match ends_at_pole {
        true if retraces_itself(sides) => one_turn(native, last),
        true if excludes_interior(sides, left_is_inside) => {
            let turn = one_turn(native, last);
            let right = [turn, -turn].into_iter().find(|&off| {
                let mut turned = sides.to_vec();
                shift_after(&mut turned, k, off);
                !excludes_interior(&turned, left_is_inside)
            });
            right.unwrap_or_else(Vec2::zeros)
        }
        true => Vec2::zeros(),
        false => whole_periods(native, last - first),
    };
    if off.norm() > 0.0 {
        shift_after(sides, k, off);
    }
}

/// Shifts all sides from `k` on by `-off`; side `k - 1` compensates.
fn shift_after(sides: &mut [Side], k: usize, off: Vec2) {
    let (before, after) = sides.split_at_mut(k);
    after.iter_mut().for_each(|s| *s = s.shifted(-off));
    before[k - 1] = Side::straight(before[k - 1].start(), before[k - 1].end() - off);
}

/// True for a loop of zero area: both passes along a seam have the same parameters.
fn retraces_itself(sides: &[Side]) -> bool {
    let extent = sides.iter().fold(0.0, |m: f64, s| m.max((s.end() - s.start()).norm()));
    signed_area(sides).abs() <= 1e-6 * extent * extent
}

/// Splits edges at the poles of the surface, where their parameter curves are discontinuous.
fn cut_at_poles(native: &Native<'_>, edges: &[RawEdge], tolerance: f64) -> Vec<RawEdge> {
    let poles = native.pole_points();
    let mut out = Vec::with_capacity(edges.len());
    for edge in edges {
        let cuts = edge.curve.as_ref().map_or_else(Vec::new, |c| inner_hits(c, &poles, tolerance));
        let Some(curve) = edge.curve.as_ref().filter(|_| !cuts.is_empty()) else {
            out.push(edge.clone());
            continue;
        };
        let [a, b] = curve.domain();
        let bounds = [vec![a], cuts, vec![b]].concat();
        let parts = bounds.windows(2).filter_map(|w| curve.trimmed(w[0], w[1]).ok());
        out.extend(parts.map(|part| RawEdge { curve: Some(part), ..RawEdge::default() }));
    }
    out
}

/// Parameters at which a curve passes through points other than its ends, increasing.
fn inner_hits(curve: &Curve3, points: &[Vec3], tolerance: f64) -> Vec<f64> {
    let [a, b] = curve.domain();
    let (first, last) = (curve.point(a), curve.point(b));
    let far = |p: &&Vec3| (*p - first).norm().min((*p - last).norm()) > 10.0 * tolerance;
    let hit = |p: &Vec3| {
        let (t, d) = curve.closest(p);
        (d.sqrt() <= tolerance && t > a && t < b).then_some(t)
    };
    let mut cuts: Vec<f64> = points.iter().filter(far).filter_map(hit).collect();
    cuts.sort_by(f64::total_cmp);
    cuts.dedup_by(|x, y| *x - *y <= 1e-9 * (b - a));
    cuts
}

fn align(native: &Native<'_>, side: &Side, end: Vec2) -> Side {
    side.shifted(whole_periods(native, end - side.start()))
}

/// The side that continues from `end`: moved onto it, or preceded by a straight side across a pole or gap.
fn join(
    native: &Native<'_>,
    end: Vec2,
    side: Side,
    tolerance: f64,
    faults: &mut Vec<LoopFault>,
) -> Vec<Side> {
    let start = side.start();
    let gap = (native.point(end) - native.point(start)).norm();
    let middle = native.point(0.5 * (end + start));
    let bulge = (middle - native.point(start)).norm().max((middle - native.point(end)).norm());
    if gap <= tolerance && bulge <= 10.0 * tolerance {
        if (end - start).norm() > 1e-6 * (side.end() - start).norm() {
            // A pole: one point in space, a side in the parameter plane.
            return vec![Side::straight(end, start), side];
        }
        return vec![Side { path: side.path.with_start(end), ..side }];
    }
    if gap > 10.0 * tolerance {
        faults.push(LoopFault::Gap(gap));
    }
    vec![Side::straight(end, start), side]
}

fn close(
    native: &Native<'_>,
    sides: &mut Vec<Side>,
    target: Vec2,
    tolerance: f64,
    faults: &mut Vec<LoopFault>,
) {
    let Some(last) = sides.last_mut() else { return };
    let end = last.end();
    let gap = (native.point(end) - native.point(target)).norm();
    let small = (end - target).norm() <= 1e-6 * (end - last.start()).norm();
    if gap <= tolerance && small {
        last.path = last.path.with_end(target);
        return;
    }
    if gap > 10.0 * tolerance {
        faults.push(LoopFault::Gap(gap));
    }
    sides.push(Side::straight(end, target));
}
