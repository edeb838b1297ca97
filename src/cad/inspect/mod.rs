//! Summary of a file: [`inspect`] for the whole, [`tree`] for bodies, layers, colours and faces; `text` prints both.

#[cfg(test)]
mod tests;
mod text;
mod tree;

use std::collections::{BTreeMap, BTreeSet};

use super::attributes::BodyKind;
use super::model::SurfaceKind;
use super::raw::LostFace;
use super::{Diagnostic, Model, Severity};

use self::tree::bounds_of;
pub use self::tree::{BodyRow, FaceRow, GroupRow, Tree, tree};

/// Summary of a model, as JSON or as text.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Inspection {
    /// File name.
    pub file: String,
    /// Unit of length the file declares.
    pub unit: String,
    /// Millimetres in one unit of the file.
    pub unit_mm: f64,
    /// Number of bodies.
    pub bodies: usize,
    /// Bodies by kind.
    pub bodies_by_kind: BTreeMap<BodyKind, usize>,
    /// Names of the bodies that have one, in the order of the bodies.
    pub body_names: Vec<String>,
    /// Number of faces.
    pub faces: usize,
    /// Faces by surface type.
    pub faces_by_type: BTreeMap<SurfaceKind, usize>,
    /// Number of layers and groups with faces.
    pub layers: usize,
    /// Number of colours of faces.
    pub colours: usize,
    /// Area of all faces [mm2].
    pub area_mm2: f64,
    /// Tight bounding box: x, y, z minima, then maxima [mm]; zeros without faces.
    pub bbox_mm: [f64; 6],
    /// Dimensions of the bounding box [mm].
    pub size_mm: [f64; 3],
    /// Edges used by one face only.
    pub free_edges: usize,
    /// Total length of free edges [mm].
    pub free_edge_length_mm: f64,
    /// Total number of edges after joining.
    pub edges: usize,
    /// Distance within which edges were joined [mm].
    pub join_tolerance_mm: f64,
    /// Faces of the file that the model lacks, with the reasons.
    pub lost_faces: Vec<LostFace>,
    /// Entities of the file by kind.
    pub entities: BTreeMap<String, usize>,
    /// Diagnostics of reading and building.
    pub diagnostics: Vec<Diagnostic>,
}

/// A face whose area is an estimate.
fn area_unmeasured(source: &str) -> Diagnostic {
    Diagnostic {
        severity: Severity::Warning,
        code: "area-unmeasured",
        place: source.to_owned(),
        text: "its area did not converge within the evaluation limit; the area of the model is an estimate".into(),
    }
}

/// Summarises a model.
#[must_use]
pub fn inspect(model: &Model, diagnostics: &[Diagnostic]) -> Inspection {
    let mut faces_by_type = BTreeMap::new();
    let (mut layers, mut colours, mut used) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
    for face in &model.faces {
        *faces_by_type.entry(face.kind).or_insert(0) += 1;
        layers.extend(face.attributes.layers.iter());
        colours.extend(face.attributes.colour);
        used.insert(face.attributes.body);
    }
    let bodies: Vec<_> = used.iter().filter_map(|&b| model.bodies.get(b)).collect();
    let mut bodies_by_kind = BTreeMap::new();
    bodies.iter().for_each(|b| *bodies_by_kind.entry(b.kind).or_insert(0) += 1);
    let names = bodies.iter().filter_map(|b| b.path.last().map(ToString::to_string));
    let bbox_mm = bounds_of(&model.bbox());
    let free: Vec<_> = model.edges.iter().filter(|e| e.uses.len() == 1).collect();
    let (area_mm2, unmeasured) = model.measured_area();
    let unmeasured = unmeasured.into_iter().map(|f| area_unmeasured(&model.faces[f].source));
    Inspection {
        file: model.name.clone(),
        unit: model.unit.clone(),
        unit_mm: model.unit_mm,
        bodies: bodies.len(),
        bodies_by_kind,
        body_names: names.collect(),
        faces: model.faces.len(),
        faces_by_type,
        layers: layers.len(),
        colours: colours.len(),
        area_mm2,
        bbox_mm,
        size_mm: [0, 1, 2].map(|k| bbox_mm[k + 3] - bbox_mm[k]),
        free_edges: free.len(),
        free_edge_length_mm: free.iter().map(|e| e.curve.length()).fold(0.0, |sum, l| sum + l),
        edges: model.edges.iter().filter(|e| !e.uses.is_empty()).count(),
        join_tolerance_mm: model.join_tolerance,
        lost_faces: model.lost.clone(),
        entities: model.entities.clone(),
        diagnostics: diagnostics.iter().cloned().chain(unmeasured).collect(),
    }
}
