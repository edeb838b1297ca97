//! Mesh generation for a model: consistent divisions, mapping, division or triangulation of faces, assembly.

mod flats;
mod rules;
mod size;

use std::sync::{Arc, OnceLock};

use rayon::prelude::*;

use super::border::{Border, Cuts, every_other, halfway, joined};
use super::divisions::PreparedRules;
use super::edge_tangents::EdgeTangents;
use super::options::{MappedOptions, MeshStyle};
use super::patchwork::{Node, Patchwork};
use super::sample::Lengths;
use super::sides::Shape;
use super::{demand, pairing, regions, sides, trimmed};
use crate::{Element, MeshError, SurfaceMesh};
use kanagata_cad::Model;
use kanagata_cad::model::Face;
use kanagata_progress::Progress;

/// Maximum number of boundary refinements of faces that cannot be meshed.
const BOUNDARY_ROUNDS_MAX: usize = 7;
/// Maximum number of remeshing rounds of faces with sides above the largest size.
const SIZE_ROUNDS_MAX: usize = 5;
/// Maximum number of elements of a mesh (32-bit ids).
const ELEMENTS_MAX: usize = 200_000_000;

/// State of the mesh generation for one model.
#[derive(Clone)]
pub(super) struct Mesher<'m> {
    pub(super) model: &'m Model,
    pub(super) options: MappedOptions,
    /// Mesh with half the boundary divisions, then split every element into quadrilaterals.
    pub(super) halved: bool,
    /// Flat faces with one loop are cut into quadrilaterals only, with boundary divisions that permit it.
    pub(super) even_flats: bool,
    pub(super) shapes: Vec<Shape>,
    pub(super) flats: Vec<bool>,
    /// Whether a face has zero area, evaluated for faces that cannot be meshed.
    tiny: Vec<OnceLock<bool>>,
    lengths: Vec<f64>,
    /// Edges with their lengths measured, on first use.
    measured: Arc<Vec<OnceLock<Lengths>>>,
    /// Edges along which patch sides deviate from their chords within the adjacent faces.
    pub(super) curved: Vec<bool>,
    pub(super) minima: Vec<usize>,
    floors: Vec<usize>,
    /// Divisions of a pole opposite to another pole, by face, at `arc_divisions`.
    poles: Vec<usize>,
    /// Divisions per quarter turn inside faces that are not mapped, and of opposite poles, by face.
    pub(super) density: Vec<usize>,
    /// Target length of interior sides relative to the largest size, by face that is not mapped.
    sizes: Vec<f64>,
    /// Where the progress of [`Self::run`] is reported.
    progress: Progress,
}

impl<'m> Mesher<'m> {
    pub(super) fn new(model: &'m Model, options: &MappedOptions, halved: bool) -> Self {
        let shapes: Vec<Shape> = model.faces.par_iter().map(sides::shape).collect();
        let flats = model.faces.par_iter().map(demand::is_flat).collect();
        let demand::EdgeDemand { mut minima, floors, lengths, curved } =
            demand::edge_demand(model, options);
        let inside: Vec<[usize; 2]> = model
            .faces
            .par_iter()
            .zip(&shapes)
            .map(|(face, shape)| demand::inside_demand(face, shape, options))
            .collect();
        for ((face, shape), required) in model.faces.iter().zip(&shapes).zip(&inside) {
            let Shape::Four(sides) = shape else { continue };
            for (k, side) in sides.iter().enumerate() {
                raise_side(face, side, required[k % 2], &mut minima, &lengths);
            }
        }
        let curved = curved.into_iter().map(|curved| curved && !options.through_cad).collect();
        let poles = inside.iter().map(|a| a[0].max(a[1]).max(2)).collect();
        let density = vec![options.arc_divisions; model.faces.len()];
        Self {
            model,
            options: *options,
            halved,
            even_flats: false,
            shapes,
            flats,
            tiny: vec![OnceLock::new(); model.faces.len()],
            lengths,
            measured: Arc::new(vec![OnceLock::new(); model.edges.len()]),
            curved,
            minima,
            floors,
            poles,
            density,
            sizes: vec![demand::initial_size_ratio(halved); model.faces.len()],
            progress: Progress::default(),
        }
    }

