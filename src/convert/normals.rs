//! Vertex normals from the CAD: each vertex is projected onto each CAD face whose elements use it.

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::error::ConvertError;
use super::searches::{SearchedFace, Searches};
use kanagata_cad::Model;
use kanagata_cad::model::Face;
use kanagata_geometry::{Aabb, Vec2, Vec3};
use kanagata_mesh::SurfaceMesh;

/// Normals of a mesh at the corners of its elements.
#[derive(Clone, Default)]
pub(super) struct NormalTable {
    /// Unit normals.
    pub normals: Vec<Vec3>,
    /// For each element the index of the normal at each corner.
    pub ids: Vec<Vec<u32>>,
    /// Foot points of the vertices; those at degenerate points of a face are absent.
    pub feet: Feet,
}

/// Surface parameters of the foot points, by (vertex, face).
pub(super) type Feet = FxHashMap<(u32, u32), Vec2>;

/// Key of a normal: vertex and face. At a degenerate point of the face (pole, apex) the normal is the limit from within
/// an element, which is then part of the key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
struct NormalKey {
    vertex: u32,
    face: u32,
    element: u32,
}

/// Value of [`NormalKey::element`] where all elements of the face have the same normal.
const ALL_ELEMENTS: u32 = u32::MAX;
/// Distance of a vertex from its face, over the size of the mesh, that is rounding. Twice the joining tolerance is added.
/// A vertex farther from its face is searched on the whole surface.
const ROUNDING_REL: f64 = 1e-9;

/// Computes the normals of all vertices on all faces. Normals at a vertex that differ by less than `smooth` [rad] are
/// replaced by their mean.
///
/// # Errors
/// [`ConvertError::Normal`] where a face has no normal; [`ConvertError::Searches`].
pub(super) fn vertex_normals(
    model: &Model,
    mesh: &SurfaceMesh,
    smooth: f64,
    searches: &Searches<'_>,
) -> Result<NormalTable, ConvertError> {
    let keys = vertices_by_face(mesh);
    let rounding = ROUNDING_REL * Aabb::of_points(&mesh.vertices).diagonal();
    let enough = (rounding + 2.0 * model.join_tolerance).powi(2);
    let stage = searches.progress.stage("normals", "vertices", keys.len() as u64);
    let foot = |key: &NormalKey| {
        let start = mesh.feet.on_face(key.vertex, key.face);
        let x = &mesh.vertices[key.vertex as usize];
        let found = foot_and_normal(searches.face(key.face), x, (start, enough));
        stage.add(1);
        found
    };
    let feet: Vec<(Vec2, Option<Vec3>)> = keys.par_iter().map(foot).collect();
    searches.check()?;
    let (mut known, mut regular) = (FxHashMap::default(), Feet::default());
    let mut degenerate: FxHashMap<(u32, u32), Vec2> = FxHashMap::default();
    for (key, &(uv, normal)) in keys.iter().zip(&feet) {
        let Some(own) = normal else {
            degenerate.insert((key.vertex, key.face), uv);
            continue;
        };
        let x = &mesh.vertices[key.vertex as usize];
        let other = normal_beyond_crease(model, (key.face, uv), x, searches);
        known.insert(*key, other.unwrap_or(own));
        if other.is_none() {
            regular.insert((key.vertex, key.face), uv);
        }
    }
    add_limit_normals(mesh, &degenerate, searches, &mut known)?;
    searches.check()?;
    let (normals, ids) = number_normals(mesh, &known, smooth);
    Ok(NormalTable { normals, ids, feet: regular })
}

/// The pairs of a vertex and a face that has it, sorted.
fn vertices_by_face(mesh: &SurfaceMesh) -> Vec<NormalKey> {
    let mut keys: Vec<NormalKey> = mesh
        .elements
        .iter()
        .flat_map(|e| e.nodes().iter().map(|&vertex| (vertex, e.face)))
        .map(|(vertex, face)| NormalKey { vertex, face, element: ALL_ELEMENTS })
        .collect();
    keys.sort_unstable();
    keys.dedup();
    keys
}

/// Adds the normals at degenerate points of faces, one for each element.
fn add_limit_normals(
    mesh: &SurfaceMesh,
    degenerate: &FxHashMap<(u32, u32), Vec2>,
    searches: &Searches<'_>,
    known: &mut FxHashMap<NormalKey, Vec3>,
) -> Result<(), ConvertError> {
    for (id, element) in mesh.elements.iter().enumerate() {
        for &vertex in element.nodes() {
            let Some(&uv) = degenerate.get(&(vertex, element.face)) else { continue };
            let searched = searches.face(element.face);
            let normal = limit_normal(searched, uv, mesh, element.nodes()).ok_or_else(|| {
                let x = mesh.vertices[vertex as usize];
                let face = searched.face.source.clone();
                ConvertError::Normal { face, x: x.x, y: x.y, z: x.z }
            })?;
            known.insert(NormalKey { vertex, face: element.face, element: id as u32 }, normal);
        }
    }
    Ok(())
}

