//! Bar charts, grouped or stacked, with one row per name: as SVG files and on pages.

use std::fmt::Write as _;
use std::path::Path;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::digits::four_digits;
use super::drawing::{Area, COLORS, Drawn, LEGEND_WIDTH_PX, Line, draw_legend, write_svg};
use super::foreign::escaped;
use super::plot::ticks::{Short, even_ticks};
use kanagata_files::WriteError;

/// A horizontal bar chart.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Bars {
    /// Title.
    pub title: String,
    /// Title of the length axis, with unit.
    pub x: String,
    /// Names of the rows, top to bottom.
    pub names: Vec<String>,
    /// Each part: its name and its length in every row.
    pub parts: Vec<(String, Vec<f64>)>,
    /// Stacked bars; otherwise the parts of a row are grouped one below the other.
    pub stacked: bool,
}

/// Width of the chart without its legend [px].
const CHART_WIDTH_PX: u32 = 700;
/// Height of a row [px].
const ROW_HEIGHT_PX: u32 = 26;
/// Height of title, axis and margins [px].
const FRAME_HEIGHT_PX: u32 = 96;
/// Width left of the bars for the names of the rows [px].
const ROW_NAME_WIDTH_PX: u32 = 170;
/// Number of colours of the style sheet of pages.
const PAGE_COLORS: usize = 12;

impl Bars {
    /// Bars of row `row`: `[start, end, top, bottom]` and the part. Top and bottom are in units of the row height.
    fn row(&self, row: usize) -> Vec<([f64; 4], usize)> {
        let mut out = Vec::new();
        let mut from = 0.0;
        let height = 0.8 / if self.stacked { 1.0 } else { self.parts.len().max(1) as f64 };
        for (k, (_, lengths)) in self.parts.iter().enumerate() {
            let length = lengths.get(row).copied().filter(|v| v.is_finite()).unwrap_or(0.0);
            if self.stacked {
                out.push(([from, from + length, 0.1, 0.9], k));
                from += length;
            } else {
                let above = 0.1 + k as f64 * height;
                out.push(([0.0, length, above, above + height], k));
            }
        }
        out
    }

    /// Length of the axis.
    fn longest(&self) -> f64 {
        let ends = (0..self.names.len()).flat_map(|row| self.row(row)).map(|(bar, _)| bar[1]);
        let longest = ends.fold(0.0, f64::max);
        if longest > 0.0 { 1.05 * longest } else { 1.0 }
    }

    /// The chart as an HTML figure with the number `id` on its page. Pointing at a bar shows its value.
    pub(super) fn figure(&self, id: usize) -> String {
        let (width, height) = (f64::from(CHART_WIDTH_PX) + 140.0, self.height() as f64 - 24.0);
        let (left, right, low) = (f64::from(ROW_NAME_WIDTH_PX), width - 24.0, height - 48.0);
        let longest = self.longest();
        let pixel = |value: f64| left + value / longest * (right - left);
        let (title, axis) = (escaped(&self.title), escaped(&self.x));
        let mut out = format!(
            "<figure class=\"plot\" id=\"plot{id}\"><div class=\"wide\"><svg viewBox=\"0 0 {width} {height}\" role=\"img\" \
             aria-labelledby=\"t{id} d{id}\"><title id=\"t{id}\">{title}</title><desc id=\"d{id}\">{axis}</desc>\n"
        );
        self.draw_axis(&mut out, [left, right, low], &pixel);
        let row_height = (low - 8.0) / self.names.len().max(1) as f64;
        for (row, name) in self.names.iter().enumerate() {
            let top = 8.0 + row as f64 * row_height;
            self.draw_row(&mut out, row, &pixel, |part| top + part * row_height);
            let _ = writeln!(
                out,
                "<text x=\"{:.1}\" y=\"{:.1}\" class=\"e\">{}</text>",
                left - 8.0,
                top + 0.5 * row_height + 4.5,
                escaped(name)
            );
        }
        let _ = writeln!(
            out,
            "<path class=\"axis\" d=\"M{left:.1} 8V{low:.1}H{right:.1}\"/></svg></div>"
        );
        self.draw_names(&mut out);
        out.push_str("</figure>\n");
        out
    }

