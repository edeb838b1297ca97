//! Rigid-body modes of an unconstrained sheet: minimal supports, and the rigid motion back to an earlier position.

use super::supports::Constraints;
use kanagata_geometry::{Mat3, Vec3};

/// Remaining fraction of a rigid-body mode above which it counts as free.
const FREE_MODE_TOLERANCE_REL: f64 = 1e-6;

type Row = nalgebra::Vector6<f64>;

/// Rigid-body modes (three translations, three rotations about the centre) and the supports that constrain them.
struct RigidModes<'a> {
    nodes: &'a [Vec3],
    centre: Vec3,
    size: f64,
    /// Constrained modes, orthonormal.
    held: Vec<Row>,
}

impl<'a> RigidModes<'a> {
    fn of(nodes: &'a [Vec3]) -> Self {
        let centre = nodes.iter().sum::<Vec3>() / nodes.len().max(1) as f64;
        let size = nodes.iter().map(|x| (x - centre).norm()).fold(0.0, f64::max).max(1e-300);
        Self { nodes, centre, size, held: Vec::new() }
    }

    /// Part of the support of `node` along a unit vector that is independent of the constrained modes.
    fn independent_part(&self, node: usize, along: &Vec3) -> Row {
        let rotation = ((self.nodes[node] - self.centre) / self.size).cross(along);
        let mut row = Row::new(along.x, along.y, along.z, rotation.x, rotation.y, rotation.z);
        for _ in 0..2 {
            for held in &self.held {
                row -= held * held.dot(&row);
            }
        }
        row
    }

    fn support(&mut self, node: usize, along: &Vec3) {
        if self.all_held() {
            return;
        }
        let row = self.independent_part(node, along);
        if row.norm() > FREE_MODE_TOLERANCE_REL {
            self.held.push(row.normalize());
        }
    }

    fn add_constraints(&mut self, constraints: &Constraints) {
        for node in 0..self.nodes.len() {
            for axis in (0..3).filter(|&axis| constraints.is_held(node, axis)) {
                self.support(node, &Vec3::ith(axis, 1.0));
            }
        }
    }

    /// Displacements of the free rigid-body modes (three for each node), orthonormal.
    fn free_motions(&self) -> Vec<Vec<f64>> {
        let mut rows = self.held.clone();
        let mut out: Vec<Vec<f64>> = Vec::new();
        for k in 0..6 {
            let mut row = Row::ith(k, 1.0);
            (0..2).for_each(|_| rows.iter().for_each(|held| row -= held * held.dot(&row)));
            if row.norm() <= FREE_MODE_TOLERANCE_REL {
                continue;
            }
            let row = row.normalize();
            rows.push(row);
            let (shift, rotation) =
                (Vec3::new(row[0], row[1], row[2]), Vec3::new(row[3], row[4], row[5]));
            let at = |x: &Vec3| shift + rotation.cross(&((x - self.centre) / self.size));
            let mut motion: Vec<f64> =
                self.nodes.iter().flat_map(|x| <[f64; 3]>::from(at(x))).collect();
            for other in &out {
                let along: f64 = motion.iter().zip(other).map(|(a, b)| a * b).sum();
                motion.iter_mut().zip(other).for_each(|(a, b)| *a -= along * b);
            }
            let size = motion.iter().map(|v| v * v).sum::<f64>().sqrt();
            motion.iter_mut().for_each(|v| *v /= size);
            out.push(motion);
        }
        out
    }

    fn all_held(&self) -> bool {
        self.held.len() == 6
    }

    /// Minimal set of displacement components of admissible nodes that constrains the free modes; greedy, the most
    /// effective first.
    fn constrain_free_modes(mut self, admissible: impl Fn(usize) -> bool) -> Vec<(usize, usize)> {
        let mut out = Vec::new();
        while !self.all_held() {
            let mut best = (0, 0, FREE_MODE_TOLERANCE_REL);
            for node in (0..self.nodes.len()).filter(|&node| admissible(node)) {
                for axis in 0..3 {
                    let size = self.independent_part(node, &Vec3::ith(axis, 1.0)).norm();
                    if size > best.2 * (1.0 + 1e-9) {
                        best = (node, axis, size);
                    }
                }
            }
            let (node, axis, size) = best;
            if size <= FREE_MODE_TOLERANCE_REL {
                break;
            }
            self.support(node, &Vec3::ith(axis, 1.0));
            out.push((node, axis));
        }
        out
    }
}

/// Fraction of the `forces` on `nodes` (three for each node) that acts along rigid-body modes left free by
/// `constraints`.
pub(crate) fn share_along_free_motions(
    constraints: &Constraints,
    nodes: &[Vec3],
    forces: &[f64],
) -> f64 {
    let mut modes = RigidModes::of(nodes);
    modes.add_constraints(constraints);
    let (mut along, mut all) = (Row::zeros(), 0.0);
    for (node, force) in forces.chunks_exact(3).map(Vec3::from_column_slice).enumerate() {
        let force = constraints.free_projector(node) * force;
        let rotation = ((nodes[node] - modes.centre) / modes.size).cross(&force);
        along += Row::new(force.x, force.y, force.z, rotation.x, rotation.y, rotation.z);
        all += force.norm();
    }
    modes.held.iter().for_each(|held| along -= held * held.dot(&along));
    if all > 0.0 { along.norm() / all } else { 0.0 }
}

