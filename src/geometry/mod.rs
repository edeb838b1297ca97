//! Vectors, frames, axis-aligned boxes, bounding volume hierarchy, disjoint sets and NURBS.

pub mod aabb;
pub mod box_tree;
pub mod frame;
pub mod golden;
pub mod numbers;
pub mod nurbs;
pub mod sets;

pub use aabb::Aabb;
pub use frame::{Affine, Frame};

/// A point or vector in space [mm].
pub type Vec3 = nalgebra::Vector3<f64>;
/// A point or vector in a parameter plane.
pub type Vec2 = nalgebra::Vector2<f64>;
/// A 3 x 3 matrix.
pub type Mat3 = nalgebra::Matrix3<f64>;
