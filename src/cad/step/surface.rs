//! Surfaces in their own parametrisation.

use std::f64::consts::FRAC_PI_2;

use super::curve::{degree, knots, length, spline_fault};
use super::entity::{Attributes, Entity, Outcome};
use super::form::Form;
use super::resolver::{Resolver, Units};
use crate::raw::RawSurface;
use kanagata_geometry::nurbs::{Curve3, Surface};
use kanagata_geometry::{Aabb, Affine, Vec3};

/// The surface of a face.
#[derive(Debug, Clone)]
pub struct Supported {
    /// In mm and rad.
    pub surface: RawSurface,
    /// `su x sv` is opposite to the normal of the entity.
    pub turned: bool,
    /// Factors from the file's parameters to those of `surface`; `None` for a nonlinear relation.
    pub scales: Option<[f64; 2]>,
    /// Instance index.
    pub entity: u32,
}

/// A surface, and the factors from the file's parameters to its own.
type Scaled = (RawSurface, Option<[f64; 2]>);

impl Resolver<'_> {
    /// Reads any surface. `near` bounds the part used; extrusions and revolutions of unbounded curves extend as far.
    pub fn surface(
        &self,
        e: Entity,
        units: Units,
        near: &Aabb,
        depth: usize,
    ) -> Outcome<Supported> {
        self.charge(e, depth, 0)?;
        let (surface, scales) = match e.kind() {
            "PLANE"
            | "CYLINDRICAL_SURFACE"
            | "CONICAL_SURFACE"
            | "SPHERICAL_SURFACE"
            | "TOROIDAL_SURFACE"
            | "DEGENERATE_TOROIDAL_SURFACE" => self.read_elementary(e, units)?,
            "SURFACE_OF_LINEAR_EXTRUSION" => self.read_extrusion(e, units, near, depth)?,
            "SURFACE_OF_REVOLUTION" => self.read_revolution(e, units, near, depth)?,
            "OFFSET_SURFACE" => return self.read_offset(e, units, near, depth),
            "RECTANGULAR_TRIMMED_SURFACE" => return self.read_trimmed(e, units, near, depth),
            "CURVE_BOUNDED_SURFACE" => {
                let base = self.surface(e.attributes().entity(1)?, units, near, depth + 1)?;
                return Ok(Supported { entity: e.index, ..base });
            }
            "SURFACE_REPLICA" => return self.read_replica(e, units, near, depth),
            kind if kind.contains("B_SPLINE_SURFACE")
                || matches!(
                    kind,
                    "BEZIER_SURFACE" | "UNIFORM_SURFACE" | "QUASI_UNIFORM_SURFACE"
                ) =>
            {
                (RawSurface::Nurbs(self.spline_surface(e, units, depth)?), Some([1.0, 1.0]))
            }
            kind => {
                let allowed = "a surface entity of AP203/214/242";
                return Err(e.fault(format!("a {kind} as a surface"), allowed));
            }
        };
        Ok(Supported { surface, turned: false, scales, entity: e.index })
    }

    /// Reads a plane, cylinder, cone or sphere; any other type as a torus. Radii in mm.
    fn read_elementary(&self, e: Entity, units: Units) -> Outcome<Scaled> {
        let a = e.attributes();
        let (l, r) = (units.length, units.angle);
        let frame = || self.frame(a.entity(1)?, units);
        Ok(match e.kind() {
            "PLANE" => (RawSurface::Plane(frame()?), Some([l, l])),
            "CYLINDRICAL_SURFACE" => {
                let radius = length(e, &a, 2, units)?;
                (RawSurface::Cylinder { frame: frame()?, radius }, Some([r, l]))
            }
            "CONICAL_SURFACE" => (self.cone(e, &a, units)?, Some([r, l])),
            "SPHERICAL_SURFACE" => {
                let radius = length(e, &a, 2, units)?;
                (RawSurface::Sphere { frame: frame()?, radius }, Some([r, r]))
            }
            _ => (self.torus(e, &a, units)?, Some([r, r])),
        })
    }

    /// `SURFACE_OF_LINEAR_EXTRUSION(name, directrix, vector)`.
    fn read_extrusion(
        &self,
        e: Entity,
        units: Units,
        near: &Aabb,
        depth: usize,
    ) -> Outcome<Scaled> {
        let a = e.attributes();
        let direction = self.vector(a.entity(2)?, units)?;
        let form = self.curve(a.entity(1)?, units, depth + 1)?;
        let scales = (!matches!(form, Form::Ellipse(..))).then_some([1.0, 1.0]);
        let directrix = self.swept(e, &form, near, &Sweep::Along(direction))?;
        Ok((RawSurface::Extrusion { directrix, direction, range: None }, scales))
    }

    /// `SURFACE_OF_REVOLUTION(name, generatrix, axis)`.
    fn read_revolution(
        &self,
        e: Entity,
        units: Units,
        near: &Aabb,
        depth: usize,
    ) -> Outcome<Scaled> {
        let a = e.attributes();
        let axis = self.frame(a.entity(2)?, units)?;
        let form = self.curve(a.entity(1)?, units, depth + 1)?;
        let scales = (!matches!(form, Form::Ellipse(..))).then_some([units.angle, 1.0]);
        let generatrix = self.swept(e, &form, near, &Sweep::About(axis.origin, axis.z))?;
        let (origin, axis) = (axis.origin, axis.z);
        let (angles, curve_first) = (None, false);
        Ok((RawSurface::Revolution { generatrix, origin, axis, angles, curve_first }, scales))
    }

    /// `OFFSET_SURFACE(name, basis, distance, self-intersect)`.
    fn read_offset(
        &self,
        e: Entity,
        units: Units,
        near: &Aabb,
        depth: usize,
    ) -> Outcome<Supported> {
        let a = e.attributes();
        let base = self.surface(a.entity(1)?, units, near, depth + 1)?;
        let sign = if base.turned { -1.0 } else { 1.0 };
        let distance = sign * a.real(2)? * units.length;
        let surface = RawSurface::Offset { base: Box::new(base.surface), distance };
        Ok(Supported { surface, entity: e.index, ..base })
    }

    /// `RECTANGULAR_TRIMMED_SURFACE(name, basis, u1, u2, v1, v2, u sense, v sense)`, without its trims.
    fn read_trimmed(
        &self,
        e: Entity,
        units: Units,
        near: &Aabb,
        depth: usize,
    ) -> Outcome<Supported> {
        let a = e.attributes();
        let base = self.surface(a.entity(1)?, units, near, depth + 1)?;
        let turned = base.turned ^ (a.flag(6)? != a.flag(7)?);
        let plain = a.flag(6)? && a.flag(7)?;
        let scales = base.scales.filter(|_| plain);
        Ok(Supported { turned, scales, entity: e.index, ..base })
    }

    /// `SURFACE_REPLICA(name, parent, transformation)`: the parent is read as far as its image reaches.
    fn read_replica(
        &self,
        e: Entity,
        units: Units,
        near: &Aabb,
        depth: usize,
    ) -> Outcome<Supported> {
        let a = e.attributes();
        let map = self.operator(a.entity(2)?, units)?;
        let before = preimage(near, &map);
        let before = before.ok_or_else(|| e.fault("a map without inverse", "a scale"))?;
        let base = self.surface(a.entity(1)?, units, &before, depth + 1)?;
        let placed = super::place::surface(&base.surface, &map);
        let placed =
            placed.ok_or_else(|| e.fault("a transformation that is no similarity", "a scale"))?;
        let (surface, turned) = (placed.surface, base.turned ^ placed.turned);
        Ok(Supported { surface, turned, scales: None, entity: e.index })
    }

    /// `TOROIDAL_SURFACE(name, position, major radius, minor radius)`; a degenerate one selects a part.
    fn torus(&self, e: Entity, a: &Attributes, units: Units) -> Outcome<RawSurface> {
        let (major, minor) = (a.real(2)? * units.length, length(e, a, 3, units)?);
        if !(major.is_finite() && major >= 0.0) {
            return Err(e.fault(format!("major radius {major} mm"), "0 or above"));
        }
        let degenerate = e.kind().starts_with('D');
        let keep_outer = if degenerate { a.flag(4).ok() } else { None };
        let frame = self.frame(a.entity(1)?, units)?;
        Ok(RawSurface::Torus { frame, major, minor, keep_outer })
    }

    /// `CONICAL_SURFACE(name, position, radius, semi-angle)`.
    fn cone(&self, e: Entity, a: &Attributes, units: Units) -> Outcome<RawSurface> {
        let (radius, semi_angle) = (a.real(2)? * units.length, a.real(3)? * units.angle);
        let frame = self.frame(a.entity(1)?, units)?;
        if !(radius >= 0.0 && radius.is_finite()) {
            return Err(e.fault(format!("radius {radius} mm"), "0 or above"));
        }
        if !(semi_angle.abs() < FRAC_PI_2 && semi_angle != 0.0) {
            return Err(e.fault(format!("semi-angle {semi_angle} rad"), "between 0 and 90 degrees"));
        }
        Ok(RawSurface::Cone { frame, radius, semi_angle })
    }

    /// `B_SPLINE_SURFACE(name, u degree, v degree, points, form, closed u, closed v, self-intersect)`.
    fn spline_surface(&self, e: Entity, units: Units, depth: usize) -> Outcome<Surface> {
        let a = e.attributes();
        let degrees = [degree(e, &a, 1)?, degree(e, &a, 2)?];
        let net = a.entity_rows(3)?;
        let columns = net.first().map_or(0, Vec::len);
        if net.iter().any(|row| row.len() != columns) {
            return Err(e.fault("rows of points of different lengths", "a rectangular net"));
        }
        self.charge(e, depth, net.len() * columns)?;
        let points: Vec<Vec3> =
            net.iter().flatten().map(|p| self.point(*p, units)).collect::<Outcome<_>>()?;
        let knots = [
            knots(e, &a, e.kind(), degrees[0], net.len(), [8, 10])?,
            knots(e, &a, e.kind(), degrees[1], columns, [9, 11])?,
        ];
        let weights = match e.part("RATIONAL_B_SPLINE_SURFACE") {
            Some(part) => {
                let rows = part.real_rows(part.len().saturating_sub(1))?;
                if rows.len() != net.len() || rows.iter().any(|row| row.len() != columns) {
                    return Err(e.fault(
                        "weights whose number differs from that of the points",
                        "one a point",
                    ));
                }
                Some(rows.concat())
            }
            None => None,
        };
        Surface::try_new(degrees, knots, points, weights).map_err(|x| spline_fault(e, &x))
    }

    /// The part of a swept curve within reach of the face.
    fn swept(&self, e: Entity, form: &Form, near: &Aabb, sweep: &Sweep) -> Outcome<Curve3> {
        if let Some(whole) = form.whole() {
            return Ok(whole);
        }
        if near.is_empty() {
            return Err(
                e.fault("an extrusion or revolution of an unbounded curve", "a bounded face")
            );
        }
        let ends = reach(form, near, sweep);
        ends.and_then(|[from, to]| form.cut(from, to))
            .ok_or_else(|| e.fault("a sweep along its own curve", "a surface"))
    }
}

