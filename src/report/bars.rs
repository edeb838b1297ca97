//! Bar charts, grouped or stacked, with one row per name: as SVG and as plotly traces.

use std::path::Path;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use serde_json::{Value, json};

use super::drawing::{Area, COLORS, Drawn, LEGEND_WIDTH_PX, Line, Short, draw_legend, write_svg};
use crate::files::WriteError;

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

    /// Plotly traces and layout.
    #[must_use]
    pub fn traces(&self) -> (Vec<Value>, Value) {
        let trace = |(name, lengths): &(String, Vec<f64>)| json!({"type": "bar", "orientation": "h", "name": name, "x": lengths, "y": self.names});
        let layout = json!({
            "barmode": if self.stacked { "stack" } else { "group" },
            "xaxis": {"title": {"text": self.x}},
            "yaxis": {"autorange": "reversed", "automargin": true},
            "showlegend": self.parts.len() > 1,
            "legend": {"traceorder": "normal"},
            "margin": {"t": 24, "r": 24, "l": 72, "b": 56},
            "font": {"family": "system-ui, sans-serif", "size": 14},
        });
        (self.parts.iter().map(trace).collect(), layout)
    }

    /// Height of the drawing and of the plot on a page [px].
    #[must_use]
    pub fn height(&self) -> usize {
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
        let longest = rows.iter().flatten().map(|(bar, _)| bar[1]).fold(0.0, f64::max);
        let longest = if longest > 0.0 { 1.05 * longest } else { 1.0 };
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
            let (traces, layout) = bars(stacked).traces();
            assert_eq!(traces.len(), 2);
            assert_eq!(layout["barmode"], if stacked { "stack" } else { "group" });
        }
        Bars::default().write(&folder.path().join("none.svg")).unwrap();
    }
}
