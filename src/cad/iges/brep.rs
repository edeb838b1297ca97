//! Boundary representation: 186 solid, 514 shell, 510 face, 508 loop, 504 edges, 502 vertices.

use std::rc::Rc;

use super::edges::EdgeDraft;
use super::file::Fault;
use super::params::Params;
use super::reader::{ListedEdge, Reader, mirrors};
use super::surface::BasisSurface;
use crate::raw::{RawEdge, RawFace};
use kanagata_geometry::nurbs::Curve3;
use kanagata_geometry::{Affine, Vec3};

/// A shell to be read: its entity, and whether its faces are reversed.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShellUse {
    /// Shell (514).
    pub shell: usize,
    /// The normals of its faces point into the material.
    pub turned: bool,
}

impl Reader<'_, '_> {
    /// Shells of a solid (186): shell DE, SOF, N, then N voids (DE, VOF).
    pub(super) fn solid(&self, entity: usize) -> Result<Vec<ShellUse>, Fault> {
        let mut p = self.file.params(entity)?;
        let outer = ShellUse { shell: p.pointer("shell")?, turned: !p.flag("SOF", true)? };
        let mut shells = vec![outer];
        let voids = p.count("number of voids", 2)?;
        for _ in 0..voids {
            shells.push(ShellUse { shell: p.pointer("void")?, turned: !p.flag("VOF", true)? });
        }
        Ok(shells)
    }

    /// Faces of a shell (514): N, then N times face DE and OF (1: the face's normal is the shell's).
    pub(super) fn shell(&self, entity: usize) -> Result<Vec<(usize, bool)>, Fault> {
        self.expect_kind(entity, &[514], "a shell (514)")?;
        let mut p = self.file.params(entity)?;
        let count = p.count("number of faces", 2)?;
        (0..count).map(|_| Ok((p.pointer("face")?, p.flag("OF", true)?))).collect()
    }

    /// Face (510): surface DE, N, OF (1: the first loop is the outer one), N loops. `edge_id` numbers shared
    /// edges by (list, number).
    pub(super) fn brep_face(
        &self,
        entity: usize,
        map: &Affine,
        turned: bool,
        edge_id: &mut dyn FnMut(usize, usize) -> usize,
    ) -> Result<RawFace, Fault> {
        self.expect_kind(entity, &[510], "a face (510)")?;
        let mut p = self.file.params(entity)?;
        let surface = p.pointer("surface")?;
        let count = p.count("number of loops", 1)?;
        let outer_first = p.flag("OF", true)?;
        let placed = self.placed(entity, map)?;
        let basis = self.surface(surface, &placed, count == 0)?;
        let mut loops = Vec::with_capacity(count);
        let mut outer = Vec::with_capacity(count);
        for i in 0..count {
            let entity = p.pointer("loop")?;
            loops.push(self.edge_loop(entity, &placed, &basis, edge_id)?);
            outer.push(outer_first.then_some(i == 0));
        }
        self.raw_face(entity, basis, loops, &outer, count == 0, mirrors(&placed) != turned)
    }

    /// Loop (508): N, then N times TYPE (1: vertex), list DE, number, OF, K, K times ISOP and parameter curve.
    fn edge_loop(
        &self,
        entity: usize,
        map: &Affine,
        basis: &BasisSurface,
        edge_id: &mut dyn FnMut(usize, usize) -> usize,
    ) -> Result<Vec<EdgeDraft>, Fault> {
        self.expect_kind(entity, &[508], "a loop (508)")?;
        let placed = self.placed(entity, map)?;
        let mut p = self.file.params(entity)?;
        let count = p.count("number of edges", 5)?;
        let mut drafts = Vec::with_capacity(count);
        for _ in 0..count {
            let at_vertex = p.flag("TYPE", false)?;
            let list = p.pointer("edge or vertex list")?;
            let number = p.integer_or("number in the list", 1)?;
            let number = usize::try_from(number).unwrap_or(0);
            let along = p.flag("OF", true)?;
            let pcurve = self.use_pcurve(entity, &mut p, basis)?;
            let mut edge = if at_vertex {
                let point = placed.point(&self.vertex(list, number)?);
                RawEdge { ends: Some([point, point]), ..RawEdge::default() }
            } else {
                let id = edge_id(list, number);
                RawEdge { edge_id: Some(id), ..self.listed_edge(list, number, along, &placed)? }
            };
            edge.pcurve = pcurve;
            drafts.push(EdgeDraft { curve_directs: edge.curve.is_some(), edge });
        }
        Ok(drafts)
    }

    fn use_pcurve(
        &self,
        entity: usize,
        p: &mut Params<'_, '_>,
        basis: &BasisSurface,
    ) -> Result<Option<kanagata_geometry::nurbs::Curve2>, Fault> {
        let count = p.count("number of parameter curves", 2)?;
        let mut pieces = Vec::new();
        for _ in 0..count {
            p.flag("ISOP", false)?;
            let curve = p.pointer_or_none("parameter curve")?.filter(|_| !basis.maps.is_empty());
            if let Some(curve) = curve {
                pieces.extend(self.flat_pieces(curve)?);
            }
        }
        self.joined_flat(entity, &pieces)
    }

