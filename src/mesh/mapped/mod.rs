//! Built-in mesher: a conforming mesh of the entire model with element sides along the boundaries of its CAD faces.
//!
//! Four-sided faces get a tensor grid of quadrilaterals on the exact surface. Three-sided faces get triangles or three
//! blocks of quadrilaterals. All others get a constrained Delaunay triangulation recombined to quadrilaterals. Edges
//! are divided once, so that adjacent faces have common nodes. The divisions follow from curvature
//! ([`MappedOptions::arc_divisions`]) and are consistent over chains of opposite edges ([`divisions`]). Flat faces get
//! the fewest elements.

mod bisect;
mod border;
mod bridges;
mod demand;
pub mod divisions;
mod edge_tangents;
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
pub use self::mesh::{mesh, mesh_watched};
pub use self::options::{MappedOptions, MeshStyle};
pub(super) use self::sine::corner_sine;
