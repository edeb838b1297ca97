//! Travel of the punch until the tools close on the sheet.

use super::GivenTool;
use super::heights::{CELLS, Heights, extreme};
use super::roles::bounds;

/// Vertical component of a normal below which a face is a wall: its clearance hardly changes along z.
const WALL_SLOPE: f64 = 0.2;
/// Fraction of the box of the punch that both tools cover, from which the die has a bottom below the punch.
const COMMON_CELLS_MIN: f64 = 0.02;

/// Travel [mm] from where die and punch touch a flat sheet of this thickness to where their distance along the normal of
/// the die is the thickness. `None` where the die is open below the punch.
///
/// With the die below, heights z over a cell, and the normal's vertical component n of the die, the travel is the
/// minimum of `(z_punch - min z_punch + t) - (z_die - max z_die) - t / n` over the cells that both tools cover.
pub(super) fn closing_travel(
    die: &GivenTool,
    punch: &GivenTool,
    die_below: bool,
    thickness: f64,
) -> Option<f64> {
    let region = bounds(punch);
    let lower = Heights::new(&die.surface, &region, die_below);
    let upper = Heights::new(&punch.surface, &region, !die_below);
    let sign = if die_below { 1.0 } else { -1.0 };
    let top_of_die = sign * extreme(&die.surface, die_below);
    let tip_of_punch = sign * extreme(&punch.surface, !die_below);
    let cells = (0..CELLS * CELLS).filter_map(|k| Some((lower.at(k)?, upper.at(k)?)));
    let floors: Vec<_> = cells.filter(|(die, _)| die[1] > WALL_SLOPE).collect();
    if (floors.len() as f64) < COMMON_CELLS_MIN * (CELLS * CELLS) as f64 {
        return None;
    }
    let travel = |(die, punch): &([f64; 2], [f64; 2])| {
        let punch = sign * punch[0] - tip_of_punch + thickness;
        let die_height = sign * die[0] - top_of_die;
        punch - die_height - thickness / die[1]
    };
    let least = floors.iter().map(travel).fold(f64::INFINITY, f64::min);
    (least > 0.0).then_some(least)
}

/// Height of the punch or depth of the die, whichever is smaller [mm].
pub(super) fn height(die: &GivenTool, punch: &GivenTool) -> f64 {
    let of = |tool: &GivenTool| extreme(&tool.surface, true) - extreme(&tool.surface, false);
    of(die).min(of(punch))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, TAU};
    use std::sync::Arc;

    use super::*;
    use crate::test_tools::{arc, plane, revolved};
    use kanagata_contact::ToolSurface;
    use kanagata_geometry::Vec3;

    fn tool(name: &str, model: kanagata_tool::ToolModel) -> GivenTool {
        let surface = Arc::new(ToolSurface::new(model));
        GivenTool { name: name.into(), file: String::new(), cad: None, surface, has_side: true }
    }

    /// A ball of radius 9 in a bowl of radius 10 closes on a sheet of 1 mm after 10 mm, where their centres meet: the
    /// rim of the bowl and the tip of the ball touch the sheet at first.
    #[test]
    fn concentric_balls_close_on_the_sheet_between_them() {
        let ball = |r: f64, to: f64| {
            revolved("b", 32, TAU, &[arc(24, [0.0, 0.0], r, [-FRAC_PI_2, 0.0], to)])
        };
        let (die, punch) = (tool("die", ball(10.0, -1.0)), tool("punch", ball(9.0, 1.0)));
        let found = closing_travel(&die, &punch, true, 1.0).unwrap();
        // Over a rim that the punch has in common the vertical distance does not limit the travel.
        assert!((found - 10.0).abs() < 0.1, "{found}");
        assert_eq!(closing_travel(&die, &punch, true, 20.0), None);
    }

    #[test]
    fn a_die_that_is_open_below_the_punch_does_not_close() {
        let ring = plane("d", Vec3::new(5.0, 0.0, 0.0), Vec3::x(), Vec3::y() * 5.0, Vec3::z());
        let punch = plane("p", Vec3::zeros(), Vec3::x() * 5.01, Vec3::y() * 5.0, -Vec3::z());
        assert_eq!(closing_travel(&tool("d", ring), &tool("p", punch), true, 1.0), None);
    }
}
