//! One meshing of a model: divisions agreed, faces mapped, cut up or triangulated, and joined.

mod flats;
mod rules;
mod size;

use std::sync::OnceLock;

use rayon::prelude::*;

use super::bends::Bends;
use super::border::{Border, Cuts, every_other, halfway, joined};
use super::divisions::{Rule, assign};
use super::options::{MappedOptions, MeshStyle};
use super::patchwork::{Node, Patchwork};
use super::sides::Shape;
use super::{demand, pairing, regions, sides, trimmed};
use crate::cad::Model;
use crate::cad::model::Face;
use crate::mesh::{Element, MeshError, SurfaceMesh};

/// Times the borders of faces that could not be meshed are made finer.
const ROUNDS: usize = 7;
/// Times faces with sides longer than the largest size are meshed again.
const SIZE_ROUNDS: usize = 5;
/// Most elements of a mesh (ids are 32 bits).
const MOST_ELEMENTS: usize = 200_000_000;

/// One meshing of a model.
#[derive(Clone)]
pub(super) struct Mesher<'m> {
    pub(super) model: &'m Model,
    pub(super) options: MappedOptions,
    /// Mesh with borders half as fine, then split every element into quads.
    pub(super) halved: bool,
    /// Flats with one loop get quads only, borders divided until that is possible.
    pub(super) even_flats: bool,
    pub(super) shapes: Vec<Shape>,
    pub(super) flats: Vec<bool>,
    /// Faces of no area, asked of those that cannot be meshed.
    tiny: Vec<OnceLock<bool>>,
    lengths: Vec<f64>,
    /// Edges along which sides of patches bend off their chords within the faces beside them.
    pub(super) bent: Vec<bool>,
    pub(super) minima: Vec<usize>,
    floors: Vec<usize>,
    /// Divisions of a pole that faces another pole, by face, at `arc_divisions`.
    poles: Vec<usize>,
    /// Divisions of a quarter turn inside faces that are not mapped, and of poles that face each other, by face.
    pub(super) density: Vec<usize>,
    /// Share of the largest size that inner sides are asked to keep, by face that is not mapped.
    sizes: Vec<f64>,
}

