//! Charts and 3-D views as plotly traces.

use serde_json::{Value, json};

use super::foreign::in_template;
use crate::geometry::Vec3;

/// One line of a chart.
#[derive(Debug, Clone)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Abscissae.
    pub x: Vec<f64>,
    /// Ordinates, one per abscissa.
    pub y: Vec<f64>,
}

/// Traces and layout of a line chart.
#[must_use]
pub fn lines(series: &[Series], x_title: &str, y_title: &str) -> (Vec<Value>, Value) {
    let traces = series
        .iter()
        .map(|s| {
            let mode = if s.x.len() <= 40 { "lines+markers" } else { "lines" };
            json!({"type": "scatter", "mode": mode, "name": s.name,
                   "x": short(&s.x), "y": short(&s.y)})
        })
        .collect();
    let layout = json!({
        "xaxis": {"title": {"text": x_title}, "zeroline": false},
        "yaxis": {"title": {"text": y_title}, "zeroline": false},
        "showlegend": series.len() > 1,
        "margin": {"t": 24, "r": 24, "l": 72, "b": 56},
        "font": {"family": "system-ui, sans-serif", "size": 14},
    });
    (traces, layout)
}

/// Traces and layout of a scatter chart over dotted guide lines. Hovering a point shows its index, from 0.
#[must_use]
pub fn points(
    points: &Series,
    guides: &[Series],
    x_title: &str,
    y_title: &str,
) -> (Vec<Value>, Value) {
    let (mut traces, mut layout) = lines(guides, x_title, y_title);
    for trace in &mut traces {
        trace["mode"] = json!("lines");
        trace["line"] = json!({"dash": "dot", "width": 1.5});
        trace["hoverinfo"] = json!("skip");
    }
    traces.push(json!({"type": "scatter", "mode": "markers", "name": points.name,
        "x": short(&points.x), "y": short(&points.y),
        "marker": {"size": 4, "opacity": 0.6, "color": "#1b6ca8"},
        "hovertemplate": "%{x:.4f}, %{y:.4f}<extra>%{pointNumber}</extra>"}));
    layout["showlegend"] = json!(true);
    layout["hovermode"] = json!("closest");
    (traces, layout)
}

/// A triangulated surface with a value at every point.
#[derive(Debug, Clone, Default)]
pub struct ValuedSurface {
    /// Name in the legend.
    pub name: String,
    /// Points [mm].
    pub points: Vec<Vec3>,
    /// Triangles by point ids.
    pub triangles: Vec<[u32; 3]>,
    /// A value at every point; empty: one uniform grey.
    pub values: Vec<f64>,
    /// Name of the quantity, with unit.
    pub quantity: String,
    /// Opacity, 0 to 1.
    pub opacity: f64,
    /// The colour scale is centred on zero (signed quantities).
    pub signed: bool,
    /// Hidden until its name in the legend is clicked.
    pub hidden: bool,
}

/// Traces and layout of a 3-D view of surfaces, each with its own colour bar.
#[must_use]
pub fn surfaces(parts: &[ValuedSurface]) -> (Vec<Value>, Value) {
    let mut traces = Vec::new();
    let mut bars = 0;
    for part in parts {
        let axis = |k: usize| short(&part.points.iter().map(|p| p[k]).collect::<Vec<_>>());
        let corner = |k: usize| part.triangles.iter().map(|t| t[k]).collect::<Vec<_>>();
        let mut trace = json!({
            "type": "mesh3d", "name": part.name, "showlegend": true, "opacity": part.opacity,
            "x": axis(0), "y": axis(1), "z": axis(2),
            "i": corner(0), "j": corner(1), "k": corner(2),
            "flatshading": false, "lighting": {"ambient": 0.65, "diffuse": 0.6, "specular": 0.1},
        });
        if part.values.is_empty() {
            trace["color"] = json!("#9aa5b1");
        } else {
            colour(&mut trace, part, bars);
            bars += 1;
        }
        if part.hidden {
            trace["visible"] = json!("legendonly");
        }
        traces.push(trace);
    }
    let axis = |name: &str| json!({"title": {"text": name}, "backgroundcolor": "#f5f7fa"});
    let layout = json!({
        "scene": {"aspectmode": "data", "xaxis": axis("x [mm]"), "yaxis": axis("y [mm]"),
                  "zaxis": axis("z [mm]"), "camera": {"eye": {"x": 1.3, "y": -1.5, "z": 0.9}}},
        "margin": {"t": 8, "r": 8, "l": 8, "b": 8},
        "legend": {"x": 0, "y": 1},
        "font": {"family": "system-ui, sans-serif", "size": 13},
    });
    (traces, layout)
}

/// Minimum half width of a signed colour scale, for values that are all zero. The renderer works in single precision.
const SIGNED_SCALE_MIN: f64 = 1e-6;

fn colour(trace: &mut Value, part: &ValuedSurface, bars: usize) {
    let low = part.values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = part.values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let (low, high, scale) = if part.signed {
        let top = low.abs().max(high.abs()).max(SIGNED_SCALE_MIN);
        (-top, top, "RdBu")
    } else {
        (low, high, "Viridis")
    };
    trace["intensity"] = json!(short(&part.values));
    trace["colorscale"] = json!(scale);
    trace["cmin"] = json!(low);
    trace["cmax"] = json!(high);
    trace["hovertemplate"] =
        json!(format!("%{{intensity:.5g}}<extra>{}</extra>", in_template(&part.name)));
    trace["colorbar"] = json!({"title": {"text": part.quantity, "side": "right"},
        "len": 0.8, "thickness": 14, "x": 1.0 + 0.1 * bars as f64});
}

/// Values rounded to six significant digits, which cuts the page to about a third; NaN becomes a gap.
fn short(values: &[f64]) -> Vec<Value> {
    let round = |v: &f64| format!("{v:.5e}").parse::<f64>().map_or(Value::Null, |r| json!(r));
    values.iter().map(round).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_lie_over_their_guides() {
        let of = |name: &str| Series { name: name.into(), x: vec![0.0, 0.5], y: vec![0.0, 1.0] };
        let (traces, layout) = points(&of("elements"), &[of("guide")], "minor", "major");
        assert_eq!(
            (traces[0]["mode"].clone(), traces[1]["mode"].clone()),
            ("lines".into(), "markers".into())
        );
        assert_eq!(traces[1]["y"], json!([0.0, 1.0]));
        assert_eq!(layout["xaxis"]["title"]["text"], json!("minor"));
    }

    #[test]
    fn a_signed_surface_has_a_scale_centred_on_zero() {
        let part = ValuedSurface {
            name: "die".into(),
            points: vec![Vec3::zeros(), Vec3::x(), Vec3::y()],
            triangles: vec![[0, 1, 2]],
            values: vec![-0.1, 0.02, 0.03],
            quantity: "shape error [mm]".into(),
            opacity: 1.0,
            signed: true,
            hidden: false,
        };
        let (traces, _) = surfaces(&[part]);
        assert_eq!(traces[0]["cmin"], json!(-0.1));
        assert_eq!(traces[0]["cmax"], json!(0.1));
    }

    #[test]
    fn numbers_are_cut_to_six_digits_and_nan_becomes_a_gap() {
        assert_eq!(short(&[1.234_567_89, f64::NAN])[0], json!(1.23457));
        assert_eq!(short(&[f64::NAN])[0], Value::Null);
    }
}
