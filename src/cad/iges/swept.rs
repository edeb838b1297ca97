//! Swept surfaces: 118 ruled, 120 revolution, 122 tabulated cylinder.

use std::f64::consts::{PI, TAU};

use super::curves::{Piece, Shape};
use super::file::Fault;
use super::params::Params;
use super::reader::{Reader, mirrors, similarity};
use super::surface::{BasisSurface, narrowed};
use super::uv::UvMap;
use crate::raw::RawSurface;
use kanagata_geometry::frame::unit;
use kanagata_geometry::nurbs::{Curve3, Surface};
use kanagata_geometry::{Affine, Frame, Vec3};

/// Length relative to another below which it counts as zero.
const ZERO_LENGTH_REL: f64 = 1e-9;

impl Reader<'_, '_> {
    /// Ruled surface (118): DE1, DE2, DIRFLG 1 joins first to last, DEVFLG. Parameters 0 to 1 in both directions. Form
    /// 0 pairs points of equal relative arc length, form 1 of equal relative parameter.
    pub(super) fn ruled(&self, entity: usize, map: &Affine) -> Result<BasisSurface, Fault> {
        let mut p = self.file.params(entity)?;
        let (first, second) = (p.pointer("first curve")?, p.pointer("second curve")?);
        let crossed = p.flag("DIRFLG", false)?;
        let placed = self.placed(entity, map)?;
        let rail = |curve: usize| -> Result<Piece, Fault> {
            if self.file.entry(curve).kind == 116 {
                let point = self.point(curve, &placed)?;
                return Ok(Piece { curve: Curve3::line(point, point), shape: Shape::Line });
            }
            self.joined(curve, &placed)
        };
        let (a, b) = (rail(first)?, rail(second)?);
        let uniform = |p: &Piece| matches!(p.shape, Shape::Line | Shape::Arc { .. });
        if self.file.entry(entity).form == 0 && !(uniform(&a) && uniform(&b)) {
            self.file.note(
                entity,
                "ruled-by-parameter",
                "form 0 requires equal arc length; the curves are paired by parameter",
            );
        }
        let second = if crossed { b.curve.reversed() } else { b.curve };
        let mut basis = narrowed(Surface::ruled(&a.curve, &second), [[f64::NAN; 2]; 2]);
        basis.approximate =
            !matches!((a.shape, b.shape), (Shape::Line | Shape::Free, Shape::Line | Shape::Free));
        Ok(basis)
    }

    /// Surface of revolution (120): axis DE (110), generatrix DE, start and end angle. File parameters (generatrix,
    /// angle) become (angle, generatrix), which reverses the normal.
    pub(super) fn revolution(
        &self,
        entity: usize,
        map: &Affine,
        whole: bool,
    ) -> Result<BasisSurface, Fault> {
        let mut p = self.file.params(entity)?;
        let (axis, generatrix) = (p.pointer("axis")?, p.pointer("generatrix")?);
        let angles = read_angles(&mut p)?;
        let placed = self.placed(entity, map)?;
        if similarity(&placed).is_none() {
            return Err(p.fault(
                "a matrix that does not preserve circles",
                "rotation, reflection and uniform scale",
            ));
        }
        let (origin, direction) = self.axis_of_revolution(entity, axis, &placed)?;
        let piece = self.joined(generatrix, &placed)?;
        if !whole && let Some(basis) = recognised(&piece, origin, direction) {
            return Ok(basis);
        }
        let approximate = !matches!(piece.shape, Shape::Line | Shape::Free);
        let [low, high] = piece.curve.domain();
        let unit_map = UvMap::axes([0.0, 1.0], [low, high - low]).swapped();
        Ok(BasisSurface {
            domain: Some([angles, [low, high]]),
            surface: RawSurface::Revolution {
                generatrix: piece.curve,
                origin,
                axis: direction,
                angles: Some(angles),
                curve_first: false,
            },
            maps: vec![UvMap::identity().swapped(), unit_map],
            narrowed: false,
            approximate,
            turned: false,
        })
    }

    /// Axis of a surface of revolution: its first point [mm] and the direction about which angles are measured.
    fn axis_of_revolution(
        &self,
        entity: usize,
        axis: usize,
        placed: &Affine,
    ) -> Result<(Vec3, Vec3), Fault> {
        let line = self.joined(axis, placed)?.curve;
        let ends = line.domain().map(|t| line.point(t));
        let direction = unit(ends[1] - ends[0]).ok_or_else(|| {
            self.file.fault(
                entity,
                "entity-invalid",
                "an axis of no length",
                "a line (110) of some length",
            )
        })?;
        Ok((ends[0], if mirrors(placed) { -direction } else { direction }))
    }

    /// Tabulated cylinder (122): directrix DE, end LX, LY, LZ of the generatrix, which begins at the start of the
    /// directrix. Parameters 0 to 1 in both directions.
    pub(super) fn extrusion(
        &self,
        entity: usize,
        map: &Affine,
        whole: bool,
    ) -> Result<BasisSurface, Fault> {
        let mut p = self.file.params(entity)?;
        let directrix = p.pointer("directrix")?;
        let end = p.vec3("end of the generatrix")?;
        let placed = self.placed(entity, map)?;
        let piece = self.joined(directrix, &placed)?;
        let [low, high] = piece.curve.domain();
        let direction = placed.point(&end) - piece.curve.point(low);
        if direction.norm() == 0.0 {
            return Err(
                p.fault("a generatrix of no length", "an end away from the directrix's start")
            );
        }
        let maps = |v: f64| {
            vec![UvMap::axes([low, high - low], [0.0, v]), UvMap::axes([0.0, 1.0], [0.0, v])]
        };
        if let (Shape::Arc { frame, radius }, false) = (piece.shape, whole) {
            let along = direction.dot(&frame.z);
            if (direction - frame.z * along).norm() <= ZERO_LENGTH_REL * direction.norm() {
                let surface = RawSurface::Cylinder { frame, radius };
                return Ok(BasisSurface {
                    maps: maps(along),
                    ..BasisSurface::plain(surface, None)
                });
            }
        }
        let approximate = !matches!(piece.shape, Shape::Line | Shape::Free);
        let domain = Some([[low, high], [0.0, 1.0]]);
        let surface =
            RawSurface::Extrusion { directrix: piece.curve, direction, range: Some([0.0, 1.0]) };
        Ok(BasisSurface { maps: maps(1.0), approximate, ..BasisSurface::plain(surface, domain) })
    }
}

