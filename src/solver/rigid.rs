//! Rigid modes of a released sheet, held with as few supports as it takes.

use super::constraints::Constraints;
use crate::geometry::Vec3;

/// Holds components of `nodes` until no rigid motion is left free beside those already in `constraints`.
///
/// Rows of the rigid motions (three translations, three rotations about the centre) at every component are
/// orthogonalised; the component that holds most of what is still free is taken each time.
pub(super) fn hold_rigid_modes(constraints: &mut Constraints, nodes: &[Vec3]) {
    let centre = nodes.iter().sum::<Vec3>() / nodes.len().max(1) as f64;
    let size = nodes.iter().map(|x| (x - centre).norm()).fold(0.0, f64::max).max(1e-300);
    let row = |node: usize, axis: usize| {
        let arm = (nodes[node] - centre) / size;
        let e = Vec3::ith(axis, 1.0);
        let turn = arm.cross(&e);
        nalgebra::Vector6::new(e.x, e.y, e.z, turn.x, turn.y, turn.z)
    };
    let mut basis: Vec<nalgebra::Vector6<f64>> = Vec::new();
    let left = |basis: &[nalgebra::Vector6<f64>], node: usize, axis: usize| {
        let mut v = row(node, axis);
        for _ in 0..2 {
            for b in basis {
                v -= b * b.dot(&v);
            }
        }
        v
    };
    let enough = 1e-6;
    for node in 0..nodes.len() {
        for axis in (0..3).filter(|&axis| constraints.is_held(node, axis)) {
            let v = left(&basis, node, axis);
            if v.norm() > enough {
                basis.push(v.normalize());
            }
        }
    }
    while basis.len() < 6 {
        let mut best = (0, 0, enough);
        for node in 0..nodes.len() {
            for axis in 0..3 {
                let size = left(&basis, node, axis).norm();
                if size > best.2 * (1.0 + 1e-9) {
                    best = (node, axis, size);
                }
            }
        }
        if best.2 <= enough {
            break;
        }
        basis.push(left(&basis, best.0, best.1).normalize());
        constraints.hold(best.0, best.1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners() -> Vec<Vec3> {
        (0..8)
            .map(|k| Vec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)))
            .collect()
    }

    fn held(c: &Constraints) -> usize {
        (0..c.len()).map(|n| (0..3).filter(|&a| c.is_held(n, a)).count()).sum()
    }

    #[test]
    fn a_free_body_needs_six_supports_and_a_quarter_one_more() {
        let mut free = Constraints::none(8);
        hold_rigid_modes(&mut free, &corners());
        assert_eq!(held(&free), 6);
        let mut quarter = Constraints::none(8);
        quarter.symmetry_plane(&corners(), 0, 0.0, 1e-9);
        quarter.symmetry_plane(&corners(), 1, 0.0, 1e-9);
        let before = held(&quarter);
        hold_rigid_modes(&mut quarter, &corners());
        assert_eq!(held(&quarter), before + 1);
    }
}
