//! Conversion of a CAD model and its mesh to a tool model.
//!
//! Every pair (vertex, CAD face) has one normal. Normals are merged only where the faces are tangent-continuous; they
//! are never averaged over a crease.

pub mod bezier;
mod conversion;
mod edges;
mod error;
mod normals;
pub mod offset;
mod options;
pub mod origin;
pub mod own;
pub mod part;
mod repair;
mod searches;
pub mod select;
pub mod tolerance;
pub mod unfolded;

pub use self::error::ConvertError;
pub use self::options::{ConvertOptions, ConvertReport};

pub use self::conversion::faces_away;
use self::conversion::{Conversion, Source};
use kanagata_cad::Model;
use kanagata_mesh::SurfaceMesh;
use kanagata_tool::{ToolKind, ToolModel};

/// Converts a mesh of `model` to a tool model. Folded patches are repaired without moving a vertex: prescribed edge
/// curves are replaced by those of Eq. 8, and quadrilaterals are split into two triangles.
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
    Conversion::new(Source::Cad(model), mesh, options)?.convert_and_repair()
}

/// Renumbers the faces of a tool: face `f` becomes face `numbers[f]`.
pub fn renumber(tool: &mut ToolModel, numbers: &[usize]) {
    let renumbered = |face: &mut u32| *face = numbers[*face as usize] as u32;
    tool.faces.iter_mut().for_each(renumbered);
    tool.corners.iter_mut().for_each(|c| renumbered(&mut c.face));
}

#[cfg(test)]
#[allow(dead_code)] // Some of these shapes are for the tests of other modules.
#[path = "../cad/query_tests/shapes.rs"]
mod shapes;
