//! A plot as an HTML figure: inline SVG, its legend, and its values as JSON for the script of the page.

use std::collections::HashSet;
use std::fmt::Write as _;
use std::ops::Range;

use serde_json::{Value, json};

use super::chart::{Axis, Plot, Series, Style};
use super::ticks::{Short, even_ticks, log_ticks};
use crate::digits::four_digits;
use crate::foreign::{escaped, json_text, visible_text};

/// Width of a plot [px].
const WIDTH_PX: f64 = 840.0;
/// Space left of, above, right of and below the area of a plot [px].
const MARGINS_PX: [f64; 4] = [78.0, 12.0, 18.0, 52.0];
/// Number of points up to which a line has markers.
const MARKERS_MAX: usize = 40;
/// Number of colours of the style sheet.
const COLORS: usize = 12;

/// An axis on the drawing: the range of its values and of its pixels.
struct Scale {
    values: Range<f64>,
    pixels: Range<f64>,
    log: bool,
}

impl Scale {
    fn pixel(&self, value: f64) -> f64 {
        let of = |v: f64| if self.log { v.ln() } else { v };
        let fraction =
            (of(value) - of(self.values.start)) / (of(self.values.end) - of(self.values.start));
        self.pixels.start + fraction * (self.pixels.end - self.pixels.start)
    }

    fn ticks(&self) -> Vec<f64> {
        if self.log { log_ticks(&self.values) } else { even_ticks(&self.values) }
    }
}

/// The figure with the number `id` on its page and this height [px]. `title`: what it shows.
pub(crate) fn figure(plot: &Plot, title: &str, id: usize, height: usize) -> String {
    let [left, top, right, bottom] = MARGINS_PX;
    let height = height as f64;
    let [mut x, mut y] = plot.ranges();
    if plot.equal {
        equalise(&mut x, &mut y, (WIDTH_PX - left - right) / (height - top - bottom));
    }
    let x = Scale { values: x, pixels: left..WIDTH_PX - right, log: plot.x.log };
    let y = Scale { values: y, pixels: height - bottom..top, log: plot.y.log };
    let mut out = format!(
        "<figure class=\"plot\" id=\"plot{id}\"><div class=\"wide\"><svg viewBox=\"0 0 {WIDTH_PX} {height}\" role=\"img\" \
         aria-labelledby=\"t{id} d{id}\"><title id=\"t{id}\">{}</title><desc id=\"d{id}\">{}</desc>\n",
        escaped(title),
        escaped(&description(plot, &x, &y))
    );
    axes(&mut out, plot, &x, &y);
    let _ = writeln!(
        out,
        "<svg x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\" viewBox=\"{left} {top} {0} {1}\">",
        WIDTH_PX - left - right,
        height - top - bottom
    );
    let mut shown = Vec::new();
    for (k, (series, style)) in plot.series.iter().enumerate() {
        shown.push(draw(&mut out, plot, (k, series, *style), &x, &y));
    }
    out.push_str("</svg></svg></div>\n");
    legend(&mut out, plot);
    let _ = writeln!(
        out,
        "<script type=\"application/json\" class=\"values\">{}</script></figure>",
        json_text(&data(plot, (&x, &y), shown.into_iter().flatten().collect()))
    );
    out
}

/// Axes and values of a plot for the script.
fn data(plot: &Plot, (x, y): (&Scale, &Scale), series: Vec<Value>) -> Value {
    let axis = |axis: &Axis, scale: &Scale| {
        json!({
            "title": visible_text(&axis.title),
            "log": scale.log,
            "values": [scale.values.start, scale.values.end],
            "pixels": [scale.pixels.start, scale.pixels.end],
        })
    };
    json!({"x": axis(&plot.x, x), "y": axis(&plot.y, y), "series": series})
}

