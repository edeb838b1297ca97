//! Bodies, layers, colours and faces of a model, with the numbers by which they are chosen.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::Model;
use crate::attributes::{BodyKind, colour_text};
use crate::model::SurfaceKind;
use kanagata_geometry::Aabb;

/// Uses of an edge above which its bodies count as open.
const USES_MAX: usize = 64;

/// Structure of a model.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Tree {
    /// Bodies with a face.
    pub bodies: Vec<BodyRow>,
    /// Layers and groups.
    pub layers: Vec<GroupRow>,
    /// Colours; the last one is `none` if there are faces without a colour.
    pub colours: Vec<GroupRow>,
    /// Faces.
    pub faces: Vec<FaceRow>,
}

/// A body.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct BodyRow {
    /// Number of the body, from 1.
    pub number: usize,
    /// Names of products, occurrences and the body, outermost first.
    pub path: Vec<String>,
    /// What it is in the file.
    pub kind: BodyKind,
    /// Entity in the file; empty for faces of no solid or shell.
    pub entity: String,
    /// Number of faces.
    pub faces: usize,
    /// Their numbers, as `0-11,14`.
    pub face_numbers: String,
    /// Every edge has two uses by faces of the body.
    pub closed: bool,
    /// Area [mm2].
    pub area_mm2: f64,
    /// Bounding box: x, y, z minima, then maxima [mm].
    pub bbox_mm: [f64; 6],
    /// Colour of all its faces, as `#rrggbb`; absent where they differ or have none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub colour: Option<String>,
}

/// A layer or a colour.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct GroupRow {
    /// Its name.
    pub name: String,
    /// Number of faces.
    pub faces: usize,
    /// Their numbers, as `0-11,14`.
    pub face_numbers: String,
}

/// A face.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct FaceRow {
    /// Number of the face, from 0.
    pub number: usize,
    /// Entity in the file.
    pub entity: String,
    /// Name in the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Surface type in the file.
    pub kind: SurfaceKind,
    /// Number of its body, from 1.
    pub body: usize,
    /// Layers and groups.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub layers: Vec<String>,
    /// Colour, as `#rrggbb`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub colour: Option<String>,
    /// Area [mm2].
    pub area_mm2: f64,
    /// Bounding box: x, y, z minima, then maxima [mm].
    pub bbox_mm: [f64; 6],
}

/// Structure of a model; `numbers` are those of its faces in the complete model.
#[must_use]
pub fn tree(model: &Model, numbers: Option<&[usize]>) -> Tree {
    let number = |f: usize| numbers.and_then(|n| n.get(f)).copied().unwrap_or(f);
    let measure = |(f, face): (usize, &crate::model::Face)| FaceRow {
        number: number(f),
        entity: face.source.clone(),
        name: face.attributes.name.as_ref().map(ToString::to_string),
        kind: face.kind,
        body: face.attributes.body + 1,
        layers: face.attributes.layers.iter().map(ToString::to_string).collect(),
        colour: face.attributes.colour.map(colour_text),
        area_mm2: face.measured(1e-9).area_mm2,
        bbox_mm: bounds_of(&face.bbox()),
    };
    let faces: Vec<FaceRow> = model.faces.par_iter().enumerate().map(measure).collect();
    let (mut layers, mut colours) = (BTreeMap::new(), BTreeMap::new());
    for (f, face) in faces.iter().enumerate() {
        for layer in &face.layers {
            layers.entry(layer.clone()).or_insert_with(Vec::new).push(number(f));
        }
        // Colours begin with `#`, which comes before the letters of `none`.
        let colour = face.colour.clone().unwrap_or_else(|| "none".into());
        colours.entry(colour).or_insert_with(Vec::new).push(number(f));
    }
    Tree { bodies: bodies(model, &faces), layers: groups(layers), colours: groups(colours), faces }
}

fn groups(found: BTreeMap<String, Vec<usize>>) -> Vec<GroupRow> {
    let row = |(name, faces): (String, Vec<usize>)| GroupRow {
        name,
        faces: faces.len(),
        face_numbers: ranges(&faces),
    };
    found.into_iter().map(row).collect()
}

fn bodies(model: &Model, rows: &[FaceRow]) -> Vec<BodyRow> {
    let mut faces_of: Vec<Vec<usize>> = vec![Vec::new(); model.bodies.len()];
    for (f, face) in model.faces.iter().enumerate() {
        if let Some(faces) = faces_of.get_mut(face.attributes.body) {
            faces.push(f);
        }
    }
    let closed = closed_bodies(model);
    let row = |(b, faces): (usize, Vec<usize>)| {
        let body = &model.bodies[b];
        let own = || faces.iter().map(|&f| &rows[f]);
        let boxes = own().fold(Aabb::EMPTY, |sum, row| {
            let [a, b, c, d, e, f] = row.bbox_mm;
            sum.union(&Aabb::of_points(&[[a, b, c].into(), [d, e, f].into()]))
        });
        let first = own().next().and_then(|row| row.colour.clone());
        let numbers: Vec<usize> = own().map(|row| row.number).collect();
        BodyRow {
            number: b + 1,
            path: body.path.iter().map(ToString::to_string).collect(),
            kind: body.kind,
            entity: body.source.clone(),
            faces: faces.len(),
            face_numbers: ranges(&numbers),
            closed: closed[b],
            area_mm2: own().map(|row| row.area_mm2).fold(0.0, |sum, area| sum + area),
            bbox_mm: bounds_of(&boxes),
            colour: first.filter(|first| own().all(|row| row.colour.as_ref() == Some(first))),
        }
    };
    let all = faces_of.into_iter().enumerate().filter(|(_, faces)| !faces.is_empty());
    all.map(row).collect()
}

/// Whether every edge of each body has two uses by its own faces.
fn closed_bodies(model: &Model) -> Vec<bool> {
    let mut closed = vec![true; model.bodies.len()];
    for edge in &model.edges {
        if edge.uses.len() > USES_MAX {
            let own = edge.uses.iter().map(|u| model.faces[u[0]].attributes.body);
            own.for_each(|body| closed.get_mut(body).into_iter().for_each(|c| *c = false));
            continue;
        }
        let bodies = || edge.uses.iter().map(|used| model.faces[used[0]].attributes.body);
        for body in bodies() {
            if let Some(closed) = closed.get_mut(body) {
                *closed &= bodies().filter(|other| *other == body).count() == 2;
            }
        }
    }
    closed
}

/// Increasing numbers as ranges: `0-11,14`.
fn ranges(numbers: &[usize]) -> String {
    let runs = numbers.chunk_by(|a, b| a + 1 == *b).map(|run| match run {
        [only] => only.to_string(),
        [first, .., last] => format!("{first}-{last}"),
        [] => String::new(),
    });
    runs.collect::<Vec<_>>().join(",")
}

/// Minima and maxima of a box [mm]; zeros for an empty one.
pub(super) fn bounds_of(bounds: &Aabb) -> [f64; 6] {
    if bounds.is_empty() {
        return [0.0; 6];
    }
    let (a, b) = (bounds.min, bounds.max);
    [a.x, a.y, a.z, b.x, b.y, b.z]
}
