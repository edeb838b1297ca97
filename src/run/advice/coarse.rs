//! Shape errors of tools: what their files record, or else what their patches turn by.

use super::curvature::corners;
use crate::geometry::Vec3;
use crate::geometry::frame::unit;
use crate::tool::Patch;
use crate::tool::edge::coefficient;

/// Turn of a side [rad] beyond which no arc is meant.
const MOST: f64 = 2.6;

/// What estimates are multiplied by to be upper ones: on the cross die and punch at 1, 2 and 4 patches over 90 degrees the
/// largest error is 0.5 to 1.0 of it.
const UPPER: f64 = 1.6;

/// Shape error of a tool.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ShapeError {
    /// Largest |shape error| [mm].
    pub mm: f64,
    /// Where it comes from when the file does not record it.
    pub from: Option<Estimated>,
}

/// The patches that an estimate rests on.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Estimated {
    /// Error of each patch that can be off at all, largest first [mm], with its number.
    pub errors: Vec<(f64, usize)>,
    /// Turn of the worst patch over its longest-turning side [rad].
    pub turn: f64,
    /// Middle of its corners, in the tool's file [mm].
    pub at: Vec3,
}

/// The recorded error, or an estimate from the patches within reach; `None` where neither says anything (flat tools,
/// Bezier patches of higher degrees).
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
        near.map(|(k, p)| (off(p).0, k)).filter(|e| e.0 > 0.0).collect();
    errors.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let &(mm, worst) = errors.first()?;
    let corners = corners(&patches[worst]);
    let at = corners.iter().map(|c| c.0).sum::<Vec3>() / corners.len().max(1) as f64;
    let turn = off(&patches[worst]).1;
    Some(ShapeError { mm, from: Some(Estimated { errors, turn, at }) })
}

/// How far a quadratic patch may be off the surface that its corners lie on [mm], and the largest turn of its sides
/// [rad]. A parabola with the ends and end tangents of an arc over the angle 2 a of radius r is off it by
/// `r (1 - cos a)^2 / (2 cos a)`, about `r (2 a)^4 / 128`; what sides that cross each other are off by is added, and the
/// distance of the middle from those of the two diagonals, drawn as sides are (Eq. 8), where the patch is a saddle.
fn off(patch: &Patch) -> (f64, f64) {
    if matches!(patch, Patch::Bezier { degrees, .. } if degrees.iter().any(|d| *d > 2)) {
        return (0.0, 0.0);
    }
    let corners = corners(patch);
    let sides: Vec<(f64, f64)> = (0..corners.len())
        .map(|k| side_off(&corners[k], &corners[(k + 1) % corners.len()]))
        .collect();
    let turn = sides.iter().map(|s| s.1).fold(0.0, f64::max);
    let mut all: Vec<f64> = sides.iter().map(|s| s.0).collect();
    if let [a, b, c, d] = all[..] {
        all = vec![a.max(c), b.max(d)];
    }
    all.sort_by(|a, b| b.total_cmp(a));
    (UPPER * (all.iter().take(2).sum::<f64>() + middle_off(patch, &corners)), turn)
}

/// Largest distance of a quadrilateral's middle from the middles of its diagonals' curves, across the patch [mm].
fn middle_off(patch: &Patch, corners: &[(Vec3, Vec3)]) -> f64 {
    let [a, b, c, d] = corners else { return 0.0 };
    let Some(normal) = unit(a.1 + b.1 + c.1 + d.1) else { return 0.0 };
    let middle = patch.derivs(0.5, 0.5).s;
    let of = |p: &(Vec3, Vec3), q: &(Vec3, Vec3)| {
        let curve = coefficient(&(q.0 - p.0), &p.1, &q.1);
        (0.5 * (p.0 + q.0) - 0.25 * curve - middle).dot(&normal).abs()
    };
    of(a, c).max(of(b, d))
}

/// The same for one side: error [mm] and turn of the normal in the side's own plane [rad].
fn side_off(a: &(Vec3, Vec3), b: &(Vec3, Vec3)) -> (f64, f64) {
    let chord = b.0 - a.0;
    let Some(along) = unit(chord) else { return (0.0, 0.0) };
    let lean = |n: &Vec3| n.dot(&along).clamp(-1.0, 1.0).asin();
    let half = 0.5 * (lean(&b.1) - lean(&a.1)).abs().min(MOST);
    if half < 1e-6 {
        return (0.0, 0.0);
    }
    let radius = 0.5 * chord.norm() / half.sin();
    (radius * (1.0 - half.cos()).powi(2) / (2.0 * half.cos()), 2.0 * half)
}

impl ShapeError {
    /// What it rests on, in words: the patches that are off by more than `allowed` [mm].
    pub(super) fn words(&self, name: &str, allowed: f64) -> Option<String> {
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
    use crate::contact::test_tools::{arc, plane, revolved};

    /// Largest distance of a ball's patches from the ball, beside the estimate.
    #[test]
    fn the_estimate_bounds_the_error_of_a_ball() {
        for (divisions, around) in [(1, 1), (2, 2), (4, 4), (8, 2)] {
            let profile = [arc(divisions, [0.0, 7.0], 7.0, [-FRAC_PI_2, 0.0], 1.0)];
            let ball = revolved("ball", around, FRAC_PI_2, &profile);
            let kept = vec![true; ball.patches.len()];
            let found = shape_error(None, &ball.patches, &kept).unwrap();
            let share = |k: usize| k as f64 / 20.0;
            let mut most = 0.0_f64;
            for patch in &ball.patches {
                for (i, j) in (0..=20).flat_map(|i| (0..=20).map(move |j| (i, j))) {
                    if patch.sides() == 4 || j <= i {
                        let p = patch.derivs(share(i), share(j)).s;
                        most = most.max(((p - Vec3::z() * 7.0).norm() - 7.0).abs());
                    }
                }
            }
            assert!(
                most < found.mm && found.mm < 8.0 * most,
                "{divisions} {around}: {most} {}",
                found.mm
            );
            assert!(found.words("ball", 0.0).unwrap().contains("of ball"));
        }
    }

    #[test]
    fn a_recorded_error_goes_first_and_planes_have_none() {
        let flat = plane("p", Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z());
        assert_eq!(shape_error(None, &flat.patches, &[true]), None);
        let recorded = shape_error(Some(0.2), &flat.patches, &[true]).unwrap();
        assert_eq!((recorded.mm, recorded.words("p", 0.0)), (0.2, None));
    }
}
