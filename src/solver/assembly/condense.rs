//! Forces and stiffness of an element with hanging corners, for its effective nodes.

use crate::element::{DOFS, ElementMatrices, Want};
use crate::sheet::hanging_nodes::HangingCorners;

/// Replaces the force `f` by `T^t f` and, if requested, the tangent `K` by `T^t K T`. `T` gives the displacements of the
/// corners for those of the effective nodes: each hanging corner has the mean of the effective node in its place and of a
/// master that is another corner.
pub(super) fn condense(corners: &HangingCorners, want: Want, block: &mut ElementMatrices) {
    let pairs = corners.pairs().flat_map(|[h, m]| [[h, m], [h + 4, m + 4]]);
    for [h, m] in pairs.flat_map(|[h, m]| [0, 1, 2].map(|k| [3 * h + k, 3 * m + k])) {
        let half = 0.5 * block.force[h];
        block.force[m] += half;
        block.force[h] = half;
        if want == Want::ResidualAndTangent {
            for row in &mut block.tangent {
                let half = 0.5 * row[h];
                row[m] += half;
                row[h] = half;
            }
            for column in 0..DOFS {
                let half = 0.5 * block.tangent[h][column];
                block.tangent[m][column] += half;
                block.tangent[h][column] = half;
            }
        }
    }
}
