//! Surfaces that are faces by themselves: bounded by curves, by trimming parameters, or by their domain.

use super::edge::flattened;
use super::entity::{Entity, Outcome};
use super::form::extent;
use super::resolver::{Resolver, Units};
use super::surface::Supported;
use crate::Severity;
use crate::iges::uv::point_on;
use crate::raw::{RawEdge, RawFace, RawLoop, RawSurface};
use kanagata_geometry::nurbs::{Curve2, Curve3};
use kanagata_geometry::{Aabb, Vec2, Vec3};

/// A curve of a boundary.
struct Member<'t> {
    curve: Entity<'t>,
    /// The boundary has the direction of the curve.
    sense: bool,
    /// Space curve; `None` for a parameter curve.
    space: Option<Curve3>,
}

impl<'t> Resolver<'t> {
    /// A surface that is a face by itself: bounded by its own curves, its trimming parameters, or its domain.
    pub fn surface_face(&self, e: Entity<'t>, units: Units) -> Outcome<RawFace> {
        let a = e.attributes();
        let (on, loops) = match e.kind() {
            "CURVE_BOUNDED_SURFACE" => self.curve_bounded(e, units)?,
            "RECTANGULAR_TRIMMED_SURFACE" => {
                let on = self.surface(e, units, &Aabb::EMPTY, 0)?;
                let sides = [a.real(2)?, a.real(3)?, a.real(4)?, a.real(5)?];
                let outline = rectangle(&on.surface, sides, on.scales);
                let outline = outline.ok_or_else(|| {
                    e.fault("trimming parameters that leave no surface", "a range")
                })?;
                (on, vec![outline])
            }
            _ => (self.surface(e, units, &Aabb::EMPTY, 0)?, vec![]),
        };
        let whole = matches!(
            on.surface,
            RawSurface::Plane(_) | RawSurface::Cylinder { .. } | RawSurface::Cone { .. }
        );
        if loops.is_empty() && whole {
            return Err(e.fault("an unbounded surface as a face", "a surface with bounds"));
        }
        let flipped = on.turned;
        let attributes = self.attributes_of_face(e);
        let (surface, source) = (on.surface, e.place());
        Ok(RawFace { surface, loops, flipped, source, shell: None, attributes })
    }

    /// `CURVE_BOUNDED_SURFACE(name, basis, boundaries, implicit outer)`.
    fn curve_bounded(&self, e: Entity<'t>, units: Units) -> Outcome<(Supported, Vec<RawLoop>)> {
        let a = e.attributes();
        let basis = a.entity(1)?;
        let mut boundaries = vec![];
        let mut near = Aabb::EMPTY;
        for boundary in a.entities(2)? {
            let members = self.boundary_members(boundary, units)?;
            for curve in members.iter().filter_map(|m| m.space.as_ref()) {
                near = near.union(&Aabb::of_points(curve.points()));
            }
            boundaries.push((boundary, members));
        }
        let on = self.surface(basis, units, &near, 1)?;
        let mut loops = vec![];
        for (boundary, members) in boundaries {
            loops.push(self.boundary_loop(boundary, members, &on, units)?);
        }
        Ok((Supported { entity: e.index, ..on }, loops))
    }

