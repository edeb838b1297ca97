//! Shape errors of tools: as recorded in their files, or estimated from their patches.

use super::curvature::corners;
use kanagata_geometry::Vec3;
use kanagata_geometry::frame::unit;
use kanagata_tool::Patch;
use kanagata_tool::edge::coefficient;

/// Largest angle of a side taken for an arc [rad].
const ARC_ANGLE_MAX: f64 = 2.6;

/// Factor from the estimate to an upper bound. On the cross die and punch at 1, 2 and 4 patches over 90 degrees the
/// largest error is 0.5 to 1.0 of the bound.
const UPPER_BOUND_FACTOR: f64 = 1.6;

/// Shape error of a tool.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ShapeError {
    /// Largest |shape error| [mm].
    pub mm: f64,
    /// Source of an estimate; `None` for a recorded error.
    pub from: Option<Estimated>,
}

/// The patches behind an estimated error.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Estimated {
    /// Estimated error of each curved patch [mm] with the index of the patch, largest first.
    pub errors: Vec<(f64, usize)>,
    /// Angle of the worst patch along its most curved side [rad].
    pub turn: f64,
    /// Mean of its corners, in coordinates of the tool file [mm].
    pub at: Vec3,
}

/// The recorded error, or else an estimate from the reachable patches. `None` if there is neither (flat tools, Bezier
/// patches of higher degree).
pub(super) fn shape_error(
    recorded: Option<f64>,
    patches: &[Patch],
    kept: &[bool],
) -> Option<ShapeError> {
    if let Some(mm) = recorded {
        return Some(ShapeError { mm, from: None });
    }
    let near = patches.iter().enumerate().filter(|(k, _)| kept[*k]);
    let mut errors: Vec<(f64, usize)> =
        near.map(|(k, p)| (patch_error(p).0, k)).filter(|e| e.0 > 0.0).collect();
    errors.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let &(mm, worst) = errors.first()?;
    let corners = corners(&patches[worst]);
    let at = corners.iter().map(|c| c.0).sum::<Vec3>() / corners.len().max(1) as f64;
    let turn = patch_error(&patches[worst]).1;
    Some(ShapeError { mm, from: Some(Estimated { errors, turn, at }) })
}

/// Estimated shape error of a quadratic patch through exact corners and normals [mm], and the largest angle of its sides
/// [rad].
///
/// A parabola with the ends and end tangents of an arc of radius r over the angle 2a deviates by `r (1 - cos a)^2 / (2
/// cos a)`, about `r (2a)^4 / 128`. The errors of crossing sides add up. On a saddle the distance between the middle and
/// the middles of the diagonal curves (Eq. 8) is added.
fn patch_error(patch: &Patch) -> (f64, f64) {
    if matches!(patch, Patch::Bezier { degrees, .. } if degrees.iter().any(|d| *d > 2)) {
        return (0.0, 0.0);
    }
    let corners = corners(patch);
    let sides: Vec<(f64, f64)> = (0..corners.len())
        .map(|k| side_error(&corners[k], &corners[(k + 1) % corners.len()]))
        .collect();
    let turn = sides.iter().map(|s| s.1).fold(0.0, f64::max);
    let mut all: Vec<f64> = sides.iter().map(|s| s.0).collect();
    if let [a, b, c, d] = all[..] {
        all = vec![a.max(c), b.max(d)];
    }
    all.sort_by(|a, b| b.total_cmp(a));
    (UPPER_BOUND_FACTOR * (all.iter().take(2).sum::<f64>() + saddle_error(patch, &corners)), turn)
}

/// Largest distance of the middle of a quadrilateral from the middles of its diagonal curves, along the normal [mm].
fn saddle_error(patch: &Patch, corners: &[(Vec3, Vec3)]) -> f64 {
    let [a, b, c, d] = corners else { return 0.0 };
    let Some(normal) = unit(a.1 + b.1 + c.1 + d.1) else { return 0.0 };
    let middle = patch.derivs(0.5, 0.5).s;
    let of = |p: &(Vec3, Vec3), q: &(Vec3, Vec3)| {
        let curve = coefficient(&(q.0 - p.0), &p.1, &q.1);
        (0.5 * (p.0 + q.0) - 0.25 * curve - middle).dot(&normal).abs()
    };
    of(a, c).max(of(b, d))
}

/// Error of one side [mm], and the angle between its end normals in the plane of the side [rad].
fn side_error(a: &(Vec3, Vec3), b: &(Vec3, Vec3)) -> (f64, f64) {
    let chord = b.0 - a.0;
    let Some(along) = unit(chord) else { return (0.0, 0.0) };
    let tilt = |n: &Vec3| n.dot(&along).clamp(-1.0, 1.0).asin();
    let half = 0.5 * (tilt(&b.1) - tilt(&a.1)).abs().min(ARC_ANGLE_MAX);
    if half < 1e-6 {
        return (0.0, 0.0);
    }
    let radius = 0.5 * chord.norm() / half.sin();
    (radius * (1.0 - half.cos()).powi(2) / (2.0 * half.cos()), 2.0 * half)
}

impl ShapeError {
    /// The patches with an error above `allowed` [mm], in patches_text; `None` if there are none.
    pub(super) fn patches_text(&self, name: &str, allowed: f64) -> Option<String> {
        let Estimated { errors, turn, at } = self.from.as_ref()?;
        let count = errors.iter().filter(|e| e.0 > allowed).count();
        let &(worst, patch) = errors.first().filter(|_| count > 0)?;
        let s = if count == 1 { "" } else { "es" };
        Some(format!(
            "{count} patch{s} of {name}, the worst number {patch} at ({:.1}, {:.1}, {:.1}) mm of its file, which turns by {:.0} degrees and is off by about {worst:.3} mm",
            at.x,
            at.y,
            at.z,
            turn.to_degrees()
        ))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::test_tools::{arc, plane, revolved};

    /// Largest distance between a ball's patches and the ball, and the estimate.
    #[test]
    fn the_estimate_bounds_the_error_of_a_ball() {
        for (divisions, around) in [(1, 1), (2, 2), (4, 4), (8, 2)] {
            let profile = [arc(divisions, [0.0, 7.0], 7.0, [-FRAC_PI_2, 0.0], 1.0)];
            let ball = revolved("ball", around, FRAC_PI_2, &profile);
            let kept = vec![true; ball.patches.len()];
            let found = shape_error(None, &ball.patches, &kept).unwrap();
            let share = |k: usize| k as f64 / 20.0;
            let mut largest = 0.0_f64;
            for patch in &ball.patches {
                for (i, j) in (0..=20).flat_map(|i| (0..=20).map(move |j| (i, j))) {
                    if patch.sides() == 4 || j <= i {
                        let p = patch.derivs(share(i), share(j)).s;
                        largest = largest.max(((p - Vec3::z() * 7.0).norm() - 7.0).abs());
                    }
                }
            }
            assert!(
                largest < found.mm && found.mm < 8.0 * largest,
                "{divisions} {around}: {largest} {}",
                found.mm
            );
            assert!(found.patches_text("ball", 0.0).unwrap().contains("of ball"));
        }
    }

    #[test]
    fn a_recorded_error_goes_first_and_planes_have_none() {
        let flat = plane("p", Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z());
        assert_eq!(shape_error(None, &flat.patches, &[true]), None);
        let recorded = shape_error(Some(0.2), &flat.patches, &[true]).unwrap();
        assert_eq!((recorded.mm, recorded.patches_text("p", 0.0)), (0.2, None));
    }
}
