//! Numbers of the bodies of a model.

use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::attributes::{Body, BodyKind, Name};
use super::model::Model;
use kanagata_geometry::sets::DisjointSets;

/// Number of the connected part of each face. Faces are connected across edges of two uses whose bodies `join`.
fn connected_parts(model: &Model, join: impl Fn(usize, usize) -> bool) -> Vec<usize> {
    let mut sets = DisjointSets::new(model.faces.len());
    let body_of = |f: usize| model.faces[f].attributes.body;
    for edge in &model.edges {
        let [[first, ..], [other, ..]] = edge.uses[..] else { continue };
        if join(body_of(first), body_of(other)) {
            sets.join(first, other);
        }
    }
    sets.numbered().0
}

/// Numbers the bodies in the order of their first faces. Faces of no solid or shell are one body where they are
/// connected across edges of two uses, and so are shells of one face: writers of surfaces make a shell of every face.
/// Bodies without a face are dropped.
pub(super) fn number_bodies(model: &mut Model) {
    name_faces_of_lone_shells(model);
    let lone = lone_shells(model);
    let is_lone = |body: usize| lone.get(body).copied().unwrap_or(false);
    let loose = |body: usize| model.bodies.get(body).is_none_or(|b| b.kind == BodyKind::Faces);
    let body_of = |f: usize| model.faces[f].attributes.body;
    let part_of = connected_parts(model, |a, b| a == b && loose(a) || is_lone(a) && is_lone(b));
    let mut numbers = FxHashMap::default();
    let mut bodies: Vec<Body> = Vec::new();
    let mut chosen = Vec::with_capacity(model.faces.len());
    for (f, part) in part_of.into_iter().enumerate() {
        let body = body_of(f);
        let key = match (is_lone(body), loose(body)) {
            (true, _) => (usize::MAX, Some(part)),
            (_, true) => (body, Some(part)),
            _ => (body, None),
        };
        let unknown =
            || Body { path: Arc::default(), kind: BodyKind::Faces, source: String::new() };
        let found = || model.bodies.get(body).cloned().unwrap_or_else(unknown);
        let number = *numbers.entry(key).or_insert_with(|| {
            bodies.push(found());
            bodies.len() - 1
        });
        if is_lone(body) && bodies[number].source != found().source {
            let path = common_path(&bodies[number].path, &found().path);
            bodies[number] = Body { path, ..unknown() };
        }
        chosen.push(number);
    }
    for (face, body) in model.faces.iter_mut().zip(chosen) {
        if face.attributes.body != body {
            Arc::make_mut(&mut face.attributes).body = body;
        }
    }
    model.bodies = bodies;
}

/// Whether each body is a shell of one face.
fn lone_shells(model: &Model) -> Vec<bool> {
    let mut faces = vec![0; model.bodies.len()];
    for face in &model.faces {
        if let Some(n) = faces.get_mut(face.attributes.body) {
            *n += 1;
        }
    }
    let lone = |(body, n): (&Body, usize)| body.kind == BodyKind::Shell && n == 1;
    model.bodies.iter().zip(faces).map(lone).collect()
}

/// A face without a name that is the only one of its shell has the name of the shell.
fn name_faces_of_lone_shells(model: &mut Model) {
    let lone = lone_shells(model);
    for face in &mut model.faces {
        let body = face.attributes.body;
        if face.attributes.name.is_none() && lone.get(body) == Some(&true) {
            Arc::make_mut(&mut face.attributes).name = model.bodies[body].path.last().cloned();
        }
    }
}

/// The names that two paths begin with.
fn common_path(a: &[Name], b: &[Name]) -> Arc<[Name]> {
    a.iter().zip(b).take_while(|(a, b)| a == b).map(|(a, _)| Arc::clone(a)).collect()
}
