//! Audit map: the tool seen from above, coloured by shape error, with patch outlines, as an SVG without scripts.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::Audit;
use super::view::cut;
use kanagata_geometry::Vec3;
use kanagata_report::foreign::escaped;
use kanagata_tool::ToolModel;

/// Pixels of the longer side.
const PIXELS_MAX: usize = 300;
/// Number of colours on either side of white.
const SHADES: i32 = 16;
const MARGIN: usize = 10;
const HEAD: usize = 44;
const LEGEND: usize = 90;
const LINE: &str = "#777";

/// One pixel of the map.
#[derive(Clone, Copy)]
struct Pixel {
    height: f64,
    delta: f64,
    patch: usize,
}

struct Raster {
    columns: usize,
    rows: usize,
    pixels: Vec<Option<Pixel>>,
}

/// SVG of `tool` seen along -z, with a symmetric colour scale from blue (inside the CAD) to red (outside). Where
/// patches overlap the highest is shown; walls along z appear as lines.
#[must_use]
pub fn svg(tool: &ToolModel, found: &Audit) -> String {
    let raster = Raster::new(tool, found);
    let r = &found.report;
    let max_error = r.max_mm.abs().max(r.min_mm.abs()).max(1e-300);
    let (width, height) = (raster.columns + LEGEND + 2 * MARGIN, raster.rows + HEAD + MARGIN);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{}\" height=\"{}\" font-family=\"sans-serif\" font-size=\"10\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n\
         <text x=\"{MARGIN}\" y=\"18\" font-size=\"13\">{}: {} patches</text>\n\
         <text x=\"{MARGIN}\" y=\"34\">shape error {:+.4} to {:+.4} mm, rms {:.4} mm</text>\n\
         <g transform=\"translate({MARGIN},{HEAD})\" shape-rendering=\"crispEdges\">\n",
        2 * width,
        2 * height,
        escaped(&tool.name),
        r.patches,
        r.min_mm,
        r.max_mm,
        r.rms_mm,
    );
    for (color, path) in raster.paths(max_error) {
        let _ = writeln!(out, "<path fill=\"{color}\" d=\"{path}\"/>");
    }
    out.push_str("</g>\n");
    put_scale(&mut out, raster.columns + 2 * MARGIN, raster.rows, max_error);
    out.push_str("</svg>\n");
    out
}

impl Raster {
    fn new(tool: &ToolModel, found: &Audit) -> Self {
        let cut = cut(tool, &found.samples);
        let low = cut.points.iter().copied().reduce(|a, b| a.inf(&b)).unwrap_or_default();
        let high = cut.points.iter().copied().reduce(|a, b| a.sup(&b)).unwrap_or_default();
        let size = high - low;
        let pixel = (size.x.max(size.y) / PIXELS_MAX as f64).max(1e-300);
        let count = |length: f64| ((length / pixel).ceil() as usize).clamp(1, PIXELS_MAX);
        let (columns, rows) = (count(size.x), count(size.y));
        let mut out = Self { columns, rows, pixels: vec![None; columns * rows] };
        // Pixel coordinates, rows counted from the top.
        let place = |p: &Vec3| Vec3::new((p.x - low.x) / pixel, (high.y - p.y) / pixel, p.z);
        for (patch, cell) in &cut.cells {
            for k in 2..cell.len() {
                let ids = [cell[0], cell[k - 1], cell[k]];
                out.paint(
                    &ids.map(|id| place(&cut.points[id])),
                    ids.map(|id| cut.delta[id]),
                    *patch,
                );
            }
        }
        out
    }

    /// Paints the pixels whose centre a triangle covers, unless a higher patch does.
    fn paint(&mut self, corners: &[Vec3; 3], delta: [f64; 3], patch: usize) {
        let [a, b, c] = corners;
        let area = (b - a).xy().perp(&(c - a).xy());
        if area.abs() < 1e-12 {
            return;
        }
        let low = a.inf(b).inf(c);
        let high = a.sup(b).sup(c);
        let range = |low: f64, high: f64, count: usize| {
            (low - 0.5).ceil().max(0.0) as usize
                ..((high + 0.5).floor().max(0.0) as usize).min(count)
        };
        for row in range(low.y, high.y, self.rows) {
            for column in range(low.x, high.x, self.columns) {
                let p = Vec3::new(column as f64 + 0.5, row as f64 + 0.5, 0.0);
                let fraction = |u: &Vec3, v: &Vec3| (u - p).xy().perp(&(v - p).xy()) / area;
                let shares = [fraction(b, c), fraction(c, a), fraction(a, b)];
                if shares.iter().any(|s| *s < -1e-9) {
                    continue;
                }
                let mean = |v: [f64; 3]| v.iter().zip(shares).map(|(v, s)| v * s).sum::<f64>();
                let (height, delta) = (mean([a.z, b.z, c.z]), mean(delta));
                let at = &mut self.pixels[row * self.columns + column];
                if at.is_none_or(|old| height > old.height) {
                    *at = Some(Pixel { height, delta, patch });
                }
            }
        }
    }

