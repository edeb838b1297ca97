//! Closes loops in the parameter plane: loops winding around a period are cut open along a seam or closed through a
//! pole.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use super::periods::whole_periods;
use super::seam::{OccupiedRanges, Seam, inner_side, points_of};
use super::side::{Path, Side, excludes_interior, signed_area};
use crate::native::Native;
use kanagata_geometry::Vec2;

/// Closed loops of a face in the parameter plane, outer loop first.
///
/// Winding loops are cut open along a seam and joined in pairs or through a pole. A face without loops gets the
/// boundary of its natural range. So does a face with holes only, on a surface without boundary (`is_closed`).
pub(crate) fn closed_loops(
    native: &Native<'_>,
    paths: Vec<Path>,
    left_is_inside: bool,
    is_closed: bool,
) -> Option<Vec<Vec<Side>>> {
    let (mut winding, plain): (Vec<Path>, Vec<Path>) =
        paths.into_iter().partition(|p| p.winding.norm() > 0.0);
    // If no slit lies inside a loop, the face is the region around all loops.
    let is_around = |at: Vec2| !plain.iter().any(|p| surrounds(native, &p.sides, at));
    let slit_outside = plain.iter().find_map(|p| p.on_slit).is_some_and(is_around);
    let plain: Vec<Vec<Side>> = plain.into_iter().map(|p| p.sides).collect();
    let mut cut_open = Vec::new();
    let holes_only = winding.is_empty()
        && is_closed
        && (slit_outside
            || plain.iter().all(|l| excludes_interior(l, left_is_inside) && !has_seam(native, l)));
    while let Some(first) = winding.pop() {
        let partner = winding.iter().position(|p| (p.winding + first.winding).norm() < 1e-9);
        let seam = Seam::new(native, &first, left_is_inside, &plain);
        cut_open.push(match partner {
            Some(k) => bridge(&seam, first, winding.swap_remove(k)),
            None => through_pole(native, &seam, first, left_is_inside)?,
        });
    }
    if holes_only || (cut_open.is_empty() && plain.is_empty()) {
        cut_open.push(natural_border(native, &plain)?);
    }
    let mut loops: Vec<Vec<Side>> = plain.into_iter().chain(cut_open).collect();
    sort_and_orient(native, &mut loops);
    Some(loops)
}

/// Joins two windings of opposite sense to one loop, with a seam traversed in both directions.
fn bridge(seam: &Seam<'_, '_>, first: Path, second: Path) -> Vec<Side> {
    let (first, second) = seam.of_two(&first, &second).unwrap_or((first, second));
    let (Some(end), Some(start)) = (first.sides.last(), second.sides.first()) else {
        return first.sides;
    };
    let shift = seam.shift(end.end(), start.start());
    let second: Vec<Side> = second.sides.iter().map(|s| s.shifted(shift)).collect();
    let there = Side::straight(end.end(), second[0].start());
    let back = Side::straight(second[second.len() - 1].end(), first.sides[0].start());
    let mut sides = first.sides;
    sides.push(there);
    sides.extend(second);
    sides.push(back);
    sides
}

/// Closes a single winding through the pole on its inner side.
fn through_pole(
    native: &Native<'_>,
    seam: &Seam<'_, '_>,
    path: Path,
    left_is_inside: bool,
) -> Option<Vec<Side>> {
    let path = seam.of_one(&path).unwrap_or(path);
    let (around, up) = inner_side(&path, left_is_inside);
    let across = 1 - around;
    let level = path.sides.first()?.start()[across];
    let poles: Vec<f64> =
        native.poles().into_iter().filter(|p| p.0 == across).map(|p| p.1).collect();
    let beyond = |p: &&f64| if up { **p > level } else { **p < level };
    let nearest = |a: &&f64, b: &&f64| (*a - level).abs().total_cmp(&(*b - level).abs());
    let pole = poles.iter().filter(beyond).min_by(nearest).or(poles.iter().min_by(nearest))?;
    let (end, start) = (path.sides.last()?.end(), path.sides.first()?.start());
    let at = |uv: Vec2| {
        let mut out = uv;
        out[across] = *pole;
        out
    };
    let mut sides = path.sides;
    sides.push(Side::straight(end, at(end)));
    sides.push(Side::straight(at(end), at(start)));
    sides.push(Side::straight(at(start), start));
    Some(sides)
}