    /// The same mesher, whose progress is reported to `progress`.
    pub(super) fn watched(self, progress: &Progress) -> Self {
        Self { progress: progress.clone(), ..self }
    }

    pub(super) fn run(mut self) -> Result<SurfaceMesh, MeshError> {
        let mut failed = Vec::new();
        let (rules, owners) = self.prepared_rules();
        let (mut failures, mut sizings) = (0, 0);
        while failures < BOUNDARY_ROUNDS_MAX {
            let (counts, mapped) = self.agree(&self.minima, &rules, &owners);
            self.check_size(&counts)?;
            let border = Border::new(self.model, &self.cuts(&counts));
            let works = self.faces(&border, &mapped);
            let reasons = works.iter().map(|w| w.as_ref().err().cloned()).enumerate();
            failed = reasons.filter_map(|(f, e)| Some((f, e?))).collect::<Vec<_>>();
            if failed.is_empty() {
                let works: Vec<Patchwork> = works.into_iter().flatten().collect();
                if sizings == SIZE_ROUNDS_MAX || !self.request_size(&works, &mapped, &counts) {
                    return Ok(self.merge(border, works.into_iter().enumerate().collect()));
                }
                sizings += 1;
                continue;
            }
            failures += 1;
            // A flat face with a largest size has interior nodes and is never cut into quadrilaterals between boundary
            // nodes.
            if self.options.max_size.is_some() && failed.iter().any(|f| self.is_even_flat(f.0)) {
                break;
            }
            for (f, _) in &failed {
                if !(self.is_even_flat(*f) && self.divide_flat(*f, &counts)) {
                    self.divide_border(*f, &counts);
                }
            }
        }
        Err(self.fault(failed))
    }

    /// Elements of all faces of a round.
    fn faces(&self, border: &Border, mapped: &[bool]) -> Vec<Result<Patchwork, String>> {
        let count = self.model.faces.len();
        let stage = self.progress.stage("mesh", "faces", count as u64);
        let meshed = |f: usize| {
            let work = self.face(border, f, mapped[f], self.density[f]);
            stage.add(1);
            work
        };
        (0..count).into_par_iter().map(meshed).collect()
    }

    /// Error for the first face that cannot be meshed.
    fn fault(&self, failed: Vec<(usize, String)>) -> MeshError {
        let (face, reason) = failed[0].clone();
        MeshError::Faces {
            count: failed.len(),
            total: self.model.faces.len(),
            face,
            source_entity: self.model.faces[face].source.clone(),
            reason,
            failed,
        }
    }

    /// Divisions of edges by count.
    pub(super) fn cuts<'a>(&'a self, counts: &'a [usize]) -> Cuts<'a> {
        let (curved, measured) = (&self.curved[..], &self.measured[..]);
        Cuts { counts, curved, by_turn: self.options.by_turn, measured }
    }

    /// Requests a finer boundary of face `f`.
    fn divide_border(&mut self, f: usize, counts: &[usize]) {
        let edges = self.edges_of(f);
        let divided = edges.iter().any(|&e| counts[e] > 2);
        for e in edges {
            let finer = match (self.halved, divided, counts[e]) {
                // Quadrilaterals: edges already divided get a smaller refinement.
                (true, true, n) => n + 2 * usize::from(n > 2),
                (_, _, n) => 2 * n,
            };
            self.minima[e] = self.minima[e].max(finer.min(20_000));
        }
    }

    /// Rules of the mapped faces, and the face of each.
    pub(super) fn prepared_rules(&self) -> (PreparedRules, Vec<usize>) {
        let (rules, owners) = self.rules();
        (PreparedRules::new(&self.lengths, &rules), owners)
    }

