//! Starts of the closest-point searches of an audit: parameters of the CAD near the middles of patches.

use kanagata_audit::sample::{PatchSamples, middle};
use kanagata_cad::Model;
use kanagata_geometry::{Vec2, Vec3};
use kanagata_mesh::MeshFeet;
use kanagata_tool::model::PatchCorners;
use kanagata_tool::{Patch, ToolModel};

/// For each patch the mean of the parameters of its corners, where the mesher knows them. `None` where the point there is
/// farther from the middle of the patch than half its longest diagonal, as across a seam. The faces of `model` have the
/// numbers from `first` in the tool.
pub(super) fn patch_starts(
    tool: &ToolModel,
    (model, first): (&Model, u32),
    feet: &MeshFeet,
) -> Vec<Option<Vec2>> {
    let start = |(corners, patch): (&PatchCorners, &Patch)| {
        let face = corners.face - first;
        let known = corners.vertices.iter().map(|&v| feet.on_face(v, face));
        let sum = known.sum::<Option<Vec2>>()?;
        let start = sum / corners.vertices.len() as f64;
        let x: Vec<Vec3> = corners.vertices.iter().map(|&v| tool.vertices[v as usize]).collect();
        let across = |k: usize| (x[(k + 2) % x.len()] - x[k]).norm();
        let size = across(0).max(across(1));
        let (eta, zeta) = middle(patch);
        let off = model.faces[face as usize].surface.point(start) - patch.derivs(eta, zeta).s;
        (off.norm() <= 0.5 * size).then_some(start)
    };
    tool.corners.iter().zip(&tool.patches).map(start).collect()
}

/// For each patch the parameters found at the grid point closest to its middle.
pub(super) fn known_starts(samples: &[PatchSamples]) -> Vec<Option<Vec2>> {
    let start = |s: &PatchSamples| {
        let [i, j] = if s.sides == 3 { [2 * s.n / 3, s.n / 3] } else { [s.n / 2, s.n / 2] };
        s.points[s.index(i, j)?].as_ref()?.uv
    };
    samples.iter().map(start).collect()
}