/// True for a loop that traverses the surface's seam in both directions, one period apart. The face contains the seam
/// and lies within the loop in the parameter plane for either orientation (kernels write bands of tori with both).
fn has_seam(native: &Native<'_>, sides: &[Side]) -> bool {
    let mut first: BTreeMap<usize, &Side> = BTreeMap::new();
    sides.iter().any(|side| {
        let before = side.edge_id.and_then(|id| match first.entry(id) {
            Entry::Occupied(before) => Some(*before.get()),
            Entry::Vacant(free) => {
                free.insert(side);
                None
            }
        });
        before.is_some_and(|b| whole_periods(native, b.start() - side.end()).norm() > 0.0)
    })
}

/// True when a loop encloses a point, or an equivalent point whole periods away, in the parameter plane.
fn surrounds(native: &Native<'_>, sides: &[Side], at: Vec2) -> bool {
    let border: Vec<Vec2> = sides.iter().flat_map(points_of).collect();
    let near = at + whole_periods(native, middle(sides) - at);
    let steps = |k: usize| native.periods()[k].map_or(vec![0.0], |p| vec![-p, 0.0, p]);
    let crosses = |p: Vec2, [a, b]: [Vec2; 2]| {
        (a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y)
    };
    let is_within = |p: Vec2| {
        let next = |k: usize| border[(k + 1) % border.len()];
        (0..border.len()).filter(|&k| crosses(p, [border[k], next(k)])).count() % 2 == 1
    };
    steps(0).iter().any(|&u| steps(1).iter().any(|&v| is_within(near + Vec2::new(u, v))))
}

/// Boundary of the natural range, with its seams opposite the first loop, or where no loop lies.
fn natural_border(native: &Native<'_>, loops: &[Vec<Side>]) -> Option<Vec<Side>> {
    let mut ranges = native.natural_range()?;
    for (k, (range, period)) in ranges.iter_mut().zip(native.periods()).enumerate() {
        let (Some(p), Some(first)) = (period, loops.first()) else { continue };
        let (occupied, opposite) = (OccupiedRanges::new(loops, k, p), middle(first)[k] - 0.5 * p);
        let gap = || occupied.gaps(std::iter::empty()).first().copied().unwrap_or(opposite);
        let begin = if occupied.has(opposite) { gap() } else { opposite };
        *range = [begin, begin + p];
    }
    let [u, v] = ranges;
    let corners =
        [(u[0], v[0]), (u[1], v[0]), (u[1], v[1]), (u[0], v[1])].map(|(x, y)| Vec2::new(x, y));
    Some((0..4).map(|k| Side::straight(corners[k], corners[(k + 1) % 4])).collect())
}

/// Centre of a loop's bounding box in the parameter plane.
fn middle(sides: &[Side]) -> Vec2 {
    let points = sides.iter().flat_map(|s| s.path.points());
    let (low, high) = points
        .fold((Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY)), |(low, high), p| {
            (low.inf(p), high.sup(p))
        });
    0.5 * (low + high)
}

/// Puts the largest loop first, counter-clockwise, and the others clockwise, shifted into its period.
fn sort_and_orient(native: &Native<'_>, loops: &mut [Vec<Side>]) {
    let mut areas: Vec<f64> = loops.iter().map(|l| signed_area(l)).collect();
    let outer = (0..loops.len()).max_by(|&a, &b| areas[a].abs().total_cmp(&areas[b].abs()));
    if let Some(outer) = outer {
        loops.swap(0, outer);
        areas.swap(0, outer);
    }
    for (k, sides) in loops.iter_mut().enumerate() {
        if (areas[k] > 0.0) != (k == 0) {
            sides.reverse();
            sides.iter_mut().for_each(|s| *s = s.reversed());
        }
    }
    let Some((outer, holes)) = loops.split_first_mut() else { return };
    for hole in holes {
        let shift = whole_periods(native, middle(outer) - middle(hole));
        hole.iter_mut().for_each(|s| *s = s.shifted(shift));
    }
}
