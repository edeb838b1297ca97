//! One meshing of a model: divisions agreed, faces mapped, cut up or triangulated, and joined.

use rayon::prelude::*;

use super::border::{Border, every_other, halfway, joined};
use super::divisions::{Assignment, Rule, assign};
use super::patchwork::{Node, Patchwork};
use super::sides::Shape;
use super::{MappedOptions, MeshStyle, demand, pairing, polygon, regions, sides, trimmed};
use crate::cad::Model;
use crate::cad::model::Face;
use crate::mesh::{Element, MeshError, SurfaceMesh};

/// Times the borders of faces that could not be meshed are made finer.
const ROUNDS: usize = 7;
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
    flats: Vec<bool>,
    lengths: Vec<f64>,
    pub(super) minima: Vec<usize>,
    floors: Vec<usize>,
    /// Divisions of a pole that faces another pole, by face, at `arc_divisions`.
    poles: Vec<usize>,
    /// Divisions of a quarter turn inside faces that are not mapped, and of poles that face each other, by face.
    pub(super) density: Vec<usize>,
}

impl<'m> Mesher<'m> {
    pub(super) fn new(model: &'m Model, options: &MappedOptions, halved: bool) -> Self {
        let shapes: Vec<Shape> = model.faces.par_iter().map(sides::shape).collect();
        let flats = model.faces.par_iter().map(demand::is_flat).collect();
        let demand::EdgeDemand { mut minima, floors, lengths } =
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
        let poles = inside.iter().map(|a| a[0].max(a[1]).max(2)).collect();
        let density = vec![options.arc_divisions; model.faces.len()];
        Self {
            model,
            options: *options,
            halved,
            even_flats: false,
            shapes,
            flats,
            lengths,
            minima,
            floors,
            poles,
            density,
        }
    }

