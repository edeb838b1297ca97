//! Eight points of a fibre in lanes.

use pulp::Simd;

use crate::geometry::Vec3;
use crate::solver::element::solid_shell::pairs::SHAPES;
use crate::solver::numbers::algebra::splat;
use crate::solver::numbers::lanes::{Lane, POINTS};

/// Columns of an element, and points of one at most.
pub(in crate::solver::element::solid_shell) const COLUMNS: usize = 4;

pub(in crate::solver::element::solid_shell) const HIGHEST: usize = 9;

/// Room for the points of an element, and for lanes beyond the last.
pub(in crate::solver::element::solid_shell) const ROOM: usize = COLUMNS * HIGHEST + POINTS;

/// Where the points are, and what the material answers there.
pub(in crate::solver::element::solid_shell) struct Points {
    /// det J.
    pub(in crate::solver) det: Each,
    /// Strain through the thickness at a mode's value of one, over the strain at the centre, by shape.
    pub(in crate::solver) lift: [Each; SHAPES],
    /// From natural to Cartesian strain, stretched.
    pub(in crate::solver) map: [[Each; 6]; 6],
    /// Assumed right Cauchy-Green tensor.
    pub(in crate::solver) stretched: [Each; 6],
    pub(in crate::solver) stress: [Each; 6],
    pub(in crate::solver) tangent: [[Each; 6]; 6],
    pub(in crate::solver) elastic_energy: Each,
    pub(in crate::solver) plastic_work: Each,
}

impl Points {
    pub(in crate::solver) fn zero() -> Self {
        const NONE: Each = [0.0; ROOM];
        Self {
            det: NONE,
            lift: [NONE; SHAPES],
            map: [[NONE; 6]; 6],
            stretched: [NONE; 6],
            stress: [NONE; 6],
            tangent: [[NONE; 6]; 6],
            elastic_energy: NONE,
            plastic_work: NONE,
        }
    }
}

#[inline(always)]
pub(in crate::solver::element::solid_shell) fn vectors<S: Simd>(
    simd: S,
    two: &[Vec3; 2],
) -> [[Lane<S>; 3]; 2] {
    [splat(simd, &two[0].into()), splat(simd, &two[1].into())]
}

/// One number of each point.
pub(in crate::solver::element::solid_shell) type Each = [f64; ROOM];
