//! Errors of meshing, mesh files and mesh checks.

use std::path::PathBuf;

use kanagata_files::WriteError;

/// The reason why a mesher, mesh reader or mesh check yields no mesh.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum MeshError {
    /// The model has nothing to mesh.
    #[error("{name}: the model has no faces to mesh; check what its file holds")]
    NoFaces {
        /// Name of the model.
        name: String,
    },
    /// An option outside its admissible range.
    #[error("{option} is {found}; allowed: {allowed}")]
    Option {
        /// Name of the field.
        option: &'static str,
        /// Value given.
        found: String,
        /// Its range.
        allowed: &'static str,
    },
    /// Faces that could not be meshed.
    #[error(
        "{count} of {total} faces could not be meshed; first: face {face} ({source_entity}): {reason}; try more divisions, a smaller size or the other mesher, or leave these faces out"
    )]
    Faces {
        /// Number of failed faces.
        count: usize,
        /// Number of faces of the model.
        total: usize,
        /// First failed face.
        face: usize,
        /// Its entity in the CAD file.
        source_entity: String,
        /// Reason.
        reason: String,
        /// All failed faces with reasons.
        failed: Vec<(usize, String)>,
    },
    /// The mesh does not match the model.
    #[error("the mesh does not fit the model: {found}; allowed: {allowed}; {remedy}")]
    Check {
        /// What was found.
        found: String,
        /// What is allowed.
        allowed: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// The mesh does not lie on the model.
    #[error(
        "the mesh does not fit the model: {found}; allowed: {allowed}; check that mesh and CAD are of the same part and that the mesh is in mm"
    )]
    OtherPart {
        /// What was found.
        found: String,
        /// What is allowed.
        allowed: String,
    },
    /// The gmsh program was not found.
    #[error(
        "gmsh not found ({tried}); install it (`pip install gmsh`), name it (`program`, or the environment variable KANAGATA_GMSH), or use the built-in mesher"
    )]
    GmshAbsent {
        /// Locations searched.
        tried: String,
    },
    /// gmsh ran without producing a mesh.
    #[error("gmsh gave no mesh of {}: {reason}; its last lines:\n  {log}", cad.display())]
    GmshFailed {
        /// The CAD file.
        cad: PathBuf,
        /// What is missing.
        reason: String,
        /// Tail of its log.
        log: String,
    },
    /// An unsupported format, and meshio is not available to read it.
    #[error(
        "{file}: read here are .msh, .stl, .obj and .vtu, other formats through Python's meshio, which is not there ({tried}); install it (`pip install meshio`), name its Python with KANAGATA_PYTHON, or convert the file to one of these formats"
    )]
    MeshioAbsent {
        /// The file's name.
        file: String,
        /// Locations searched.
        tried: String,
    },
    /// meshio ran without producing a mesh.
    #[error(
        "meshio cannot read {file}: {reason}; allowed: a format that meshio knows, with triangles or quadrilaterals"
    )]
    MeshioFailed {
        /// The file's name.
        file: String,
        /// Its message.
        reason: String,
    },
    /// A file that cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        #[source]
        source: std::io::Error,
    },
    /// A mesh file that violates its format.
    #[error("{file}, {place}: {found}; allowed: {allowed}")]
    Invalid {
        /// The file's name.
        file: String,
        /// Line or byte.
        place: String,
        /// What was found.
        found: String,
        /// What is allowed.
        allowed: String,
    },
    /// A file that cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}
