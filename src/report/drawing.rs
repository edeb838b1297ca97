//! Drawings as SVG for pages without scripts: heat maps, and line charts with linear or logarithmic axes.

use std::ops::Range;
use std::path::Path;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

use super::foreign::visible_text;
use super::plot::ticks::{Short, log_ticks};
use kanagata_files::{WriteError, write_atomic};

pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// Result of drawing. Drawing to a string does not fail in practice.
pub(super) type Drawn = Result<(), Box<dyn std::error::Error + Send + Sync>>;

/// One panel of coloured cells.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// Title.
    pub title: String,
    /// Title and range of the horizontal axis.
    pub x: (String, Range<f64>),
    /// Title and range of the vertical axis.
    pub y: (String, Range<f64>),
    /// Values row by row from the lower left; cells that are not finite are grey.
    pub columns: usize,
    /// Values row by row from the lower left; cells that are not a number stay grey.
    pub values: Vec<f64>,
}

/// One line of a chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Name for the legend.
    pub name: String,
    /// Points (x, y); on logarithmic axes too these are values, not logarithms.
    pub points: Vec<(f64, f64)>,
    /// Draw rings only, in black, to mark points of other lines.
    pub marks_only: bool,
}

/// A line chart.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Chart {
    /// Title.
    pub title: String,
    /// Title of the horizontal axis, and whether it is logarithmic.
    pub x: (String, bool),
    /// Title of the vertical axis, and whether it is logarithmic.
    pub y: (String, bool),
    /// The lines.
    pub lines: Vec<Line>,
}

/// Width and height of one heat map [px].
const PANEL_SIZE_PX: (u32, u32) = (330, 300);
/// Width of the colour bar [px].
const COLOR_BAR_WIDTH_PX: u32 = 96;
/// Steps of the colour scale; the heat map shows one colour more.
const COLOR_STEPS: f64 = 32.0;
/// Width of the legend beside a chart [px].
pub(super) const LEGEND_WIDTH_PX: u32 = 170;
pub(super) const COLORS: [RGBColor; 12] = [
    RGBColor(31, 119, 180),
    RGBColor(214, 39, 40),
    RGBColor(44, 160, 44),
    RGBColor(148, 103, 189),
    RGBColor(255, 127, 14),
    RGBColor(23, 190, 207),
    RGBColor(140, 86, 75),
    RGBColor(90, 90, 90),
    RGBColor(227, 119, 194),
    RGBColor(188, 189, 34),
    RGBColor(0, 90, 60),
    RGBColor(250, 180, 120),
];

fn color(value: f64, scale: &Range<f64>) -> RGBColor {
    if !value.is_finite() {
        return RGBColor(200, 200, 200);
    }
    let share = (value - scale.start) / (scale.end - scale.start);
    ViridisRGB.get_color((share.clamp(0.0, 1.0) * COLOR_STEPS).round() / COLOR_STEPS)
}

/// Writes panels side by side with one colour scale over `scale`; `meaning` is the title of its colour bar.
///
/// # Errors
/// [`WriteError`].
pub fn write_heat_maps(
    path: &Path,
    panels: &[HeatMap],
    scale: Range<f64>,
    meaning: &str,
) -> Result<(), WriteError> {
    let size = (PANEL_SIZE_PX.0 * panels.len() as u32 + COLOR_BAR_WIDTH_PX, PANEL_SIZE_PX.1);
    write_svg(path, size, |root| {
        let (maps, legend) = root.split_horizontally(PANEL_SIZE_PX.0 * panels.len() as u32);
        for (area, map) in maps.split_evenly((1, panels.len().max(1))).iter().zip(panels) {
            draw_map(area, map, &scale)?;
        }
        draw_scale(&legend, &scale, meaning)
    })
}

