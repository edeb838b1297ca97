//! The undeformed sheet: hexahedra in columns, supports, rigid-body motions, characteristic lengths.
//!
//! Used by `assembly`, `system`, `scene` and all above them.

pub mod columns;
pub mod hanging;
pub mod hanging_nodes;
pub mod hex_mesh;
pub mod refine;
pub(super) mod rigid_motions;
pub(super) mod sizes;
pub mod supports;
