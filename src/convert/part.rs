//! Submodels: a subset of the faces of a model.

use std::collections::BTreeMap;

use kanagata_cad::Model;
use kanagata_cad::raw::LostFace;

/// A subset of the faces of a model, as a model of its own.
#[derive(Debug, Clone)]
pub struct Part {
    /// The remaining faces, renumbered. The excluded faces are listed among its lost faces.
    pub model: Model,
    /// Number of each remaining face in the complete model.
    pub kept: Vec<usize>,
}

impl Part {
    /// `model` without `faces`, which map each excluded face to the reason; `None` when no face remains.
    #[must_use]
    pub fn without(model: &Model, faces: &BTreeMap<usize, String>) -> Option<Self> {
        let kept: Vec<usize> = (0..model.faces.len()).filter(|f| !faces.contains_key(f)).collect();
        let mut part = subset(model, &kept);
        let lost = |(&f, reason): (&usize, &String)| {
            let source = model.faces.get(f)?.source.clone();
            Some(LostFace { source, reason: reason.clone() })
        };
        part.lost.extend(faces.iter().filter_map(lost));
        (!kept.is_empty()).then_some(Self { model: part, kept })
    }
}

/// The model of the faces `kept`, renumbered in this order. Edges keep their numbers.
#[must_use]
pub fn subset(model: &Model, kept: &[usize]) -> Model {
    let new_number: BTreeMap<usize, usize> =
        kept.iter().enumerate().map(|(k, &f)| (f, k)).collect();
    let mut out = model.clone();
    out.faces = kept.iter().map(|&f| model.faces[f].clone()).collect();
    // The lists of parts of one CAD face would need the new face numbers. They serve only meshes of complete models.
    out.cut.clear();
    for (k, edge) in out.edges.iter_mut().enumerate() {
        let (before, uses) = (edge.uses.len(), edge.uses.iter());
        edge.uses = uses.filter_map(|u| Some([*new_number.get(&u[0])?, u[1], u[2]])).collect();
        if edge.uses.len() < before {
            out.left_out.insert(k);
        }
    }
    out
}
