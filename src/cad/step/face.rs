//! Faces and their loops, with all orientation flags applied.

use std::rc::Rc;

use super::entity::{Entity, Outcome};
use super::resolver::{EdgeGeometry, REFERENCE_DEPTH_MAX, Resolver, Units};
use super::surface::Supported;
use crate::raw::{RawEdge, RawFace, RawLoop, RawSurface};
use kanagata_geometry::frame::unit;
use kanagata_geometry::nurbs::{Curve2, Curve3};
use kanagata_geometry::{Aabb, Frame, Vec2, Vec3};

/// A loop before its surface is known, in the direction of its bound.
struct Bound {
    outer: Option<bool>,
    shape: Shape,
}

enum Shape {
    /// Edge, its number, and whether it is traversed in reverse.
    Edges(Vec<(Rc<EdgeGeometry>, usize, bool)>),
    /// Corner points, each with the number of the edge to the next one.
    Polygon(Vec<(Vec3, usize)>),
    Vertex(Vec3),
}

impl<'t> Resolver<'t> {
    /// A face of any type. `oriented` is false when its container reverses it.
    pub fn face(&self, e: Entity<'t>, units: Units, oriented: bool) -> Outcome<RawFace> {
        let (mut e, mut oriented) = (e, oriented);
        let mut depth = 0;
        while matches!(e.kind(), "ORIENTED_FACE" | "SUBFACE") {
            self.charge(e, depth, 0)?;
            let a = e.attributes();
            // ORIENTED_FACE(name, *, element, orientation); SUBFACE(name, bounds, parent)
            oriented ^= e.kind() == "ORIENTED_FACE" && !a.flag(3)?;
            e = a.entity(2)?;
            depth += 1;
        }
        self.charge(e, depth, 0)?;
        let a = e.attributes();
        let bounds: Vec<Bound> =
            a.entities(1)?.into_iter().map(|b| self.bound(b, units)).collect::<Outcome<_>>()?;
        let (on, sense) = match e.kind() {
            "ADVANCED_FACE" | "FACE_SURFACE" => {
                let near = box_around(&bounds);
                (self.surface(a.entity(2)?, units, &near, 1)?, a.flag(3)?)
            }
            "FACE" => (polygon_plane(e, &bounds)?, true),
            kind => {
                return Err(e.fault(format!("a {kind} as a face"), "ADVANCED_FACE, FACE_SURFACE"));
            }
        };
        let flipped = !(sense ^ on.turned);
        let mut loops: Vec<RawLoop> =
            bounds.into_iter().map(|b| self.raw_loop(b, &on, flipped, units)).collect();
        loops.retain(|l| l.vertex.is_some() || !l.edges.is_empty());
        if !oriented {
            loops.iter_mut().for_each(RawLoop::reverse);
        }
        let flipped = flipped ^ !oriented;
        let attributes = self.attributes_of_face(e);
        let (surface, source) = (on.surface, e.place());
        Ok(RawFace { surface, loops, flipped, source, shell: None, attributes })
    }

    /// `FACE_BOUND(name, loop, orientation)`.
    fn bound(&self, e: Entity<'t>, units: Units) -> Outcome<Bound> {
        let outer = match e.kind() {
            "FACE_OUTER_BOUND" => Some(true),
            "FACE_BOUND" => None,
            kind => return Err(e.fault(format!("a {kind} as a bound"), "FACE_BOUND")),
        };
        let a = e.attributes();
        let (inner, forwards) = (a.entity(1)?, a.flag(2)?);
        let b = inner.attributes();
        let shape = match inner.kind() {
            "VERTEX_LOOP" => Shape::Vertex(self.vertex(b.entity(1)?, units)?),
            "EDGE_LOOP" => {
                let mut edges = b
                    .entities(1)?
                    .into_iter()
                    .map(|o| self.oriented_edge(o, units))
                    .collect::<Outcome<Vec<_>>>()?;
                if !forwards {
                    edges.reverse();
                    edges.iter_mut().for_each(|edge| edge.2 = !edge.2);
                }
                Shape::Edges(edges)
            }
            "POLY_LOOP" => Shape::Polygon(self.polygon(inner, units, forwards)?),
            kind => {
                return Err(
                    inner.fault(format!("a {kind} as a loop"), "EDGE_LOOP, VERTEX_LOOP, POLY_LOOP")
                );
            }
        };
        Ok(Bound { outer, shape })
    }

    /// `ORIENTED_EDGE(name, *, *, edge, orientation)`, possibly nested.
    fn oriented_edge(
        &self,
        e: Entity<'t>,
        units: Units,
    ) -> Outcome<(Rc<EdgeGeometry>, usize, bool)> {
        let (mut e, mut reversed) = (e, false);
        for depth in 0..=REFERENCE_DEPTH_MAX + 1 {
            self.charge(e, depth, 0)?;
            if e.kind() != "ORIENTED_EDGE" {
                break;
            }
            let a = e.attributes();
            reversed ^= !a.flag(4)?;
            e = a.entity(3)?;
        }
        Ok((self.edge_curve(e, units)?, e.index as usize, reversed))
    }

