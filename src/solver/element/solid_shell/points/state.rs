//! Arrays over all points of a solid-shell, laid out for SIMD lanes.

use pulp::Simd;

use crate::element::solid_shell::pairs::SHAPES;
use crate::numbers::algebra::splat;
use crate::numbers::lanes::{Lane, POINTS};
use kanagata_geometry::Vec3;

/// Number of columns of an element.
pub(in crate::element::solid_shell) const COLUMNS: usize = 4;

/// Maximum number of points of a column.
pub(in crate::element) const COLUMN_POINTS_MAX: usize = 10;

/// Array length: the points of an element and padding lanes beyond the last.
pub(in crate::element::solid_shell) const POINT_CAPACITY: usize =
    COLUMNS * COLUMN_POINTS_MAX + POINTS;

/// Kinematics and material response at the points.
pub(in crate::element::solid_shell) struct Points {
    /// det J.
    pub(crate) det: PerPoint,
    /// Thickness strain of a mode at unit value over the strain at the centre, by shape.
    pub(crate) shape_strain: [PerPoint; SHAPES],
    /// Map from natural to Cartesian strain, including the stretch.
    pub(crate) map: [[PerPoint; 6]; 6],
    /// Assumed right Cauchy-Green tensor.
    pub(crate) stretched: [PerPoint; 6],
    pub(crate) stress: [PerPoint; 6],
    pub(crate) tangent: [[PerPoint; 6]; 6],
    pub(crate) elastic_energy: PerPoint,
    pub(crate) plastic_work: PerPoint,
}

impl Points {
    pub(crate) fn zero() -> Self {
        const ZERO: PerPoint = [0.0; POINT_CAPACITY];
        Self {
            det: ZERO,
            shape_strain: [ZERO; SHAPES],
            map: [[ZERO; 6]; 6],
            stretched: [ZERO; 6],
            stress: [ZERO; 6],
            tangent: [[ZERO; 6]; 6],
            elastic_energy: ZERO,
            plastic_work: ZERO,
        }
    }
}

#[inline(always)]
pub(in crate::element::solid_shell) fn vectors<S: Simd>(
    simd: S,
    two: &[Vec3; 2],
) -> [[Lane<S>; 3]; 2] {
    [splat(simd, &two[0].into()), splat(simd, &two[1].into())]
}

/// One value for each point.
pub(in crate::element::solid_shell) type PerPoint = [f64; POINT_CAPACITY];
