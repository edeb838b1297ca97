//! What a plot shows.

use std::ops::Range;

/// Points of a plot under one name.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Abscissae.
    pub x: Vec<f64>,
    /// Ordinates, one per abscissa.
    pub y: Vec<f64>,
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Style {
    /// A line, with markers if there are few points.
    Line,
    /// A dotted guide without values on hover.
    Guide,
    /// Dots. Hovering a dot shows its index, from 0.
    Dots,
    /// Rings, which mark points of other series.
    Rings,
    /// Vertical bars of this width.
    Bars(f64),
}

/// An axis.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Axis {
    /// Title with unit.
    pub title: String,
    /// Logarithmic; points that are not positive are left out.
    pub log: bool,
}

/// A plot.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Plot {
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// The series in the order of drawing.
    pub series: Vec<(Series, Style)>,
    /// Both axes have the same scale.
    pub equal: bool,
}

impl Plot {
    /// Lines over linear axes.
    #[must_use]
    pub fn lines(series: Vec<Series>, x_title: &str, y_title: &str) -> Self {
        let axis = |title: &str| Axis { title: title.into(), log: false };
        let series = series.into_iter().map(|one| (one, Style::Line)).collect();
        Self { x: axis(x_title), y: axis(y_title), series, equal: false }
    }

    /// Dots over dotted guides, on linear axes.
    #[must_use]
    pub fn scatter(dots: Series, guides: Vec<Series>, x_title: &str, y_title: &str) -> Self {
        let mut plot = Self::lines(Vec::new(), x_title, y_title);
        plot.series = guides.into_iter().map(|one| (one, Style::Guide)).collect();
        plot.series.push((dots, Style::Dots));
        plot
    }

    /// Adds a line.
    pub fn line(&mut self, series: Series) {
        self.series.push((series, Style::Line));
    }

    /// Adds a dotted guide.
    pub fn guide(&mut self, series: Series) {
        self.series.push((series, Style::Guide));
    }

    /// Whether a point can be drawn: finite, and positive on logarithmic axes.
    pub(super) fn drawable(&self, x: f64, y: f64) -> bool {
        let fits = |v: f64, log: bool| v.is_finite() && (!log || v > 0.0);
        fits(x, self.x.log) && fits(y, self.y.log)
    }

    /// Ranges of both axes.
    pub(super) fn ranges(&self) -> [Range<f64>; 2] {
        let (mut x, mut y) = (Extent::default(), Extent::default());
        for (series, style) in &self.series {
            let points = series.x.iter().zip(&series.y);
            for (&a, &b) in points.filter(|(a, b)| self.drawable(**a, **b)) {
                let half = if let Style::Bars(width) = style { 0.5 * width } else { 0.0 };
                x.include(a - half);
                x.include(a + half);
                y.include(b);
                if half > 0.0 && !self.y.log {
                    y.include(0.0);
                }
            }
        }
        [x.range(self.x.log), y.range(self.y.log)]
    }
}

/// Smallest and largest value.
struct Extent(f64, f64);

impl Default for Extent {
    fn default() -> Self {
        Self(f64::INFINITY, f64::NEG_INFINITY)
    }
}

impl Extent {
    fn include(&mut self, value: f64) {
        *self = Self(self.0.min(value), self.1.max(value));
    }

    /// The range of an axis with a margin; around a single value, or a default without values.
    fn range(&self, log: bool) -> Range<f64> {
        let (low, high) = (self.0, self.1);
        let width = high - low;
        match (low < high && width.is_finite(), log) {
            (true, true) => low / 1.15..high * 1.15,
            (true, false) => low - 0.02 * width..high + 0.05 * width,
            (false, true) if low == high => low / 2.0..low * 2.0,
            (false, false) if low == high && low != 0.0 => {
                low - 0.5 * low.abs()..low + 0.5 * low.abs()
            }
            (false, true) => 0.1..10.0,
            (false, false) => 0.0..1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_hold_what_can_be_drawn() {
        let series = |y: Vec<f64>| Series { name: "a".into(), x: vec![1.0, 2.0, 3.0], y };
        let mut plot = Plot::lines(vec![series(vec![f64::NAN, -1.0, 3.0])], "x", "y");
        let [x, y] = plot.ranges();
        assert!((x.start - 1.98).abs() < 1e-12 && (y.start + 1.08).abs() < 1e-12, "{x:?} {y:?}");
        plot.y.log = true;
        let [_, y] = plot.ranges();
        assert_eq!((y.start, y.end), (1.5, 6.0));
        plot.series[0].1 = Style::Bars(0.5);
        assert_eq!(plot.ranges()[0].start, 2.75 - 0.02 * 0.5);
        assert_eq!(Plot::default().ranges(), [0.0..1.0, 0.0..1.0]);
    }
}
