//! Trimmed surfaces: 141 boundary, 142 curve on a surface, 143 bounded surface, 144 trimmed surface.

use super::edges::{EdgeDraft, fit_parameter_map, paired};
use super::file::{Fault, PIECE_COST};
use super::offset::use_side_of_edges;
use super::reader::{Reader, mirrors};
use super::surface::BasisSurface;
use crate::raw::{RawEdge, RawFace, RawLoop};
use kanagata_geometry::nurbs::{Curve2, Curve3};
use kanagata_geometry::{Affine, Vec2};

impl Reader<'_, '_> {
    /// Trimmed surface (144): surface DE, N1 (0: the outer boundary is that of the domain), N2, outer boundary DE, N2
    /// inner boundaries.
    pub(super) fn trimmed_surface(&self, entity: usize, map: &Affine) -> Result<RawFace, Fault> {
        let mut p = self.file.params(entity)?;
        let surface = p.pointer("surface")?;
        let outer_given = p.flag("N1", true)?;
        let count = p.count("N2", 1)?;
        let outer = p.pointer_or_none("outer boundary")?.filter(|_| outer_given);
        let mut boundaries: Vec<(usize, Option<bool>)> =
            outer.map(|o| (o, Some(true))).into_iter().collect();
        for _ in 0..count {
            if let Some(inner) = p.pointer_or_none("inner boundary")? {
                boundaries.push((inner, Some(false)));
            }
        }
        self.face(entity, surface, map, &boundaries, outer.is_none())
    }

    /// Bounded surface (143): TYPE, surface DE, N, boundaries.
    pub(super) fn bounded_surface(&self, entity: usize, map: &Affine) -> Result<RawFace, Fault> {
        let mut p = self.file.params(entity)?;
        p.integer_or("TYPE", 0)?;
        let surface = p.pointer("surface")?;
        let count = p.count("number of boundaries", 1)?;
        let boundaries = (0..count)
            .map(|_| Ok((p.pointer("boundary")?, None)))
            .collect::<Result<Vec<_>, Fault>>()?;
        self.face(entity, surface, map, &boundaries, count == 0)
    }

    /// A face on `surface` with these boundaries; with `to_domain` the outer boundary is that of the surface's domain.
    fn face(
        &self,
        entity: usize,
        surface: usize,
        map: &Affine,
        boundaries: &[(usize, Option<bool>)],
        to_domain: bool,
    ) -> Result<RawFace, Fault> {
        let placed = self.placed(entity, map)?;
        let basis = self.surface(surface, &placed, to_domain)?;
        let mut loops = Vec::with_capacity(boundaries.len() + 1);
        for (boundary, _) in boundaries {
            loops.push(self.boundary(*boundary, &placed, &basis)?);
        }
        let outer: Vec<Option<bool>> = boundaries.iter().map(|b| b.1).collect();
        self.raw_face(entity, basis, loops, &outer, to_domain, mirrors(&placed))
    }

    /// Assembles a face. `turn`: its outward normal is opposite to that of surface and map.
    pub(super) fn raw_face(
        &self,
        entity: usize,
        mut basis: BasisSurface,
        mut loops: Vec<Vec<EdgeDraft>>,
        outer: &[Option<bool>],
        to_domain: bool,
        turn: bool,
    ) -> Result<RawFace, Fault> {
        self.file.charge(entity, PIECE_COST)?;
        self.make_consistent(entity, &mut basis, &mut loops);
        let drafts = loops.into_iter().zip(outer.iter().chain(std::iter::repeat(&None)));
        let mut out: Vec<RawLoop> = drafts.map(|(one, outer)| raw_loop(one, *outer)).collect();
        self.check_curves(entity, &out)?;
        if turn {
            // In the file a loop runs about the normal of the surface (508), whatever the shell (514) makes of the face.
            // The loops of a raw face run about its outward normal.
            out.iter_mut().for_each(RawLoop::reverse);
        }
        if to_domain && (!out.is_empty() || basis.narrowed) {
            let Some(domain) = basis.domain else {
                let found = "an unbounded surface without an outer boundary";
                let allowed = "an outer boundary (N1 = 1)";
                return Err(self.file.fault(entity, "boundary-missing", found, allowed));
            };
            out.insert(0, domain_loop(domain));
        }
        let entry = self.file.entry(entity);
        Ok(RawFace {
            flipped: basis.reversed() != turn,
            surface: basis.surface,
            loops: out,
            source: format!("D{} ({})", entry.pointer, entry.kind),
            shell: None,
            attributes: self.attributes_of(entity),
        })
    }

