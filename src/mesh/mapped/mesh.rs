//! Mesh of all faces of a model.

use super::mesher::Mesher;
use super::options::{MappedOptions, MeshStyle, check_options};
use crate::{MeshError, SurfaceMesh};
use kanagata_cad::Model;
use kanagata_progress::Progress;

/// Meshes every face of `model`.
///
/// # Errors
/// [`MeshError::NoFaces`], [`MeshError::Option`]; [`MeshError::Faces`] with the first of the faces whose boundary
/// encloses no region at any refinement.
pub fn mesh(model: &Model, options: &MappedOptions) -> Result<SurfaceMesh, MeshError> {
    mesh_watched(model, options, &Progress::default())
}

/// As [`mesh`], with its progress reported: the faces of every round.
///
/// # Errors
/// As [`mesh`].
pub fn mesh_watched(
    model: &Model,
    options: &MappedOptions,
    progress: &Progress,
) -> Result<SurfaceMesh, MeshError> {
    check_options(options)?;
    if model.faces.is_empty() {
        return Err(MeshError::NoFaces { name: model.name.clone() });
    }
    if options.style != MeshStyle::Quads {
        return Mesher::new(model, options, false).watched(progress).run();
    }
    let structured = MappedOptions { style: MeshStyle::Structured, ..*options };
    if let Some(mesh) = even_quads(model, &structured) {
        return Ok(mesh);
    }
    Mesher::new(model, &structured, true).watched(progress).run()
}

/// Quadrilaterals without halving: all faces are mapped except flat ones, whose boundaries are divided until they can
/// be cut into quadrilaterals. `None` when this fails.
pub(super) fn even_quads(model: &Model, options: &MappedOptions) -> Option<SurfaceMesh> {
    if options.unstructured {
        return None;
    }
    let mut mesher = Mesher::new(model, options, false);
    mesher.even_flats = true;
    let mesh = mesher.run().ok()?;
    mesh.elements.iter().all(|e| e.nodes().len() == 4).then_some(mesh)
}
