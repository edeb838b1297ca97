//! Parameters of the vertices of a mesh on the faces and edges of its CAD model, known to the mesher that placed them.

use rustc_hash::FxHashMap;

use kanagata_geometry::Vec2;

/// Parameters of vertices on CAD faces and edges: starts of closest-point searches. They are no part of the value of a
/// mesh: all are equal, and a mesh without them has the same conversion to rounding.
#[derive(Debug, Clone, Default)]
pub struct MeshFeet {
    on_faces: FxHashMap<(u32, u32), Vec2>,
    /// Not a number at the ends of a closed edge, which have two parameters.
    on_edges: FxHashMap<(u32, u32), f64>,
}

impl PartialEq for MeshFeet {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl MeshFeet {
    /// Parameters of `vertex` on the surface of `face`. At a seam or pole these are one of several.
    #[must_use]
    pub fn on_face(&self, vertex: u32, face: u32) -> Option<Vec2> {
        self.on_faces.get(&(vertex, face)).copied()
    }

    /// Parameter of `vertex` on the curve of `edge`; `None` at the ends of a closed edge.
    #[must_use]
    pub fn on_edge(&self, vertex: u32, edge: u32) -> Option<f64> {
        self.on_edges.get(&(vertex, edge)).copied().filter(|t| !t.is_nan())
    }

    /// Adds the parameters of `vertex` on `face`; the first ones are kept.
    pub(super) fn add_on_face(&mut self, vertex: u32, face: u32, uv: Vec2) {
        self.on_faces.entry((vertex, face)).or_insert(uv);
    }

    /// Adds the parameter of `vertex` on `edge`.
    pub(super) fn add_on_edge(&mut self, vertex: u32, edge: u32, t: f64) {
        let known = self.on_edges.entry((vertex, edge)).or_insert(t);
        if *known != t {
            *known = f64::NAN;
        }
    }

    /// Replaces vertex `v` by `new_ids[v]`; those with `u32::MAX` are dropped.
    pub(super) fn renumber(&mut self, new_ids: &[u32]) {
        let new = |v: u32| new_ids.get(v as usize).copied().filter(|&id| id != u32::MAX);
        let faces = self.on_faces.drain().filter_map(|((v, f), uv)| Some(((new(v)?, f), uv)));
        self.on_faces = faces.collect();
        let edges = self.on_edges.drain().filter_map(|((v, e), t)| Some(((new(v)?, e), t)));
        self.on_edges = edges.collect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_follow_the_numbers_of_their_vertices() {
        let mut feet = MeshFeet::default();
        feet.add_on_face(3, 7, Vec2::new(0.25, 0.5));
        feet.add_on_face(3, 7, Vec2::new(1.25, 0.5));
        feet.add_on_edge(3, 2, 0.75);
        feet.add_on_edge(1, 2, 0.0);
        feet.renumber(&[u32::MAX, u32::MAX, u32::MAX, 0]);
        assert_eq!(feet.on_face(0, 7), Some(Vec2::new(0.25, 0.5)));
        assert_eq!((feet.on_edge(0, 2), feet.on_edge(1, 2)), (Some(0.75), None));
    }

    #[test]
    fn the_end_of_a_closed_edge_has_no_parameter() {
        let mut feet = MeshFeet::default();
        feet.add_on_edge(0, 4, 0.0);
        feet.add_on_edge(0, 4, 6.25);
        assert_eq!(feet.on_edge(0, 4), None);
    }
}