fn draw_map(area: &Area<'_>, map: &HeatMap, scale: &Range<f64>) -> Drawn {
    let (x, y) = (map.x.1.clone(), map.y.1.clone());
    let mut chart = ChartBuilder::on(area)
        .caption(&map.title, ("sans-serif", 14))
        .margin(6)
        .x_label_area_size(34)
        .y_label_area_size(42)
        .build_cartesian_2d(x.clone(), y.clone())?;
    chart
        .configure_mesh()
        .disable_mesh()
        .x_desc(&map.x.0)
        .y_desc(&map.y.0)
        .x_labels(6)
        .y_labels(6)
        .draw()?;
    let rows = map.values.len() / map.columns.max(1);
    let (dx, dy) = ((x.end - x.start) / map.columns as f64, (y.end - y.start) / rows as f64);
    for (j, row) in map.values.chunks(map.columns.max(1)).enumerate() {
        let low = y.start + j as f64 * dy;
        let runs = runs(row, scale).into_iter().map(|(from, to, color)| {
            let (left, right) = (x.start + from as f64 * dx, x.start + to as f64 * dx);
            Rectangle::new([(left, low), (right, low + dy)], color.filled())
        });
        chart.draw_series(runs)?;
    }
    Ok(())
}

/// Runs of neighbouring cells with the same colour: start, end, colour.
fn runs(row: &[f64], scale: &Range<f64>) -> Vec<(usize, usize, RGBColor)> {
    let mut out: Vec<(usize, usize, RGBColor)> = Vec::new();
    for (k, &value) in row.iter().enumerate() {
        let color = color(value, scale);
        match out.last_mut() {
            Some((_, to, last)) if *last == color => *to = k + 1,
            _ => out.push((k, k + 1, color)),
        }
    }
    out
}

fn draw_scale(area: &Area<'_>, scale: &Range<f64>, meaning: &str) -> Drawn {
    const STEPS: usize = 32;
    let mut chart = ChartBuilder::on(area)
        .caption(meaning, ("sans-serif", 11))
        .margin(6)
        .margin_bottom(40)
        .margin_right(20)
        .y_label_area_size(46)
        .build_cartesian_2d(0.0..1.0, scale.clone())?;
    chart
        .configure_mesh()
        .disable_mesh()
        .disable_x_axis()
        .y_labels(6)
        .label_style(("sans-serif", 12))
        .draw()?;
    let step = (scale.end - scale.start) / STEPS as f64;
    chart.draw_series((0..STEPS).map(|k| {
        let low = scale.start + k as f64 * step;
        let fill = color(low + 0.5 * step, scale).filled();
        Rectangle::new([(0.0, low), (1.0, low + step)], fill)
    }))?;
    Ok(())
}

/// Writes a line chart.
///
/// # Errors
/// [`WriteError`].
pub fn write_chart(path: &Path, chart: &Chart) -> Result<(), WriteError> {
    write_svg(path, (700 + LEGEND_WIDTH_PX, 440), |root| {
        let (root, names) = root.split_horizontally(700);
        draw_legend(&names, &chart.lines)?;
        let x = range_of(chart, chart.x.1, |p| p.0);
        let y = range_of(chart, chart.y.1, |p| p.1);
        let log = |range: Range<f64>| {
            let ticks = log_ticks(&range);
            range.log_scale().with_key_points(ticks)
        };
        match (chart.x.1, chart.y.1) {
            (false, false) => draw_lines(&root, chart, x, y),
            (true, false) => draw_lines(&root, chart, log(x), y),
            (false, true) => draw_lines(&root, chart, x, log(y)),
            (true, true) => draw_lines(&root, chart, log(x), log(y)),
        }
    })
}

/// Whether a point can be drawn: finite, and positive on logarithmic axes.
fn drawable(chart: &Chart, p: &(f64, f64)) -> bool {
    let fits = |v: f64, log: bool| v.is_finite() && (!log || v > 0.0);
    fits(p.0, chart.x.1) && fits(p.1, chart.y.1)
}

fn range_of(chart: &Chart, log: bool, of: impl Fn(&(f64, f64)) -> f64) -> Range<f64> {
    let points = chart.lines.iter().flat_map(|l| &l.points).filter(|p| drawable(chart, p));
    let (low, high) =
        points.map(&of).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    match (low < high, log) {
        (true, true) => low / 1.15..high * 1.15,
        (true, false) => low - 0.02 * (high - low)..high + 0.05 * (high - low),
        (false, true) => 0.1..10.0,
        (false, false) => 0.0..1.0,
    }
}