    /// Space curve of a listed edge, trimmed to its vertices, in the direction of use.
    fn listed_edge(
        &self,
        list: usize,
        number: usize,
        along: bool,
        map: &Affine,
    ) -> Result<RawEdge, Fault> {
        let edges = self.edge_list(list)?;
        let Some(listed) = number.checked_sub(1).and_then(|i| edges.get(i)) else {
            return Err(self.file.fault(
                list,
                "edge-missing",
                format!("edge {number} of a list of {}", edges.len()),
                "a number from 1 to the list's length",
            ));
        };
        let placed = self.placed(list, map)?;
        let mut ends = [Vec3::zeros(); 2];
        for (end, (vertices, number)) in ends.iter_mut().zip(listed.ends) {
            *end = map.point(&self.vertex(vertices, number)?);
        }
        let curve = cut_to(self.joined(listed.curve, &placed)?.curve, &ends);
        if along {
            return Ok(RawEdge { curve: Some(curve), ends: Some(ends), ..RawEdge::default() });
        }
        ends.reverse();
        Ok(RawEdge { curve: Some(curve.reversed()), ends: Some(ends), ..RawEdge::default() })
    }

    /// Edge list (504): N, then N times curve DE, start vertex list and number, end vertex list and number.
    fn edge_list(&self, entity: usize) -> Result<Rc<[ListedEdge]>, Fault> {
        if let Some(known) = self.edges.borrow().get(&entity) {
            return Ok(Rc::clone(known));
        }
        self.expect_kind(entity, &[504], "an edge list (504)")?;
        let mut p = self.file.params(entity)?;
        let count = p.count("number of edges", 5)?;
        let mut edges = Vec::with_capacity(count);
        for _ in 0..count {
            let curve = p.pointer("curve")?;
            let mut ends = [(0, 0); 2];
            for end in &mut ends {
                let list = p.pointer("vertex list")?;
                *end = (list, usize::try_from(p.integer_or("vertex", 1)?).unwrap_or(0));
            }
            edges.push(ListedEdge { curve, ends });
        }
        let edges: Rc<[ListedEdge]> = edges.into();
        self.edges.borrow_mut().insert(entity, Rc::clone(&edges));
        Ok(edges)
    }

    /// Vertex `number` (from 1) of a vertex list (502): N, N points.
    fn vertex(&self, entity: usize, number: usize) -> Result<Vec3, Fault> {
        let known = self.vertices.borrow().get(&entity).cloned();
        let list = match known {
            Some(list) => list,
            None => self.vertex_list(entity)?,
        };
        number.checked_sub(1).and_then(|i| list.get(i)).copied().ok_or_else(|| {
            self.file.fault(
                entity,
                "vertex-missing",
                format!("vertex {number} of a list of {}", list.len()),
                "a number from 1 to the list's length",
            )
        })
    }

    fn vertex_list(&self, entity: usize) -> Result<Rc<[Vec3]>, Fault> {
        self.expect_kind(entity, &[502], "a vertex list (502)")?;
        let mut p = self.file.params(entity)?;
        let count = p.count("number of vertices", 3)?;
        let placed = self.placed(entity, &Affine::identity())?;
        let points: Rc<[Vec3]> =
            p.points(count, "coordinate")?.iter().map(|v| placed.point(v)).collect();
        self.vertices.borrow_mut().insert(entity, Rc::clone(&points));
        Ok(points)
    }
}

/// Trims a curve to the vertices of its edge and reverses it if it runs from the second to the first.
fn cut_to(curve: Curve3, ends: &[Vec3; 2]) -> Curve3 {
    let [low, high] = curve.domain();
    let [a, b] = [curve.point(low), curve.point(high)];
    let size = curve.points().iter().map(|p| (p - a).norm()).fold(0.0, f64::max);
    let near = |p: &Vec3, q: &Vec3| (p - q).norm() <= 1e-3 * size;
    if near(&a, &ends[0]) && near(&b, &ends[1]) {
        return curve;
    }
    if near(&a, &ends[1]) && near(&b, &ends[0]) {
        return curve.reversed();
    }
    let (s, t) = (foot(&curve, &ends[0]), foot(&curve, &ends[1]));
    let fits = near(&curve.point(s), &ends[0]) && near(&curve.point(t), &ends[1]);
    let piece = if fits { curve.trimmed(s.min(t), s.max(t)).ok() } else { None };
    match piece {
        Some(piece) if s < t => piece,
        Some(piece) => piece.reversed(),
        None => curve,
    }
}

/// Parameter of a point on a curve: the nearest of eight samples per span, then ternary search. Intended for vertices
/// that lie on the curve.
fn foot(curve: &Curve3, p: &Vec3) -> f64 {
    let [low, high] = curve.domain();
    let count = 8 * curve.points().len().clamp(2, 1000);
    #[allow(clippy::cast_precision_loss)]
    let at = |i: usize| low + (high - low) * (i.min(count) as f64 / count as f64);
    let off = |t: f64| (curve.point(t) - p).norm_squared();
    let best = (0..=count).min_by(|a, b| off(at(*a)).total_cmp(&off(at(*b)))).unwrap_or(0);
    let (mut a, mut b) = (at(best.saturating_sub(1)), at(best + 1));
    for _ in 0..80 {
        let (c, d) = (a + (b - a) / 3.0, b - (b - a) / 3.0);
        if off(c) < off(d) {
            b = d;
        } else {
            a = c;
        }
    }
    f64::midpoint(a, b)
}