    /// Grid lines, ticks and title of the length axis.
    fn draw_axis(&self, out: &mut String, [left, right, low]: [f64; 3], x: &impl Fn(f64) -> f64) {
        for tick in even_ticks(&(0.0..self.longest())) {
            let (at, label) = (x(tick), Short(tick));
            let _ = write!(
                out,
                "<path class=\"grid\" d=\"M{at:.1} {low:.1}V8\"/><text x=\"{at:.1}\" y=\"{:.1}\" class=\"m\">{label}</text>",
                low + 18.0
            );
        }
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" class=\"m\">{}</text>",
            0.5 * (left + right),
            low + 40.0,
            escaped(&self.x)
        );
    }

    fn draw_row(
        &self,
        out: &mut String,
        row: usize,
        x: &impl Fn(f64) -> f64,
        y: impl Fn(f64) -> f64,
    ) {
        for ([from, to, above, below], part) in self.row(row) {
            let _ = writeln!(
                out,
                "<rect class=\"bar c{}\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"><title>{}, {}: {}</title></rect>",
                part % PAGE_COLORS,
                x(from),
                y(above),
                x(to) - x(from),
                y(below) - y(above),
                escaped(&self.names[row]),
                escaped(&self.parts[part].0),
                four_digits(to - from)
            );
        }
    }

    /// The legend, if there are several parts.
    fn draw_names(&self, out: &mut String) {
        if self.parts.len() < 2 {
            return;
        }
        out.push_str("<ul class=\"legend\">");
        for (k, (name, _)) in self.parts.iter().enumerate() {
            let _ = write!(
                out,
                "<li><svg viewBox=\"0 0 22 12\" aria-hidden=\"true\"><rect class=\"bar c{}\" width=\"22\" height=\"12\"/></svg>{}</li>",
                k % PAGE_COLORS,
                escaped(name)
            );
        }
        out.push_str("</ul>\n");
    }

    /// Height of the drawing [px].
    fn height(&self) -> usize {
        (FRAME_HEIGHT_PX + ROW_HEIGHT_PX * self.names.len().max(self.parts.len()) as u32) as usize
    }

    /// Writes the chart as SVG.
    ///
    /// # Errors
    /// [`WriteError`].
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        write_svg(path, (CHART_WIDTH_PX + LEGEND_WIDTH_PX, self.height() as u32), |root| {
            let (area, names) = root.split_horizontally(CHART_WIDTH_PX);
            let legend = |(name, _): &(String, Vec<f64>)| Line {
                name: name.clone(),
                points: Vec::new(),
                marks_only: false,
            };
            draw_legend(&names, &self.parts.iter().map(legend).collect::<Vec<_>>())?;
            self.draw(&area)
        })
    }

    fn draw(&self, area: &Area<'_>) -> Drawn {
        let rows: Vec<_> = (0..self.names.len()).map(|row| self.row(row)).collect();
        let longest = self.longest();
        // Plotters' ordinate grows upwards; rows are numbered downwards.
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, ("sans-serif", 16))
            .margin(8)
            .margin_right(16)
            .x_label_area_size(40)
            .y_label_area_size(ROW_NAME_WIDTH_PX)
            .build_cartesian_2d(0.0..longest, -(self.names.len().max(1) as f64)..0.0)?;
        chart
            .configure_mesh()
            .disable_y_mesh()
            .y_labels(0)
            .x_desc(&self.x)
            .light_line_style(WHITE)
            .x_label_formatter(&|v: &f64| Short(*v).to_string())
            .draw()?;
        for (row, bars) in rows.iter().enumerate() {
            let above = -(row as f64);
            chart.draw_series(bars.iter().map(|([begin, end, from, to], part)| {
                let corners = [(*begin, above - from), (*end, above - to)];
                Rectangle::new(corners, COLORS[part % COLORS.len()].filled())
            }))?;
            let (x, y) = chart.backend_coord(&(0.0, above - 0.5));
            let style =
                TextStyle::from(("sans-serif", 12)).pos(Pos::new(HPos::Right, VPos::Center));
            area.draw(&Text::new(self.names[row].clone(), (x - 8, y), style))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_stand_one_behind_or_one_below_the_other() {
        let bars = |stacked: bool| Bars {
            title: "time".into(),
            x: "wall time [s]".into(),
            names: vec!["a".into(), "b".into()],
            parts: vec![("one".into(), vec![1.0, 2.0]), ("two".into(), vec![3.0, f64::NAN])],
            stacked,
        };
        assert_eq!(bars(true).row(0), [([0.0, 1.0, 0.1, 0.9], 0), ([1.0, 4.0, 0.1, 0.9], 1)]);
        assert_eq!(bars(false).row(1)[0], ([0.0, 2.0, 0.1, 0.5], 0));
        assert_eq!(bars(false).row(1)[1].0[1], 0.0);
        let folder = tempfile::tempdir().unwrap();
        for stacked in [false, true] {
            let path = folder.path().join("bars.svg");
            bars(stacked).write(&path).unwrap();
            let text = std::fs::read_to_string(&path).unwrap();
            assert!(text.contains("wall time") && text.matches("<rect").count() >= 1 + 4 + 2);
            let page = bars(stacked).figure(0);
            assert_eq!(page.matches("<rect").count(), 4 + 2, "{page}");
            assert!(page.contains("<title>b, two: 0</title>") && page.contains("wall time [s]"));
        }
        Bars::default().write(&folder.path().join("none.svg")).unwrap();
    }
}