    pub(super) fn run(mut self) -> Result<SurfaceMesh, MeshError> {
        let mut failed = Vec::new();
        let (rules, owners) = self.rules();
        for _ in 0..ROUNDS {
            let (counts, mapped) = self.agree(&self.minima, &rules, &owners);
            self.check_size(&counts)?;
            let border = Border::new(self.model, &counts);
            let works: Vec<Result<Patchwork, String>> = (0..self.model.faces.len())
                .into_par_iter()
                .map(|f| self.face(&border, f, mapped[f], self.density[f]))
                .collect();
            failed = works
                .iter()
                .enumerate()
                .filter_map(|(f, w)| w.as_ref().err().map(|e| (f, e.clone())))
                .collect::<Vec<_>>();
            if failed.is_empty() {
                return Ok(self.merge(border, works.into_iter().flatten().enumerate().collect()));
            }
            for (f, _) in &failed {
                if self.is_even_flat(*f) && self.divide_flat(*f, &counts) {
                    continue;
                }
                let uses = self.model.faces[*f].loops.iter().flat_map(|l| &l.uses);
                let edges: Vec<usize> = uses.filter_map(|u| u.edge).collect();
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
        }
        let (face, reason) = failed.swap_remove(0);
        Err(MeshError::Faces {
            count: failed.len() + 1,
            total: self.model.faces.len(),
            face,
            source_entity: self.model.faces[face].source.clone(),
            reason,
        })
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

    /// Rules of the faces that are to be mapped, and the face each belongs to.
    pub(super) fn rules(&self) -> (Vec<Rule>, Vec<usize>) {
        let (mut rules, mut owners) = (Vec::new(), Vec::new());
        if self.options.unstructured {
            return (rules, owners);
        }
        for (f, face) in self.model.faces.iter().enumerate() {
            if self.is_even_flat(f) && self.free_edges(f).is_empty() {
                rules.push(Rule::Even(self.edges_of(f)));
                owners.push(f);
            }
            let edges = |side: &[usize]| -> Option<Vec<usize>> {
                side.iter().map(|&u| face.loops[0].uses[u].edge).collect()
            };
            let mut rule = |a: &[usize], b: &[usize]| {
                if let (Some(a), Some(b)) = (edges(a), edges(b)) {
                    rules.push(Rule::Equal(a, b));
                    owners.push(f);
                }
            };
            match &self.shapes[f] {
                // A flat is cut as well without: it takes no part unless its sides are single edges.
                Shape::Four(sides) if self.flats[f] && sides.iter().any(|s| s.len() > 1) => {}
                Shape::Three(_) if self.flats[f] => {}
                Shape::Four([a, b, c, d]) => {
                    rule(a, c);
                    rule(b, d);
                }
                Shape::Three([a, b, c]) => {
                    rule(a, b);
                    rule(b, c);
                    if self.three_blocks()
                        && let Some(a) = edges(a)
                    {
                        rules.push(Rule::Even(a));
                        owners.push(f);
                    }
                }
                _ => {}
            }
        }
        (rules, owners)
    }

    /// True for a flat that is to be cut into quads only.
    fn is_even_flat(&self, f: usize) -> bool {
        self.even_flats && self.flats[f] && self.model.faces[f].loops.len() == 1
    }

    fn edges_of(&self, f: usize) -> Vec<usize> {
        let uses = self.model.faces[f].loops.iter().flat_map(|l| &l.uses);
        uses.filter_map(|u| u.edge).collect()
    }

    /// Edges of face `f` that bound only flats, longest first: what their divisions are does not matter to shapes.
    fn free_edges(&self, f: usize) -> Vec<usize> {
        let mut edges = self.edges_of(f);
        edges.retain(|&e| self.model.edges[e].uses.iter().all(|u| self.flats[u[0]]));
        edges.sort_by(|&a, &b| self.lengths[b].total_cmp(&self.lengths[a]).then(a.cmp(&b)));
        edges
    }

    /// Raises the minima of the longest free edges of flat `f` by as little as lets it be cut into quads; false when
    /// nothing does.
    fn divide_flat(&mut self, f: usize, counts: &[usize]) -> bool {
        const EDGES: usize = 3;
        const MOST_TRIES: usize = 4000;
        let edges: Vec<usize> = self.free_edges(f).into_iter().take(EDGES).collect();
        if edges.is_empty() {
            return false;
        }
        let mut tries = 0;
        for more in 1.. {
            let mut best: Option<(f64, Vec<usize>)> = None;
            for first in 0..=more {
                for second in 0..=more - first {
                    let extra = [first, second, more - first - second];
                    // Nothing for edges there are none of.
                    if extra[edges.len()..].iter().any(|&n| n > 0) {
                        continue;
                    }
                    tries += 1;
                    let mut raised = counts.to_vec();
                    edges.iter().zip(extra).for_each(|(&e, n)| raised[e] += n);
                    let face = &self.model.faces[f];
                    let border = Border::of_face(self.model, &raised, face);
                    let loops = border.loops(face, &self.shapes[f], 2);
                    let found = polygon::quads(face, &ring(&loops[0]), false);
                    if let Some((_, badness)) = found
                        && best.as_ref().is_none_or(|b| badness < b.0)
                    {
                        best = Some((badness, raised));
                    }
                }
            }
            if let Some((_, raised)) = best {
                edges.iter().for_each(|&e| self.minima[e] = self.minima[e].max(raised[e]));
                return true;
            }
            if tries > MOST_TRIES {
                return false;
            }
        }
        false
    }

    fn three_blocks(&self) -> bool {
        self.options.style == MeshStyle::Structured && !self.halved
    }

    fn mapped_faces(&self, agreed: &Assignment, owners: &[usize]) -> Vec<bool> {
        let may = |s: &Shape| *s != Shape::Other && !self.options.unstructured;
        let mut mapped: Vec<bool> = self.shapes.iter().map(may).collect();
        for (&f, &kept) in owners.iter().zip(&agreed.kept) {
            mapped[f] &= kept;
        }
        mapped
    }

    fn check_size(&self, counts: &[usize]) -> Result<(), MeshError> {
        let total: usize = counts.iter().sum();
        if total > MOST_ELEMENTS / 16 {
            let found =
                format!("{} (asks for {total} divisions of edges)", self.options.arc_divisions);
            let allowed = "a size that gives at most 12500000 divisions of edges";
            return Err(MeshError::Option { option: "--arc-divisions", found, allowed });
        }
        Ok(())
    }

    pub(super) fn face(
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
            return self.region(f, &sides, mapped, density);
        }
        let (thin, middle) = (every_other(&sides), halfway(&sides));
        let split = |coarse: Patchwork| {
            let mut fine = coarse.refined(face, &middle);
            fine.untangle(face);
            (fine.worst_corner(face), fine)
        };
        let (worst, fine) = split(self.region(f, &thin, mapped, density)?);
        if worst > 0.0 || mapped {
            return Ok(fine);
        }
        // An arc of the border reaches past the middle of a quad: triangles leave its parts more room.
        let (other, plain) = split(self.triangles(f, &thin, density)?);
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
        mapped: bool,
        density: usize,
    ) -> Result<Patchwork, String> {
        let (face, shape) = (&self.model.faces[f], &self.shapes[f]);
        let side = |uses: &Vec<usize>| joined(&loops[0], uses);
        let work = match shape {
            Shape::Four(s) if mapped => {
                let sides = [side(&s[0]), side(&s[1]), side(&s[2]), side(&s[3])];
                let agree = sides[0].len() == sides[2].len() && sides[1].len() == sides[3].len();
                if agree { regions::four(face, &sides) } else { None }
            }
            Shape::Three(s) if mapped => {
                let sides = [side(&s[0]), side(&s[1]), side(&s[2])];
                let agree = sides.iter().all(|s| s.len() == sides[0].len());
                if agree { regions::three(face, &sides, self.three_blocks()) } else { None }
            }
            _ => None,
        };
        if let Some(work) = work {
            return Ok(work);
        }
        if let Some(work) = self.polygon(f, loops) {
            return Ok(work);
        }
        if self.is_even_flat(f) {
            return Err("no convex quads between the nodes of its border".into());
        }
        let mut work = self.triangles(f, loops, density)?;
        if self.options.style != MeshStyle::Triangles {
            pairing::pair(face, &mut work);
        }
        work.untangle(face);
        Ok(work)
    }

    /// A flat with one loop without nodes inside.
    fn polygon(&self, f: usize, loops: &[Vec<Vec<Node>>]) -> Option<Patchwork> {
        let [sides] = loops else { return None };
        let wanted = self.options.style == MeshStyle::Structured
            && !self.options.unstructured
            && !self.halved
            && self.flats[f]
            && self.options.max_size.is_none();
        let triangles = !self.even_flats;
        let cut = || polygon::quads(&self.model.faces[f], &ring(sides), triangles);
        wanted.then(cut).flatten().map(|found| found.0)
    }

    fn triangles(
        &self,
        f: usize,
        loops: &[Vec<Vec<Node>>],
        density: usize,
    ) -> Result<Patchwork, String> {
        let rings: Vec<Vec<Node>> = loops.iter().map(|sides| ring(sides)).collect();
        let options = MappedOptions { arc_divisions: density, ..self.options };
        trimmed::triangulate(&self.model.faces[f], &rings, &options)
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