    /// Counts of all edges that satisfy the rules, and the faces that can then be mapped.
    pub(super) fn agree(
        &self,
        minima: &[usize],
        rules: &PreparedRules,
        owners: &[usize],
    ) -> (Vec<usize>, Vec<bool>) {
        let half = || minima.iter().zip(&self.floors).map(|(n, &low)| n.div_ceil(2).max(low));
        let minima = if self.halved { half().collect() } else { minima.to_vec() };
        let agreed = rules.assign(&minima);
        let factor = if self.halved { 2 } else { 1 };
        let counts = agreed.counts.iter().map(|n| n * factor).collect();
        (counts, self.mapped_faces(&agreed, owners))
    }

    fn edges_of(&self, f: usize) -> Vec<usize> {
        let uses = self.model.faces[f].loops.iter().flat_map(|l| &l.uses);
        uses.filter_map(|u| u.edge).collect()
    }

    fn three_blocks(&self) -> bool {
        self.options.style == MeshStyle::Structured && !self.halved
    }

    fn check_size(&self, counts: &[usize]) -> Result<(), MeshError> {
        let total: usize = counts.iter().sum();
        if total > ELEMENTS_MAX / 16 {
            let found =
                format!("{} (asks for {total} divisions of edges)", self.options.arc_divisions);
            let allowed = "a size that gives at most 12500000 divisions of edges";
            return Err(MeshError::Option { option: "arc_divisions", found, allowed });
        }
        Ok(())
    }

    /// Elements of face `f`; none where it cannot be meshed and has no area within the model's tolerance.
    pub(super) fn face(
        &self,
        border: &Border,
        f: usize,
        mapped: bool,
        density: usize,
    ) -> Result<Patchwork, String> {
        let none = |reason| match *self.tiny[f].get_or_init(|| self.model.is_tiny(f)) {
            true => Ok(Patchwork::default()),
            false => Err(reason),
        };
        self.elements_of(border, f, mapped, density).or_else(none)
    }

    fn elements_of(
        &self,
        border: &Border,
        f: usize,
        mapped: bool,
        density: usize,
    ) -> Result<Patchwork, String> {
        let (face, shape) = (&self.model.faces[f], &self.shapes[f]);
        let poles = (self.poles[f] * density).div_ceil(self.options.arc_divisions);
        let sides = border.loops(face, shape, poles + poles % 2);
        if !self.halved {
            return self.region(f, &sides, &border.edge_tangents(face), (mapped, density));
        }
        // The coarse elements use chords: the known tangents are those of the halved sides.
        let chords = EdgeTangents::default();
        let (thin, middle) = (every_other(&sides), halfway(&sides));
        let split = |coarse: Patchwork| {
            let mut fine = coarse.refined(face, &middle);
            fine.untangle(face);
            (fine.worst_corner(face), fine)
        };
        let (worst, fine) = split(self.region(f, &thin, &chords, (mapped, density))?);
        if worst > 0.0 || mapped {
            return Ok(fine);
        }
        // A boundary arc extends past the middle of a quadrilateral: triangles leave its parts more space.
        let (other, plain) = split(self.triangles(f, &thin, &chords, density)?);
        match worst.max(other) {
            best if best <= 0.0 => {
                Err("an arc of its border reaches past the quads beside it".into())
            }
            _ if other > worst => Ok(plain),
            _ => Ok(fine),
        }
    }

    fn region(
        &self,
        f: usize,
        loops: &[Vec<Vec<Node>>],
        edge_tangents: &EdgeTangents,
        (mapped, density): (bool, usize),
    ) -> Result<Patchwork, String> {
        let face = &self.model.faces[f];
        if let Some(work) = mapped.then(|| self.map_region(f, loops)).flatten() {
            return Ok(work);
        }
        if let Some(work) = self.polygon(f, loops, edge_tangents) {
            return Ok(work);
        }
        if self.is_even_flat(f) {
            return Err("no convex quads between the nodes of its border".into());
        }
        let mut work = self.triangles(f, loops, edge_tangents, density)?;
        if self.options.style != MeshStyle::Triangles {
            pairing::pair(face, &mut work, edge_tangents);
        }
        work.untangle(face);
        Ok(work)
    }

