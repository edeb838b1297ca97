//! A side of a face before sides are joined into edges.

use crate::geometry::nurbs::{Curve2, Curve3};

/// Sides of one edge of the file may lie apart by this share of its length.
pub(super) const OWN_EDGE: f64 = 0.02;

/// A side of a face on its way to an edge use: (face, loop, position), its parameter curve, and the file's curve
/// in space in the same direction.
#[derive(Debug, Clone)]
pub(in crate::cad) struct Piece {
    pub at: [usize; 3],
    pub pcurve: Curve2,
    pub curve: Option<Curve3>,
    /// The file's own edge: sides of one edge are joined however far apart their parameter curves lie.
    pub edge_id: Option<usize>,
}
