//! Patches that the sheet cannot reach, patches far finer than its elements, radii that its elements cannot follow.

use std::collections::BTreeSet;

use super::clamping::Clamping;
use super::curvature::{Bend, FLAT, bends, corners};
use super::finding::Finding;
use super::size::{Size, Sizes};
use crate::geometry::{Aabb, Vec3};
use crate::report::doubt::{DoubtCode, place_mm};
use crate::run::cost::{Cost, GROWTH};
use crate::solver::{SimulationSetup, ToolSetup};
use crate::tool::Patch;

/// Elements over 90 degrees of a radius that follow it well.
const OVER_A_RADIUS: f64 = 4.0;
/// Depth over the thickness to which a tool may penetrate faces of elements between their nodes
/// ([`DoubtCode::PenetrationOnFaces`]).
const FACE_PENETRATION: f64 = 0.05;
/// Elements over 90 degrees below which one is bent by more than 45 degrees between its nodes: it may turn inside out, and its face
/// lies in the tool by more than 0.07 of the radius.
const FOLDS: f64 = 2.0;
/// Patches shorter than this share of an element, and within the tolerance even when longer by its inverse, are not felt.
const FINE: f64 = 0.25;
/// Shape error of a patch over the radius times the turn to the fourth power: 1 / 128 for an arc, up to five times as much
/// on saddles (the cross tool).
const ERROR: f64 = 5.0 / 128.0;
/// Share of a bend's direction from which finer elements along an edge help.
const HELPS: f64 = 0.5;
/// Memory of a patch's pieces and their tree.
const BYTES_A_PATCH: f64 = 2500.0;

/// Whether the sheet comes near no patch of some face of the CAD.
fn has_face_beyond(tool: &ToolSetup, kept: &[bool]) -> bool {
    let faces = &tool.surface.model().faces;
    let near: BTreeSet<u32> =
        faces.iter().zip(kept).filter(|(_, kept)| **kept).map(|(face, _)| *face).collect();
    faces.iter().any(|face| !near.contains(face))
}