/// Widens one range so that both axes have the same scale; `aspect`: width over height of the area.
fn equalise(x: &mut Range<f64>, y: &mut Range<f64>, aspect: f64) {
    let widen = |range: &mut Range<f64>, to: f64| {
        let more = 0.5 * (to - (range.end - range.start));
        *range = range.start - more..range.end + more;
    };
    let (across, up) = (x.end - x.start, y.end - y.start);
    if across < up * aspect { widen(x, up * aspect) } else { widen(y, across / aspect) }
}

/// The plot in words.
fn description(plot: &Plot, x: &Scale, y: &Scale) -> String {
    let names: Vec<&str> = plot.series.iter().map(|(series, _)| series.name.as_str()).collect();
    let axis = |name: &str, axis: &Axis, scale: &Scale| {
        let log = if scale.log { ", logarithmic" } else { "" };
        let [low, high] = [scale.values.start, scale.values.end].map(four_digits);
        format!("{name}: {}, {low} to {high}{log}", axis.title)
    };
    format!(
        "{}; {}; series: {}",
        axis("horizontal", &plot.x, x),
        axis("vertical", &plot.y, y),
        names.join(", ")
    )
}

/// Grid lines, labels and titles of both axes.
fn axes(out: &mut String, plot: &Plot, x: &Scale, y: &Scale) {
    let (left, right) = (x.pixels.start, x.pixels.end);
    let (low, top) = (y.pixels.start, y.pixels.end);
    let mut lines = String::new();
    for tick in x.ticks() {
        let at = x.pixel(tick);
        let _ = write!(lines, "M{at:.1} {low:.1}V{top:.1}");
        let _ = write!(
            out,
            "<text x=\"{at:.1}\" y=\"{:.1}\" class=\"m\">{}</text>",
            low + 18.0,
            Short(tick)
        );
    }
    for tick in y.ticks() {
        let at = y.pixel(tick);
        let _ = write!(lines, "M{left:.1} {at:.1}H{right:.1}");
        let _ = write!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" class=\"e\">{}</text>",
            left - 8.0,
            at + 4.5,
            Short(tick)
        );
    }
    let _ = writeln!(
        out,
        "<path class=\"grid\" d=\"{lines}\"/><path class=\"axis\" d=\"M{left:.1} {top:.1}V{low:.1}H{right:.1}\"/>"
    );
    let (middle, height) = (0.5 * (left + right), 0.5 * (low + top));
    let _ = writeln!(
        out,
        "<text x=\"{middle:.1}\" y=\"{:.1}\" class=\"m\">{}</text><text transform=\"translate(18 {height:.1}) rotate(-90)\" \
         class=\"m\">{}</text>",
        low + 40.0,
        escaped(&plot.x.title),
        escaped(&plot.y.title)
    );
}

/// Bars of a width in units of x.
fn bar_path(points: &[(usize, f64, f64)], width: f64, x: &Scale, y: &Scale) -> String {
    let base = if y.log { y.pixels.start } else { y.pixel(0.0) };
    let mut path = String::new();
    for &(_, a, b) in points {
        let (from, to) = (x.pixel(a - 0.5 * width), x.pixel(a + 0.5 * width));
        let _ = write!(path, "M{from:.1} {base:.1}V{:.1}H{to:.1}V{base:.1}Z", y.pixel(b));
    }
    path
}

