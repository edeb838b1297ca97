//! Why a mesh makes no tool model.

use crate::tool::build::ToolError;

/// Why a mesh makes no tool model.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ConvertError {
    /// An element on a face that the model does not have.
    #[error(
        "element {element} lies on CAD face {face}; the model has {count} faces: attach the mesh to this model first"
    )]
    Face {
        /// Element, from 0.
        element: usize,
        /// Face it names.
        face: u32,
        /// Faces there are.
        count: usize,
    },
    /// No normal at a vertex.
    #[error(
        "no normal on {face} at ({x:.4}, {y:.4}, {z:.4}) mm: the surface is degenerate there; mesh the face finer or repair it in the CAD"
    )]
    Normal {
        /// Face.
        face: String,
        /// Position [mm].
        x: f64,
        /// Position [mm].
        y: f64,
        /// Position [mm].
        z: f64,
    },
    /// Closest points on a face cost too much.
    #[error(
        "closest points on the surface of {face} need more than {cells} parts of it in all: it folds, or waves more finely than its mesh; repair the face in the CAD, mesh it finer, or leave it out"
    )]
    Searches {
        /// Face.
        face: String,
        /// Parts that its searches may examine.
        cells: u64,
    },
    /// Only Nagata patches and facets come from a mesh.
    #[error(
        "patches of kind Bezier do not come from vertices and normals; allowed: nagata, facets; see `bezier_from_cad`"
    )]
    Kind,
    /// A mesh without CAD whose elements cannot all look outwards.
    #[error(
        "the elements on both sides of the edge from ({from}) to ({to}) mm cannot be turned alike, as on a Moebius strip; allowed: a mesh with two sides; cut it there, or mesh the part again"
    )]
    OneSided {
        /// One end [mm].
        from: String,
        /// The other one [mm].
        to: String,
    },
    /// A mesh without elements of any area.
    #[error(
        "the mesh has no triangles or quadrilaterals; allowed: one at least; export the surface of the tool"
    )]
    NoElements,
    /// The tool cannot be built.
    #[error(transparent)]
    Tool(#[from] ToolError),
}