fn draw_lines<X, Y>(root: &Area<'_>, chart: &Chart, x: X, y: Y) -> Drawn
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: ValueFormatter<f64>,
    Y::CoordDescType: ValueFormatter<f64>,
{
    let mut area = ChartBuilder::on(root)
        .caption(&chart.title, ("sans-serif", 16))
        .margin(8)
        .margin_right(16)
        .x_label_area_size(40)
        .y_label_area_size(64)
        .build_cartesian_2d(x, y)?;
    let label = |v: &f64| Short(*v).to_string();
    area.configure_mesh()
        .x_desc(&chart.x.0)
        .y_desc(&chart.y.0)
        .light_line_style(WHITE)
        .x_label_formatter(&label)
        .y_label_formatter(&label)
        .draw()?;
    for (k, line) in chart.lines.iter().enumerate() {
        let color = color_of(k, line);
        let points: Vec<_> = line.points.iter().filter(|p| drawable(chart, p)).copied().collect();
        if line.marks_only {
            area.draw_series(points.iter().map(|&p| Circle::new(p, 6, color.stroke_width(1))))?;
            continue;
        }
        let markers = points.len() <= 40;
        if markers {
            area.draw_series(points.iter().map(|&p| Circle::new(p, 3, color.filled())))?;
        }
        area.draw_series(LineSeries::new(points, color.stroke_width(2)))?;
    }
    Ok(())
}

/// Colour of line `k`; rings are black.
fn color_of(k: usize, line: &Line) -> RGBColor {
    if line.marks_only { BLACK } else { COLORS[k % COLORS.len()] }
}

/// Draws the legend: names and colours of the lines, one below the other.
pub(super) fn draw_legend(area: &Area<'_>, lines: &[Line]) -> Drawn {
    for (k, line) in lines.iter().enumerate() {
        let y = 44 + 20 * k as i32;
        let color = color_of(k, line);
        if line.marks_only {
            area.draw(&Circle::new((11, y), 6, color.stroke_width(1)))?;
        } else {
            area.draw(&Rectangle::new([(4, y - 4), (18, y + 4)], color.filled()))?;
        }
        area.draw(&Text::new(line.name.clone(), (24, y - 6), ("sans-serif", 12)))?;
    }
    Ok(())
}

pub(super) fn write_svg(
    path: &Path,
    size: (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> Drawn,
) -> Result<(), WriteError> {
    let mut text = String::new();
    let drawn = {
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        let filled = root.fill(&WHITE).map_err(Into::into);
        filled.and_then(|()| draw(&root)).and_then(|()| root.present().map_err(Into::into))
    };
    write_atomic(path, |w| {
        drawn.map_err(std::io::Error::other)?;
        // The drawing library escapes markup in names, but not characters that XML does not allow.
        w.write_all(visible_text(&text).as_bytes())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawings_hold_their_cells_lines_and_titles_whatever_the_values() {
        let folder = tempfile::tempdir().unwrap();
        let map = HeatMap {
            title: "map".into(),
            x: ("across".into(), 0.0..1.0),
            y: ("up".into(), -1.0..1.0),
            columns: 3,
            values: vec![0.0, f64::NAN, 2.0, 1.0, f64::INFINITY, -5.0],
        };
        let path = folder.path().join("map.svg");
        write_heat_maps(&path, &[map.clone(), map], 0.0..1.0, "share").unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.matches("<rect").count() >= 10 + 32 && text.contains("across"));

        let points = vec![(1.0, 1e-3), (10.0, 0.0), (100.0, 1e-7), (f64::NAN, 1.0)];
        for (x, y) in [(false, false), (true, false), (false, true), (true, true)] {
            for points in [points.clone(), vec![], vec![(1.0, 1.0)]] {
                let line = Line { name: "one".into(), points, marks_only: false };
                let chart = Chart {
                    title: "chart".into(),
                    x: ("x".into(), x),
                    y: ("error".into(), y),
                    lines: vec![line],
                };
                let path = folder.path().join("chart.svg");
                write_chart(&path, &chart).unwrap();
                assert!(std::fs::read_to_string(&path).unwrap().contains("error"));
            }
        }
    }
}
