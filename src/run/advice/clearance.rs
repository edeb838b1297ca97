//! Clearance between tools at the end of their travel, compared with the thickness of the sheet and the shape errors of
//! the tools.

use super::element_size::SHAPE_ERROR_TOLERANCE_REL;
use super::finding::{Conversion, Finding};
use super::shape_error::{ShapeError, shape_error};
use super::travel::end_of;
use kanagata_audit::clearance::{ClearanceOptions, clearance};
use kanagata_geometry::Vec3;
use kanagata_scene::Plan;
use kanagata_solver::SimulationSetup;

/// Allowed sum of shape errors, over the clearance beside the sheet and over the thickness.
const SHAPE_ERROR_PER_CLEARANCE: f64 = 0.5;
const SHAPE_ERROR_PER_THICKNESS: f64 = 2.0 * SHAPE_ERROR_TOLERANCE_REL;
/// Sampling intervals along a side of a patch.
const SIDE_INTERVALS: usize = 3;

/// Notes on pairs of facing tools whose travels are prescribed. `kept`: reachable patches of each tool.
pub(super) fn findings(
    plan: &Plan,
    setup: &SimulationSetup,
    kept: &[Vec<bool>],
    out: &mut Vec<Finding>,
) {
    let thickness = setup.body.mesh().mean_thickness();
    let tools = &setup.tools;
    for a in 0..tools.len() {
        for b in 0..a {
            let (Some(end_a), Some(end_b)) = (farthest(setup, a), farthest(setup, b)) else {
                continue;
            };
            if tools[a].direction.dot(&tools[b].direction) > -0.5 || (end_a == 0.0 && end_b == 0.0)
            {
                continue;
            }
            let shift = |k: usize, travel: f64| tools[k].offset + tools[k].direction * travel;
            let options = ClearanceOptions {
                travel: shift(a, end_a) - shift(b, end_b),
                thickness_mm: thickness,
                samples: SIDE_INTERVALS,
                refine: 8,
                nearest: 1,
            };
            let found = clearance(tools[a].surface.model(), &tools[b].surface, &options);
            if let Some(minimum) = found.min_mm {
                let errors = [a, b].map(|k| {
                    let patches = &tools[k].surface.model().patches;
                    shape_error(plan.tools[k].shape_error_mm, patches, &kept[k])
                });
                let names = [a, b].map(|k| tools[k].name.as_str());
                let at = found.at_mm.map(Vec3::from);
                out.extend(Clearance { names, minimum, at, thickness, errors }.finding());
            }
        }
    }
}

/// Clearance of a pair of tools at the end of their travel.
struct Clearance<'a> {
    names: [&'a str; 2],
    /// Smallest clearance [mm]; negative where the tools overlap.
    minimum: f64,
    /// Position of the minimum [mm].
    at: Option<Vec3>,
    /// Thickness of the sheet [mm].
    thickness: f64,
    errors: [Option<ShapeError>; 2],
}

