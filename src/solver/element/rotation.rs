//! Places of the points of an element, and the rotation of its material there.

use super::kind::ElementKind;
use super::shape::{gauss_2x2x2, jacobian};
use kanagata_geometry::{Mat3, Vec3};

impl ElementKind {
    /// Natural coordinates of the points, in their order; `rule` is [`Self::thickness_rule`].
    #[must_use]
    pub(crate) fn point_places(self, rule: &[(f64, f64)]) -> Vec<[f64; 3]> {
        let gauss = gauss_2x2x2();
        match self {
            Self::Hex8 | Self::Hex8Enhanced => gauss.to_vec(),
            Self::SolidShell { .. } => gauss[..4]
                .iter()
                .flat_map(|[xi, eta, _]| rule.iter().map(|(zeta, _)| [*xi, *eta, *zeta]))
                .collect(),
        }
    }

    /// Indices of the points nearest to the lower and to the upper face, one at each of the four places in the plane.
    #[must_use]
    pub(crate) fn outermost_points(self) -> [[usize; 4]; 2] {
        match self {
            Self::Hex8 | Self::Hex8Enhanced => [[0, 1, 2, 3], [4, 5, 6, 7]],
            Self::SolidShell { points, .. } => {
                let layers = usize::from(points);
                [[0, 1, 2, 3].map(|k| k * layers), [1, 2, 3, 4].map(|k| k * layers - 1)]
            }
        }
    }
}

/// Rotation `R` at the natural coordinates `xi` of an element with the stretch `U` there.
///
/// The in-plane base vectors are material lines: `R` takes `U G_1`, `U G_2` into the plane of the deformed `g_1`, `g_2`,
/// with the same bisector of their directions. This is the rotation of the polar decomposition where the strain is that
/// of the displacements. Where the element assumes other transverse strains, a stress without component along the normal
/// of the undeformed surface has none along that of the deformed surface.
///
/// `None` where base vectors are parallel.
#[must_use]
pub(crate) fn rotation(
    nodes: &[Vec3; 8],
    moved: &[Vec3; 8],
    xi: [f64; 3],
    stretch: &Mat3,
) -> Option<Mat3> {
    let (before, now) = (jacobian(nodes, xi), jacobian(moved, xi));
    let plane = |base: &Mat3| bisector_frame(&base.column(0).into(), &base.column(1).into());
    Some(plane(&now)? * plane(&(stretch * before))?.transpose())
}

/// Orthonormal axes: the bisector of two vectors, the direction across it in their plane, and their normal.
fn bisector_frame(a: &Vec3, b: &Vec3) -> Option<Mat3> {
    let (a, b) = (a.try_normalize(0.0)?, b.try_normalize(0.0)?);
    let along = (a + b).try_normalize(0.0)?;
    let across = (b - a).try_normalize(0.0)?;
    Some(Mat3::from_columns(&[along, across, along.cross(&across)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::shape::CORNERS;

    /// `F = R U` of an oblique element: the rotation is found at every point.
    #[test]
    fn the_rotation_is_that_of_the_polar_decomposition() {
        let nodes = CORNERS.map(|[x, y, z]| Vec3::new(x + 0.3 * y, 0.8 * y + 0.1 * x * y, 0.2 * z));
        let turn = nalgebra::Rotation3::from_euler_angles(0.7, -1.9, 2.4).into_inner();
        let stretch = Mat3::new(1.3, 0.2, 0.1, 0.2, 0.9, -0.1, 0.1, -0.1, 0.8);
        let moved = nodes.map(|x| turn * stretch * x);
        let shell = ElementKind::default();
        for kind in [ElementKind::Hex8, shell] {
            let places = kind.point_places(&kind.thickness_rule());
            assert_eq!(places.len(), kind.point_count());
            for xi in &places {
                let found = rotation(&nodes, &moved, *xi, &stretch).unwrap();
                assert!((found - turn).norm() < 1e-14, "{found}");
            }
            let [low, high] = kind.outermost_points();
            for (low, high) in low.into_iter().zip(high) {
                assert_eq!(places[low][..2], places[high][..2]);
                let heights = places.iter().map(|xi| xi[2]);
                assert_eq!(places[low][2], heights.clone().fold(1.0, f64::min));
                assert_eq!(places[high][2], heights.fold(-1.0, f64::max));
            }
        }
        let flat = [Vec3::zeros(); 8];
        assert_eq!(rotation(&nodes, &flat, [0.0; 3], &stretch), None);
    }
}
