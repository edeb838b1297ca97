//! Strain paths of the elements: how far each turned from a straight one.
//!
//! A limit curve is measured on straight paths. The path of an element is followed in steps of [`PATH_STEP`]: whenever
//! its strain has moved by so much from the last point, the angle between this step and the strain at that point is
//! taken, and the largest is kept. Strains are tensors in axes of the undeformed element (Frobenius product). Without
//! rotation of the principal axes the angle is that in the forming limit diagram.

use serde::{Deserialize, Serialize};

use super::strains::SheetStrain;

/// Length of a step of the path. Elastic strains and scatter between increments are below. With twice the length small
/// first strains, for example of closing the holder, are not seen as a path of their own.
pub const PATH_STEP: f64 = 0.01;
/// Angle above which a path has turned [degrees]: more than from uniaxial tension of an isotropic sheet to plane strain
/// (27 degrees). From plane strain to equibiaxial stretching it is 45 degrees.
pub const TURNED_ANGLE_DEG: f64 = 30.0;

/// The path of an element: strain tensor at its last point, and the smallest cosine of an angle so far.
type Path = [f64; 4];

/// Strain paths of all elements so far.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StrainPaths(Vec<Path>);

impl StrainPaths {
    /// Follows the paths to `strains`, one per element.
    pub(super) fn update(&mut self, strains: &[SheetStrain]) {
        if self.0.len() != strains.len() {
            self.0 = vec![[0.0, 0.0, 0.0, 1.0]; strains.len()];
        }
        for (path, strain) in self.0.iter_mut().zip(strains) {
            advance(path, strain.tensor);
        }
    }

    /// Largest angle of an element [degrees]; 0 for a straight path.
    #[must_use]
    pub fn angle_deg(&self, element: usize) -> f64 {
        self.0.get(element).map_or(0.0, |path| path[3].clamp(-1.0, 1.0).acos().to_degrees())
    }

    /// Whether the path of an element turned by more than [`TURNED_ANGLE_DEG`].
    #[must_use]
    pub fn has_turned(&self, element: usize) -> bool {
        self.angle_deg(element) > TURNED_ANGLE_DEG
    }
}

/// Follows a path to the strain `to`.
fn advance(path: &mut Path, to: [f64; 3]) {
    let from = [path[0], path[1], path[2]];
    let step = [to[0] - from[0], to[1] - from[1], to[2] - from[2]];
    let dot = |a: [f64; 3], b: [f64; 3]| 2.0 * (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
    let (length, before) = (dot(step, step).sqrt(), dot(from, from).sqrt());
    if length.is_nan() || length < PATH_STEP {
        return;
    }
    let cosine = if before > 0.0 { dot(step, from) / (length * before) } else { 1.0 };
    *path = [to[0], to[1], to[2], path[3].min(cosine)];
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strains::Principal;

    /// Principal strains with the major one at `angle` [rad] to the first axis.
    fn strain(major: f64, minor: f64, angle: f64) -> SheetStrain {
        let half = 0.5 * (major - minor);
        let tensor =
            [0.5 * (major + minor), half * (2.0 * angle).cos(), half * (2.0 * angle).sin()];
        SheetStrain { principal: Principal { major, minor }, tensor, thickness: 0.0, area: 1.0 }
    }

    /// The angle after a path through these states of principal strains, in so many increments each.
    fn angle(states: &[[f64; 2]], increments: usize) -> f64 {
        let mut paths = StrainPaths::default();
        let mut last = [0.0; 2];
        for state in states {
            for k in 1..=increments {
                let part = k as f64 / increments as f64;
                let at = |i: usize| last[i] + part * (state[i] - last[i]);
                paths.update(&[strain(at(0), at(1), 0.4)]);
            }
            last = *state;
        }
        paths.angle_deg(0)
    }

    #[test]
    fn a_straight_path_has_no_angle_and_a_kink_has_its_own() {
        for increments in [1, 3, 20] {
            // A cosine rounded by one bit is an angle of 1e-6 degrees.
            assert!(angle(&[[0.3, -0.15]], increments) < 1e-5);
            // Tension, then plane strain: the kink is seen at its full angle where a step begins there.
            let kink = 0.5_f64.atan().to_degrees();
            let found = angle(&[[0.2, -0.1], [0.4, -0.1]], increments);
            assert!((found - kink).abs() < 2.0, "{increments}: {found} {kink}");
            // Plane strain, then back: reversed.
            let found = angle(&[[0.2, 0.0], [0.1, 0.0]], increments);
            assert!((found - 180.0).abs() < 1e-5, "{increments}: {found}");
        }
    }

    #[test]
    fn elastic_and_first_strains_are_no_path() {
        assert_eq!(angle(&[[0.004, 0.0], [0.002, 0.003], [0.0, 0.0]], 2), 0.0);
        let unloaded = angle(&[[0.2, -0.1], [0.196, -0.098], [0.3, -0.15]], 10);
        assert!(unloaded < 1e-5, "{unloaded}");
    }

    #[test]
    fn principal_axes_that_turn_are_a_turned_path() {
        let mut paths = StrainPaths::default();
        paths.update(&[strain(0.1, -0.05, 0.0)]);
        // The same stretch again, across the first one: tensors add up.
        paths.update(&[strain(0.05, 0.05, 0.0)]);
        assert!(paths.angle_deg(0) > 90.0 && paths.has_turned(0));
    }

    #[test]
    fn paths_are_restored_from_text_bit_by_bit() {
        let mut whole = StrainPaths::default();
        let states = [[0.1, -0.03], [0.17, 0.01], [0.19, 0.1], [0.3, 0.12]];
        let text = {
            let mut part = StrainPaths::default();
            states[..2].iter().for_each(|s| part.update(&[strain(s[0], s[1], 0.3)]));
            serde_json::to_string(&part).unwrap()
        };
        let mut restored: StrainPaths = serde_json::from_str(&text).unwrap();
        states[2..].iter().for_each(|s| restored.update(&[strain(s[0], s[1], 0.3)]));
        states.iter().for_each(|s| whole.update(&[strain(s[0], s[1], 0.3)]));
        assert_eq!(restored, whole);
        assert!(whole.has_turned(0));
    }
}
