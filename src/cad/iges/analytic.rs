//! Planes (108, 190), cylinders (192), cones (194), spheres (196) and tori (198).

use super::file::Fault;
use super::reader::{Reader, mirrors, similarity};
use super::surface::BasisSurface;
use super::uv::UvMap;
use crate::raw::RawSurface;
use kanagata_geometry::{Affine, Frame, Vec3};

impl Reader<'_, '_> {
    /// Plane (108): A x + B y + C z = D, boundary curve DE or 0, display symbol. The entity defines no parametrisation.
    pub(super) fn plane_108(&self, entity: usize, map: &Affine) -> Result<BasisSurface, Fault> {
        let mut p = self.file.params(entity)?;
        let normal = p.vec3("coefficient")?;
        let level = p.real("D")?;
        let size = normal.norm();
        if size == 0.0 {
            return Err(p.fault("A, B, C all 0", "the normal of a plane"));
        }
        let placed = self.placed(entity, map)?;
        let local = Frame::from_z_x(normal * (level / (size * size)), normal, Vec3::x());
        let frame = local.and_then(|f| {
            let z = placed.linear.try_inverse()?.transpose() * f.z;
            Frame::from_z_x(placed.point(&f.origin), z, placed.vector(&f.x))
        });
        let Some(frame) = frame else { return Err(p.fault("no plane", "finite coefficients")) };
        let plane = BasisSurface::plain(RawSurface::Plane(frame), None);
        Ok(BasisSurface { maps: Vec::new(), turned: mirrors(&placed), ..plane })
    }

    /// The curve that bounds a plane (108, form 1 or -1).
    pub(super) fn plane_boundary(&self, entity: usize) -> Result<Option<usize>, Fault> {
        let mut p = self.file.params(entity)?;
        p.vec3("coefficient")?;
        p.real("D")?;
        p.pointer_or_none("boundary")
    }

    /// Plane (190): point DE, normal DE, reference direction DE (form 1). `S = C + u x + v y`.
    pub(super) fn plane_190(&self, entity: usize, map: &Affine) -> Result<BasisSurface, Fault> {
        let mut p = self.file.params(entity)?;
        let (point, normal) = (p.pointer("point")?, p.pointer("normal")?);
        let reference = p.pointer_or_none("reference direction")?;
        let placed = self.placed(entity, map)?;
        let (frame, flip, scale) = self.frame(entity, point, Some(normal), reference, &placed)?;
        let map = UvMap::scales(scale, flip * scale);
        Ok(BasisSurface { maps: vec![map], ..BasisSurface::plain(RawSurface::Plane(frame), None) })
    }

    /// Cylinder (192): point, axis, radius, reference. Cone (194): point, axis, radius, semi-angle [deg],
    /// reference. Sphere (196): point, radius, axis, reference. Torus (198): point, axis, radii, reference.
    /// Their angles are in degrees.
    pub(super) fn quadric(&self, entity: usize, map: &Affine) -> Result<BasisSurface, Fault> {
        let kind = self.file.entry(entity).kind;
        let mut p = self.file.params(entity)?;
        let point = p.pointer("centre or point")?;
        let mut axis = if kind == 196 { None } else { Some(p.pointer("axis")?) };
        let radius = p.real("radius")?;
        let second =
            if matches!(kind, 194 | 198) { p.real("second radius or semi-angle")? } else { 0.0 };
        if kind == 196 {
            axis = p.pointer_or_none("axis")?;
        }
        let reference = p.pointer_or_none("reference direction")?;
        let good = match kind {
            194 => radius >= 0.0 && second > 0.0 && second < 90.0,
            198 => radius > 0.0 && second > 0.0,
            _ => radius > 0.0,
        };
        if !good {
            return Err(p.fault(
                format_args!("radius {radius}, second {second}"),
                "radii above 0, a semi-angle between 0 and 90 degrees",
            ));
        }
        let placed = self.placed(entity, map)?;
        let (frame, flip, scale) = self.frame(entity, point, axis, reference, &placed)?;
        let degree = flip * 1f64.to_radians();
        let (surface, v) = scaled_quadric(kind, frame, [radius, second], scale);
        let in_radians = if matches!(kind, 196 | 198) { 1.0 } else { v };
        let mut maps = vec![UvMap::scales(degree, v), UvMap::scales(flip, in_radians)];
        if kind == 194 {
            let slant = v * second.to_radians().cos();
            maps.extend([UvMap::scales(degree, slant), UvMap::scales(flip, slant)]);
        }
        if kind == 198 {
            // Open CASCADE: the angle about the tube first, then that about the axis in the opposite sense.
            let turned = [UvMap::scales(-degree, v), UvMap::scales(-flip, in_radians)];
            maps.extend(turned.map(UvMap::swapped));
        }
        Ok(BasisSurface { maps, ..BasisSurface::plain(surface, None) })
    }

    /// Placed frame, the sign of angles (-1 where a reflection made the frame left-handed), and the scale.
    fn frame(
        &self,
        entity: usize,
        point: usize,
        axis: Option<usize>,
        reference: Option<usize>,
        placed: &Affine,
    ) -> Result<(Frame, f64, f64), Fault> {
        let scale = similarity(placed).ok_or_else(|| {
            self.file.fault(
                entity,
                "matrix-skews",
                "a matrix that does not preserve shapes",
                "rotation, reflection and uniform scale",
            )
        })?;
        let origin = self.point(point, placed)?;
        let z = axis.map_or(Ok(placed.vector(&Vec3::z())), |a| self.direction(a, placed))?;
        let x = reference.map_or(Ok(placed.vector(&Vec3::x())), |r| self.direction(r, placed))?;
        let frame = Frame::from_z_x(origin, z, x).ok_or_else(|| {
            self.file.fault(entity, "entity-invalid", "no axes", "directions that are not zero")
        })?;
        Ok((frame, if mirrors(placed) { -1.0 } else { 1.0 }, scale))
    }
}

/// Cylinder (192), cone (194), sphere (196) or torus (any other type) with lengths times `scale`, and the factor from
/// the file's v to its own.
fn scaled_quadric(
    kind: u32,
    frame: Frame,
    [radius, second]: [f64; 2],
    scale: f64,
) -> (RawSurface, f64) {
    match kind {
        192 => (RawSurface::Cylinder { frame, radius: radius * scale }, scale),
        194 => {
            let semi_angle = second.to_radians();
            (RawSurface::Cone { frame, radius: radius * scale, semi_angle }, scale)
        }
        196 => (RawSurface::Sphere { frame, radius: radius * scale }, 1f64.to_radians()),
        _ => {
            let (major, minor) = (radius * scale, second * scale);
            (RawSurface::Torus { frame, major, minor, keep_outer: None }, 1f64.to_radians())
        }
    }
}