    /// Colour of a pixel, or of the outline where its right or lower neighbour belongs to another patch.
    fn color(&self, row: usize, column: usize, max_error: f64) -> Option<String> {
        let at = |row: usize, column: usize| self.pixels[row * self.columns + column];
        let own = at(row, column)?;
        let other = |next: Option<Pixel>| next.is_some_and(|p| p.patch != own.patch);
        let right = column + 1 < self.columns && other(at(row, column + 1));
        let below = row + 1 < self.rows && other(at(row + 1, column));
        Some(if right || below { LINE.to_owned() } else { shade(own.delta / max_error) })
    }

    /// Path of all pixels of each colour.
    fn paths(&self, max_error: f64) -> BTreeMap<String, String> {
        let mut paths: BTreeMap<String, String> = BTreeMap::new();
        for row in 0..self.rows {
            let colors: Vec<_> = (0..self.columns).map(|k| self.color(row, k, max_error)).collect();
            let mut column = 0;
            for run in colors.chunk_by(|a, b| a == b) {
                if let Some(color) = &run[0] {
                    let path = paths.entry(color.clone()).or_default();
                    let _ = write!(path, "M{column} {row}h{0}v1h-{0}z", run.len());
                }
                column += run.len();
            }
        }
        paths
    }
}

/// Colour from blue over white to red for -1 to 1; grey for values that are not finite.
fn shade(fraction: f64) -> String {
    if !fraction.is_finite() {
        return "#ccc".into();
    }
    let steps = (fraction * f64::from(SHADES)).round().clamp(-f64::from(SHADES), f64::from(SHADES));
    let fade = 1.0 - steps.abs() / f64::from(SHADES);
    let full = if steps < 0.0 { [33.0, 82.0, 183.0] } else { [187.0, 21.0, 26.0] };
    let [r, g, b] = full.map(|c: f64| (c + (250.0 - c) * fade).round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Adds the colour scale with its limits, from `x` on next to a map of `rows`.
fn put_scale(out: &mut String, x: usize, rows: usize, max_error: f64) {
    let step = rows as f64 / f64::from(2 * SHADES + 1);
    for k in -SHADES..=SHADES {
        let y = HEAD as f64 + step * f64::from(SHADES - k);
        let color = shade(f64::from(k) / f64::from(SHADES));
        let _ = writeln!(
            out,
            "<rect x=\"{x}\" y=\"{y:.2}\" width=\"14\" height=\"{:.2}\" fill=\"{color}\"/>",
            step + 0.1
        );
    }
    for (fraction, value) in [
        (0.0, max_error),
        (0.25, 0.5 * max_error),
        (0.5, 0.0),
        (0.75, -0.5 * max_error),
        (1.0, -max_error),
    ] {
        let y = HEAD as f64 + fraction * (rows as f64 - 8.0) + 8.0;
        let _ = writeln!(out, "<text x=\"{}\" y=\"{y:.1}\">{value:+.4} mm</text>", x + 18);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{AuditOptions, ReferenceSurface, audit, reference::ReferenceFoot};
    use kanagata_tool::{Patch, ToolKind};

    /// The plane z = 0.
    struct Plane;
    impl ReferenceSurface for Plane {
        fn closest(&self, p: &Vec3, face: u32) -> Option<ReferenceFoot> {
            let point = Vec3::new(p.x, p.y, 0.0);
            Some(ReferenceFoot {
                point,
                normal: Vec3::z(),
                own_normal: None,
                face,
                on_border: false,
            })
        }
    }

    #[test]
    fn a_patch_above_is_red_one_below_blue_and_their_border_a_line() {
        let z = Vec3::zeros();
        // S = c0 + c1 eta + c2 zeta: 10 x 10 mm each, adjacent.
        let patch = |x: f64, height: f64| {
            let (corner, along, up) =
                (Vec3::new(x, 0.0, height), Vec3::new(10.0, 0.0, 0.0), Vec3::new(0.0, 10.0, 0.0));
            Patch::Quad([corner, along, up, z, z, z, z, z])
        };
        let tool = ToolModel::of_patches(
            "a < b",
            ToolKind::Nagata,
            vec![patch(0.0, 0.2), patch(10.0, -0.2)],
            vec![0, 0],
        );
        let found = audit(&tool, &Plane, &AuditOptions::default()).unwrap();
        let raster = Raster::new(&tool, &found);
        assert_eq!((raster.columns, raster.rows), (PIXELS_MAX, PIXELS_MAX / 2));
        assert!(raster.pixels.iter().all(Option::is_some));
        let paths = raster.paths(0.2);
        let colors: Vec<&str> = paths.keys().map(String::as_str).collect();
        assert_eq!(colors, [&shade(-1.0), LINE, &shade(1.0)]);
        // Half the map minus the outline.
        assert!(paths[&shade(1.0)].starts_with("M0 0h149v1"));
        let text = svg(&tool, &found);
        assert!(text.contains("a &lt; b: 2 patches") && text.contains("-0.2000 to +0.2000 mm"));
        assert_eq!(shade(f64::NAN), "#ccc");
        assert_eq!(shade(0.0), "#fafafa");
    }
}