    /// Rejects loops without edges or vertex, and edges without a curve.
    fn check_curves(&self, entity: usize, loops: &[RawLoop]) -> Result<(), Fault> {
        let bare =
            loops.iter().flat_map(|l| &l.edges).any(|e| e.curve.is_none() && e.pcurve.is_none());
        if bare || loops.iter().any(|l| l.edges.is_empty() && l.vertex.is_none()) {
            return Err(self.file.fault(
                entity,
                "boundary-empty",
                "a boundary edge with no curve that can be used",
                "a curve in space, or one in the parameters of a surface that has them",
            ));
        }
        Ok(())
    }

    /// Makes a surface and the curves of its edges consistent, with a note where one of them deviates from the file.
    fn make_consistent(
        &self,
        entity: usize,
        basis: &mut BasisSurface,
        loops: &mut [Vec<EdgeDraft>],
    ) {
        let other_side = use_side_of_edges(&mut basis.surface, loops);
        let fitted = fit_parameter_map(basis, loops);
        let notes = [
            (
                other_side,
                "offset-other-side",
                "the space curves of its edges lie on the other side of the base than its offset indicator (140) states; the side of the curves is used",
            ),
            (
                fitted.map > 0,
                "parameters-other",
                "its parameter curves do not use the standard parametrisation of their surface; the best-fitting one is used",
            ),
            (
                fitted.dropped > 0,
                "parameter-curve-off",
                "parameter curves far from their space curves were discarded",
            ),
        ];
        for (_, code, text) in notes.into_iter().filter(|note| note.0) {
            self.file.note(entity, code, text);
        }
    }

    /// The edges of a boundary: 142, 141, or a bare curve.
    fn boundary(
        &self,
        entity: usize,
        map: &Affine,
        basis: &BasisSurface,
    ) -> Result<Vec<EdgeDraft>, Fault> {
        let placed = self.placed(entity, map)?;
        match self.file.entry(entity).kind {
            142 => self.curve_on_surface(entity, &placed, basis),
            141 => self.boundary_141(entity, &placed, basis),
            _ => Ok(paired(self.space(entity, map)?, Vec::new(), false)),
        }
    }

    /// Curve on a surface (142): CRTN, surface DE, parameter curve DE, space curve DE, PREF (1 parameter, 2 space, 3
    /// equal).
    fn curve_on_surface(
        &self,
        entity: usize,
        map: &Affine,
        basis: &BasisSurface,
    ) -> Result<Vec<EdgeDraft>, Fault> {
        let mut p = self.file.params(entity)?;
        p.integer_or("CRTN", 0)?;
        p.pointer_or_none("surface")?;
        let flat = p.pointer_or_none("parameter curve")?.filter(|_| !basis.maps.is_empty());
        let space = p.pointer_or_none("space curve")?;
        let prefer_pcurve = p.integer_or("PREF", 0)? == 1;
        let pcurves = flat.map_or(Ok(Vec::new()), |c| self.flat_pieces(c));
        let curves = space.map_or(Ok(Vec::new()), |c| self.space(c, map));
        let (curves, pcurves) = match (curves, pcurves) {
            (Err(fault), Ok(pcurves)) if !pcurves.is_empty() => {
                self.file.skip(entity, &fault);
                (Vec::new(), pcurves)
            }
            (Ok(curves), Err(fault)) if !curves.is_empty() => {
                self.file.skip(entity, &fault);
                (curves, Vec::new())
            }
            (curves, pcurves) => (curves?, pcurves?),
        };
        Ok(paired(curves, pcurves, prefer_pcurve))
    }

