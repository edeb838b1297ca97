//! Element lengths compared with the tool radii that the sheet is drawn over.

use super::clamping::Clamping;
use super::curvature::{FLAT_ANGLE, PrincipalCurvature, corners, principal_curvatures};
use super::element_size::{Size, Sizes};
use super::finding::Finding;
use crate::cost::{Cost, TIME_EXPONENT};
use kanagata_contact::ToolSurface;
use kanagata_geometry::{Aabb, Vec3};
use kanagata_report::doubt::{DoubtCode, place_mm};
use kanagata_solver::reach::reachable;
use kanagata_solver::{SimulationSetup, ToolSetup};
use kanagata_tool::Patch;

/// Elements over 90 degrees that represent a radius well.
const ELEMENTS_PER_90_DEG: f64 = 4.0;
/// Allowed penetration of a tool into element faces between nodes, over the thickness
/// ([`DoubtCode::PenetrationOnFaces`]).
const FACE_PENETRATION_MAX_REL: f64 = 0.05;
/// Elements over 90 degrees below which a doubt is raised. An element bends by more than 45 degrees and may invert; the
/// tool penetrates its face by more than 0.07 of the radius.
const ELEMENTS_PER_90_DEG_MIN: f64 = 2.0;
/// Component of the bending direction along an element edge above which refinement of that edge helps.
const EDGE_COMPONENT_MIN: f64 = 0.5;

