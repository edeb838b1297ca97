//! Periods and poles of a surface in the parameter plane.

use crate::native::Native;
use kanagata_geometry::Vec2;

/// Whole periods from the first to the last point of a loop. Zero along the collapsed direction of a pole at which the
/// loop begins and ends, because it is closed there for any turn.
pub(super) fn turns(native: &Native<'_>, first: Vec2, last: Vec2, tolerance: f64) -> Vec2 {
    let mut turns = whole_periods(native, last - first);
    if let Some(k) = collapsed_direction(native, first, tolerance)
        && collapsed_direction(native, last, tolerance) == Some(k)
        && (native.point(first) - native.point(last)).norm() <= tolerance
    {
        turns[k] = 0.0;
    }
    turns
}

/// The multiple of the periods closest to a difference of parameters.
pub(super) fn whole_periods(native: &Native<'_>, difference: Vec2) -> Vec2 {
    let mut out = Vec2::zeros();
    for (k, period) in native.periods().into_iter().enumerate() {
        if let Some(p) = period {
            out[k] = p * (difference[k] / p).round();
        }
    }
    out
}

/// One period along the collapsed direction of a pole.
pub(super) fn one_turn(native: &Native<'_>, pole: Vec2) -> Vec2 {
    let mut turn = Vec2::zeros();
    for (k, period) in native.periods().into_iter().enumerate() {
        let Some(p) = period else { continue };
        let mut other = pole;
        other[k] += 0.5 * p;
        let collapsed = (native.point(pole) - native.point(other)).norm();
        let mut across = pole;
        across[1 - k] += 0.1;
        let size = (native.point(pole) - native.point(across)).norm();
        if turn.norm() == 0.0 && collapsed <= 1e-6 * size.max(f64::MIN_POSITIVE) {
            turn[k] = p;
        }
    }
    turn
}

/// True for a pole: the point in space does not depend on the periodic parameter.
pub(super) fn is_pole(native: &Native<'_>, uv: Vec2, tolerance: f64) -> bool {
    collapsed_direction(native, uv, tolerance).is_some()
}

/// Index of the periodic parameter that has no effect at a pole.
pub(super) fn collapsed_direction(native: &Native<'_>, uv: Vec2, tolerance: f64) -> Option<usize> {
    (0..2).find(|&k| {
        native.periods()[k].is_some_and(|p| {
            let mut other = uv;
            other[k] += 0.5 * p;
            (native.point(uv) - native.point(other)).norm() <= tolerance
        })
    })
}
