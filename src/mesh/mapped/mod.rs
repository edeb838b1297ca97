//! The built-in mesher: a conforming mesh of the whole model whose lines run along the borders of its
//! CAD faces.
//!
//! Four-sided faces get a tensor grid of quads on the exact surface, three-sided ones triangles or three
//! blocks of quads, all others a constrained Delaunay triangulation joined to quads. Edges are divided
//! once, so that neighbours share their nodes; how often is agreed over chains of opposite edges
//! ([`divisions`]) from what the curvature asks ([`MappedOptions::arc_divisions`]). Flats get the fewest.

mod bends;
mod bisect;
mod border;
mod bridges;
mod demand;
pub mod divisions;
mod grid;
mod mesh;
mod mesher;
mod options;
mod pairing;
mod patchwork;
pub mod plan;
mod poles;
mod polygon;
mod regions;
mod sample;
mod sides;
mod sine;
#[cfg(test)]
mod tests;
mod trimmed;
mod untangle;

pub use self::demand::{is_crease, is_flat};
pub use self::mesh::mesh;
pub use self::options::{MappedOptions, MeshStyle};
pub(super) use self::sine::corner_sine;
