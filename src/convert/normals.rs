//! Vertex normals from the CAD: each vertex projected on each CAD face whose elements use it.

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::error::ConvertError;
use super::searches::{SearchedFace, Searches};
use crate::cad::Model;
use crate::cad::model::Face;
use crate::geometry::{Vec2, Vec3};
use crate::mesh::SurfaceMesh;

/// Normals, and for every element the ids at its corners.
#[derive(Clone, Default)]
pub(super) struct NormalTable {
    pub normals: Vec<Vec3>,
    pub ids: Vec<Vec<u32>>,
    /// Parameters of a vertex on a face, where the face is regular there.
    pub feet: Feet,
}

/// Parameters by vertex and face.
pub(super) type Feet = FxHashMap<(u32, u32), Vec2>;

/// Where a normal is asked for: a vertex on a face; at a degenerate point of the face (pole, apex) also an
/// element, whose direction the limit is taken along.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
struct Place {
    vertex: u32,
    face: u32,
    element: u32,
}

const EVERY_ELEMENT: u32 = u32::MAX;

/// Builds the table. Normals at a vertex that differ by less than `smooth` [rad] become one, their mean.
pub(super) fn table(
    model: &Model,
    mesh: &SurfaceMesh,
    smooth: f64,
    searches: &Searches<'_>,
) -> Result<NormalTable, ConvertError> {
    let mut places: Vec<Place> = mesh
        .elements
        .iter()
        .flat_map(|e| e.nodes().iter().map(|&vertex| (vertex, e.face)))
        .map(|(vertex, face)| Place { vertex, face, element: EVERY_ELEMENT })
        .collect();
    places.sort_unstable();
    places.dedup();
    let feet: Vec<(Vec2, Option<Vec3>)> = places
        .par_iter()
        .map(|place| foot(searches.face(place.face), &mesh.vertices[place.vertex as usize]))
        .collect();
    searches.check()?;
    let (mut known, mut regular) = (FxHashMap::default(), Feet::default());
    let mut degenerate: FxHashMap<(u32, u32), Vec2> = FxHashMap::default();
    for (place, &(uv, normal)) in places.iter().zip(&feet) {
        let Some(own) = normal else {
            degenerate.insert((place.vertex, place.face), uv);
            continue;
        };
        let x = &mesh.vertices[place.vertex as usize];
        let other = beyond_crease(model, (place.face, uv), x, searches);
        known.insert(*place, other.unwrap_or(own));
        if other.is_none() {
            regular.insert((place.vertex, place.face), uv);
        }
    }
    add_limits(mesh, &degenerate, searches, &mut known)?;
    searches.check()?;
    let (normals, ids) = number(mesh, &known, smooth);
    Ok(NormalTable { normals, ids, feet: regular })
}

/// Adds normals at degenerate points of faces, an element's each.
fn add_limits(
    mesh: &SurfaceMesh,
    degenerate: &FxHashMap<(u32, u32), Vec2>,
    searches: &Searches<'_>,
    known: &mut FxHashMap<Place, Vec3>,
) -> Result<(), ConvertError> {
    for (id, element) in mesh.elements.iter().enumerate() {
        for &vertex in element.nodes() {
            let Some(&uv) = degenerate.get(&(vertex, element.face)) else { continue };
            let searched = searches.face(element.face);
            let normal = limit(searched, uv, mesh, element.nodes()).ok_or_else(|| {
                let x = mesh.vertices[vertex as usize];
                let face = searched.face.source.clone();
                ConvertError::Normal { face, x: x.x, y: x.y, z: x.z }
            })?;
            known.insert(Place { vertex, face: element.face, element: id as u32 }, normal);
        }
    }
    Ok(())
}

/// Foot of a vertex on its own face's surface, and the normal where it is well defined.
fn foot(searched: SearchedFace<'_>, x: &Vec3) -> (Vec2, Option<Vec3>) {
    let (face, (uv, _)) = (searched.face, searched.closest(x));
    let d = face.surface.derivs(uv);
    let [u, v] = face.surface.domain();
    let (reach_u, reach_v) = (d.su.norm() * (u[1] - u[0]), d.sv.norm() * (v[1] - v[0]));
    let regular = reach_u.min(reach_v) > 1e-6 * reach_u.max(reach_v);
    (uv, if regular { face.normal(uv) } else { None })
}