/// Remarks on one tool; `kept`: patches the sheet may come near; `part`: where the model is, symmetry planes being its ends;
/// `clamping`: what of the tool the sheet does not bend over.
pub(super) fn remarks(
    tool: &ToolSetup,
    kept: &[bool],
    (part, clamping): (&Aabb, &Clamping<'_>),
    (sizes, cost): (&Sizes, &Cost),
    out: &mut Vec<Finding>,
) {
    let name = &tool.name;
    let (count, patches) = (kept.iter().filter(|k| **k).count(), kept.len());
    if count == 0 {
        out.push(Finding::note(
            format!("none of the {patches} patches of {name} can be reached by the sheet"),
            "check its place, direction and travel".into(),
        ));
        return;
    }
    if count < patches {
        let beyond = patches - count;
        out.push(Finding {
            auto: true,
            ..Finding::note(
                format!(
                    "{beyond} of {patches} patches of {name} are beyond the reach of the sheet"
                ),
                format!(
                    "{} of search trees, no unknowns{}",
                    megabytes(beyond as f64 * BYTES_A_PATCH),
                    if has_face_beyond(tool, kept) {
                        "; `kanagata convert --reach` leaves such faces out of the file"
                    } else {
                        ""
                    }
                ),
            )
        });
    }
    let model = tool.surface.model();
    let near = || model.patches.iter().zip(kept).filter(|(_, k)| **k).map(|(p, _)| p);
    let fine = near().filter(|p| is_fine(p, &tool.offset, sizes)).count();
    if 2 * fine > count {
        out.push(Finding::note(
            format!(
                "{fine} of {count} patches of {name} within reach are shorter than a quarter of the elements along their curvature, and within {:.4} mm even at four times their length",
                sizes.tolerance
            ),
            format!(
                "{} and the time to search them; convert with --tol {:.4} instead of fixed divisions",
                megabytes(fine as f64 * BYTES_A_PATCH),
                sizes.tolerance
            ),
        ));
    }
    let worst = Coarsest::of(tool, kept, (part, clamping), sizes);
    out.extend(worst.filter(|worst| worst.over >= FOLDS).map(|worst| worst.note(name, cost)));
}

/// A doubt about a tool over a radius of which elements may turn inside out.
pub(super) fn folding(
    tool: &ToolSetup,
    kept: &[bool],
    (part, clamping): (&Aabb, &Clamping<'_>),
    sizes: &Sizes,
) -> Option<Finding> {
    let worst = Coarsest::of(tool, kept, (part, clamping), sizes)?;
    (worst.over < FOLDS).then(|| worst.doubt(&tool.name))
}

/// A remark on a tool some of whose patches have no area.
pub(super) fn without_area(tool: &ToolSetup) -> Option<Finding> {
    let patches = &tool.surface.model().patches;
    let mut flat = patches.iter().enumerate().filter(|(_, patch)| patch.is_degenerate());
    let (first, patch) = flat.next()?;
    let x = patch.derivs(0.5, 0.5).s;
    Some(Finding::doubt(
        DoubtCode::PatchesWithoutArea,
        tool.name.clone(),
        format!(
            "{} of {} patches of {} have no area, first patch {first} at ({:.1}, {:.1}, {:.1}) mm of its file.",
            1 + flat.count(),
            patches.len(),
            tool.name,
            x.x,
            x.y,
            x.z
        ),
        "They have no normal, and contact forces there have no direction. Convert the tool again with `kanagata convert`, or remove these patches.".into(),
    ))
}

/// The smallest radius of the tools within reach, [mm]; infinite without any.
pub(super) fn sharpest(setup: &SimulationSetup, kept: &[Vec<bool>]) -> f64 {
    let tools = setup.tools.iter().zip(kept);
    let near = tools.flat_map(|(tool, kept)| tool.surface.model().patches.iter().zip(kept));
    let bent = near.filter(|(_, kept)| **kept).filter_map(|(patch, _)| bends(&corners(patch)));
    let radii = bent.map(|(_, [bend, _])| bend).filter(|bend| bend.turn() > FLAT);
    radii.map(|bend| bend.radius).fold(f64::INFINITY, f64::min)
}

fn megabytes(bytes: f64) -> String {
    if bytes < 1e5 { "less than 0.1 MB".into() } else { format!("about {:.1} MB", bytes / 1e6) }
}

/// A bend and the size of the elements along it.
type SizedBend = (Bend, Size);

/// The two bends of a patch, each with the size of the elements along it; those along which it is flat have none.
fn sized(patch: &Patch, offset: &Vec3, sizes: &Sizes) -> Option<(Vec3, [Option<SizedBend>; 2])> {
    let (middle, both) = bends(&corners(patch))?;
    let at = middle + offset;
    let size = |k: usize| {
        let (bend, other) = (both[k], both[1 - k].direction);
        let size = || sizes.along(&at, &bend.direction, &other).map(|size| (bend, size));
        (bend.turn() > FLAT).then(size).flatten()
    };
    Some((at, [size(0), size(1)]))
}

/// Whether coarser patches would do: short against the elements, and far within the tolerance, along a curvature, or, where
/// there is none, short in all directions.
fn is_fine(patch: &Patch, offset: &Vec3, sizes: &Sizes) -> bool {
    let bent = sized(patch, offset, sizes).map_or([None; 2], |(_, bent)| bent);
    if bent == [None; 2] {
        let corners = corners(patch);
        let pairs = (0..corners.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        let longest = pairs.map(|(a, b)| (corners[a].0 - corners[b].0).norm()).fold(0.0, f64::max);
        return longest < FINE * sizes.mean;
    }
    let within = |b: &Bend| ERROR * b.radius * (b.turn() / FINE).powi(4) < sizes.tolerance;
    let fine = |(b, s): &SizedBend| b.length < FINE * s.length && within(b);
    bent.iter().flatten().any(fine)
}

/// The place of a tool that has the fewest elements over its radius.
struct Coarsest {
    /// Elements over 90 degrees.
    over: f64,
    /// In the world [mm].
    at: Vec3,
    bend: Bend,
    size: Size,
    /// Elements over 90 degrees that are needed.
    needed: f64,
    /// How many times finer elements should be along their two edges.
    finer: [f64; 2],
}

/// Elements over 90 degrees of a radius [mm] that a sheet of this thickness [mm] needs. A chord of length `L` on a radius `R` is
/// `L^2 / (8 R)` inside it, which has to stay below the depth allowed.
fn needed(radius: f64, thickness: f64) -> f64 {
    let longest = (8.0 * radius * FACE_PENETRATION * thickness).sqrt();
    OVER_A_RADIUS.max(std::f64::consts::FRAC_PI_2 * radius / longest)
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
        // What lies beyond a symmetry plane is the image of what lies before it.
        let modelled = |p: &&Patch| {
            let corners = corners(p);
            let middle = corners.iter().map(|c| c.0).sum::<Vec3>() / corners.len().max(1) as f64;
            part.distance_squared(&(middle + tool.offset)) == 0.0
        };
        let bent = near.filter(modelled).filter(|patch| !clamping.is_behind(patch));
        Self::of_patches(&tool.offset, bent, sizes)
    }

    /// `None` where there are enough elements over every radius.
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
                for (finer, share) in all_finer.iter_mut().zip(size.shares) {
                    if share > HELPS {
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
            // Increments grow with the number of contacts that change.
            format!(
                "{:.1} keep the tool out of their faces to {:.0} % of the thickness and want elements of {:.2} mm along it: {:.0} unknowns if all are, {}",
                self.needed,
                100.0 * FACE_PENETRATION,
                self.size.length * self.over / self.needed,
                cost.unknowns as f64 * more,
                cost.times(more.powf(GROWTH))
            ),
        )
    }

    fn doubt(&self, name: &str) -> Finding {
        let at: [f64; 3] = self.at.into();
        Finding::doubt(
            DoubtCode::ElementsTooLong,
            format!("{name}, {}", place_mm(&at)),
            format!(
                "Elements of {:.2} mm are too long for the radius of {:.2} mm of {name} at {}: {:.1} over 90 degrees, {FOLDS} at least and {:.1} recommended. An element drawn over it bends by {:.0} degrees, may turn inside out, and the tool penetrates it between its nodes.",
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
        .exceeds([self.over, FOLDS])
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::contact::test_tools::{arc, plane, revolved};
    use crate::solver::sheet::hex_mesh::rectangle;
    use crate::tool::ToolModel;

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

    /// A torus sector of small radius 4 and large radius 2000: a shoulder that bends along x, 40 mm wide along y.
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

    fn told(nx: usize, ny: usize, tool: &ToolModel) -> Option<String> {
        coarsest(nx, ny, tool).map(|worst| worst.note("die", &cost()).to_string())
    }

    /// Elements of 6 mm are bent by 86 degrees, those of 2.9 mm by 41.
    #[test]
    fn elements_that_bend_by_more_than_half_a_right_angle_are_doubtful() {
        let die = shoulder(6);
        let worst = coarsest(10, 10, &die).unwrap();
        assert!(worst.over < FOLDS, "{}", worst.over);
        let text = worst.doubt("die").to_string();
        assert!(text.contains("bends by 86 degrees") && text.contains("inside out"), "{text}");
        assert!(text.contains("elements of 1.26 mm"), "{text}");
        assert!(coarsest(21, 10, &die).unwrap().over > FOLDS);
    }

    #[test]
    fn elements_are_held_against_radii_along_the_bend() {
        let die = shoulder(6);
        // 6.3 elements of 1 mm over 90 degrees, however long they are along the shoulder, whose radius of 2 m they follow.
        assert_eq!((told(60, 60, &die), told(60, 4, &die)), (None, None));
        let coarse = told(6, 60, &die).unwrap();
        assert!(
            coarse.contains("9.99 mm along the bend") && coarse.contains(": 0.6 over 90"),
            "{coarse}"
        );
        // Finer along x alone: 4.97 / 0.63 times as many.
        assert!(
            coarse.contains("elements of 1.26 mm") && coarse.contains(": 7896 unknowns"),
            "{coarse}"
        );
    }

    /// Four over sharp radii, more where a chord of that length is inside the tool by more than is allowed.
    #[test]
    fn large_radii_need_more_elements() {
        assert_eq!(needed(2.0, 1.0), OVER_A_RADIUS);
        let (radius, thickness) = (6.35, 1.0);
        let length = FRAC_PI_2 * radius / needed(radius, thickness);
        let depth = radius - (radius * radius - 0.25 * length * length).sqrt();
        assert!((depth / thickness - FACE_PENETRATION).abs() < 1e-3, "{depth}");
    }

    #[test]
    fn patches_short_across_their_curvature_are_fine() {
        let sizes = Sizes::new(&rectangle(60.0, 60.0, 1.0, 20, 20, 1), 1.0);
        let fine = |tool: &ToolModel| {
            let offset = Vec3::new(-1950.0, 0.0, 0.0);
            tool.patches.iter().filter(|p| is_fine(p, &offset, &sizes)).count()
        };
        // 0.26 mm by 20 mm, 3.75 degrees; 0.79 mm, 11.25 degrees; elements of 3 mm.
        assert_eq!((fine(&shoulder(24)), fine(&shoulder(8))), (48, 0));
        let flat = plane("p", Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z());
        let of =
            |size: usize| Sizes::new(&rectangle(60.0, 60.0, 1.0, 60 / size, 60 / size, 1), 1.0);
        let is = |size: usize| is_fine(&flat.patches[0], &Vec3::zeros(), &of(size));
        assert!(is(6) && !is(5));
        // A quarter of 90 degrees turns too much to be left to fewer patches.
        let ball =
            revolved("ball", 3, FRAC_PI_2, &[arc(4, [0.0, 7.0], 7.0, [-FRAC_PI_2, 0.0], 1.0)]);
        assert!(ball.patches.iter().all(|p| !is_fine(p, &Vec3::zeros(), &of(60))));
    }
}
