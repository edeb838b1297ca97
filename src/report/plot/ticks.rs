//! Round ticks of linear and logarithmic axes, and their labels.

use std::fmt::Display;
use std::ops::Range;

/// Ascending ticks of a logarithmic axis. A short range has more ticks per decade; a very short one has even steps.
pub(crate) fn log_ticks(range: &Range<f64>) -> Vec<f64> {
    let (first, last) = (range.start.log10().floor() as i32, range.end.log10().ceil() as i32);
    let per_decade: &[f64] = match (range.end / range.start).log10() {
        decades if decades < 1.0 => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
        decades if decades < 3.5 => &[1.0, 2.0, 5.0],
        _ => &[1.0],
    };
    let decades = (first..=last).flat_map(|k| per_decade.iter().map(move |m| m * 10f64.powi(k)));
    let ticks: Vec<f64> = decades.filter(|tick| range.contains(tick)).collect();
    if ticks.len() < 3 { even_ticks(range) } else { ticks }
}

/// Three to nine multiples within the range of 1, 2 or 5 times a power of ten.
pub(crate) fn even_ticks(range: &Range<f64>) -> Vec<f64> {
    let quarter = (range.end - range.start) / 4.0;
    let decade = 10f64.powi(quarter.log10().floor() as i32);
    let step = [5.0, 2.0, 1.0].map(|m| m * decade).into_iter().find(|&step| step <= quarter);
    let step = step.unwrap_or(decade);
    let first = (range.start / step).ceil();
    let tick = |k: i32| (first + f64::from(k)) * step;
    // A range at the limit of the number format has no distinct multiples.
    (0..TICKS_MAX).map(tick).take_while(|tick| range.contains(tick)).collect()
}

/// Limit of the ticks of an axis; even steps make at most ten.
const TICKS_MAX: i32 = 16;

/// A number formatted for an axis: at most six decimals, or an exponent.
pub(crate) struct Short(pub(crate) f64);

impl Display for Short {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let size = self.0.abs();
        if size != 0.0 && !(1e-3..1e6).contains(&size) {
            write!(f, "{:.0e}", self.0)
        } else {
            // Adding zero turns a negative zero into a positive one.
            write!(f, "{}", (self.0 * 1e6).round() / 1e6 + 0.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_of_a_logarithmic_axis_are_round_and_few() {
        assert_eq!(log_ticks(&(0.9..60.0)), [1.0, 2.0, 5.0, 10.0, 20.0, 50.0]);
        assert_eq!(log_ticks(&(3e-9..4e-2)).len(), 7);
        assert_eq!(log_ticks(&(30.0..2400.0)), [50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0]);
        assert_eq!(log_ticks(&(242.78..387.72)), [260.0, 280.0, 300.0, 320.0, 340.0, 360.0, 380.0]);
        assert_eq!(log_ticks(&(7.1..8.1)).len(), 5);
    }

    #[test]
    fn even_steps_are_few_for_any_range() {
        for (low, high) in [(0.0, 1.0), (-3.7, 11.2), (1e9, 1e9 + 3.0), (-1e-7, 2e-7)] {
            let count = even_ticks(&(low..high)).len();
            assert!((3..=10).contains(&count), "{low} {high}: {count}");
        }
        assert!(even_ticks(&(1.0..1.0 + f64::EPSILON)).len() <= 16);
        assert_eq!(Short(-0.0).to_string(), "0");
        assert_eq!([1234.5, 2e6, 2e-5].map(|v| Short(v).to_string()), ["1234.5", "2e6", "2e-5"]);
    }
}