/// Subtracts from the displacements `moves` of `nodes` (three for each node) their projection on the free rigid-body
/// modes. Modes are constrained by `constraints` and by supports of nodes along directions.
pub(crate) fn take_free_motions(
    constraints: &Constraints,
    nodes: &[Vec3],
    supports: impl Iterator<Item = (usize, Vec3)>,
    moves: &mut [f64],
) {
    let mut modes = RigidModes::of(nodes);
    modes.add_constraints(constraints);
    supports.for_each(|(node, along)| modes.support(node, &along));
    let motions = modes.free_motions();
    for motion in &motions {
        let along: f64 = moves.iter().zip(motion).map(|(a, b)| a * b).sum();
        moves.iter_mut().zip(motion).for_each(|(a, b)| *a -= along * b);
    }
}

/// Displacement components that constrain the rigid-body modes left free by `constraints` and by supports of nodes
/// along directions. Nodes with supports are not used.
pub(crate) fn unsupported(
    constraints: &Constraints,
    nodes: &[Vec3],
    supports: impl Iterator<Item = (usize, Vec3)> + Clone,
) -> Vec<(usize, usize)> {
    let mut modes = RigidModes::of(nodes);
    modes.add_constraints(constraints);
    for (node, along) in supports.clone() {
        if modes.all_held() {
            return Vec::new();
        }
        modes.support(node, &along);
    }
    let mut supported = vec![false; nodes.len()];
    supports.for_each(|(node, _)| supported[node] = true);
    modes.constrain_free_modes(|node| !supported[node] && !constraints.is_hanging(node))
}

/// Rigid motion `x -> rotation x + shift` from points `from` to points `to` (least squares). Arbitrary if `constraints`
/// hold nothing; a rotation about and a shift normal to the axis if they hold only one axis. `None` if they hold
/// more.
pub(crate) fn fit_rigid_motion(
    constraints: &Constraints,
    from: &[Vec3],
    to: &[Vec3],
) -> Option<(Mat3, Vec3)> {
    let held = |&axis: &usize| (0..constraints.len()).any(|n| constraints.is_held(n, axis));
    let held: Vec<usize> = (0..3).filter(held).collect();
    let middle = |points: &[Vec3]| points.iter().sum::<Vec3>() / points.len().max(1) as f64;
    let (a, b) = (middle(from), middle(to));
    let products = from.iter().zip(to).map(|(x, y)| (y - b) * (x - a).transpose()).sum::<Mat3>();
    let rotation = match held[..] {
        [] => rotation_of(&products)?,
        [axis] => rotation_about(axis, &products),
        _ => return None,
    };
    let mut shift = b - rotation * a;
    held.iter().for_each(|&axis| shift[axis] = 0.0);
    Some((rotation, shift))
}

/// As [`fit_rigid_motion`], but if more than one axis is held, a translation along the free axes.
pub(crate) fn nearest_free(constraints: &Constraints, from: &[Vec3], to: &[Vec3]) -> (Mat3, Vec3) {
    fit_rigid_motion(constraints, from, to).unwrap_or_else(|| {
        let middle = |points: &[Vec3]| points.iter().sum::<Vec3>() / points.len().max(1) as f64;
        let mut shift = middle(to) - middle(from);
        for axis in 0..3 {
            if (0..constraints.len()).any(|n| constraints.is_held(n, axis)) {
                shift[axis] = 0.0;
            }
        }
        (Mat3::identity(), shift)
    })
}

/// Rotation with the largest `rotation : products` (Kabsch, 1976).
fn rotation_of(products: &Mat3) -> Option<Mat3> {
    let svd = products.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    // Singular values are sorted in descending order: a reflection is removed along the smallest.
    let upright = Vec3::new(1.0, 1.0, (u * v_t).determinant().signum());
    Some(u * Mat3::from_diagonal(&upright) * v_t)
}

