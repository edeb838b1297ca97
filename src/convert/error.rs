//! Errors of a conversion.

use kanagata_tool::build::ToolError;

/// Reason why no tool model can be made.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ConvertError {
    /// An element refers to a face that the model does not have.
    #[error(
        "element {element} lies on CAD face {face}; the model has {count} faces: attach the mesh to this model first"
    )]
    Face {
        /// Element number, from 0.
        element: usize,
        /// Face number of the element.
        face: u32,
        /// Number of faces of the model.
        count: usize,
    },
    /// The normal at a vertex is undefined.
    #[error(
        "no normal on {face} at ({x:.4}, {y:.4}, {z:.4}) mm: the surface is degenerate there; refine the mesh of the face or repair it in the CAD"
    )]
    Normal {
        /// Face.
        face: String,
        /// Position, x [mm].
        x: f64,
        /// Position, y [mm].
        y: f64,
        /// Position, z [mm].
        z: f64,
    },
    /// The closest-point searches on a face exceed their work limit.
    #[error(
        "closest-point searches on the surface of {face} exceed {cells} cells: the surface folds or oscillates within one element; repair the face in the CAD, refine its mesh, or exclude the face"
    )]
    Searches {
        /// Face.
        face: String,
        /// Number of cells that the searches on it may examine.
        cells: u64,
    },
    /// A mesh gives Nagata patches and facets only.
    #[error(
        "Bezier patches cannot be built from vertices and normals; allowed: nagata, facets; see `bezier_from_cad`"
    )]
    Kind,
    /// A mesh without CAD is not orientable.
    #[error(
        "the elements on both sides of the edge from ({from}) to ({to}) mm cannot be oriented consistently, as on a Moebius strip; allowed: an orientable mesh; cut it there, or mesh the part again"
    )]
    OneSided {
        /// Start of the edge [mm].
        from: String,
        /// End of the edge [mm].
        to: String,
    },
    /// The mesh has no elements.
    #[error(
        "the mesh has no triangles or quadrilaterals; allowed: at least one; export the surface of the tool"
    )]
    NoElements,
    /// The tool model cannot be built.
    #[error(transparent)]
    Tool(#[from] ToolError),
}