    /// Boundary (141): TYPE, PREF, surface DE, N, then for each curve: DE, SENSE (2: reversed), K, K parameter curves.
    fn boundary_141(
        &self,
        entity: usize,
        map: &Affine,
        basis: &BasisSurface,
    ) -> Result<Vec<EdgeDraft>, Fault> {
        let mut p = self.file.params(entity)?;
        p.integer_or("TYPE", 0)?;
        let prefer_pcurve = p.integer_or("PREF", 0)? == 1;
        p.pointer_or_none("surface")?;
        let count = p.count("number of curves", 3)?;
        let mut drafts = Vec::new();
        for _ in 0..count {
            let curve = p.pointer_or_none("curve")?;
            let against = p.integer_or("SENSE", 1)? == 2;
            let flats = p.count("number of parameter curves", 1)?;
            let flats = (0..flats)
                .map(|_| p.pointer("parameter curve"))
                .collect::<Result<Vec<_>, Fault>>()?;
            let mut curves = curve.map_or(Ok(Vec::new()), |c| self.space(c, map))?;
            if against {
                curves.reverse();
                curves.iter_mut().for_each(|c| *c = c.reversed());
            }
            let mut pcurves: Vec<Curve2> = Vec::new();
            for flat in flats.into_iter().filter(|_| !basis.maps.is_empty()) {
                pcurves.extend(self.flat_pieces(flat)?);
            }
            if curves.len() == 1 && pcurves.len() > 1 {
                pcurves = self.joined_flat(entity, &pcurves)?.into_iter().collect();
            }
            let mut edges = paired(curves, pcurves, prefer_pcurve);
            edges.iter_mut().for_each(|d| d.curve_directs = d.edge.curve.is_some());
            drafts.extend(edges);
        }
        Ok(drafts)
    }

    /// Space curves of a boundary, one per edge.
    fn space(&self, entity: usize, map: &Affine) -> Result<Vec<Curve3>, Fault> {
        Ok(self.pieces(entity, map)?.into_iter().map(|p| p.curve).collect())
    }

    /// Parameter curves joined into one.
    pub(super) fn joined_flat(
        &self,
        entity: usize,
        pieces: &[Curve2],
    ) -> Result<Option<Curve2>, Fault> {
        if let [] | [_] = pieces {
            return Ok(pieces.first().cloned());
        }
        let lift = |c: &Curve2| {
            let points = c.points().iter().map(|p| p.push(0.0)).collect();
            Curve3::try_new(c.degree(), c.knots().to_vec(), points, Some(c.weights().to_vec()))
        };
        let joined = pieces
            .iter()
            .map(lift)
            .collect::<Result<Vec<_>, _>>()
            .and_then(|lifted| super::curves::flat(&super::join::join(&lifted)?));
        joined.map(Some).map_err(|e| self.nurbs_fault(entity, &e))
    }
}

/// A loop of edges; a single edge with ends but without curves is a pole.
fn raw_loop(drafts: Vec<EdgeDraft>, outer: Option<bool>) -> RawLoop {
    let mut edges: Vec<RawEdge> = drafts.into_iter().map(|d| d.edge).collect();
    let bare = |e: &RawEdge| e.curve.is_none() && e.pcurve.is_none();
    let vertex = match edges.as_slice() {
        [only] if bare(only) => only.ends.map(|e| e[0]),
        _ => None,
    };
    edges.retain(|e| !(bare(e) && e.ends.is_some()));
    RawLoop { outer, edges, vertex }
}

/// Boundary of a parameter rectangle, counter-clockwise.
fn domain_loop([[u0, u1], [v0, v1]]: [[f64; 2]; 2]) -> RawLoop {
    let corners = [Vec2::new(u0, v0), Vec2::new(u1, v0), Vec2::new(u1, v1), Vec2::new(u0, v1)];
    let edges = (0..4)
        .map(|i| RawEdge {
            pcurve: Some(Curve2::line(corners[i], corners[(i + 1) % 4])),
            prefer_pcurve: true,
            ..RawEdge::default()
        })
        .collect();
    RawLoop { outer: Some(true), edges, vertex: None }
}
