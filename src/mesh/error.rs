//! Why there is no mesh.

use std::path::PathBuf;

use crate::files::WriteError;

/// Why a mesher, mesh reader or mesh check gives no mesh.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum MeshError {
    /// The model has nothing to mesh.
    #[error("{name}: the model has no faces to mesh; check what its file holds")]
    NoFaces {
        /// Name of the model.
        name: String,
    },
    /// A field of the options outside its range.
    #[error("{option} is {found}; allowed: {allowed}")]
    Option {
        /// Name of the field.
        option: &'static str,
        /// What was given.
        found: String,
        /// Its range.
        allowed: &'static str,
    },
    /// Faces that could not be meshed.
    #[error(
        "{count} of {total} faces could not be meshed; first: face {face} ({source_entity}): {reason}; try more divisions, a smaller size or the other mesher, or leave these faces out"
    )]
    Faces {
        /// How many failed.
        count: usize,
        /// Faces of the model.
        total: usize,
        /// First that failed.
        face: usize,
        /// Its entity in the CAD file.
        source_entity: String,
        /// Why.
        reason: String,
        /// All that failed, and why.
        failed: Vec<(usize, String)>,
    },
    /// The mesh is there but is not one of the model.
    #[error("the mesh does not fit the model: {found}; allowed: {allowed}; {remedy}")]
    Check {
        /// What was found.
        found: String,
        /// What is allowed.
        allowed: String,
        /// What to do.
        remedy: &'static str,
    },
    /// The mesh lies elsewhere than the model.
    #[error(
        "the mesh does not fit the model: {found}; allowed: {allowed}; check that mesh and CAD are of the same part and that the mesh is in mm"
    )]
    OtherPart {
        /// What was found.
        found: String,
        /// What is allowed.
        allowed: String,
    },
    /// The gmsh program is not there.
    #[error(
        "gmsh not found ({tried}); install it (`pip install gmsh`), name it (`program`, or the environment variable KANAGATA_GMSH), or use the built-in mesher"
    )]
    GmshAbsent {
        /// Where it was looked for.
        tried: String,
    },
    /// The gmsh program ran and gave no mesh.
    #[error("gmsh gave no mesh of {}: {reason}; its last lines:\n  {log}", cad.display())]
    GmshFailed {
        /// The CAD file.
        cad: PathBuf,
        /// What is missing.
        reason: String,
        /// Tail of its log.
        log: String,
    },
    /// A format that is not read here, and no meshio to read it.
    #[error(
        "{file}: read here are .msh, .stl, .obj and .vtu, other formats through Python's meshio, which is not there ({tried}); install it (`pip install meshio`), name its Python with KANAGATA_PYTHON, or convert the file to one of these formats"
    )]
    MeshioAbsent {
        /// The file's name.
        file: String,
        /// What was tried.
        tried: String,
    },
    /// meshio was run and gave no mesh.
    #[error(
        "meshio cannot read {file}: {reason}; allowed: a format that meshio knows, with triangles or quadrilaterals"
    )]
    MeshioFailed {
        /// The file's name.
        file: String,
        /// What it said.
        reason: String,
    },
    /// A file that cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// A mesh file whose text breaks its format.
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
