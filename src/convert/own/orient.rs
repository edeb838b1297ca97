//! Consistent orientation of the elements of a mesh.

use rustc_hash::FxHashMap;

use crate::ConvertError;
use kanagata_geometry::Vec3;
use kanagata_mesh::io::MeshFile;
use kanagata_mesh::{Element, SurfaceMesh};

/// Vector area of an element [mm^2].
pub(super) fn vector_area(mesh: &SurfaceMesh, element: &Element) -> Vec3 {
    let x = |k: usize| mesh.vertices[element.nodes()[k] as usize];
    match element.nodes().len() {
        3 => (x(1) - x(0)).cross(&(x(2) - x(0))) * 0.5,
        _ => (x(2) - x(0)).cross(&(x(3) - x(1))) * 0.5,
    }
}

/// For each edge its elements, with true where the element runs from the lower to the higher vertex number.
pub(super) fn edge_elements(mesh: &SurfaceMesh) -> FxHashMap<[u32; 2], Vec<(usize, bool)>> {
    let mut out: FxHashMap<[u32; 2], Vec<(usize, bool)>> = FxHashMap::default();
    for (k, element) in mesh.elements.iter().enumerate() {
        for [a, b] in element.sides() {
            out.entry([a.min(b), a.max(b)]).or_default().push((k, a < b));
        }
    }
    out
}

/// Reverses elements so that adjacent ones are oriented consistently. Each connected part is oriented by the normals of
/// the file, or by the larger part of its area where the file has none.
///
/// # Errors
/// [`ConvertError::OneSided`] when a part is not orientable.
pub(super) fn orient(file: &MeshFile) -> Result<MeshFile, ConvertError> {
    let mesh = &file.mesh;
    let mut beside: Vec<Vec<(usize, bool)>> = vec![Vec::new(); mesh.elements.len()];
    for sides in edge_elements(mesh).values() {
        // At an edge of more than two elements there are no unique neighbours.
        if let [(a, forward), (b, other)] = sides[..] {
            beside[a].push((b, forward == other));
            beside[b].push((a, forward == other));
        }
    }
    let mut reversed: Vec<Option<bool>> = vec![None; mesh.elements.len()];
    let mut out = file.clone();
    for start in 0..mesh.elements.len() {
        if reversed[start].is_some() {
            continue;
        }
        let part = orient_part(mesh, &beside, start, &mut reversed)?;
        let sign = |k: usize| if reversed[k] == Some(true) { -1.0 } else { 1.0 };
        let weight: f64 = part.iter().map(|&k| sign(k) * orientation_weight(file, k)).sum();
        for k in part {
            let is_reversed = reversed[k] == Some(true);
            if is_reversed != (weight < 0.0) {
                out.mesh.elements[k] = mesh.elements[k].reversed();
                if let Some(normals) = out.normals.get_mut(k) {
                    normals[..mesh.elements[k].nodes().len()].reverse();
                }
            }
        }
    }
    Ok(out)
}

/// Weight of an element for its present orientation: vector area times the sum of its file normals; its area without
/// file normals.
fn orientation_weight(file: &MeshFile, k: usize) -> f64 {
    let area = vector_area(&file.mesh, &file.mesh.elements[k]);
    let given: Vec3 = file.normals.get(k).map_or_else(Vec3::zeros, |normals| normals.iter().sum());
    if given == Vec3::zeros() { area.norm() } else { area.dot(&given) }
}

/// Lists the elements connected with `start` and marks in `reversed` those oriented opposite to it.
fn orient_part(
    mesh: &SurfaceMesh,
    beside: &[Vec<(usize, bool)>],
    start: usize,
    reversed: &mut [Option<bool>],
) -> Result<Vec<usize>, ConvertError> {
    reversed[start] = Some(false);
    let mut part = vec![start];
    let mut next = 0;
    while let Some(&k) = part.get(next) {
        next += 1;
        for &(other, against) in &beside[k] {
            let wanted = reversed[k].map(|r| r != against);
            if reversed[other].is_none() {
                reversed[other] = wanted;
                part.push(other);
            } else if reversed[other] != wanted {
                return Err(one_sided_error(mesh, k, other));
            }
        }
    }
    Ok(part)
}

/// The error for two adjacent elements that cannot be oriented consistently.
fn one_sided_error(mesh: &SurfaceMesh, k: usize, other: usize) -> ConvertError {
    let theirs = mesh.elements[other].nodes();
    let shared = mesh.elements[k].nodes().iter().filter(|n| theirs.contains(n));
    let mut ends = shared.map(|&n| {
        let x = mesh.vertices[n as usize];
        format!("{:.4}, {:.4}, {:.4}", x.x, x.y, x.z)
    });
    let mut end = || ends.next().unwrap_or_default();
    ConvertError::OneSided { from: end(), to: end() }
}