/// Draws a series; gives the points with values on hover.
fn draw(
    out: &mut String,
    plot: &Plot,
    (k, series, style): (usize, &Series, Style),
    x: &Scale,
    y: &Scale,
) -> Option<Value> {
    let color = k % COLORS;
    let all: Vec<(usize, f64, f64)> =
        (0..series.x.len().min(series.y.len())).map(|k| (k, series.x[k], series.y[k])).collect();
    let mut points: Vec<_> = all.iter().copied().filter(|&(_, a, b)| plot.drawable(a, b)).collect();
    match style {
        Style::Guide => {
            let path = line_path(plot, &all, x, y);
            let _ = writeln!(out, "<path class=\"guide c{color}\" d=\"{path}\"/>");
        }
        Style::Line => {
            let path = line_path(plot, &all, x, y);
            let _ = writeln!(out, "<path class=\"line c{color}\" d=\"{path}\"/>");
            if points.len() <= MARKERS_MAX {
                let dots = dots(&points, x, y);
                let _ = writeln!(out, "<path class=\"dot c{color}\" d=\"{dots}\"/>");
            }
        }
        Style::Dots => {
            // Dots that fall on one pixel are drawn once.
            let mut seen = HashSet::new();
            points.retain(|&(_, a, b)| seen.insert([x.pixel(a) as i64, y.pixel(b) as i64]));
            let _ = writeln!(out, "<path class=\"dots c{color}\" d=\"{}\"/>", dots(&points, x, y));
        }
        Style::Rings => points.iter().for_each(|&(_, a, b)| draw_ring(out, x.pixel(a), y.pixel(b))),
        Style::Bars(width) => {
            let path = bar_path(&points, width, x, y);
            let _ = writeln!(out, "<path class=\"bar c{color}\" d=\"{path}\"/>");
        }
    }
    (style != Style::Guide).then(|| values(series, style, &points, all.len()))
}

fn draw_ring(out: &mut String, x: f64, y: f64) {
    let _ = writeln!(out, "<circle class=\"ring\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"7\"/>");
}

/// Values of the drawn points for the script: six significant digits; indices where they are not 0, 1, 2 and so on.
fn values(series: &Series, style: Style, points: &[(usize, f64, f64)], all: usize) -> Value {
    let short = |v: f64| format!("{v:.5e}").parse::<f64>().unwrap_or(v);
    let x: Vec<f64> = points.iter().map(|p| short(p.1)).collect();
    let y: Vec<f64> = points.iter().map(|p| short(p.2)).collect();
    let mut out = json!({"name": visible_text(&series.name), "x": x, "y": y});
    if style == Style::Dots {
        out["index"] = json!(true);
        if points.len() < all {
            out["index"] = json!(points.iter().map(|p| p.0).collect::<Vec<_>>());
        }
    }
    out
}

/// A path through points; points that cannot be drawn interrupt it, points on the pixel of the last are left out.
fn line_path(plot: &Plot, points: &[(usize, f64, f64)], x: &Scale, y: &Scale) -> String {
    let mut path = String::new();
    let mut last = String::new();
    for &(_, a, b) in points {
        if !plot.drawable(a, b) {
            last.clear();
            continue;
        }
        let place = format!("{:.1} {:.1}", x.pixel(a), y.pixel(b));
        if place != last {
            let _ = write!(path, "{}{place}", if last.is_empty() { 'M' } else { 'L' });
            last = place;
        }
    }
    path
}

/// Dots as lines of no length, which the style sheet draws with round ends.
fn dots(points: &[(usize, f64, f64)], x: &Scale, y: &Scale) -> String {
    let mut path = String::new();
    for &(_, a, b) in points {
        let _ = write!(path, "M{:.1} {:.1}h0", x.pixel(a), y.pixel(b));
    }
    path
}