    /// `POLY_LOOP(name, points)`; edges are numbered by the pair of points they connect.
    fn polygon(&self, e: Entity<'t>, units: Units, forwards: bool) -> Outcome<Vec<(Vec3, usize)>> {
        let mut corners = e.attributes().entities(1)?;
        self.charge(e, 0, corners.len())?;
        if !forwards {
            corners.reverse();
        }
        if corners.len() < 3 {
            return Err(e.fault(format!("{} corners", corners.len()), "at least 3"));
        }
        let mut numbers = self.poly_edges.borrow_mut();
        let next = corners.iter().cycle().skip(1);
        let pairs = corners.iter().zip(next);
        pairs
            .map(|(a, b)| {
                let key = [a.index.min(b.index), a.index.max(b.index)];
                let fresh = self.table.len() + numbers.len();
                Ok((self.point(*a, units)?, *numbers.entry(key).or_insert(fresh)))
            })
            .collect()
    }

    fn raw_loop(&self, bound: Bound, on: &Supported, flipped: bool, units: Units) -> RawLoop {
        let outer = bound.outer;
        let edges = match bound.shape {
            Shape::Vertex(p) => return RawLoop { outer, vertex: Some(p), edges: vec![] },
            Shape::Polygon(corners) => polygon_edges(&corners),
            Shape::Edges(edges) => {
                let uses = edges.iter().map(|(edge, id, reversed)| {
                    let (mut raw, pcurves) = self.edge_use(edge, *reversed, on, units);
                    raw.edge_id = Some(*id);
                    (raw, pcurves)
                });
                choose_on_seams(uses.collect(), flipped)
            }
        };
        RawLoop { outer, edges, vertex: None }
    }
}

/// Selects one of the two parameter curves of a seam: the one adjacent to its neighbours in the loop, otherwise the one
/// with the face on its left (`flipped`: right).
fn choose_on_seams(uses: Vec<(RawEdge, Vec<Curve2>)>, flipped: bool) -> Vec<RawEdge> {
    let n = uses.len();
    let start = |c: &Curve2| c.point(c.domain()[0]);
    let end = |c: &Curve2| c.point(c.domain()[1]);
    let certain = |k: usize| match uses[k % n].1.as_slice() {
        [only] => Some(only),
        _ => None,
    };
    let mut chosen: Vec<Option<Curve2>> = Vec::with_capacity(n);
    for (k, (_, pcurves)) in uses.iter().enumerate() {
        let [first, second] = pcurves.as_slice() else {
            chosen.push(pcurves.first().cloned());
            continue;
        };
        let before =
            k.checked_sub(1).and_then(|j| chosen[j].as_ref()).or_else(|| certain(k + n - 1));
        let gap = |c: &Curve2| {
            let before = before.map(|b| (end(b) - start(c)).norm());
            before.or_else(|| certain(k + 1).map(|a| (start(a) - end(c)).norm()))
        };
        let take_first = match (gap(first), gap(second)) {
            (Some(a), Some(b)) if (a - b).abs() > 1e-6 => a < b,
            _ => {
                let along = end(first) - start(first);
                let left = Vec2::new(-along.y, along.x);
                ((start(second) - start(first)).dot(&left) > 0.0) != flipped
            }
        };
        chosen.push(Some(if take_first { first.clone() } else { second.clone() }));
    }
    let edges = uses.into_iter().zip(chosen);
    let edges = edges.map(|((edge, _), pcurve)| RawEdge { pcurve, ..edge });
    edges.filter(|edge| edge.curve.is_some() || edge.pcurve.is_some()).collect()
}

fn polygon_edges(corners: &[(Vec3, usize)]) -> Vec<RawEdge> {
    let next = corners.iter().cycle().skip(1);
    let sides = corners.iter().zip(next).filter(|(a, b)| a.0 != b.0);
    sides
        .map(|((a, id), (b, _))| RawEdge {
            curve: Some(Curve3::line(*a, *b)),
            edge_id: Some(*id),
            ends: Some([*a, *b]),
            ..RawEdge::default()
        })
        .collect()
}

/// The plane of a face without a surface, from its corners (Newell's method).
fn polygon_plane(e: Entity, bounds: &[Bound]) -> Outcome<Supported> {
    let outer = bounds.iter().find_map(|b| match &b.shape {
        Shape::Polygon(corners) => Some(corners),
        _ => None,
    });
    let corners = outer.ok_or_else(|| e.fault("a face without a surface", "POLY_LOOP bounds"))?;
    let origin = corners.first().map_or(Vec3::zeros(), |c| c.0);
    let next = corners.iter().cycle().skip(1);
    let normal: Vec3 =
        corners.iter().zip(next).map(|(a, b)| (a.0 - origin).cross(&(b.0 - origin))).sum();
    let x = corners.iter().find_map(|c| unit(c.0 - origin)).unwrap_or_else(Vec3::x);
    let frame = Frame::from_z_x(origin, normal, x)
        .ok_or_else(|| e.fault("corners in one line", "a polygon with an area"))?;
    let surface = RawSurface::Plane(frame);
    Ok(Supported { surface, turned: false, scales: None, entity: e.index })
}

fn box_around(bounds: &[Bound]) -> Aabb {
    let mut out = Aabb::EMPTY;
    for bound in bounds {
        match &bound.shape {
            Shape::Vertex(p) => out.grow(p),
            Shape::Polygon(corners) => corners.iter().for_each(|c| out.grow(&c.0)),
            Shape::Edges(edges) => {
                for (edge, ..) in edges {
                    edge.ends.iter().for_each(|p| out.grow(p));
                    edge.curve.iter().flat_map(Curve3::points).for_each(|p| out.grow(p));
                }
            }
        }
    }
    out
}
