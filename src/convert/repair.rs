//! Folded patches repaired: without their given curves, and as two triangles.

use super::{ConvertError, ConvertOptions, ConvertReport, convert_once};
use crate::cad::Model;
use crate::geometry::Vec3;
use crate::mesh::{Element, SurfaceMesh};
use crate::tool::ToolModel;

/// Rounds of repair: a dropped curve can fold a neighbour.
const ROUNDS: usize = 4;

/// The model with as few folded patches as found: first the edges of folded patches become those of Eq. 8, then
/// folded quadrilaterals are split.
pub(super) fn repaired(
    model: &Model,
    mesh: &SurfaceMesh,
    options: &ConvertOptions,
    first: (ToolModel, ConvertReport),
) -> Result<(ToolModel, ConvertReport), ConvertError> {
    let mut best = first;
    let mut plain: Vec<u32> = Vec::new();
    if options.through_cad {
        for _ in 0..ROUNDS {
            plain.extend(&best.1.folded);
            plain.sort_unstable();
            plain.dedup();
            let next = convert_once(model, mesh, options, &plain)?;
            let done = next.1.folded.iter().all(|k| plain.contains(k));
            if next.1.folded.len() <= best.1.folded.len() {
                best = next;
            }
            if done {
                break;
            }
        }
    }
    let (cut, split) = split(mesh, &best.0, &best.1.folded);
    if split == 0 {
        return Ok(best);
    }
    // Split elements are replaced by their first half; the second halves follow at the end, so that ids stay.
    let mut next = convert_once(model, &cut, options, &plain)?;
    if next.1.folded.len() < best.1.folded.len() {
        next.1.split = split;
        best = next;
    }
    Ok(best)
}

/// The mesh with the folded quadrilaterals cut along the diagonal whose triangles turn least against the normals.
fn split(mesh: &SurfaceMesh, tool: &ToolModel, folded: &[u32]) -> (SurfaceMesh, usize) {
    let mut out = mesh.clone();
    let mut seconds = Vec::new();
    for &k in folded {
        let element = mesh.elements[k as usize];
        let [a, b, c, d] = *element.nodes() else { continue };
        let corners = &tool.corners[k as usize];
        let normal: Vec3 = corners.normals.iter().map(|&n| tool.normals[n as usize]).sum();
        // The tool may have been turned round: the area tells which way its elements go.
        let x = |n: u32| mesh.vertices[n as usize];
        let cross = |t: [u32; 3]| (x(t[1]) - x(t[0])).cross(&(x(t[2]) - x(t[0]))).dot(&normal);
        let turned = corners.vertices.first() != element.nodes().first();
        let sign = if turned { -1.0 } else { 1.0 };
        let worst = |pair: [[u32; 3]; 2]| (sign * cross(pair[0])).min(sign * cross(pair[1]));
        let (one, other) = ([[a, b, c], [a, c, d]], [[a, b, d], [b, c, d]]);
        let pair = if worst(one) >= worst(other) { one } else { other };
        if worst(pair) > 0.0 {
            out.elements[k as usize] = Element::triangle(pair[0], element.face);
            seconds.push(Element::triangle(pair[1], element.face));
        }
    }
    let split = seconds.len();
    out.elements.extend(seconds);
    (out, split)
}
