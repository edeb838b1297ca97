//! Lengths that no forming process has in mm: a scene, or a tool file, in another unit.

use super::finding::Finding;
use crate::geometry::Aabb;
use crate::report::digits::four_digits;
use crate::report::doubt::DoubtCode;
use crate::solver::{SimulationSetup, ToolSetup};

/// Thickness of formed sheets [mm]: foils of 0.01 mm to plates of 50 mm. The lower limit is above any sheet in metres
/// (50 mm would be 0.05), the upper one below any foil in micrometres but the thinnest.
const THICKNESS: [f64; 2] = [0.01, 50.0];
/// Longest side of a blank [mm]: a connector of 1 mm to a wing panel of 20 m.
const BLANK: [f64; 2] = [1.0, 20_000.0];
/// Size of a tool over that of the blank: a factor of 25.4 (inches) passes for a large or a small tool, one of 1000 does not.
const TOOL_OVER_BLANK: [f64; 2] = [0.005, 200.0];

/// Findings on the sizes of blank and tools.
pub(super) fn findings(setup: &SimulationSetup, out: &mut Vec<Finding>) {
    let mesh = setup.body.mesh();
    let lower = mesh.bottom_nodes().into_iter().map(|n| mesh.nodes[n as usize]);
    let lower = Aabb::of_points(&lower.collect::<Vec<_>>());
    let size = (lower.max - lower.min).max();
    let found = [
        ("blank.thickness_mm", "thickness", mesh.mean_thickness(), THICKNESS),
        ("blank.shape", "longest side", size, BLANK),
    ];
    out.extend(found.into_iter().filter_map(|(key, name, value, range)| {
        let limit = outside(value, range)?;
        let what = format!(
            "The {name} of the blank is {} mm; formed sheets have {} to {} mm.",
            four_digits(value),
            range[0],
            range[1]
        );
        let remedy = unit_of(value, range);
        let doubt = Finding::doubt(DoubtCode::SceneUnits, key.into(), what, remedy);
        Some(doubt.exceeds([value, limit]))
    }));
    let blank = Aabb::of_points(&mesh.nodes).diagonal();
    out.extend(setup.tools.iter().filter_map(|tool| tool_against_blank(tool, blank)));
}

/// A doubt about a tool far larger or smaller than a blank with a diagonal of `blank` [mm].
fn tool_against_blank(tool: &ToolSetup, blank: f64) -> Option<Finding> {
    let size = tool.surface.bounds().diagonal();
    let ratio = size / blank;
    let limit = outside(ratio, TOOL_OVER_BLANK)?;
    let doubt = Finding::doubt(
        DoubtCode::SceneUnits,
        tool.name.clone(),
        format!(
            "{} is {size:.4} mm large and the blank {blank:.4} mm: a ratio of {ratio:.2e}.",
            tool.name
        ),
        "Check the units of the tool file and of the scene: both are in mm.".into(),
    );
    Some(doubt.exceeds([ratio, limit]))
}

/// The limit of the range that a value is beyond.
fn outside(value: f64, [low, high]: [f64; 2]) -> Option<f64> {
    if value < low { Some(low) } else { (value > high).then_some(high) }
}

/// The unit that the value is likely in.
fn unit_of(value: f64, [low, high]: [f64; 2]) -> String {
    let units = [("metres", 1000.0), ("inches", 25.4), ("micrometres", 1e-3)];
    let fits = units.iter().find(|(_, factor)| (low..=high).contains(&(value * factor)));
    fits.map_or_else(
        || "Check the unit: lengths are in mm.".into(),
        |(unit, factor)| {
            format!(
                "Lengths are in mm; in {unit} this would be {} mm.",
                four_digits(value * factor)
            )
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_is_named() {
        assert_eq!(outside(0.8, THICKNESS), None);
        assert_eq!(outside(0.0008, THICKNESS), Some(0.01));
        assert!(unit_of(0.0008, THICKNESS).contains("metres this would be 0.8 mm"));
        assert!(unit_of(800.0, THICKNESS).contains("micrometres"));
        assert!(!unit_of(1e-9, THICKNESS).contains("would be"));
    }
}
