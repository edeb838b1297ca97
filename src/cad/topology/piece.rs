//! A side of a face before it is joined to an edge.

use kanagata_geometry::nurbs::{Curve2, Curve3};

/// Distance between sides of one edge of the file, relative to its length, up to which they are joined.
pub(super) const SHARED_EDGE_TOLERANCE_REL: f64 = 0.02;

/// A side to be joined: (face, loop, position), its parameter curve, and the file's space curve in the same direction.
#[derive(Debug, Clone)]
pub(crate) struct Piece {
    pub at: [usize; 3],
    pub pcurve: Curve2,
    pub curve: Option<Curve3>,
    /// Edge identity in the file; sides of one edge are joined for any distance of their parameter curves.
    pub edge_id: Option<usize>,
}
