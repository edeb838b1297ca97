//! Patches that the sheet cannot reach, patches far finer than its elements, radii that its elements cannot follow.

use super::{GROWTH, Remark};
use crate::geometry::Vec3;
use crate::run::cost::Cost;
use crate::solver::ToolSetup;
use crate::tool::Patch;

/// Elements over 90 degrees of a radius that follow it well.
const OVER_A_RADIUS: f64 = 4.0;
/// Angle between normals of a patch [rad] below which it counts as flat.
const FLAT: f64 = 1e-3;
/// Patches shorter than this share of an element, and turning by less than this angle [rad], are not felt.
const FINE: (f64, f64) = (0.25, 0.09);

/// Remarks on one tool; `kept`: patches the sheet may come near; `size`: of its elements [mm].
pub(super) fn remarks(
    tool: &ToolSetup,
    kept: &[bool],
    size: f64,
    cost: &Cost,
    out: &mut Vec<Remark>,
) {
    let name = &tool.name;
    let (count, patches) = (kept.iter().filter(|k| **k).count(), kept.len());
    if count == 0 {
        out.push(Remark::new(
            format!("none of the {patches} patches of {name} can be reached by the sheet"),
            "check its place, direction and travel".into(),
        ));
        return;
    }
    if count < patches {
        let beyond = patches - count;
        out.push(Remark {
            what: format!("{beyond} of {patches} patches of {name} are beyond the reach of the sheet"),
            cost: format!(
                "about {} of search trees, no unknowns; `kanagata convert --reach` leaves such faces out of the file",
                megabytes(beyond as f64 * BYTES_A_PATCH)
            ),
            auto: true,
        });
    }
    let model = tool.surface.model();
    let near = || model.patches.iter().zip(kept).filter(|(_, k)| **k).map(|(p, _)| p);
    let fine = near().filter(|p| is_fine(p, size)).count();
    if 2 * fine > count {
        out.push(Remark::new(
            format!(
                "{fine} of {count} patches of {name} within reach are shorter than a quarter of the elements' {size:.2} mm and nearly flat"
            ),
            format!(
                "about {} and the time to search them; convert with --tol instead of fixed divisions",
                megabytes(fine as f64 * BYTES_A_PATCH)
            ),
        ));
    }
    let Some(radius) = smallest_radius(near()) else { return };
    let over = std::f64::consts::FRAC_PI_2 * radius / size;
    if over < OVER_A_RADIUS {
        let finer = OVER_A_RADIUS / over;
        // Twice in plan, and increments grow with the number of contacts that change.
        let unknowns = cost.unknowns as f64 * finer.powi(2);
        out.push(Remark::new(
            format!(
                "elements of {size:.2} mm are coarse for the radius of {radius:.2} mm of {name}: {over:.1} over 90 degrees"
            ),
            format!(
                "{OVER_A_RADIUS} want elements of {:.2} mm: {unknowns:.0} unknowns everywhere, {}",
                size / finer,
                cost.times(finer.powf(2.0 * GROWTH))
            ),
        ));
    }
}

/// Memory of a patch's pieces and their tree.
const BYTES_A_PATCH: f64 = 2500.0;

fn megabytes(bytes: f64) -> String {
    if bytes < 1e5 { "less than 0.1 MB".into() } else { format!("{:.1} MB", bytes / 1e6) }
}

/// Corners of a patch with their normals, where it has them.
fn corners(patch: &Patch) -> Vec<(Vec3, Vec3)> {
    let all = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
    let at = |&(eta, zeta): &(f64, f64)| {
        // Just inside, where collapsed corners have a normal.
        let inside = |v: f64, to: f64| v + 1e-6 * (to - v);
        let normal = patch.normal(inside(eta, 0.6), inside(zeta, 0.4))?;
        Some((patch.derivs(eta, zeta).s, normal))
    };
    all[..patch.sides()].iter().filter_map(at).collect()
}

fn is_fine(patch: &Patch, size: f64) -> bool {
    let corners = corners(patch);
    let pairs = || (0..corners.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
    let longest = pairs().map(|(a, b)| (corners[a].0 - corners[b].0).norm()).fold(0.0, f64::max);
    let turn = pairs().map(|(a, b)| corners[a].1.angle(&corners[b].1)).fold(0.0, f64::max);
    longest < FINE.0 * size && turn < FINE.1
}

/// Smallest radius of curvature [mm], from the turn of the normal along the patches' sides; `None` for flat ones.
fn smallest_radius<'a>(patches: impl Iterator<Item = &'a Patch>) -> Option<f64> {
    let mut least = f64::INFINITY;
    for patch in patches {
        let corners = corners(patch);
        for k in 0..corners.len() {
            let ((a, na), (b, nb)) = (corners[k], corners[(k + 1) % corners.len()]);
            let angle = na.angle(&nb);
            if angle > FLAT && (b - a).norm() > 0.0 {
                // An arc of this chord.
                least = least.min(0.5 * (b - a).norm() / (0.5 * angle).sin());
            }
        }
    }
    least.is_finite().then_some(least)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::contact::test_tools::{arc, plane, revolved};

    #[test]
    fn radii_are_found_and_fine_patches_told() {
        let ball =
            revolved("ball", 4, FRAC_PI_2, &[arc(6, [0.0, 7.0], 7.0, [-FRAC_PI_2, 0.0], 1.0)]);
        let radius = smallest_radius(ball.patches.iter()).unwrap();
        assert!(radius < 7.0 + 1e-3 && radius > 0.9, "{radius}");
        let flat = plane("p", Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z());
        assert!(smallest_radius(flat.patches.iter()).is_none());
        assert!(is_fine(&flat.patches[0], 6.0) && !is_fine(&flat.patches[0], 5.0));
        // A sixth of 90 degrees turns too much to be left to fewer patches.
        assert!(ball.patches.iter().all(|p| !is_fine(p, 1e3)));
    }
}