impl<'m> Mesher<'m> {
    pub(super) fn new(model: &'m Model, options: &MappedOptions, halved: bool) -> Self {
        let shapes: Vec<Shape> = model.faces.par_iter().map(sides::shape).collect();
        let flats = model.faces.par_iter().map(demand::is_flat).collect();
        let demand::EdgeDemand { mut minima, floors, lengths, bent } =
            demand::edge_demand(model, options);
        let inside: Vec<[usize; 2]> = model
            .faces
            .par_iter()
            .zip(&shapes)
            .map(|(face, shape)| demand::inside_demand(face, shape, options))
            .collect();
        for ((face, shape), asked) in model.faces.iter().zip(&shapes).zip(&inside) {
            let Shape::Four(sides) = shape else { continue };
            for (k, side) in sides.iter().enumerate() {
                raise_side(face, side, asked[k % 2], &mut minima, &lengths);
            }
        }
        let bent = bent.into_iter().map(|bent| bent && !options.through_cad).collect();
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
            bent,
            minima,
            floors,
            poles,
            density,
            sizes: vec![demand::first_share(halved); model.faces.len()],
        }
    }

    pub(super) fn run(mut self) -> Result<SurfaceMesh, MeshError> {
        let mut failed = Vec::new();
        let (rules, owners) = self.rules();
        let (mut failures, mut sizings) = (0, 0);
        while failures < ROUNDS {
            let (counts, mapped) = self.agree(&self.minima, &rules, &owners);
            self.check_size(&counts)?;
            let border = Border::new(self.model, &self.cuts(&counts));
            let works: Vec<Result<Patchwork, String>> = (0..self.model.faces.len())
                .into_par_iter()
                .map(|f| self.face(&border, f, mapped[f], self.density[f]))
                .collect();
            let reasons = works.iter().map(|w| w.as_ref().err().cloned()).enumerate();
            failed = reasons.filter_map(|(f, e)| Some((f, e?))).collect::<Vec<_>>();
            if failed.is_empty() {
                let works: Vec<Patchwork> = works.into_iter().flatten().collect();
                if sizings == SIZE_ROUNDS || !self.ask_for_size(&works, &mapped, &counts) {
                    return Ok(self.merge(border, works.into_iter().enumerate().collect()));
                }
                sizings += 1;
                continue;
            }
            failures += 1;
            // A flat with a largest size has nodes inside, and is never cut into quads between those of its border.
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

    /// The first of the faces that cannot be meshed, named.
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

    /// Edges divided so many times.
    pub(super) fn cuts<'a>(&'a self, counts: &'a [usize]) -> Cuts<'a> {
        Cuts { counts, bent: &self.bent, by_turn: self.options.by_turn }
    }

    /// Asks for a finer border of face `f`.
    fn divide_border(&mut self, f: usize, counts: &[usize]) {
        let edges = self.edges_of(f);
        let divided = edges.iter().any(|&e| counts[e] > 2);
        for e in edges {
            let finer = match (self.halved, divided, counts[e]) {
                // Quads: arcs that are divided already, a step finer.
                (true, true, n) => n + 2 * usize::from(n > 2),
                (_, _, n) => 2 * n,
            };
            self.minima[e] = self.minima[e].max(finer.min(20_000));
        }
    }

    /// Counts of every edge that keep the rules, and the faces that can be mapped with them.
    pub(super) fn agree(
        &self,
        minima: &[usize],
        rules: &[Rule],
        owners: &[usize],
    ) -> (Vec<usize>, Vec<bool>) {
        let half = || minima.iter().zip(&self.floors).map(|(n, &low)| n.div_ceil(2).max(low));
        let minima = if self.halved { half().collect() } else { minima.to_vec() };
        let agreed = assign(&minima, &self.lengths, rules);
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
        if total > MOST_ELEMENTS / 16 {
            let found =
                format!("{} (asks for {total} divisions of edges)", self.options.arc_divisions);
            let allowed = "a size that gives at most 12500000 divisions of edges";
            return Err(MeshError::Option { option: "arc_divisions", found, allowed });
        }
        Ok(())
    }

    /// Elements of face `f`; none where it cannot be meshed and has no area within the tolerance of the model.
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
            return self.region(f, &sides, &border.bends(face), (mapped, density));
        }
        // The coarse elements go by their chords: the bends known are those of the halved sides.
        let chords = Bends::default();
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
        // An arc of the border reaches past the middle of a quad: triangles leave its parts more room.
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
        bends: &Bends,
        (mapped, density): (bool, usize),
    ) -> Result<Patchwork, String> {
        let face = &self.model.faces[f];
        if let Some(work) = mapped.then(|| self.map_region(f, loops)).flatten() {
            return Ok(work);
        }
        if let Some(work) = self.polygon(f, loops, bends) {
            return Ok(work);
        }
        if self.is_even_flat(f) {
            return Err("no convex quads between the nodes of its border".into());
        }
        let mut work = self.triangles(f, loops, bends, density)?;
        if self.options.style != MeshStyle::Triangles {
            pairing::pair(face, &mut work, bends);
        }
        work.untangle(face);
        Ok(work)
    }

    /// Maps a face of four or three sides whose divisions agree; `None` for others, and where the map folds.
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
        bends: &Bends,
        density: usize,
    ) -> Result<Patchwork, String> {
        let rings: Vec<Vec<Node>> = loops.iter().map(|sides| ring(sides)).collect();
        let max_size = self.options.max_size.map(|size| size * self.sizes[f]);
        let options = MappedOptions { arc_divisions: density, max_size, ..self.options };
        let face = &self.model.faces[f];
        let mut work = trimmed::triangulate(face, &rings, bends, &options)?;
        if let Some(size) = max_size {
            work.bisect(face, size / demand::FIRST_SHARE);
        }
        Ok(work)
    }

    /// The mesh of some faces.
    pub(super) fn merge(&self, border: Border, works: Vec<(usize, Patchwork)>) -> SurfaceMesh {
        let mut out = SurfaceMesh { vertices: border.points, elements: Vec::new() };
        for (f, work) in &works {
            let mut ids = Vec::with_capacity(work.nodes.len());
            for node in &work.nodes {
                ids.push(node.id.unwrap_or(out.vertices.len() as u32));
                if node.id.is_none() {
                    out.vertices.push(node.point);
                }
            }
            for e in &work.elements {
                let ring: Vec<u32> = e.nodes().iter().map(|&n| ids[n as usize]).collect();
                if let Some(e) = Element::from_ring(&ring, *f as u32) {
                    let flipped = self.model.faces[*f].flipped;
                    out.elements.push(if flipped { e.reversed() } else { e });
                }
            }
        }
        out.compact();
        if self.options.style == MeshStyle::Triangles { out.to_triangles() } else { out }
    }
}

/// The nodes of a loop, each once.
fn ring(sides: &[Vec<Node>]) -> Vec<Node> {
    sides.iter().flat_map(|s| s.iter().take(s.len().max(1) - 1)).copied().collect()
}

/// Raises the minima of a side's edges to `asked` in all, by length.
fn raise_side(face: &Face, side: &[usize], asked: usize, minima: &mut [usize], lengths: &[f64]) {
    let edges: Vec<usize> = side.iter().filter_map(|&u| face.loops[0].uses[u].edge).collect();
    let whole: f64 = edges.iter().map(|&e| lengths[e]).sum();
    for e in edges {
        let share = if whole > 0.0 { lengths[e] / whole } else { 1.0 };
        minima[e] = minima[e].max((asked as f64 * share - 1e-6).ceil() as usize);
    }
}