    /// Maps a face of four or three sides with matching divisions; `None` for others, and where the map folds.
    fn map_region(&self, f: usize, loops: &[Vec<Vec<Node>>]) -> Option<Patchwork> {
        let face = &self.model.faces[f];
        let side = |uses: &Vec<usize>| joined(&loops[0], uses);
        match &self.shapes[f] {
            Shape::Four(s) => {
                let sides = [side(&s[0]), side(&s[1]), side(&s[2]), side(&s[3])];
                let agree = sides[0].len() == sides[2].len() && sides[1].len() == sides[3].len();
                let joined = self.options.fewest
                    && self.options.style == MeshStyle::Structured
                    && !self.halved;
                if agree { regions::four(face, &sides, joined) } else { None }
            }
            Shape::Three(s) => {
                let sides = [side(&s[0]), side(&s[1]), side(&s[2])];
                let agree = sides.iter().all(|s| s.len() == sides[0].len());
                if agree { regions::three(face, &sides, self.three_blocks()) } else { None }
            }
            _ => None,
        }
    }

    fn triangles(
        &self,
        f: usize,
        loops: &[Vec<Vec<Node>>],
        edge_tangents: &EdgeTangents,
        density: usize,
    ) -> Result<Patchwork, String> {
        let rings: Vec<Vec<Node>> = loops.iter().map(|sides| ring(sides)).collect();
        let max_size = self.options.max_size.map(|size| size * self.sizes[f]);
        let options = MappedOptions { arc_divisions: density, max_size, ..self.options };
        let face = &self.model.faces[f];
        let mut work = trimmed::triangulate(face, &rings, edge_tangents, &options)?;
        if let Some(size) = max_size {
            work.bisect(face, size / demand::INITIAL_SIZE_RATIO);
        }
        Ok(work)
    }

    /// The mesh of some faces.
    pub(super) fn merge(&self, border: Border, works: Vec<(usize, Patchwork)>) -> SurfaceMesh {
        let count_of = |of: fn(&Patchwork) -> usize| works.iter().map(|(_, work)| of(work)).sum();
        let mut out = SurfaceMesh {
            elements: Vec::with_capacity(count_of(|work| work.elements.len())),
            feet: border.feet(),
            vertices: border.points,
        };
        out.vertices.reserve_exact(count_of(|work| work.nodes.len()));
        // Each face's work is dropped when it is merged: a fine mesh is not held twice.
        for (f, work) in works {
            let mut ids = Vec::with_capacity(work.nodes.len());
            for node in &work.nodes {
                ids.push(node.id.unwrap_or(out.vertices.len() as u32));
                if node.id.is_none() {
                    out.vertices.push(node.point);
                }
                out.feet.add_on_face(ids[ids.len() - 1], f as u32, node.uv);
            }
            for e in &work.elements {
                let ring: Vec<u32> = e.nodes().iter().map(|&n| ids[n as usize]).collect();
                if let Some(e) = Element::from_ring(&ring, f as u32) {
                    let flipped = self.model.faces[f].flipped;
                    out.elements.push(if flipped { e.reversed() } else { e });
                }
            }
        }
        out.compact();
        if self.options.style == MeshStyle::Triangles { out.to_triangles() } else { out }
    }
}

/// Nodes of a loop, each once.
fn ring(sides: &[Vec<Node>]) -> Vec<Node> {
    sides.iter().flat_map(|s| s.iter().take(s.len().max(1) - 1)).copied().collect()
}

/// Raises the minima of a side's edges to a total of `required`, in proportion to length.
fn raise_side(face: &Face, side: &[usize], required: usize, minima: &mut [usize], lengths: &[f64]) {
    let edges: Vec<usize> = side.iter().filter_map(|&u| face.loops[0].uses[u].edge).collect();
    let whole: f64 = edges.iter().map(|&e| lengths[e]).sum();
    for e in edges {
        let fraction = if whole > 0.0 { lengths[e] / whole } else { 1.0 };
        minima[e] = minima[e].max((required as f64 * fraction - 1e-6).ceil() as usize);
    }
}
