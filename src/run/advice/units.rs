//! Implausible lengths: a scene or a tool file in another unit than mm.

use super::finding::Finding;
use kanagata_geometry::Aabb;
use kanagata_report::digits::four_digits;
use kanagata_report::doubt::DoubtCode;
use kanagata_solver::{SimulationSetup, ToolSetup};

/// Range of sheet thicknesses [mm]: from foils to plates. The lower limit is above any sheet given in metres (50 mm
/// would be 0.05), the upper one below any foil given in micrometres but the thinnest.
const THICKNESS_RANGE_MM: [f64; 2] = [0.01, 50.0];
/// Range of the longest side of a blank [mm]: from a connector of 1 mm to a wing panel of 20 m.
const BLANK_RANGE_MM: [f64; 2] = [1.0, 20_000.0];
/// Range of the size of a tool over that of the blank. A factor of 25.4 (inches) may be a large or a small tool, a
/// factor of 1000 cannot.
const TOOL_SIZE_RANGE_REL: [f64; 2] = [0.005, 200.0];

/// Doubts about the sizes of blank and tools.
pub(super) fn findings(setup: &SimulationSetup, out: &mut Vec<Finding>) {
    let mesh = setup.body.mesh();
    let lower = mesh.bottom_nodes().into_iter().map(|n| mesh.nodes[n as usize]);
    let lower = Aabb::of_points(&lower.collect::<Vec<_>>());
    let size = (lower.max - lower.min).max();
    let found = [
        ("blank.thickness_mm", "thickness", mesh.mean_thickness(), THICKNESS_RANGE_MM),
        ("blank.shape", "longest side", size, BLANK_RANGE_MM),
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

/// A doubt about a tool far larger or smaller than the blank, whose diagonal is `blank` [mm].
fn tool_against_blank(tool: &ToolSetup, blank: f64) -> Option<Finding> {
    let size = tool.surface.bounds().diagonal();
    let ratio = size / blank;
    let limit = outside(ratio, TOOL_SIZE_RANGE_REL)?;
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

/// The limit of the range that a value exceeds; `None` within the range.
fn outside(value: f64, [low, high]: [f64; 2]) -> Option<f64> {
    if value < low { Some(low) } else { (value > high).then_some(high) }
}

/// The remedy: the unit in which the value would be in range.
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
        assert_eq!(outside(0.8, THICKNESS_RANGE_MM), None);
        assert_eq!(outside(0.0008, THICKNESS_RANGE_MM), Some(0.01));
        assert!(unit_of(0.0008, THICKNESS_RANGE_MM).contains("metres this would be 0.8 mm"));
        assert!(unit_of(800.0, THICKNESS_RANGE_MM).contains("micrometres"));
        assert!(!unit_of(1e-9, THICKNESS_RANGE_MM).contains("would be"));
    }
}
