//! Elements turned so that neighbours look the same way.

use rustc_hash::FxHashMap;

use crate::convert::ConvertError;
use crate::geometry::Vec3;
use crate::mesh::io::MeshFile;
use crate::mesh::{Element, SurfaceMesh};

/// Vector area of an element [mm2].
pub(super) fn vector_area(mesh: &SurfaceMesh, element: &Element) -> Vec3 {
    let x = |k: usize| mesh.vertices[element.nodes()[k] as usize];
    match element.nodes().len() {
        3 => (x(1) - x(0)).cross(&(x(2) - x(0))) * 0.5,
        _ => (x(2) - x(0)).cross(&(x(3) - x(1))) * 0.5,
    }
}

/// Elements at every edge, and whether they run along it from its lower vertex to its higher.
pub(super) fn edges(mesh: &SurfaceMesh) -> FxHashMap<[u32; 2], Vec<(usize, bool)>> {
    let mut edges: FxHashMap<[u32; 2], Vec<(usize, bool)>> = FxHashMap::default();
    for (k, element) in mesh.elements.iter().enumerate() {
        for [a, b] in element.sides() {
            edges.entry([a.min(b), a.max(b)]).or_default().push((k, a < b));
        }
    }
    edges
}

/// The mesh with elements reversed so that neighbours look the same way, and every connected part the way its normals do,
/// or else most of its area.
pub(super) fn oriented(file: &MeshFile) -> Result<MeshFile, ConvertError> {
    let mesh = &file.mesh;
    let mut beside: Vec<Vec<(usize, bool)>> = vec![Vec::new(); mesh.elements.len()];
    for sides in edges(mesh).values() {
        // Where more than two meet there is no telling which go on into which.
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
        let part = spread(mesh, &beside, start, &mut reversed)?;
        let sign = |k: usize| if reversed[k] == Some(true) { -1.0 } else { 1.0 };
        let outwards: f64 = part.iter().map(|&k| sign(k) * outwards(file, k)).sum();
        for k in part {
            let is_reversed = reversed[k] == Some(true);
            if is_reversed != (outwards < 0.0) {
                out.mesh.elements[k] = mesh.elements[k].reversed();
                if let Some(normals) = out.normals.get_mut(k) {
                    normals[..mesh.elements[k].nodes().len()].reverse();
                }
            }
        }
    }
    Ok(out)
}

/// How far an element as it is looks where its normals do; its area when it has none.
fn outwards(file: &MeshFile, k: usize) -> f64 {
    let area = vector_area(&file.mesh, &file.mesh.elements[k]);
    let given: Vec3 = file.normals.get(k).map_or_else(Vec3::zeros, |normals| normals.iter().sum());
    if given == Vec3::zeros() { area.norm() } else { area.dot(&given) }
}

/// The part of the mesh that is connected with an element, each marked as reversed against it or not.
fn spread(
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
                return Err(one_sided(mesh, k, other));
            }
        }
    }
    Ok(part)
}

fn one_sided(mesh: &SurfaceMesh, k: usize, other: usize) -> ConvertError {
    let theirs = mesh.elements[other].nodes();
    let shared = mesh.elements[k].nodes().iter().filter(|n| theirs.contains(n));
    let mut ends = shared.map(|&n| {
        let x = mesh.vertices[n as usize];
        format!("{:.4}, {:.4}, {:.4}", x.x, x.y, x.z)
    });
    let mut end = || ends.next().unwrap_or_default();
    ConvertError::OneSided { from: end(), to: end() }
}
