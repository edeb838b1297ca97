//! Folded patches repaired: without their given curves, as two triangles, with straight edges.

use super::{ConvertError, ConvertOptions, ConvertReport, Exempt, convert_once};
use crate::cad::Model;
use crate::geometry::Vec3;
use crate::mesh::{Element, SurfaceMesh};
use crate::tool::{ToolKind, ToolModel};

/// Rounds of repair: a dropped curve can fold a neighbour.
const ROUNDS: usize = 4;

/// The model with as few folded patches as found: first the edges of folded patches become those of Eq. 8, then
/// folded quadrilaterals are split, and where that is asked the edges of what still folds become straight.
pub(super) fn repaired(
    model: &Model,
    mesh: &SurfaceMesh,
    options: &ConvertOptions,
    first: (ToolModel, ConvertReport),
) -> Result<(ToolModel, ConvertReport), ConvertError> {
    let mut best = first;
    let mut exempt = Exempt::default();
    if options.through_cad {
        for _ in 0..ROUNDS {
            grow(&mut exempt.plain, &best.1.folded);
            let next = convert_once(model, mesh, options, &exempt)?;
            let done = next.1.folded.iter().all(|k| exempt.plain.contains(k));
            if next.1.folded.len() <= best.1.folded.len() {
                best = next;
            }
            if done {
                break;
            }
        }
    }
    let (cut, split) = split(mesh, &best.0, &best.1.folded);
    let mut mesh = mesh;
    if split > 0 {
        // Split elements are replaced by their first half; the second halves follow at the end, so that ids stay.
        let mut next = convert_once(model, &cut, options, &exempt)?;
        if next.1.folded.len() < best.1.folded.len() {
            next.1.split = split;
            best = next;
            mesh = &cut;
        }
    }
    if options.straighten && options.kind == ToolKind::Nagata {
        best = straightened(model, mesh, options, exempt, best)?;
    }
    Ok(best)
}

/// The edges of folded patches as chords, as long as that unfolds some.
fn straightened(
    model: &Model,
    mesh: &SurfaceMesh,
    options: &ConvertOptions,
    mut exempt: Exempt,
    mut best: (ToolModel, ConvertReport),
) -> Result<(ToolModel, ConvertReport), ConvertError> {
    let split = best.1.split;
    for _ in 0..ROUNDS {
        if best.1.folded.is_empty() {
            break;
        }
        grow(&mut exempt.straight, &best.1.folded);
        let mut next = convert_once(model, mesh, options, &exempt)?;
        if next.1.folded.len() >= best.1.folded.len() {
            break;
        }
        next.1.split = split;
        best = next;
    }
    Ok(best)
}

fn grow(list: &mut Vec<u32>, by: &[u32]) {
    list.extend(by);
    list.sort_unstable();
    list.dedup();
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
