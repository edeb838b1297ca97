//! Unreachable patches, patches far finer than the elements, and patches without area.

use std::collections::BTreeSet;

use super::curvature::{PrincipalCurvature, corners};
use super::element_size::Sizes;
use super::finding::{Conversion, Finding};
use super::radii::{SizedCurvature, sized};
use kanagata_geometry::Vec3;
use kanagata_report::doubt::DoubtCode;
use kanagata_solver::ToolSetup;
use kanagata_tool::Patch;

/// Length of a patch over that of an element below which the patch is finer than needed, if patches longer by the
/// inverse are still within tolerance.
const FINE_LENGTH_REL: f64 = 0.25;
/// Shape error of a patch over radius times angle to the fourth power: 1/128 for an arc, up to five times as much on
/// saddles (the cross tool).
const PATCH_ERROR_COEFFICIENT: f64 = 5.0 / 128.0;
/// Memory of a patch's Bezier pieces and their search tree [B].
const BYTES_PER_PATCH: f64 = 2500.0;

/// Whether some CAD face has no reachable patch.
fn has_unreachable_face(tool: &ToolSetup, kept: &[bool]) -> bool {
    let faces = &tool.surface.model().faces;
    let near: BTreeSet<u32> =
        faces.iter().zip(kept).filter(|(_, kept)| **kept).map(|(face, _)| *face).collect();
    faces.iter().any(|face| !near.contains(face))
}

/// Notes on the patches of one tool. `kept`: reachable patches; `reachable_only`: the tool is made of reachable faces.
pub(super) fn findings(
    tool: &ToolSetup,
    kept: &[bool],
    reachable_only: bool,
    sizes: &Sizes,
    out: &mut Vec<Finding>,
) {
    if !kept.contains(&true) {
        let (patches, name) = (kept.len(), &tool.name);
        out.push(Finding::note(
            format!("the sheet can touch none of the {patches} patches of {name}"),
            "check its place, direction and travel".into(),
        ));
        return;
    }
    out.extend(unreachable(tool, kept, reachable_only));
    out.extend(too_fine(tool, kept, sizes));
}

/// A note on unreachable patches.
fn unreachable(tool: &ToolSetup, kept: &[bool], reachable_only: bool) -> Option<Finding> {
    let (beyond, patches) = (kept.iter().filter(|k| !**k).count(), kept.len());
    let has_faces = !reachable_only && has_unreachable_face(tool, kept);
    let remedy = if has_faces { "; a conversion for this scene omits such faces" } else { "" };
    (beyond > 0).then(|| Finding {
        auto: true,
        conversion: has_faces.then_some(Conversion::Reachable),
        ..Finding::note(
            format!("the sheet cannot touch {beyond} of {patches} patches of {}", tool.name),
            format!(
                "excluding them saves {} of search trees, no unknowns{remedy}",
                megabytes(beyond as f64 * BYTES_PER_PATCH)
            ),
        )
    })
}

/// A note on a tool most of whose reachable patches are finer than the elements resolve.
fn too_fine(tool: &ToolSetup, kept: &[bool], sizes: &Sizes) -> Option<Finding> {
    let patches = tool.surface.model().patches.iter().zip(kept);
    let near: Vec<&Patch> = patches.filter(|(_, kept)| **kept).map(|(patch, _)| patch).collect();
    let fine = near.iter().filter(|patch| is_fine(patch, &tool.offset, sizes)).count();
    (2 * fine > near.len()).then(|| {
        Finding::note(
            format!(
                "{fine} of {} patches of {} within reach are shorter than a quarter of the elements along their curvature, and within {:.4} mm even at four times their length",
                near.len(),
                tool.name,
                sizes.tolerance
            ),
            format!(
                "{} and the time to search them; convert to a tolerance of {:.4} mm instead of fixed divisions",
                megabytes(fine as f64 * BYTES_PER_PATCH),
                sizes.tolerance
            ),
        )
        .conversion(Conversion::Within(sizes.tolerance))
    })
}

/// A doubt about a tool with patches without area.
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
        "They have no normal, and contact forces there have no direction. Convert the tool again, or remove these patches.".into(),
    ))
}

fn megabytes(bytes: f64) -> String {
    if bytes < 1e5 { "less than 0.1 MB".into() } else { format!("about {:.1} MB", bytes / 1e6) }
}

/// Whether coarser patches would do: short compared with the elements and far within tolerance along a curvature, or, if
/// flat, short in all directions.
fn is_fine(patch: &Patch, offset: &Vec3, sizes: &Sizes) -> bool {
    let bent = sized(patch, offset, sizes).map_or([None; 2], |(_, bent)| bent);
    if bent == [None; 2] {
        let corners = corners(patch);
        let pairs = (0..corners.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        let longest = pairs.map(|(a, b)| (corners[a].0 - corners[b].0).norm()).fold(0.0, f64::max);
        return longest < FINE_LENGTH_REL * sizes.mean;
    }
    let within = |b: &PrincipalCurvature| {
        PATCH_ERROR_COEFFICIENT * b.radius * (b.turn() / FINE_LENGTH_REL).powi(4) < sizes.tolerance
    };
    let fine = |(b, s): &SizedCurvature| b.length < FINE_LENGTH_REL * s.length && within(b);
    bent.iter().flatten().any(fine)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::test_tools::{arc, plane, revolved};
    use kanagata_solver::sheet::hex_mesh::rectangle;
    use kanagata_tool::ToolModel;

    #[test]
    fn patches_short_across_their_curvature_are_fine() {
        let sizes = Sizes::new(&rectangle(60.0, 60.0, 1.0, 20, 20, 1), 1.0);
        let fine = |tool: &ToolModel| {
            let offset = Vec3::new(-1950.0, 0.0, 0.0);
            tool.patches.iter().filter(|p| is_fine(p, &offset, &sizes)).count()
        };
        // A torus sector of small radius 4 and large radius 2000: a shoulder 40 mm wide.
        let shoulder = |divisions: usize| {
            let profile = [arc(divisions, [2000.0, 0.0], 4.0, [0.0, FRAC_PI_2], 1.0)];
            revolved("shoulder", 2, 40.0 / 2000.0, &profile)
        };
        // 0.26 mm by 20 mm, 3.75 degrees; 0.79 mm, 11.25 degrees; elements of 3 mm.
        assert_eq!((fine(&shoulder(24)), fine(&shoulder(8))), (48, 0));
        let flat = plane("p", Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z());
        let of =
            |size: usize| Sizes::new(&rectangle(60.0, 60.0, 1.0, 60 / size, 60 / size, 1), 1.0);
        let is = |size: usize| is_fine(&flat.patches[0], &Vec3::zeros(), &of(size));
        assert!(is(6) && !is(5));
        // Patches of a quarter of 90 degrees are needed: coarser ones exceed the tolerance.
        let ball =
            revolved("ball", 3, FRAC_PI_2, &[arc(4, [0.0, 7.0], 7.0, [-FRAC_PI_2, 0.0], 1.0)]);
        assert!(ball.patches.iter().all(|p| !is_fine(p, &Vec3::zeros(), &of(60))));
    }
}