impl Clearance<'_> {
    fn finding(&self) -> Option<Finding> {
        let ironed = self.free_gap() < -SHAPE_ERROR_PER_THICKNESS * self.thickness;
        if !ironed {
            return self.is_coarse().then(|| self.coarse());
        }
        let overlap = self.minimum < 0.0 && self.known_error() < -self.minimum;
        Some(if overlap { self.overlapping() } else { self.ironing() })
    }

    /// Clearance less thickness [mm].
    fn free_gap(&self) -> f64 {
        self.minimum - self.thickness
    }

    /// Sum of the known shape errors [mm].
    fn known_error(&self) -> f64 {
        self.errors.iter().flatten().map(|e| e.mm).sum()
    }

    /// Sum of shape errors that the clearance allows [mm].
    fn allowed_error(&self) -> f64 {
        SHAPE_ERROR_PER_CLEARANCE
            * self.free_gap().max(2.0 * SHAPE_ERROR_PER_THICKNESS * self.thickness)
    }

    fn is_coarse(&self) -> bool {
        self.known_error() > self.allowed_error()
    }

    fn both(&self) -> String {
        self.names.join(" and ")
    }

    fn place(&self) -> String {
        self.at.map_or_else(String::new, |p| format!(" at ({:.1}, {:.1}, {:.1}) mm", p.x, p.y, p.z))
    }

    /// The sum of the shape errors, and for estimates the patches that cause it.
    fn error_text(&self) -> String {
        let estimated = self.errors.iter().flatten().any(|e| e.from.is_some());
        let about = if estimated { "about " } else { "" };
        let each = 0.5 * self.allowed_error();
        let named = self.errors.iter().zip(self.names);
        let coarse: Vec<String> =
            named.filter_map(|(e, name)| e.as_ref()?.patches_text(name, each)).collect();
        let patches = if coarse.is_empty() {
            String::new()
        } else {
            format!(" (estimated: {})", coarse.join("; "))
        };
        format!("{about}{:.3} mm together{patches}", self.known_error())
    }

    fn finer_tools(&self) -> String {
        let each = 0.5 * self.allowed_error();
        format!("convert to a tolerance of {each:.4} mm; unknowns stay the same")
    }

    /// The conversion that makes the tools accurate enough.
    fn conversion(&self) -> Conversion {
        Conversion::Within(0.5 * self.allowed_error())
    }

    /// Note: shape errors too large for the clearance.
    fn coarse(&self) -> Finding {
        Finding::note(
            format!(
                "the shape errors of {} are {}, their clearance leaves {:.3} mm beside the sheet{}: too coarse",
                self.both(),
                self.error_text(),
                self.free_gap().max(0.0),
                self.place()
            ),
            self.finer_tools(),
        )
        .conversion(self.conversion())
    }

    /// Note: the tools overlap.
    fn overlapping(&self) -> Finding {
        Finding::note(
            format!(
                "{} overlap by {:.3} mm at the end of their travel{}, with the sheet of {:.3} mm between them",
                self.both(),
                -self.minimum,
                self.place(),
                self.thickness
            ),
            "no equilibrium exists there: check travel and place of both".into(),
        )
    }

    /// Note: clearance below the thickness.
    fn ironing(&self) -> Finding {
        let (both, place) = (self.both(), self.place());
        let mut what = format!(
            "{both} leave {:.3} mm at the end of their travel{place}, the sheet has {:.3} mm",
            self.minimum, self.thickness
        );
        let mut cost = "it is ironed there: forces and run time are many times higher".to_owned();
        if !self.is_coarse() {
            return Finding::note(what, cost);
        }
        what += &format!("; their shape errors are {}: too coarse", self.error_text());
        cost += &format!("; {}", self.finer_tools());
        Finding::note(what, cost).conversion(self.conversion())
    }
}

/// Travel of a tool of largest magnitude [mm]; `None` if a force or a spring drives it.
fn farthest(setup: &SimulationSetup, tool: usize) -> Option<f64> {
    let mut now = 0.0_f64;
    let mut farthest = 0.0_f64;
    for stage in &setup.stages {
        now = end_of(&stage.motions[tool], now)?;
        farthest = if now.abs() > farthest.abs() { now } else { farthest };
    }
    Some(farthest)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::test_tools::{arc, revolved};

    #[test]
    fn room_is_held_against_thickness_and_shape_error() {
        let finding_for = |minimum: f64, errors: [Option<f64>; 2]| {
            let errors = errors.map(|mm| mm.map(|mm| ShapeError { mm, from: None }));
            let names = ["a", "b"];
            let clearance = Clearance { names, minimum, at: None, thickness: 1.0, errors };
            clearance.finding().map(|r| r.to_string())
        };
        assert_eq!(finding_for(1.2, [Some(0.01), None]), None);
        let ironed = finding_for(0.9, [None; 2]).unwrap();
        assert!(ironed.contains("ironed") && !ironed.contains("coarse"), "{ironed}");
        let coarse = finding_for(1.1, [Some(0.04), Some(0.03)]).unwrap();
        assert!(
            coarse.contains("0.070 mm") && coarse.contains("tolerance of 0.0250 mm"),
            "{coarse}"
        );
        let both = finding_for(0.9, [Some(0.04), None]).unwrap();
        assert!(both.contains("ironed") && both.contains("tolerance of 0.0100 mm"), "{both}");
        let apart = finding_for(-0.489, [Some(0.04), None]).unwrap();
        assert!(apart.contains("overlap by 0.489 mm") && !apart.contains("tolerance"), "{apart}");
    }

    #[test]
    fn coarse_patches_are_named_if_the_file_records_no_error() {
        let finding_for = |divisions: usize, minimum: f64| {
            let profile = [arc(divisions, [0.0, 7.0], 7.0, [-FRAC_PI_2, 0.0], 1.0)];
            let patches = revolved("die", divisions, FRAC_PI_2, &profile).patches;
            let error = shape_error(None, &patches, &vec![true; patches.len()]);
            let (names, errors) = (["die", "punch"], [error, None]);
            let clearance = Clearance { names, minimum, at: None, thickness: 1.0, errors };
            clearance.finding().map(|r| r.to_string())
        };
        for minimum in [0.9, 1.1] {
            let text = finding_for(1, minimum).unwrap();
            for part in ["of die", "turns by 90 degrees", "too coarse", "tolerance of"] {
                assert!(text.contains(part), "{part}: {text}");
            }
        }
        assert_eq!(finding_for(8, 1.1), None);
    }
}
