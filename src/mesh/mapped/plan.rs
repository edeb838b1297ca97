//! Meshes with prescribed divisions of edges and faces, for refinement to a tolerance.

use std::sync::Mutex;

use rustc_hash::FxHashMap;

use super::border::Border;
use super::divisions::{PreparedRules, Rule};
use super::mesh::even_quads;
use super::mesher::Mesher;
use super::options::{MappedOptions, MeshStyle, check_options};
use super::sides::Shape;
use crate::{MeshError, SurfaceMesh};
use kanagata_cad::Model;
use kanagata_progress::Progress;

/// Data of a model that do not depend on the divisions.
pub struct Plan<'m> {
    mesher: Mesher<'m>,
    rules: PreparedRules,
    owners: Vec<usize>,
    chains: Vec<usize>,
    /// Quadrilaterals only, and flat faces can be cut into them.
    even: bool,
    /// Results of [`Plan::minima_at`].
    uniform: Mutex<FxHashMap<usize, Vec<usize>>>,
}

/// Divisions of every edge that satisfy the rules of the mapped faces.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Divisions {
    /// Divisions of each edge.
    pub counts: Vec<usize>,
    /// Faces that can be mapped with these divisions.
    pub mapped: Vec<bool>,
}

impl<'m> Plan<'m> {
    /// Prepares `model`.
    ///
    /// # Errors
    /// [`MeshError::NoFaces`], [`MeshError::Option`].
    pub fn new(model: &'m Model, options: &MappedOptions) -> Result<Self, MeshError> {
        check_options(options)?;
        if model.faces.is_empty() {
            return Err(MeshError::NoFaces { name: model.name.clone() });
        }
        let structured = MappedOptions { style: MeshStyle::Structured, ..*options };
        let quads = options.style == MeshStyle::Quads;
        let even = quads && even_quads(model, &structured).is_some();
        let mesher = Mesher::new(model, if even { &structured } else { options }, quads && !even);
        let chains = chains(model.edges.len(), &mesher.rules().0);
        let (rules, owners) = mesher.prepared_rules();
        Ok(Self { mesher, rules, owners, chains, even, uniform: Mutex::default() })
    }

    /// The same plan, which reports the progress of [`Self::mesh`].
    #[must_use]
    pub fn watched(self, progress: &Progress) -> Self {
        Self { mesher: self.mesher.watched(progress), ..self }
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &'m Model {
        self.mesher.model
    }

    /// Minimum divisions of each edge required by the options.
    #[must_use]
    pub fn minima(&self) -> &[usize] {
        &self.mesher.minima
    }

    /// Minimum divisions of each edge at `arc_divisions` per quarter turn: those of the uniform mesh.
    #[must_use]
    pub fn minima_at(&self, arc_divisions: usize) -> Vec<usize> {
        let known = self.uniform.lock().ok().and_then(|all| all.get(&arc_divisions).cloned());
        known.unwrap_or_else(|| {
            let options = MappedOptions { arc_divisions, ..self.mesher.options };
            let minima = Mesher::new(self.mesher.model, &options, self.mesher.halved).minima;
            if let Ok(mut all) = self.uniform.lock() {
                all.insert(arc_divisions, minima.clone());
            }
            minima
        })
    }

    /// For each edge the first edge of its chain; the edges of a chain have equal divisions.
    #[must_use]
    pub fn chains(&self) -> &[usize] {
        &self.chains
    }

    /// True when the divisions inside face `f` are independent of its edges: it is not mapped, or two opposite sides
    /// are poles.
    #[must_use]
    pub fn divides_inside(&self, f: usize, mapped: bool) -> bool {
        let Shape::Four(sides) = &self.mesher.shapes[f] else { return !mapped };
        let uses = &self.mesher.model.faces[f].loops[0].uses;
        let is_pole = |side: &Vec<usize>| side.iter().all(|&u| uses[u].edge.is_none());
        let facing = |k: usize| is_pole(&sides[k]) && is_pole(&sides[k + 2]);
        !mapped || facing(0) || facing(1)
    }

    /// True when [`MappedOptions::fewest`] may have an effect: the model has poles on four-sided faces, or flat faces
    /// with holes.
    #[must_use]
    pub fn may_save(&self) -> bool {
        (0..self.mesher.shapes.len()).any(|f| self.may_save_on(f))
    }

    /// True when [`MappedOptions::fewest`] may have an effect on face `f`.
    #[must_use]
    pub fn may_save_on(&self, f: usize) -> bool {
        let Mesher { model, shapes, flats, .. } = &self.mesher;
        match &shapes[f] {
            Shape::Four(sides) => {
                let uses = &model.faces[f].loops[0].uses;
                sides.iter().any(|side| side.iter().all(|&u| uses[u].edge.is_none()))
            }
            _ => flats[f] && model.faces[f].loops.len() > 1,
        }
    }

    /// Divisions of every edge, at least `minima`, that satisfy the rules.
    #[must_use]
    pub fn agree(&self, minima: &[usize]) -> Divisions {
        let (counts, mapped) = self.mesher.agree(minima, &self.rules, &self.owners);
        Divisions { counts, mapped }
    }

    /// The mesh of face `f`. `density` is the number of divisions per quarter turn inside it, where that is independent
    /// of its edges ([`Plan::divides_inside`]).
    ///
    /// # Errors
    /// The reason why its boundary encloses no region; a finer boundary may.
    pub fn face(
        &self,
        f: usize,
        divisions: &Divisions,
        density: usize,
    ) -> Result<SurfaceMesh, String> {
        let mesher = &self.mesher;
        let face = &mesher.model.faces[f];
        let border = Border::of_face(mesher.model, &mesher.cuts(&divisions.counts), face);
        let work = mesher.face(&border, f, divisions.mapped[f], density)?;
        Ok(mesher.merge(border, vec![(f, work)]))
    }

    /// The mesh of the entire model with at least `minima` divisions on its edges.
    ///
    /// # Errors
    /// [`MeshError::Option`] for too many elements, [`MeshError::Faces`].
    pub fn mesh(&self, minima: &[usize], density: &[usize]) -> Result<SurfaceMesh, MeshError> {
        let mut mesher = self.mesher.clone();
        mesher.minima = minima.to_vec();
        mesher.density = density.to_vec();
        mesher.even_flats = self.even;
        mesher.run()
    }
}

/// The first edge of each edge's chain, over the rules between single edges.
fn chains(edges: usize, rules: &[Rule]) -> Vec<usize> {
    let mut first: Vec<usize> = (0..edges).collect();
    let root = |first: &[usize], mut e: usize| {
        while first[e] != e {
            e = first[e];
        }
        e
    };
    for rule in rules {
        if let Rule::Equal(a, b) = rule
            && let ([a], [b]) = (&a[..], &b[..])
        {
            let (a, b) = (root(&first, *a), root(&first, *b));
            first[a.max(b)] = a.min(b);
        }
    }
    (0..edges).map(|e| root(&first, e)).collect()
}
