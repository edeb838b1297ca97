//! Some of the faces of a model.

use std::collections::BTreeMap;

use crate::cad::Model;
use crate::cad::raw::LostFace;

/// A model of some of the faces of another one.
#[derive(Debug, Clone)]
pub struct Part {
    /// The faces that are kept, numbered anew; the others are among its lost faces.
    pub model: Model,
    /// For each of them its number in the whole model.
    pub kept: Vec<usize>,
}

impl Part {
    /// `model` without some faces, each given with the reason; `None` when no face is left.
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

/// The model of some faces; edges keep their numbers.
pub(super) fn subset(model: &Model, kept: &[usize]) -> Model {
    let number: BTreeMap<usize, usize> = kept.iter().enumerate().map(|(k, &f)| (f, k)).collect();
    let mut out = model.clone();
    out.faces = kept.iter().map(|&f| model.faces[f].clone()).collect();
    // Numbers change, and who asks for parts attaches meshes of whole files.
    out.cut.clear();
    for edge in &mut out.edges {
        let uses = edge.uses.iter();
        edge.uses = uses.filter_map(|u| Some([*number.get(&u[0])?, u[1], u[2]])).collect();
    }
    out
}
