//! What is wrong with a joined model: borders that stay free, the gaps between them, faces that are
//! inside out, tiny or there twice.

use super::model::Model;
use super::topology::{Piece, join};

impl Model {
    /// The model with its edges joined anew within `tolerance` [mm]: faces and parameter curves stay.
    #[must_use]
    pub fn joined_within(&self, tolerance: f64) -> Self {
        let mut out = self.clone();
        let mut pieces = Vec::new();
        for (f, face) in self.faces.iter().enumerate() {
            for (l, trim) in face.loops.iter().enumerate() {
                for (k, used) in trim.uses.iter().enumerate() {
                    let Some(edge) = used.edge else { continue };
                    let curve = &self.edges[edge].curve;
                    let curve = if used.reversed { curve.reversed() } else { curve.clone() };
                    let pcurve = used.pcurve.clone();
                    pieces.push(Piece { at: [f, l, k], pcurve, curve: Some(curve), edge_id: None });
                }
            }
        }
        out.join_tolerance = tolerance;
        join(&mut out, pieces, tolerance);
        out
    }
}