/// Names and colours below the drawing, if there are several.
fn legend(out: &mut String, plot: &Plot) {
    if plot.series.len() < 2 {
        return;
    }
    out.push_str("<ul class=\"legend\">");
    for (k, (series, style)) in plot.series.iter().enumerate() {
        let class = match style {
            Style::Guide => "guide",
            Style::Rings => "ring",
            Style::Dots => "dots",
            Style::Line | Style::Bars(_) => "line",
        };
        let _ = write!(
            out,
            "<li><svg viewBox=\"0 0 22 12\" aria-hidden=\"true\">{}</svg>{}</li>",
            match style {
                Style::Rings => "<circle class=\"ring\" cx=\"11\" cy=\"6\" r=\"5\"/>".to_owned(),
                Style::Dots => format!("<path class=\"dot c{}\" d=\"M11 6h0\"/>", k % COLORS),
                _ => format!("<path class=\"{class} c{}\" d=\"M1 6H21\"/>", k % COLORS),
            },
            escaped(&series.name)
        );
    }
    out.push_str("</ul>\n");
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(name: &str, y: &[f64]) -> Series {
        let x = (0..y.len()).map(|k| 1.0 + k as f64).collect();
        Series { name: name.into(), x, y: y.to_vec() }
    }

    /// The values that a figure holds for the script.
    fn held(figure: &str) -> Value {
        let (_, rest) = figure.split_once("class=\"values\">").unwrap();
        serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
    }

    #[test]
    fn lines_break_where_a_point_cannot_be_drawn() {
        let plot = Plot::lines(vec![series("a", &[1.0, 2.0, f64::NAN, 4.0, 5.0])], "x", "y");
        let text = figure(&plot, "t", 3, 400);
        let line = text.split("class=\"line c0\" d=\"").nth(1).unwrap().split('"').next().unwrap();
        assert_eq!((line.matches('M').count(), line.matches('L').count()), (2, 2));
        assert!(text.contains("id=\"plot3\"") && text.contains("aria-labelledby=\"t3 d3\""));
        let shown = held(&text);
        assert_eq!(shown["series"][0]["y"], json!([1.0, 2.0, 4.0, 5.0]));
        // The first point is at the pixel that the script computes from the ranges.
        let (v, p) = (&shown["x"]["values"], &shown["x"]["pixels"]);
        let [v0, v1, p0, p1] = [&v[0], &v[1], &p[0], &p[1]].map(|v| v.as_f64().unwrap());
        let at = p0 + (1.0 - v0) / (v1 - v0) * (p1 - p0);
        assert!(line.starts_with(&format!("M{at:.1} ")), "{line}");
    }

    #[test]
    fn names_are_text_in_the_drawing_and_in_the_values() {
        let name = "</script><b>&\u{202e}";
        let plot = Plot::lines(vec![series(name, &[1.0, 2.0]), series("b", &[1.0])], name, "y");
        let text = figure(&plot, name, 0, 300);
        assert!(!text.contains("</script><b>") && !text.contains('\u{202e}'));
        assert_eq!(text.matches("</script>").count(), 1);
        assert_eq!(held(&text)["series"][0]["name"], json!("</script><b>&\u{fffd}"));
    }

    #[test]
    fn dots_on_one_pixel_are_drawn_once_and_keep_their_index() {
        let mut dots = series("elements", &[0.0, 1.0, 1.0, 0.5]);
        dots.x = vec![0.0, 0.5, 0.5 + 1e-6, 1.0];
        let plot = Plot::scatter(dots, vec![series("guide", &[0.0, 1.0])], "minor", "major");
        let text = figure(&plot, "strains", 0, 480);
        let shown = held(&text);
        assert_eq!(shown["series"].as_array().unwrap().len(), 1, "guides have no values");
        assert_eq!(shown["series"][0]["index"], json!([0, 1, 3]));
        assert!(text.contains("class=\"guide c0\""));
    }

    #[test]
    fn equal_scales_widen_the_shorter_axis() {
        let (mut x, mut y) = (0.0..2.0, 0.0..2.0);
        equalise(&mut x, &mut y, 2.0);
        assert_eq!((x, y), (-1.0..3.0, 0.0..2.0));
    }

    #[test]
    fn any_values_make_a_plot() {
        for y in [vec![], vec![f64::INFINITY], vec![0.0], vec![1e300, -1e300], vec![1e-320]] {
            for log in [false, true] {
                for style in [Style::Line, Style::Dots, Style::Rings, Style::Bars(0.1)] {
                    let mut plot = Plot::lines(vec![series("a", &y)], "x", "y");
                    (plot.y.log, plot.series[0].1) = (log, style);
                    let text = figure(&plot, "t", 0, 300);
                    assert!(!text.contains("NaN") && !text.contains("inf"), "{y:?} {log}: {text}");
                }
            }
        }
    }
}
