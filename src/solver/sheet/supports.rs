//! Prescribed displacements: zero on symmetry planes and at fixed nodes, means of other nodes at hanging nodes.

use kanagata_geometry::{Mat3, Vec3};

/// Bit of a node that hangs between its masters.
const HANGING: u8 = 1 << 3;

/// Held displacement components, one bit each, and hanging nodes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Constraints {
    held: Vec<u8>,
}

impl Constraints {
    /// No constraints on `nodes` nodes.
    #[must_use]
    pub fn none(nodes: usize) -> Self {
        Self { held: vec![0; nodes] }
    }

    /// Holds component `axis` (0..3) of `node`; a node out of range is ignored.
    pub fn hold(&mut self, node: usize, axis: usize) {
        if let Some(bits) = self.held.get_mut(node) {
            *bits |= 1 << (axis % 3);
        }
    }

    /// Holds component `axis` of every node with `|x[axis] - at| <= tolerance` [mm] (symmetry plane). Returns the
    /// number of these nodes.
    pub fn symmetry_plane(
        &mut self,
        nodes: &[Vec3],
        axis: usize,
        at: f64,
        tolerance: f64,
    ) -> usize {
        let mut count = 0;
        for (node, x) in nodes.iter().enumerate() {
            if (x[axis] - at).abs() <= tolerance {
                self.hold(node, axis);
                count += 1;
            }
        }
        count
    }

    /// Makes `node` a hanging node: its equations are removed, and it has no support of its own.
    pub fn hang(&mut self, node: usize) {
        if let Some(bits) = self.held.get_mut(node) {
            *bits = HANGING;
        }
    }

    /// Whether `node` hangs between its masters.
    #[must_use]
    pub fn is_hanging(&self, node: usize) -> bool {
        self.held[node] & HANGING != 0
    }

    /// Whether component `axis` of `node` is held by a support.
    #[must_use]
    pub fn is_held(&self, node: usize, axis: usize) -> bool {
        self.held[node] & (1 << axis) != 0
    }

    /// Projector onto the free components of `node`; zero for a hanging node.
    #[must_use]
    pub fn free_projector(&self, node: usize) -> Mat3 {
        let hangs = self.is_hanging(node);
        let free = |axis| if hangs || self.is_held(node, axis) { 0.0 } else { 1.0 };
        Mat3::from_diagonal(&Vec3::new(free(0), free(1), free(2)))
    }

    /// Whether no component of `node` is held and it does not hang.
    #[must_use]
    pub fn is_free(&self, node: usize) -> bool {
        self.held[node] == 0
    }

    /// Number of nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.held.len()
    }

    /// Whether there are no nodes.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.held.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_on_two_planes_keeps_one_direction() {
        let nodes = [Vec3::zeros(), Vec3::new(1.0, 0.0, 0.0)];
        let mut c = Constraints::none(2);
        assert_eq!(c.symmetry_plane(&nodes, 0, 0.0, 1e-9), 1);
        assert_eq!(c.symmetry_plane(&nodes, 1, 0.0, 1e-9), 2);
        assert_eq!(c.free_projector(0) * Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.0, 0.0, 3.0));
        assert!(c.is_held(1, 1) && !c.is_held(1, 0));
    }
}
