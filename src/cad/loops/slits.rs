//! Slits: parts of a loop on a closed surface traversed in both directions, between holes or to poles. Kernels connect
//! the single loop of a face along its seam in this manner; the face lies on both sides.

use super::periods::{collapsed_direction, turns, whole_periods};
use super::side::{Path, Side};
use crate::native::Native;
use kanagata_geometry::Vec2;

/// Distance between two passes along a curve, relative to their length in the parameter plane, below which they
/// coincide. Passes along a seam are one period apart.
const COINCIDENCE_TOLERANCE_REL: f64 = 1e-3;
/// Maximum number of sides of a loop searched for slits, because every side is compared with all others.
const SIDES_MAX: usize = 1000;

/// The loops that remain after removing the slits of a loop, each with a point on a slit. `None` for a loop without
/// slits, one that consists of slits only, one with too many sides, or one through a single pole (its turn there
/// follows from its end).
pub(super) fn without_slits(
    native: &Native<'_>,
    sides: &[Side],
    tolerance: f64,
) -> Option<Vec<Path>> {
    let from_pole = |s: &&Side| {
        s.curve.is_some() && collapsed_direction(native, s.start(), tolerance).is_some()
    };
    if !native.has_no_boundary()
        || sides.len() > SIDES_MAX
        || sides.iter().filter(from_pole).count() == 1
    {
        return None;
    }
    let mut slits = Vec::new();
    let loops = parts(native, sides.to_vec(), tolerance, &mut slits);
    let on_slit = slits.first().copied()?;
    let path = |sides: Vec<Side>| {
        let (first, last) = (sides.first()?.start(), sides.last()?.end());
        Some(Path { winding: turns(native, first, last, tolerance), sides, on_slit: Some(on_slit) })
    };
    let paths: Vec<Path> = loops.into_iter().filter_map(path).collect();
    (!paths.is_empty()).then_some(paths)
}

fn parts(
    native: &Native<'_>,
    sides: Vec<Side>,
    tolerance: f64,
    slits: &mut Vec<Vec2>,
) -> Vec<Vec<Side>> {
    let mut left = vec![sides];
    let mut whole = Vec::new();
    while let Some(ring) = left.pop() {
        let ring = without_spurs(native, ring, tolerance, slits);
        let pair = (0..ring.len()).find_map(|i| {
            let back =
                (i + 1..ring.len()).find(|&j| retraces(native, &ring[i], &ring[j], false))?;
            Some([i, back])
        });
        match pair {
            Some([there, back]) => {
                slits.push(middle(&ring[there]));
                left.push(ring[there + 1..back].to_vec());
                left.push([&ring[..there], &ring[back + 1..]].concat());
            }
            None => whole.push(ring),
        }
    }
    whole.retain(|ring| ring.iter().any(|s| !is_point(native, s, tolerance)));
    whole
}

/// Removes the slits that end within a loop. Sides after a slit are shifted by whole periods to continue where it
/// began.
fn without_spurs(
    native: &Native<'_>,
    sides: Vec<Side>,
    tolerance: f64,
    slits: &mut Vec<Vec2>,
) -> Vec<Side> {
    let mut kept: Vec<Side> = Vec::with_capacity(sides.len());
    for side in sides {
        let end = kept.last().map(Side::end);
        let side =
            end.map_or(side.clone(), |e| side.shifted(whole_periods(native, e - side.start())));
        let behind_pole = kept.last().is_some_and(|s| is_point(native, s, tolerance));
        let there = kept.len().checked_sub(1 + usize::from(behind_pole));
        match there.filter(|&k| retraces(native, &kept[k], &side, behind_pole)) {
            Some(k) => {
                slits.push(middle(&side));
                kept.truncate(k);
            }
            None => kept.push(side),
        }
    }
    // A slit at the start of the loop, which may be a pole.
    loop {
        let real = |s: &Side| !is_point(native, s, tolerance);
        let (Some(first), Some(last)) = (kept.iter().position(real), kept.iter().rposition(real))
        else {
            return kept;
        };
        let at_pole = collapsed_direction(native, kept[first].start(), tolerance).is_some();
        if first == last || !retraces(native, &kept[last], &kept[first], at_pole) {
            return kept;
        }
        slits.push(middle(&kept[first]));
        kept = kept[first + 1..last].to_vec();
    }
}

/// True when a side is the reversed preceding side; after a pole it may be shifted by whole periods.
fn retraces(native: &Native<'_>, there: &Side, back: &Side, behind_pole: bool) -> bool {
    if there.curve.is_none() || back.curve.is_none() || there.edge_id != back.edge_id {
        return false;
    }
    let at = |side: &Side, fraction: f64| {
        let [a, b] = side.path.domain();
        side.path.point(a + (b - a) * fraction)
    };
    let turned = match behind_pole {
        true => whole_periods(native, there.start() - back.end()),
        false => Vec2::zeros(),
    };
    let length = (middle(there) - there.start()).norm() + (there.end() - middle(there)).norm();
    let near = |fraction: f64| {
        let off = at(there, fraction) - at(back, 1.0 - fraction) - turned;
        off.norm() <= COINCIDENCE_TOLERANCE_REL * length
    };
    // At a pole one parameter is arbitrary.
    near(0.0) && near(0.5) && (behind_pole || near(1.0))
}

fn middle(side: &Side) -> Vec2 {
    let [a, b] = side.path.domain();
    side.path.point(0.5 * (a + b))
}

/// True for a side of zero length in space.
fn is_point(native: &Native<'_>, side: &Side, tolerance: f64) -> bool {
    side.curve.is_none()
        && collapsed_direction(native, side.start(), tolerance).is_some()
        && (native.point(side.start()) - native.point(side.end())).norm() <= tolerance
        && (native.point(middle(side)) - native.point(side.end())).norm() <= tolerance
}