/// Foot point of a vertex on the surface of a face, and the normal where the surface is regular. It is regular where
/// one tangent, times the width of its parameter range, is longer than 1e-6 of the other. `start` are known parameters; a
/// foot point near them within the squared distance `enough` [mm^2] is accepted.
fn foot_and_normal(
    searched: SearchedFace<'_>,
    x: &Vec3,
    (start, enough): (Option<Vec2>, f64),
) -> (Vec2, Option<Vec3>) {
    let (face, (uv, _)) = (searched.face, searched.foot(x, start, enough));
    let [reach_u, reach_v] = face.reach(&face.surface.derivs(uv));
    let regular = reach_u.min(reach_v) > 1e-6 * reach_u.max(reach_v);
    (uv, if regular { face.normal(uv) } else { None })
}

/// Normal at a vertex on another part of the CAD face to which face `id` belongs. The elements of a foreign mesh may
/// cross the crease between the parts of a split face. `uv` is the foot point on face `id`. `None` when the vertex lies
/// on face `id`, or when no other part is closer than half its distance from that face.
fn normal_beyond_crease(
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
    let distance = |face: &Face, uv: Vec2| (face.surface.point(uv) - x).norm();
    let own = distance(&model.faces[f], uv);
    if own <= model.join_tolerance {
        return None;
    }
    let others = parts.filter(|&k| k != f).filter_map(|k| {
        let (uv, normal) = foot_and_normal(searches.face_on_budget(id, k), x, (None, 0.0));
        Some((distance(&model.faces[k], uv), normal?))
    });
    let nearest = others.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (nearest.0 < 0.5 * own).then_some(nearest.1)
}

/// Limit of the normal at a degenerate point `uv`, from within an element. It is extrapolated linearly from the normals
/// at the fractions 1e-3 and 1e-4 of the path to the centre of the element. The surface is regular there.
fn limit_normal(
    searched: SearchedFace<'_>,
    uv: Vec2,
    mesh: &SurfaceMesh,
    nodes: &[u32],
) -> Option<Vec3> {
    let center: Vec3 =
        nodes.iter().map(|&n| mesh.vertices[n as usize]).sum::<Vec3>() / nodes.len() as f64;
    let (face, (inside, _)) = (searched.face, searched.closest(&center));
    let at = |fraction: f64| {
        // The parameter that is arbitrary at the pole is that of the element's centre.
        let d = face.surface.derivs(uv);
        let [u, v] = face.surface.domain();
        let u_collapsed = d.su.norm() * (u[1] - u[0]) <= d.sv.norm() * (v[1] - v[0]);
        let start = if u_collapsed { Vec2::new(inside.x, uv.y) } else { Vec2::new(uv.x, inside.y) };
        face.normal(start + (inside - start) * fraction)
    };
    let (near, nearer) = (at(1e-3)?, at(1e-4)?);
    // Linear extrapolation to zero: (10 n(1e-4) - n(1e-3)) / 9.
    kanagata_geometry::frame::unit((nearer * 10.0 - near) / 9.0)
}

/// Merges the normals of each vertex by [`merge_normals`] and indexes them by element corner.
fn number_normals(
    mesh: &SurfaceMesh,
    known: &FxHashMap<NormalKey, Vec3>,
    smooth: f64,
) -> (Vec<Vec3>, Vec<Vec<u32>>) {
    let mut keys: Vec<NormalKey> = known.keys().copied().collect();
    keys.sort_unstable();
    let mut normals: Vec<Vec3> = Vec::new();
    let mut id_of: FxHashMap<NormalKey, u32> = FxHashMap::default();
    for group in keys.chunk_by(|a, b| a.vertex == b.vertex) {
        let here: Vec<Vec3> = group.iter().map(|key| known[key]).collect();
        let numbers = merge_normals(&here, smooth, &mut normals);
        id_of.extend(group.iter().copied().zip(numbers));
    }
    let ids = mesh.elements.iter().enumerate().map(|(id, e)| {
        let at =
            |vertex: u32, element: u32| id_of.get(&NormalKey { vertex, face: e.face, element });
        let known = |&v: &u32| at(v, ALL_ELEMENTS).or_else(|| at(v, id as u32)).copied();
        e.nodes().iter().filter_map(known).collect()
    });
    (normals, ids.collect())
}

/// Appends the normals of one vertex to `all` and returns the index of each. Normals within `smooth` [rad] of the first
/// one of a group are replaced by the normalised mean of the group.
pub(super) fn merge_normals(here: &[Vec3], smooth: f64, all: &mut Vec<Vec3>) -> Vec<u32> {
    // First normal and sum of each group.
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
