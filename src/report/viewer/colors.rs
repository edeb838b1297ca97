//! Colours of values, for the picture and for the script alike.

/// Colours from low to high: dark blue, green, yellow; even in lightness (viridis, public domain).
pub(super) const SEQUENTIAL: [[u8; 3]; 10] = [
    [68, 1, 84],
    [72, 40, 120],
    [62, 73, 137],
    [49, 104, 142],
    [38, 130, 142],
    [31, 158, 137],
    [53, 183, 121],
    [110, 206, 88],
    [181, 222, 43],
    [253, 231, 37],
];

/// Colours of signed values: blue below zero, light at zero, red above.
pub(super) const DIVERGING: [[u8; 3]; 5] =
    [[33, 82, 160], [132, 176, 222], [236, 236, 236], [235, 150, 118], [172, 38, 38]];

/// The table of a scale.
pub(super) fn table(signed: bool) -> &'static [[u8; 3]] {
    if signed { &DIVERGING } else { &SEQUENTIAL }
}

/// Colour at a fraction of a table, from 0 to 1, by linear interpolation.
pub(super) fn color(table: &[[u8; 3]], fraction: f64) -> [f64; 3] {
    let at = fraction.clamp(0.0, 1.0) * (table.len() - 1) as f64;
    let k = (at as usize).min(table.len() - 2);
    let t = at - k as f64;
    [0, 1, 2].map(|c| f64::from(table[k][c]) * (1.0 - t) + f64::from(table[k + 1][c]) * t)
}

/// Minimum half width of a signed scale, for values that are all zero. The browser works in single precision.
const SIGNED_MIN: f64 = 1e-6;

/// Limits of a colour scale over values; symmetric to zero if `signed`. `None` without a finite value.
pub(super) fn limits(values: impl Iterator<Item = f64>, signed: bool) -> Option<[f64; 2]> {
    let finite = values.filter(|v| v.is_finite());
    let (low, high) =
        finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    if low > high {
        return None;
    }
    if signed {
        let top = low.abs().max(high.abs()).max(SIGNED_MIN);
        return Some([-top, top]);
    }
    Some([low, high])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signed_scale_is_centred_on_zero() {
        assert_eq!(limits([-0.1, 0.02, f64::NAN].into_iter(), true), Some([-0.1, 0.1]));
        assert_eq!(limits([0.0].into_iter(), true), Some([-SIGNED_MIN, SIGNED_MIN]));
        assert_eq!(limits([1.0, 3.0].into_iter(), false), Some([1.0, 3.0]));
        assert_eq!(limits([f64::NAN].into_iter(), false), None);
    }

    #[test]
    fn colours_pass_through_their_table() {
        assert_eq!(color(&DIVERGING, 0.5), [236.0; 3]);
        assert_eq!(color(&SEQUENTIAL, -1.0), [68.0, 1.0, 84.0]);
        assert_eq!(color(&SEQUENTIAL, 2.0), [253.0, 231.0, 37.0]);
        assert_eq!(color(&SEQUENTIAL, 0.5 / 9.0), [70.0, 20.5, 102.0]);
    }
}