    /// Reads the members of a boundary; space curves in mm.
    fn boundary_members(&self, boundary: Entity<'t>, units: Units) -> Outcome<Vec<Member<'t>>> {
        let mut members = vec![];
        for (curve, sense) in self.members(boundary)? {
            let space = if curve.kind() == "PCURVE" {
                None
            } else {
                let whole = self.curve(curve, units, 1)?.whole();
                Some(whole.ok_or_else(|| curve.fault("an unbounded segment", "bounded curves"))?)
            };
            members.push(Member { curve, sense, space });
        }
        Ok(members)
    }

    /// Reads a boundary loop of a face on the surface `on`.
    fn boundary_loop(
        &self,
        boundary: Entity<'t>,
        members: Vec<Member<'t>>,
        on: &Supported,
        units: Units,
    ) -> Outcome<RawLoop> {
        let mut edges = vec![];
        for Member { curve, sense, space } in members {
            let pcurve = self.member_pcurve(curve, on, units);
            // As for edge loops, the direction of the boundary defines the side on which the face lies.
            let edge_id = Some(curve.index as usize);
            let mut edge = RawEdge { curve: space, pcurve, edge_id, ..RawEdge::default() };
            if edge.curve.is_none() && edge.pcurve.is_none() {
                return Err(curve.fault("a boundary curve on another surface", "one on the basis"));
            }
            if !sense {
                edge.reverse();
            }
            edges.push(edge);
        }
        if let Some(turned @ 1..) = chain(&mut edges) {
            let text = format!("{turned} segments opposite to their neighbours: reversed");
            self.note(Severity::Note, "segment-turned", boundary.place(), text);
        }
        edges.iter_mut().for_each(|edge| align(edge, on));
        let outer = boundary.has("OUTER_BOUNDARY_CURVE").then_some(true);
        Ok(RawLoop { outer, edges, vertex: None })
    }

    fn member_pcurve(&self, curve: Entity<'t>, on: &Supported, units: Units) -> Option<Curve2> {
        let scales = on.scales?;
        let listed = match curve.kind() {
            "PCURVE" => vec![curve],
            _ => curve.attributes().entities(2).ok()?,
        };
        let mut here = listed.into_iter().filter(|p| {
            p.kind() == "PCURVE" && p.attributes().entity(1).is_ok_and(|s| s.index == on.entity)
        });
        let flat = self.flat_curve(here.next()?, units).ok()?.whole()?;
        self.charge(curve, 0, flat.points().len()).ok()?;
        flattened(&flat, scales)
    }
}

/// Reverses segments that connect to their neighbours only in reverse; returns their number if all have a space curve.
fn chain(edges: &mut [RawEdge]) -> Option<usize> {
    let ends = |edge: &RawEdge| {
        let curve = edge.curve.as_ref()?;
        let [low, high] = curve.domain();
        Some([curve.point(low), curve.point(high)])
    };
    let n = edges.len();
    let mut turned = 0;
    for k in 0..n {
        let [from, to] = ends(&edges[k])?;
        let (before, after) = (ends(&edges[(k + n - 1) % n])?[1], ends(&edges[(k + 1) % n])?[0]);
        let gap = |a: Vec3, b: Vec3| (before - a).norm() + (b - after).norm();
        if n > 2 && gap(to, from) < 0.01 * gap(from, to) {
            edges[k].reverse();
            turned += 1;
        }
    }
    Some(turned)
}

/// Reverses a parameter curve opposite to its space curve; discards one at another location.
fn align(edge: &mut RawEdge, on: &Supported) {
    let (Some(curve), Some(pcurve)) = (&edge.curve, &edge.pcurve) else { return };
    let ([a, b], [c, d]) = (curve.domain(), pcurve.domain());
    let image = |t: f64| point_on(&on.surface, pcurve.point(t));
    let (Some(first), Some(last)) = (image(c), image(d)) else { return };
    let (start, end) = (curve.point(a), curve.point(b));
    let close = 1e-3 * extent(curve) + 1e-6;
    let fits = |p: Vec3, q: Vec3| (start - p).norm() <= close && (end - q).norm() <= close;
    if fits(first, last) {
        return;
    }
    edge.pcurve = fits(last, first).then(|| pcurve.reversed());
}

/// The loop `u1..u2 x v1..v2` in the file's parameters.
fn rectangle(surface: &RawSurface, sides: [f64; 4], scales: Option<[f64; 2]>) -> Option<RawLoop> {
    let [su, sv] = scales.unwrap_or([1.0, 1.0]);
    let [mut u1, mut u2, mut v1, mut v2] =
        [sides[0] * su, sides[1] * su, sides[2] * sv, sides[3] * sv];
    let round_u = !matches!(
        surface,
        RawSurface::Plane(_)
            | RawSurface::Nurbs(_)
            | RawSurface::Extrusion { .. }
            | RawSurface::Offset { .. }
    );
    if u2 <= u1 && round_u {
        u2 += std::f64::consts::TAU;
    }
    if v2 <= v1 && matches!(surface, RawSurface::Torus { .. }) {
        v2 += std::f64::consts::TAU;
    }
    if u1 > u2 {
        (u1, u2) = (u2, u1);
    }
    if v1 > v2 {
        (v1, v2) = (v2, v1);
    }
    if !(u1 < u2 && v1 < v2) {
        return None;
    }
    let corners = [Vec2::new(u1, v1), Vec2::new(u2, v1), Vec2::new(u2, v2), Vec2::new(u1, v2)];
    let edges = (0..4)
        .map(|k| RawEdge {
            pcurve: Some(Curve2::line(corners[k], corners[(k + 1) % 4])),
            prefer_pcurve: true,
            ..RawEdge::default()
        })
        .collect();
    Some(RawLoop { outer: Some(true), edges, vertex: None })
}
