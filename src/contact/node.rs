//! Node of the search tree: bounding boxes of eight children in single precision, rounded outwards.

use kanagata_geometry::Aabb;

/// Number of children of a node.
pub(super) const WIDE: usize = 8;

/// Flag of a child that is a piece.
pub(super) const PIECE: u32 = 1 << 31;

/// Bounding boxes of eight children as a structure of arrays.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub(super) struct Node {
    pub(super) low: [[f32; WIDE]; 3],
    pub(super) high: [[f32; WIDE]; 3],
    pub(super) child: [u32; WIDE],
}

impl Node {
    pub(super) const EMPTY: Self = Self {
        low: [[f32::INFINITY; WIDE]; 3],
        high: [[f32::NEG_INFINITY; WIDE]; 3],
        child: [PIECE; WIDE],
    };

    pub(super) fn set(&mut self, lane: usize, bounds: &Aabb, child: u32) {
        for k in 0..3 {
            self.low[k][lane] = down(bounds.min[k]);
            self.high[k][lane] = -down(-bounds.max[k]);
        }
        self.child[lane] = child;
    }
}

/// The largest single-precision number not above `x`.
fn down(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) > x { near.next_down() } else { near }
}