/// Recognises cylinder, cone, sphere or torus in the revolution of a line or an arc in a plane with the axis.
fn recognised(piece: &Piece, origin: Vec3, axis: Vec3) -> Option<BasisSurface> {
    let (surface, maps) = match piece.shape {
        Shape::Line => revolved_line(piece.curve.points(), origin, axis)?,
        Shape::Arc { frame, radius } => revolved_arc(piece, &frame, radius, origin, axis)?,
        Shape::Free | Shape::Reparametrised => return None,
    };
    Some(BasisSurface {
        maps: maps.into_iter().map(UvMap::swapped).collect(),
        ..BasisSurface::plain(surface, None)
    })
}

/// Revolution of a line; the maps are from (angle, generatrix).
fn revolved_line(ends: &[Vec3], origin: Vec3, axis: Vec3) -> Option<(RawSurface, Vec<UvMap>)> {
    let [a, b] = ends else { return None };
    let split = |p: &Vec3| {
        let height = axis.dot(&(p - origin));
        (height, p - origin - axis * height)
    };
    let ((ha, ra), (hb, rb)) = (split(a), split(b));
    let size = ra.norm().max(rb.norm());
    let rise = hb - ha;
    if size == 0.0 || rise.abs() <= 1e-6 * (b - a).norm() {
        return None;
    }
    if ra.cross(&rb).norm() > ZERO_LENGTH_REL * size * size
        || ra.dot(&rb) < -ZERO_LENGTH_REL * size * size
    {
        return None;
    }
    let outward = if ra.norm() > rb.norm() { ra } else { rb };
    let frame = Frame::from_z_x(origin + axis * ha, axis, outward)?;
    let maps = vec![UvMap::axes([0.0, 1.0], [0.0, rise])];
    let slope = (rb.norm() - ra.norm()) / rise;
    let surface = if (rb.norm() - ra.norm()).abs() <= ZERO_LENGTH_REL * size {
        RawSurface::Cylinder { frame, radius: size }
    } else {
        RawSurface::Cone { frame, radius: ra.norm(), semi_angle: slope.atan() }
    };
    Some((surface, maps))
}

/// Start and end angle [rad], the end at most one turn after the start.
fn read_angles(p: &mut Params<'_, '_>) -> Result<[f64; 2], Fault> {
    let (from, mut to) = (p.real("start angle")?, p.real_or("end angle", TAU)?);
    if !(from.abs() < 1e6 && to.abs() < 1e6) {
        return Err(p.fault(format_args!("angles {from} to {to}"), "angles in radians"));
    }
    while to - from <= 1e-12 {
        to += TAU;
    }
    Ok([from, to.min(from + TAU)])
}

/// Unit vector in the plane of an arc and normal to the axis, towards the side of the arc at an angle [rad].
fn outward_at(arc: &Frame, axis: Vec3, angle: f64) -> Option<Vec3> {
    let across = unit(arc.z.cross(&axis))?;
    let there = arc.x * angle.cos() + arc.y * angle.sin();
    Some(if there.dot(&across) < 0.0 { -across } else { across })
}

fn revolved_arc(
    piece: &Piece,
    arc: &Frame,
    radius: f64,
    origin: Vec3,
    axis: Vec3,
) -> Option<(RawSurface, Vec<UvMap>)> {
    let height = axis.dot(&(arc.origin - origin));
    let foot = origin + axis * height;
    let out = arc.origin - foot;
    let major = out.norm();
    if arc.z.dot(&axis).abs() > ZERO_LENGTH_REL {
        return None;
    }
    let [low, high] = piece.curve.domain();
    let ball = major <= ZERO_LENGTH_REL * radius;
    let outward = if ball { outward_at(arc, axis, f64::midpoint(low, high))? } else { out / major };
    if arc.z.dot(&outward).abs() > ZERO_LENGTH_REL {
        return None;
    }
    let frame = Frame::from_z_x(foot, axis, outward)?;
    let start = arc.x.dot(&axis).atan2(arc.x.dot(&frame.x));
    let sense = if arc.z.dot(&frame.x.cross(&axis)) > 0.0 { 1.0 } else { -1.0 };
    let middle = start + sense * f64::midpoint(low, high);
    let shift = start - TAU * (middle / TAU).round();
    let ends = [low, high].map(|t| shift + sense * t);
    let beyond = ends.iter().any(|v| v.abs() > PI / 2.0 + 1e-7);
    let surface = match (ball, beyond) {
        (true, true) => return None,
        (true, false) => RawSurface::Sphere { frame, radius },
        _ => RawSurface::Torus { frame, major, minor: radius, keep_outer: None },
    };
    Some((surface, vec![UvMap::axes([0.0, 1.0], [shift, sense])]))
}
