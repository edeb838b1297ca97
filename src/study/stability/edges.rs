//! Map of the coefficient of Eq. 8 over the normals of an edge, plain and guarded.

use std::ops::Range;

use super::description::EdgeMap;
use super::panel::Panel;
use kanagata_geometry::Vec3;
use kanagata_report::drawing::HeatMap;
use kanagata_tool::edge::{EdgeRule, edge_curve};

/// Tilt of the mean normal from the perpendicular of the edge [deg].
const TILT_DEG: Range<f64> = -45.0..45.0;
/// Angle between the normals [deg].
const ANGLE_DEG: Range<f64> = -120.0..120.0;

/// Maps of log10 `|c| / |d|` of plane edges for both rules.
pub(super) fn maps(plan: &EdgeMap) -> Vec<Panel> {
    [(EdgeRule::Plain, "Eq. 8 as printed"), (EdgeRule::Guarded, "guarded (grey: straight)")]
        .map(|(rule, title)| panel(plan.cells, rule, title))
        .into()
}

fn panel(cells: usize, rule: EdgeRule, title: &str) -> Panel {
    let at = |k: usize, range: &Range<f64>| {
        (range.start + (k as f64 + 0.5) / cells as f64 * (range.end - range.start)).to_radians()
    };
    let normal = |angle: f64| Vec3::new(angle.sin(), 0.0, angle.cos());
    let curves = (0..cells * cells).map(|k| {
        let (tilt, angle) = (at(k % cells, &TILT_DEG), at(k / cells, &ANGLE_DEG));
        let ends = [[normal(tilt - 0.5 * angle), normal(tilt + 0.5 * angle)]];
        let curve = edge_curve(&Vec3::x(), &ends, rule);
        let fault = curve.fault.is_some();
        if rule == EdgeRule::Guarded && fault {
            return (f64::NAN, true);
        }
        (curve.c.norm().log10(), !fault)
    });
    let (values, sound): (Vec<f64>, Vec<bool>) = curves.unzip();
    let sound = sound.iter().filter(|s| **s).count() as f64 / sound.len() as f64;
    let map = HeatMap {
        title: title.into(),
        x: ("tilt of the mean normal [deg]".into(), TILT_DEG),
        y: ("angle between the normals [deg]".into(), ANGLE_DEG),
        columns: cells,
        values,
    };
    Panel { map, sound }
}
