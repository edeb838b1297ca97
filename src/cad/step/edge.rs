//! Edges: the segment of a curve between two vertices, and its parameter curves on a face's surface.

use std::rc::Rc;

use super::entity::{Entity, Outcome};
use super::form::{Form, extent};
use super::resolver::{EdgeGeometry, Resolver, Units};
use super::surface::Supported;
use crate::iges::uv::point_on;
use crate::raw::RawEdge;
use kanagata_geometry::nurbs::{Curve2, Curve3};
use kanagata_geometry::{Vec2, Vec3};

impl<'t> Resolver<'t> {
    /// `EDGE_CURVE(name, start, end, geometry, same_sense)`.
    pub fn edge_curve(&self, e: Entity<'t>, units: Units) -> Outcome<Rc<EdgeGeometry>> {
        let key = (e.index, units.length.to_bits());
        if let Some(edge) = self.edges.borrow().get(&key) {
            return Ok(Rc::clone(edge));
        }
        self.charge(e, 0, 0)?;
        if e.kind() != "EDGE_CURVE" {
            return Err(e.fault(format!("a {} as an edge", e.kind()), "EDGE_CURVE"));
        }
        let a = e.attributes();
        let (start, end) = (a.entity(1)?, a.entity(2)?);
        let ends = [self.vertex(start, units)?, self.vertex(end, units)?];
        let geometry = a.entity(3)?;
        let same_sense = a.flag(4)?;
        let form = self.curve(geometry, units, 1)?;
        let [from, to] = if same_sense { ends } else { [ends[1], ends[0]] };
        let cut = cut_between(&form, from, to, start.index == end.index);
        let (curve, range) = match cut {
            Some((curve, range)) => (Some(curve), range),
            None if (from - to).norm() <= 1e-6 * (1.0 + from.norm()) => (None, None),
            None => {
                return Err(
                    e.fault("no piece of the curve between its vertices", "vertices on the curve")
                );
            }
        };
        let curve = curve.map(|c| if same_sense { c } else { c.reversed() });
        self.charge(e, 0, curve.as_ref().map_or(0, |c| c.points().len()))?;
        let edge = EdgeGeometry { curve, ends, geometry: geometry.index, range, same_sense };
        let edge = Rc::new(edge);
        self.edges.borrow_mut().insert(key, Rc::clone(&edge));
        Ok(edge)
    }

    /// `VERTEX_POINT(name, point)`.
    pub fn vertex(&self, e: Entity, units: Units) -> Outcome<Vec3> {
        if e.kind() != "VERTEX_POINT" {
            return Err(e.fault(format!("a {} as a vertex", e.kind()), "VERTEX_POINT"));
        }
        self.point(e.attributes().entity(1)?, units)
    }

    /// One use of an edge in a loop, with its parameter curves in the file (two on a seam).
    pub fn edge_use(
        &self,
        edge: &EdgeGeometry,
        reversed: bool,
        on: &Supported,
        units: Units,
    ) -> (RawEdge, Vec<Curve2>) {
        let turn = |c: &Curve3| if reversed { c.reversed() } else { c.clone() };
        let curve = edge.curve.as_ref().map(turn);
        let ends = if reversed { [edge.ends[1], edge.ends[0]] } else { edge.ends };
        let mut pcurves = vec![];
        for candidate in self.pcurve_entities(self.entity(edge.geometry), on.entity) {
            // Unreadable parameter curves are replaced by projection later.
            if let Ok(Some(p)) = self.pcurve(candidate, edge, on, units) {
                pcurves.push(if reversed { p.reversed() } else { p });
            }
        }
        (RawEdge { curve, ends: Some(ends), ..RawEdge::default() }, pcurves)
    }