fn rotation_about(axis: usize, products: &Mat3) -> Mat3 {
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let angle = (products[(j, i)] - products[(i, j)]).atan2(products[(i, i)] + products[(j, j)]);
    nalgebra::Rotation3::from_axis_angle(
        &nalgebra::Unit::new_unchecked(Vec3::ith(axis, 1.0)),
        angle,
    )
    .into_inner()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners() -> Vec<Vec3> {
        (0..8)
            .map(|k| Vec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)))
            .collect()
    }

    #[test]
    fn a_free_body_needs_six_supports_and_a_quarter_one() {
        let needed = |held: &Constraints| unsupported(held, &corners(), std::iter::empty()).len();
        assert_eq!(needed(&Constraints::none(8)), 6);
        let mut quarter = Constraints::none(8);
        quarter.symmetry_plane(&corners(), 0, 0.0, 1e-9);
        quarter.symmetry_plane(&corners(), 1, 0.0, 1e-9);
        assert_eq!(needed(&quarter), 1);
    }

    #[test]
    fn free_motions_are_subtracted_and_deformation_is_kept() {
        let mut on_plane = Constraints::none(8);
        on_plane.symmetry_plane(&corners(), 0, 0.0, 1e-9);
        let stretch = |x: &Vec3| Vec3::new(0.1 * x.x, 0.2 * (x.y - 0.5), -0.3 * (x.z - 0.5));
        let rotation = |x: &Vec3| Vec3::x().cross(&(x - Vec3::repeat(0.5))) * 0.02;
        let moves = |shift: Vec3| -> Vec<f64> {
            let at = |x: &Vec3| <[f64; 3]>::from(stretch(x) + rotation(x) + shift);
            corners().iter().flat_map(at).collect()
        };
        let mut independent_part = moves(Vec3::new(0.0, 3.0, -2.0));
        take_free_motions(&on_plane, &corners(), std::iter::empty(), &mut independent_part);
        for (at, x) in independent_part.chunks_exact(3).zip(corners()) {
            assert!((Vec3::from_column_slice(at) - stretch(&x)).norm() < 1e-12);
        }
        // A support along y at the middle of the plane leaves the motion along z free.
        let supports = corners().into_iter().enumerate().map(|(node, _)| (node, Vec3::y()));
        let mut independent_part = moves(Vec3::new(0.0, 3.0, -2.0));
        take_free_motions(&on_plane, &corners(), supports, &mut independent_part);
        for (at, x) in independent_part.chunks_exact(3).zip(corners()) {
            let kept = stretch(&x) + rotation(&x) + Vec3::new(0.0, 3.0, 0.0);
            assert!((Vec3::from_column_slice(at) - kept).norm() < 1e-12);
        }
    }

    #[test]
    fn loads_push_along_the_motions_that_are_free() {
        let (free, mut on_plane) = (Constraints::none(8), Constraints::none(8));
        on_plane.symmetry_plane(&corners(), 0, 0.0, 1e-9);
        let share = |held: &Constraints, loads: &[(usize, f64)]| {
            let mut forces = [0.0; 24];
            loads.iter().for_each(|&(unknown, force)| forces[unknown] = force);
            share_along_free_motions(held, &corners(), &forces)
        };
        let stretch = [(0, -2.0), (3, 2.0)];
        let couple = [(0, -2.0), (9, 2.0)];
        assert!(share(&free, &stretch) < 1e-15 && share(&free, &[]) == 0.0);
        assert!(share(&free, &couple) > 0.1);
        // A plane holds its nodes along x, and the body against rotation about y and z.
        assert!(share(&on_plane, &couple) < 1e-15 && share(&on_plane, &[(4, 1.0)]) > 0.9);
    }

    #[test]
    fn a_body_moved_is_brought_back_as_far_as_it_is_free() {
        let about = nalgebra::Unit::new_normalize(Vec3::new(0.3, -1.0, 2.0));
        let far = nalgebra::Rotation3::from_axis_angle(&about, 2.0).into_inner();
        let little = nalgebra::Rotation3::from_axis_angle(&Vec3::x_axis(), -0.4).into_inner();
        let mut on_plane = Constraints::none(8);
        on_plane.symmetry_plane(&corners(), 0, 0.0, 1e-9);
        // A flat sheet coincides with its mirror image.
        let flat: Vec<Vec3> = corners().iter().map(|x| Vec3::new(x.x, 2.0 * x.y, 0.0)).collect();
        let free = Constraints::none(8);
        for (held, points, rotation, shift) in [
            (&free, corners(), far, Vec3::new(5.0, -3.0, 1.0)),
            (&free, flat, far, Vec3::new(5.0, -3.0, 1.0)),
            (&on_plane, corners(), little, Vec3::new(0.0, 0.2, -0.5)),
        ] {
            let moved: Vec<Vec3> = points.iter().map(|x| rotation * x + shift).collect();
            let (back, by) = fit_rigid_motion(held, &moved, &points).unwrap();
            for (x, y) in points.iter().zip(&moved) {
                assert!((back * y + by - x).norm() < 1e-14);
            }
            assert!((back.determinant() - 1.0).abs() < 1e-14);
        }
        // A quarter translates only along the free axis, and not at all if a node is held along it.
        on_plane.hold(3, 1);
        assert_eq!(fit_rigid_motion(&on_plane, &corners(), &corners()), None);
        let lifted: Vec<Vec3> = corners().iter().map(|x| x + Vec3::new(0.1, 0.2, 0.3)).collect();
        let (rotation, shift) = nearest_free(&on_plane, &lifted, &corners());
        assert!(rotation == Mat3::identity() && (shift + 0.3 * Vec3::z()).norm() < 1e-14);
        on_plane.hold(3, 2);
        assert_eq!(nearest_free(&on_plane, &lifted, &corners()).1, Vec3::zeros());
    }
}