/// A note on the coarsest radius of a tool whose elements do not invert.
///
/// `kept`: reachable patches; `part`: region of the model within its symmetry planes; `clamping`: patches the sheet does
/// not bend over.
pub(super) fn coarse(
    tool: &ToolSetup,
    kept: &[bool],
    (part, clamping): (&Aabb, &Clamping<'_>),
    (sizes, cost): (&Sizes, &Cost),
) -> Option<Finding> {
    let worst = Coarsest::of(tool, kept, (part, clamping), sizes)?;
    (worst.over >= ELEMENTS_PER_90_DEG_MIN).then(|| worst.note(&tool.name, cost))
}

/// A doubt about a tool radius over which elements may invert.
pub(super) fn inverting(
    tool: &ToolSetup,
    kept: &[bool],
    (part, clamping): (&Aabb, &Clamping<'_>),
    sizes: &Sizes,
) -> Option<Finding> {
    let worst = Coarsest::of(tool, kept, (part, clamping), sizes)?;
    (worst.over < ELEMENTS_PER_90_DEG_MIN).then(|| worst.doubt(&tool.name))
}

/// The smallest radius of all reachable patches [mm]; infinite if all are flat.
pub(super) fn sharpest(setup: &SimulationSetup, kept: &[Vec<bool>]) -> f64 {
    let tools = setup.tools.iter().zip(kept);
    let near = tools.flat_map(|(tool, kept)| tool.surface.model().patches.iter().zip(kept));
    smallest_radius(near.filter(|(_, kept)| **kept).map(|(patch, _)| patch))
}

/// The smallest radius of a surface [mm]; infinite if it is flat.
pub(crate) fn sharpest_of(surface: &ToolSurface) -> f64 {
    smallest_radius(surface.model().patches.iter())
}

/// The longest element that does not invert over the smallest radius that the sheet can touch [mm]; infinite if all are
/// flat.
#[must_use]
pub fn longest_element(setup: &SimulationSetup) -> f64 {
    std::f64::consts::FRAC_PI_2 * sharpest(setup, &reachable(setup)) / ELEMENTS_PER_90_DEG_MIN
}

fn smallest_radius<'a>(patches: impl Iterator<Item = &'a Patch>) -> f64 {
    let bent = patches.filter_map(|patch| principal_curvatures(&corners(patch)));
    let radii = bent.map(|(_, [bend, _])| bend).filter(|bend| bend.turn() > FLAT_ANGLE);
    radii.map(|bend| bend.radius).fold(f64::INFINITY, f64::min)
}

/// A principal curvature and the element size along it.
pub(super) type SizedCurvature = (PrincipalCurvature, Size);

/// Middle of a patch, and its principal curvatures with the element size along each; `None` for a flat direction.
pub(super) fn sized(
    patch: &Patch,
    offset: &Vec3,
    sizes: &Sizes,
) -> Option<(Vec3, [Option<SizedCurvature>; 2])> {
    let (middle, both) = principal_curvatures(&corners(patch))?;
    let at = middle + offset;
    let size = |k: usize| {
        let (bend, other) = (both[k], both[1 - k].direction);
        let size = || sizes.along(&at, &bend.direction, &other).map(|size| (bend, size));
        (bend.turn() > FLAT_ANGLE).then(size).flatten()
    };
    Some((at, [size(0), size(1)]))
}

/// The radius of a tool with the fewest elements.
struct Coarsest {
    /// Elements over 90 degrees.
    over: f64,
    /// Position in global coordinates [mm].
    at: Vec3,
    bend: PrincipalCurvature,
    size: Size,
    /// Required elements over 90 degrees.
    needed: f64,
    /// Refinement factors along the two edges of the elements.
    finer: [f64; 2],
}

/// Length of elements that represent a radius [mm] well for a thickness [mm].
pub(crate) fn wanted_length(radius: f64, thickness: f64) -> f64 {
    std::f64::consts::FRAC_PI_2 * radius / needed(radius, thickness)
}

/// Required elements over 90 degrees of a radius [mm] for a thickness [mm].
///
/// A chord of length L on a radius R penetrates by `L^2 / (8 R)`, which must not exceed the allowed penetration.
fn needed(radius: f64, thickness: f64) -> f64 {
    let longest = (8.0 * radius * FACE_PENETRATION_MAX_REL * thickness).sqrt();
    ELEMENTS_PER_90_DEG.max(std::f64::consts::FRAC_PI_2 * radius / longest)
}

impl Coarsest {
    fn of(
        tool: &ToolSetup,
        kept: &[bool],
        (part, clamping): (&Aabb, &Clamping<'_>),
        sizes: &Sizes,
    ) -> Option<Self> {
        let patches = tool.surface.model().patches.iter().zip(kept);
        let near = patches.filter(|(_, kept)| **kept).map(|(patch, _)| patch);
        // Patches beyond a symmetry plane are images of modelled ones.
        let modelled = |p: &&Patch| {
            let corners = corners(p);
            let middle = corners.iter().map(|c| c.0).sum::<Vec3>() / corners.len().max(1) as f64;
            part.distance_squared(&(middle + tool.offset)) == 0.0
        };
        let bent = near.filter(modelled).filter(|patch| !clamping.is_behind(patch));
        Self::of_patches(&tool.offset, bent, sizes)
    }

    /// `None` if every radius has enough elements.
    fn of_patches<'a>(
        offset: &Vec3,
        patches: impl Iterator<Item = &'a Patch>,
        sizes: &Sizes,
    ) -> Option<Self> {
        let mut worst: Option<Self> = None;
        let mut all_finer = [1.0_f64; 2];
        for patch in patches {
            let Some((at, bent)) = sized(patch, offset, sizes) else { continue };
            for (bend, size) in bent.into_iter().flatten() {
                let over = std::f64::consts::FRAC_PI_2 * bend.radius / size.length;
                let needed = needed(bend.radius, sizes.thickness);
                for (finer, share) in all_finer.iter_mut().zip(size.edge_components) {
                    if share > EDGE_COMPONENT_MIN {
                        *finer = finer.max(needed / over);
                    }
                }
                if worst.as_ref().is_none_or(|w| over * w.needed < w.over * needed) {
                    worst = Some(Self { over, at, bend, size, needed, finer: [1.0; 2] });
                }
            }
        }
        let worst = worst.filter(|worst| worst.over < worst.needed)?;
        Some(Self { finer: all_finer, ..worst })
    }

    fn found(&self, name: &str) -> String {
        let Self { over, at, bend, size, .. } = self;
        format!(
            "elements of {:.2} mm along the bend are coarse for the radius of {:.2} mm of {name} at ({:.1}, {:.1}, {:.1}) mm: {over:.1} over 90 degrees",
            size.length, bend.radius, at.x, at.y, at.z
        )
    }

    fn note(&self, name: &str, cost: &Cost) -> Finding {
        let more = self.finer[0] * self.finer[1];
        Finding::note(
            self.found(name),
            // The number of increments grows with the number of changing contacts.
            format!(
                "{:.1} limit the penetration of faces to {:.0} % of the thickness: elements of {:.2} mm along it, {:.0} unknowns if all are refined, {}",
                self.needed,
                100.0 * FACE_PENETRATION_MAX_REL,
                self.size.length * self.over / self.needed,
                cost.unknowns as f64 * more,
                cost.times(more.powf(TIME_EXPONENT))
            ),
        )
    }

    fn doubt(&self, name: &str) -> Finding {
        let at: [f64; 3] = self.at.into();
        Finding::doubt(
            DoubtCode::ElementsTooLong,
            format!("{name}, {}", place_mm(&at)),
            format!(
                "Elements of {:.2} mm are too long for the radius of {:.2} mm of {name} at {}: {:.1} over 90 degrees, {ELEMENTS_PER_90_DEG_MIN} at least and {:.1} recommended. An element drawn over it bends by {:.0} degrees, may turn inside out, and the tool penetrates it between its nodes.",
                self.size.length,
                self.bend.radius,
                place_mm(&at),
                self.over,
                self.needed,
                (90.0 / self.over).min(90.0)
            ),
            format!(
                "Use elements of {:.2} mm along the bend ({:.0} times the unknowns if all are).",
                self.size.length * self.over / self.needed,
                self.finer[0] * self.finer[1]
            ),
        )
        .exceeds([self.over, ELEMENTS_PER_90_DEG_MIN])
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::test_tools::{arc, revolved};
    use kanagata_solver::sheet::hex_mesh::rectangle;
    use kanagata_tool::ToolModel;

    fn cost() -> Cost {
        Cost {
            unknowns: 1000,
            measured: false,
            flop: 0.0,
            factors_mb: 0.0,
            memory_mb: 0.0,
            elements_s: 0.0,
            factor_s: 0.0,
            increments: [1.0; 2],
            iterations: [1.0; 2],
            seconds: [1.0; 2],
        }
    }

    /// A torus sector of small radius 4 and large radius 2000: a shoulder that bends along x and is 40 mm wide along y.
    fn shoulder(divisions: usize) -> ToolModel {
        let angle = 40.0 / 2000.0;
        let profile = [arc(divisions, [2000.0, 0.0], 4.0, [0.0, FRAC_PI_2], 1.0)];
        revolved("shoulder", 2, angle, &profile)
    }

    fn coarsest(nx: usize, ny: usize, tool: &ToolModel) -> Option<Coarsest> {
        let sizes = Sizes::new(&rectangle(60.0, 60.0, 1.0, nx, ny, 1), 1.0);
        let offset = Vec3::new(-1950.0, 0.0, 0.0);
        Coarsest::of_patches(&offset, tool.patches.iter(), &sizes)
    }

    fn text_of(nx: usize, ny: usize, tool: &ToolModel) -> Option<String> {
        coarsest(nx, ny, tool).map(|worst| worst.note("die", &cost()).to_string())
    }

    /// Elements of 6 mm bend by 86 degrees, elements of 2.9 mm by 41.
    #[test]
    fn elements_that_bend_by_more_than_half_a_right_angle_are_doubtful() {
        let die = shoulder(6);
        let worst = coarsest(10, 10, &die).unwrap();
        assert!(worst.over < ELEMENTS_PER_90_DEG_MIN, "{}", worst.over);
        let text = worst.doubt("die").to_string();
        assert!(text.contains("bends by 86 degrees") && text.contains("inside out"), "{text}");
        assert!(text.contains("elements of 1.26 mm"), "{text}");
        assert!(coarsest(21, 10, &die).unwrap().over > ELEMENTS_PER_90_DEG_MIN);
    }

    #[test]
    fn elements_are_held_against_radii_along_the_bend() {
        let die = shoulder(6);
        // 6.3 elements of 1 mm over 90 degrees. Their length along the shoulder does not matter: its radius is 2 m.
        assert_eq!((text_of(60, 60, &die), text_of(60, 4, &die)), (None, None));
        let coarse = text_of(6, 60, &die).unwrap();
        assert!(
            coarse.contains("9.99 mm along the bend") && coarse.contains(": 0.6 over 90"),
            "{coarse}"
        );
        // Refined along x only: 4.97 / 0.63 times as many.
        assert!(
            coarse.contains("elements of 1.26 mm") && coarse.contains(", 7896 unknowns"),
            "{coarse}"
        );
    }

    /// Four over sharp radii; more where the chord of such an element would penetrate by more than is allowed.
    #[test]
    fn large_radii_need_more_elements() {
        assert_eq!(needed(2.0, 1.0), ELEMENTS_PER_90_DEG);
        let (radius, thickness) = (6.35, 1.0);
        let length = FRAC_PI_2 * radius / needed(radius, thickness);
        let depth = radius - (radius * radius - 0.25 * length * length).sqrt();
        assert!((depth / thickness - FACE_PENETRATION_MAX_REL).abs() < 1e-3, "{depth}");
    }
}