/// Box around what `map` takes into a box; `None` where the map has no inverse.
fn preimage(near: &Aabb, map: &Affine) -> Option<Aabb> {
    if near.is_empty() {
        return Some(Aabb::EMPTY);
    }
    let inverse = map.linear.try_inverse()?;
    Some(Aabb::of_points(&near.corners().map(|corner| inverse * (corner - map.shift))))
}

enum Sweep {
    Along(Vec3),
    About(Vec3, Vec3),
}

/// Parameters between which an unbounded curve has to be swept to cover the bounding box.
fn reach(form: &Form, near: &Aabb, sweep: &Sweep) -> Option<[f64; 2]> {
    let centre = match form {
        Form::Line(o, _) => *o,
        Form::Hyperbola(f, ..) | Form::Parabola(f, _) => f.origin,
        _ => return None,
    };
    let far = 1.01 * distance_to_cover(near, centre, sweep) + 1e-6;
    match form {
        Form::Line(_, d) => {
            let slant = match sweep {
                Sweep::Along(v) => d.cross(v).norm() / (d.norm() * v.norm()),
                Sweep::About(..) => 1.0,
            };
            let t = far / (d.norm() * slant);
            (slant > 1e-9 && t.is_finite()).then_some([-t, t])
        }
        Form::Hyperbola(_, a, b) => {
            let t = (far / a.min(*b)).asinh().min(40.0);
            Some([-t, t])
        }
        Form::Parabola(_, p) => {
            let t = (far / p).sqrt().max(far / (2.0 * p));
            Some([-t, t])
        }
        _ => None,
    }
}

/// Distance [mm] from the curve's centre that the swept curve must cover to contain the box.
fn distance_to_cover(near: &Aabb, centre: Vec3, sweep: &Sweep) -> f64 {
    let corner = |k: usize| {
        let pick = |bit: usize| if k >> bit & 1 == 0 { near.min } else { near.max };
        Vec3::new(pick(0).x, pick(1).y, pick(2).z)
    };
    let mut far = 0.0_f64;
    for corner in (0..8).map(corner) {
        let away = match sweep {
            Sweep::About(origin, axis) => {
                let radial = |p: Vec3| (p - origin - axis * (p - origin).dot(axis)).norm();
                (corner - centre).dot(axis).abs() + radial(corner) + radial(centre)
            }
            Sweep::Along(direction) => {
                let d = direction.normalize();
                let across = (corner - centre) - d * d.dot(&(corner - centre));
                across.norm()
            }
        };
        far = far.max(away);
    }
    far
}
