//! Attachment of foreign meshes to the CAD: assigns elements to faces and projects vertices.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::io::UNATTACHED;
use super::{Element, MeshError, SurfaceMesh};
use kanagata_cad::Model;
use kanagata_cad::closest::ClosestPoint;
use kanagata_cad::model::Foot;
use kanagata_geometry::{Aabb, Vec3};

/// Distance from the model relative to its diagonal below which vertices are moved onto it.
const SNAP_DISTANCE_REL: f64 = 1e-4;
/// Number of sampled elements per file surface for the assignment to a CAD face.
const SAMPLES_PER_SURFACE: usize = 64;

/// Assigns every element of a foreign mesh to a CAD face, orients it counter-clockwise seen from outside, and projects
/// vertices within 1e-4 of the model's diagonal onto the model.
///
/// Elements with a common surface number (MSH entities) belong to one face, chosen by majority. Elements without a
/// number are assigned individually: among the faces closest to their corners, the one closest to their centre. The
/// same applies to the parts of a face split along creases, which other programs do not know.
///
/// # Errors
/// [`MeshError::NoFaces`]; [`MeshError::OtherPart`] when the corners of an element are farther from the model than 1 % of
/// its diagonal (another part, another unit).
pub fn attach(mesh: &SurfaceMesh, model: &Model) -> Result<SurfaceMesh, MeshError> {
    if model.faces.is_empty() {
        return Err(MeshError::NoFaces { name: model.name.clone() });
    }
    let index = ClosestPoint::new(model);
    let feet: Vec<Option<Foot>> = mesh.vertices.par_iter().map(|p| index.closest(p)).collect();
    let diagonal = model.faces.iter().fold(Aabb::EMPTY, |b, f| b.union(&f.bbox())).diagonal();
    check_distance(mesh, &feet, diagonal)?;
    let vertices = mesh.vertices.iter().zip(&feet).map(|(p, foot)| match foot {
        Some(f) if f.distance <= SNAP_DISTANCE_REL * diagonal => f.point,
        _ => *p,
    });
    let mut out = SurfaceMesh {
        vertices: vertices.collect(),
        elements: mesh.elements.clone(),
        ..SurfaceMesh::default()
    };
    let by_surface = majority_faces(&out, &index);
    let attached: Vec<Element> = out
        .elements
        .par_iter()
        .map(|e| {
            let face = match by_surface.get(&e.face).map(|&f| model.cut_with(f)) {
                Some(parts) if parts.len() == 1 => Some(parts.start),
                Some(parts) => nearest_face(&out, e, &index, parts),
                None => own_face(&out, e, &index, &feet),
            };
            let face = face.unwrap_or(0);
            let mut element = *e;
            element.face = face as u32;
            orient(&out, element, &index)
        })
        .collect();
    out.elements = attached;
    Ok(out)
}

fn check_distance(
    mesh: &SurfaceMesh,
    feet: &[Option<Foot>],
    diagonal: f64,
) -> Result<(), MeshError> {
    let far = feet.iter().enumerate().filter_map(|(k, f)| Some((k, f.as_ref()?.distance)));
    let Some((k, distance)) = far.max_by(|a, b| a.1.total_cmp(&b.1)) else { return Ok(()) };
    if distance <= 0.01 * diagonal {
        return Ok(());
    }
    let p = mesh.vertices[k];
    Err(MeshError::OtherPart {
        found: format!("vertex ({:.4}, {:.4}, {:.4}) {distance:.4} mm from the CAD", p.x, p.y, p.z),
        allowed: format!("{:.4} mm (1 % of the model's diagonal)", 0.01 * diagonal),
    })
}

fn middle(mesh: &SurfaceMesh, e: &Element) -> Vec3 {
    mesh.corners(e).iter().sum::<Vec3>() / e.nodes().len() as f64
}

/// Face closest to the majority of the elements of each numbered surface.
fn majority_faces(mesh: &SurfaceMesh, index: &ClosestPoint<'_>) -> BTreeMap<u32, usize> {
    let mut groups: BTreeMap<u32, Vec<&Element>> = BTreeMap::new();
    for e in mesh.elements.iter().filter(|e| e.face != UNATTACHED) {
        groups.entry(e.face).or_default().push(e);
    }
    // A single number carries no information.
    if groups.len() < 2 {
        return BTreeMap::new();
    }
    let elect = |elements: &Vec<&Element>| {
        let step = elements.len().div_ceil(SAMPLES_PER_SURFACE);
        let mut votes: BTreeMap<usize, usize> = BTreeMap::new();
        for e in elements.iter().step_by(step) {
            let face = index.closest(&middle(mesh, e)).map(|f| f.face);
            *votes.entry(face.unwrap_or(0)).or_default() += 1;
        }
        votes.into_iter().max_by_key(|&(face, n)| (n, std::cmp::Reverse(face))).map(|v| v.0)
    };
    groups.iter().filter_map(|(&surface, e)| Some((surface, elect(e)?))).collect()
}

/// The closest of the faces that are closest to the corners of `e` and to its centre.
fn own_face(
    mesh: &SurfaceMesh,
    e: &Element,
    index: &ClosestPoint<'_>,
    feet: &[Option<Foot>],
) -> Option<usize> {
    let centre = middle(mesh, e);
    let mut candidates: Vec<usize> =
        e.nodes().iter().filter_map(|&n| Some(feet[n as usize]?.face)).collect();
    candidates.extend(index.closest(&centre).map(|f| f.face));
    candidates.sort_unstable();
    candidates.dedup();
    nearest_face(mesh, e, index, candidates)
}

/// Among some faces the one closest to all corners of `e` together, then to its centre.
fn nearest_face(
    mesh: &SurfaceMesh,
    e: &Element,
    index: &ClosestPoint<'_>,
    candidates: impl IntoIterator<Item = usize>,
) -> Option<usize> {
    let centre = middle(mesh, e);
    let corners = mesh.corners(e);
    let cost = |face: usize| {
        let off = |p: &Vec3| index.closest_on_face(face, p).map_or(f64::INFINITY, |f| f.distance);
        corners.iter().map(off).fold(0.0, f64::max) + 0.01 * off(&centre)
    };
    let costs = candidates.into_iter().map(|f| (cost(f), f));
    costs.min_by(|a, b| a.0.total_cmp(&b.0)).map(|c| c.1)
}

fn orient(mesh: &SurfaceMesh, e: Element, index: &ClosestPoint<'_>) -> Element {
    let p = mesh.corners(&e);
    let normal = (p[1] - p[0]).cross(&(p[2] - p[0]))
        + if p.len() == 4 { (p[2] - p[0]).cross(&(p[3] - p[0])) } else { Vec3::zeros() };
    let foot = index.closest_on_face(e.face as usize, &middle(mesh, &e));
    let against = foot.is_some_and(|f| f.normal.dot(&normal) < 0.0);
    if against { e.reversed() } else { e }
}