    /// Parameter curves of a surface curve on the surface `on`.
    fn pcurve_entities(&self, e: Entity<'t>, on: u32) -> Vec<Entity<'t>> {
        let listed = match e.kind() {
            "SURFACE_CURVE" | "SEAM_CURVE" | "INTERSECTION_CURVE" => {
                e.attributes().entities(2).unwrap_or_default()
            }
            "PCURVE" => vec![e],
            _ => vec![],
        };
        let here = |p: &Entity| {
            p.kind() == "PCURVE" && p.attributes().entity(1).is_ok_and(|s| s.index == on)
        };
        listed.into_iter().filter(here).take(2).collect()
    }

    /// `PCURVE(name, surface, definitional representation)` trimmed to the edge, in its direction.
    fn pcurve(
        &self,
        e: Entity,
        edge: &EdgeGeometry,
        on: &Supported,
        units: Units,
    ) -> Outcome<Option<Curve2>> {
        let Some(scales) = on.scales else { return Ok(None) };
        let form = self.flat_curve(e, units)?;
        let mut tries: Vec<Option<Curve3>> = vec![];
        if let Some([from, to]) = edge.range {
            tries.push(form.cut(from, to));
        }
        if let Form::Free(curve) = &form {
            tries.push(Some(curve.clone()));
        }
        for flat in tries.into_iter().flatten() {
            self.charge(e, 0, flat.points().len())?;
            let Some(pcurve) = flattened(&flat, scales) else { continue };
            let pcurve = if edge.same_sense { pcurve } else { pcurve.reversed() };
            if lies_on(&pcurve, edge, on) {
                return Ok(Some(pcurve));
            }
        }
        Ok(None)
    }

    /// The curve in the parameter plane of a `PCURVE`, in the file's units (angles of conics in rad).
    pub fn flat_curve(&self, e: Entity, units: Units) -> Outcome<Form> {
        let representation = e.attributes().entity(2)?;
        let items = representation.attributes().entities(1)?;
        let [item] = items.as_slice() else {
            let found = format!("{} items in a parameter curve", items.len());
            return Err(representation.fault(found, "one curve"));
        };
        self.curve(*item, Units { length: 1.0, angle: units.angle }, 1)
    }
}

/// The planar curve with its parameters scaled to mm and rad.
#[must_use]
pub fn flattened(flat: &Curve3, [su, sv]: [f64; 2]) -> Option<Curve2> {
    let points = flat.points().iter().map(|p| Vec2::new(p.x * su, p.y * sv)).collect();
    Curve2::try_new(flat.degree(), flat.knots().to_vec(), points, Some(flat.weights().to_vec()))
        .ok()
}

/// True when the image of the parameter curve matches the edge at start, interior and end. The parametrisations may
/// differ, so that interior points only need to agree in direction.
fn lies_on(pcurve: &Curve2, edge: &EdgeGeometry, on: &Supported) -> bool {
    let Some(curve) = &edge.curve else { return true };
    let size = extent(curve);
    let near = |fraction: f64, tolerance: f64| {
        let at = |[a, b]: [f64; 2]| a + (b - a) * fraction;
        let c = curve.point(at(curve.domain()));
        match point_on(&on.surface, pcurve.point(at(pcurve.domain()))) {
            Some(s) => (s - c).norm() <= tolerance,
            None => true,
        }
    };
    let close = 1e-3 * size + 1e-6;
    near(0.0, close) && near(1.0, close) && near(0.25, 0.5 * size) && near(0.5, 0.5 * size)
}

/// The segment of a curve between two points in its direction, and its parameters.
fn cut_between(
    form: &Form,
    from: Vec3,
    to: Vec3,
    same_vertex: bool,
) -> Option<(Curve3, Option<[f64; 2]>)> {
    match form {
        Form::Free(curve) => free_between(form, curve, from, to, same_vertex),
        Form::Ellipse(_, rx, ry) => {
            let (t0, mut t1) = (form.parameter(&from), form.parameter(&to));
            let full = same_vertex || (from - to).norm() <= 1e-9 * rx.max(*ry);
            if full {
                t1 = t0;
            }
            while t1 <= t0 {
                t1 += std::f64::consts::TAU;
            }
            Some((form.cut(t0, t1)?, Some([t0, t1])))
        }
        _ => {
            let (t0, t1) = (form.parameter(&from), form.parameter(&to));
            if t0 < t1 {
                return Some((form.cut(t0, t1)?, Some([t0, t1])));
            }
            Some((form.cut(t1, t0)?.reversed(), None))
        }
    }
}

fn free_between(
    form: &Form,
    curve: &Curve3,
    from: Vec3,
    to: Vec3,
    same_vertex: bool,
) -> Option<(Curve3, Option<[f64; 2]>)> {
    let [low, high] = curve.domain();
    let tolerance = 1e-7 * extent(curve);
    let at_low = |p: &Vec3| (curve.point(low) - p).norm() <= tolerance;
    let at_high = |p: &Vec3| (curve.point(high) - p).norm() <= tolerance;
    let tiny = 1e-9 * (high - low);
    let parameter = |p: &Vec3| {
        let t = form.parameter(p);
        if t < low + tiny {
            low
        } else if t > high - tiny {
            high
        } else {
            t
        }
    };
    let t0 = if at_low(&from) { low } else { parameter(&from) };
    let t1 = if at_high(&to) { high } else { parameter(&to) };
    let closed = form.closed();
    let t0 = if closed && t0 == high { low } else { t0 };
    let t1 = if closed && t1 == low { high } else { t1 };
    if t0 < t1 && !(same_vertex && t0 > low) {
        return Some((form.cut(t0, t1)?, Some([t0, t1])));
    }
    if closed && same_vertex {
        // A full turn that starts inside the domain.
        return Some((form.cut_wrapped(t0, t0)?, None));
    }
    Some((form.cut_wrapped(t0, t1)?, None))
}
