//! Chosen faces.

use crate::part::subset;
use kanagata_cad::Model;

/// The chosen faces of a model, as a model of their own.
#[derive(Debug, Clone)]
pub struct Chosen {
    /// The faces, renumbered.
    pub model: Model,
    /// Number of each face in the complete model.
    pub kept: Vec<usize>,
}

impl Chosen {
    /// The faces `own` of `model`, which have the numbers `kept` in the complete model.
    pub(super) fn new(model: &Model, own: &[usize], kept: Vec<usize>) -> Self {
        Self { model: subset(model, own), kept }
    }
}