/// Normal at a vertex that lies on another part of the face of the file of which face `id` is one, where another program's
/// element goes across the crease between them; `uv`: its foot on face `id`.
fn beyond_crease(
    model: &Model,
    (id, uv): (u32, Vec2),
    x: &Vec3,
    searches: &Searches<'_>,
) -> Option<Vec3> {
    let f = id as usize;
    let parts = model.cut_with(f);
    if parts.len() < 2 {
        return None;
    }
    let off = |face: &Face, uv: Vec2| (face.surface.point(uv) - x).norm();
    let own = off(&model.faces[f], uv);
    if own <= model.join_tolerance {
        return None;
    }
    let others = parts.filter(|&k| k != f).filter_map(|k| {
        let (uv, normal) = foot(searches.on(id, k), x);
        Some((off(&model.faces[k], uv), normal?))
    });
    let nearest = others.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (nearest.0 < 0.5 * own).then_some(nearest.1)
}

/// Normal on the way from a degenerate point into an element: there the surface is regular, and a thousandth of
/// the way is near enough to the limit for a quadratic surface; the same at a tenth of that gives the rate.
fn limit(searched: SearchedFace<'_>, uv: Vec2, mesh: &SurfaceMesh, nodes: &[u32]) -> Option<Vec3> {
    let center: Vec3 =
        nodes.iter().map(|&n| mesh.vertices[n as usize]).sum::<Vec3>() / nodes.len() as f64;
    let (face, (inside, _)) = (searched.face, searched.closest(&center));
    let at = |share: f64| {
        // The parameter that is anybody's at the pole is the element's own; the other one goes to the pole.
        let d = face.surface.derivs(uv);
        let [u, v] = face.surface.domain();
        let u_collapsed = d.su.norm() * (u[1] - u[0]) <= d.sv.norm() * (v[1] - v[0]);
        let start = if u_collapsed { Vec2::new(inside.x, uv.y) } else { Vec2::new(uv.x, inside.y) };
        face.normal(start + (inside - start) * share)
    };
    let (near, nearer) = (at(1e-3)?, at(1e-4)?);
    // Extrapolated to zero: (10 nearer - near) / 9.
    crate::geometry::frame::unit((nearer * 10.0 - near) / 9.0)
}

/// Merges the normals of each vertex and numbers them.
fn number(
    mesh: &SurfaceMesh,
    known: &FxHashMap<Place, Vec3>,
    smooth: f64,
) -> (Vec<Vec3>, Vec<Vec<u32>>) {
    let mut places: Vec<Place> = known.keys().copied().collect();
    places.sort_unstable();
    let mut normals: Vec<Vec3> = Vec::new();
    let mut id_of: FxHashMap<Place, u32> = FxHashMap::default();
    for group in places.chunk_by(|a, b| a.vertex == b.vertex) {
        let here: Vec<Vec3> = group.iter().map(|place| known[place]).collect();
        let numbers = merged(&here, smooth, &mut normals);
        id_of.extend(group.iter().copied().zip(numbers));
    }
    let ids = mesh.elements.iter().enumerate().map(|(id, e)| {
        let at = |vertex: u32, element: u32| id_of.get(&Place { vertex, face: e.face, element });
        let known = |&v: &u32| at(v, EVERY_ELEMENT).or_else(|| at(v, id as u32)).copied();
        e.nodes().iter().filter_map(known).collect()
    });
    (normals, ids.collect())
}

/// Puts the normals of one vertex behind all others, those that differ by less than `smooth` [rad] as one, their mean;
/// returns the number of each.
pub(super) fn merged(here: &[Vec3], smooth: f64, all: &mut Vec<Vec3>) -> Vec<u32> {
    // First normal and sum of each that is told apart.
    let mut clusters: Vec<(Vec3, Vec3)> = Vec::new();
    let first = all.len();
    let numbers = here.iter().map(|n| {
        let near = |c: &(Vec3, Vec3)| c.0.cross(n).norm() <= smooth.sin() && c.0.dot(n) > 0.0;
        let known = clusters.iter().position(near);
        let k = known.unwrap_or(clusters.len());
        match known {
            Some(k) => clusters[k].1 += n,
            None => clusters.push((*n, *n)),
        }
        (first + k) as u32
    });
    let numbers = numbers.collect();
    all.extend(clusters.iter().map(|c| c.1.normalize()));
    numbers
}
