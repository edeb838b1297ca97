//! CAD and mesh become a tool model: one normal per (vertex, CAD face), merged only where the faces are
//! tangent-continuous, never averaged over a crease.

pub mod bezier;
mod edges;
mod error;
mod ground;
mod normals;
mod options;
pub mod own;
pub mod part;
pub mod reach;
mod repair;
mod searches;
pub mod tolerance;
pub mod unfolded;

pub use self::error::ConvertError;
pub use self::options::{ConvertOptions, ConvertReport};

use self::ground::{Ground, Source};
use crate::cad::Model;
use crate::mesh::SurfaceMesh;
use crate::tool::{ToolKind, ToolModel};

/// Converts a mesh of `model` to a tool model. Folded patches are repaired where that is possible without moving a
/// vertex: given curves that fold a patch are dropped, a quadrilateral is split in two triangles.
///
/// # Errors
/// [`ConvertError`] names the element, face or vertex.
pub fn convert(
    model: &Model,
    mesh: &SurfaceMesh,
    options: &ConvertOptions,
) -> Result<(ToolModel, ConvertReport), ConvertError> {
    if options.kind == ToolKind::Bezier {
        return Err(ConvertError::Kind);
    }
    let count = model.faces.len();
    if let Some(element) = mesh.elements.iter().position(|e| e.face as usize >= count) {
        return Err(ConvertError::Face { element, face: mesh.elements[element].face, count });
    }
    Ground::new(Source::Cad(model), mesh, options)?.convert_and_repair()
}

/// Gives the faces of a tool other numbers: `numbers[f]` for face f.
pub fn renumber(tool: &mut ToolModel, numbers: &[usize]) {
    let other = |face: &mut u32| *face = numbers[*face as usize] as u32;
    tool.faces.iter_mut().for_each(other);
    tool.corners.iter_mut().for_each(|c| other(&mut c.face));
}
