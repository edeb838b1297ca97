//! Conversion of offset surfaces to explicit surfaces: exact for planes, quadrics and tori, fitted for swept surfaces
//! and splines.

use super::budget::{Fineness, breaks_of};
use super::fit::offset_spline;
use crate::model::Face;
use crate::raw::RawSurface;
use crate::trim_region::TrimRegion;
use kanagata_geometry::frame::unit;
use kanagata_geometry::nurbs::{Curve3, Surface};
use kanagata_geometry::{Frame, Vec2, Vec3};

/// The surface at `distance` [mm] along the normal of `base`, with its parametrisation, within `tolerance` [mm] as far
/// as `fineness` permits.
///
/// # Errors
/// The surface degenerates, or the base has no normal.
pub(crate) fn offset(
    base: &RawSurface,
    distance: f64,
    tolerance: f64,
    fineness: &mut Fineness,
) -> Result<RawSurface, String> {
    Ok(match base {
        &RawSurface::Plane(mut frame) => {
            frame.origin += frame.z * distance;
            RawSurface::Plane(frame)
        }
        &RawSurface::Cylinder { frame, radius } => {
            RawSurface::Cylinder { frame, radius: offset_radius(radius, distance)? }
        }
        &RawSurface::Sphere { frame, radius } => {
            RawSurface::Sphere { frame, radius: offset_radius(radius, distance)? }
        }
        &RawSurface::Torus { frame, major, minor, keep_outer } => {
            let minor = offset_radius(minor, distance)?;
            RawSurface::Torus { frame, major, minor, keep_outer }
        }
        &RawSurface::Cone { frame, radius, semi_angle } => {
            offset_cone(frame, radius, semi_angle, distance)
        }
        &RawSurface::Revolution { ref generatrix, origin, axis, angles, curve_first } => {
            let signed = if curve_first { -distance } else { distance };
            let generatrix = offset_generatrix(generatrix, (origin, axis), signed, tolerance)?;
            RawSurface::Revolution { generatrix, origin, axis, angles, curve_first }
        }
        &RawSurface::Extrusion { ref directrix, direction, range } => {
            let directrix = offset_directrix(directrix, direction, distance, tolerance)?;
            RawSurface::Extrusion { directrix, direction, range }
        }
        RawSurface::Nurbs(s) => RawSurface::Nurbs(offset_spline(s, distance, tolerance, fineness)?),
        RawSurface::Offset { base, distance: first } => {
            let inner = offset(base, *first, tolerance, fineness)?;
            offset(&inner, distance, tolerance, fineness)?
        }
    })
}

/// Radius [mm] of the offset of a cylinder, sphere or torus tube by `distance` [mm].
fn offset_radius(radius: f64, distance: f64) -> Result<f64, String> {
    let r = radius + distance;
    if r > 0.0 {
        Ok(r)
    } else {
        Err(format!("an offset by {distance} mm of a surface with radius {radius} mm degenerates"))
    }
}

/// Offset of a cone by `distance` [mm] to its outside, with its parameters; its frame moves along the axis by
/// `-distance sin a`.
///
/// The radius at v = 0 becomes `radius + distance cos a`. It may be negative: the apex then lies on the other side of v = 0,
/// and the surface is the offset wherever `radius + distance cos a + v tan a > 0`.
fn offset_cone(mut frame: Frame, radius: f64, semi_angle: f64, distance: f64) -> RawSurface {
    let (sin, cos) = semi_angle.sin_cos();
    frame.origin -= frame.z * (distance * sin);
    RawSurface::Cone { frame, radius: radius + distance * cos, semi_angle }
}

/// Generatrix of the offset by `distance` [mm] of a surface of revolution.
fn offset_generatrix(
    generatrix: &Curve3,
    (origin, axis): (Vec3, Vec3),
    distance: f64,
    tolerance: f64,
) -> Result<Curve3, String> {
    let normal = |t: f64| {
        let d = generatrix.derivs(t);
        let x = d.c - (origin + axis * axis.dot(&(d.c - origin)));
        unit(axis.cross(&x).cross(&d.d1))
    };
    offset_curve(generatrix, distance, &normal, tolerance)
}

/// Directrix of the offset by `distance` [mm] of an extrusion.
fn offset_directrix(
    directrix: &Curve3,
    direction: Vec3,
    distance: f64,
    tolerance: f64,
) -> Result<Curve3, String> {
    let normal = |t: f64| unit(directrix.derivs(t).d1.cross(&direction));
    offset_curve(directrix, distance, &normal, tolerance)
}

/// `curve + distance * normal`; a point without normal (on the axis) uses that of its neighbour.
fn offset_curve(
    curve: &Curve3,
    distance: f64,
    normal: &dyn Fn(f64) -> Option<Vec3>,
    tolerance: f64,
) -> Result<Curve3, String> {
    let [a, b] = curve.domain();
    let beside = |t: f64| {
        let h = 1e-7 * (b - a);
        normal(t).or_else(|| normal((t + h).min(b))).or_else(|| normal((t - h).max(a)))
    };
    let breaks = breaks_of(curve.knots(), [a, b]);
    if breaks.windows(2).any(|w| beside(0.5 * (w[0] + w[1])).is_none()) {
        return Err("an offset of a sweep that has no normal".into());
    }
    let at = |t: f64| curve.point(t) + beside(t).unwrap_or_else(Vec3::zeros) * distance;
    Ok(Curve3::fitted(at, &breaks, tolerance))
}

/// Largest distance [mm] of a face from the exact offset surface, at two points inside each patch of its spline within
/// the trimming loops. Zero for surfaces other than offsets of splines.
pub(crate) fn deviation(surface: &RawSurface, face: &Face) -> f64 {
    let Some((base, distance)) = spline_below(surface) else { return 0.0 };
    let region = TrimRegion::new(face);
    let domain = face.surface.domain();
    let [us, vs] = [0, 1].map(|k| breaks_of(face.surface.knots()[k], domain[k]));
    let inside = |w: &[f64], fraction: f64| w[0] + (w[1] - w[0]) * fraction;
    let mut worst = 0.0_f64;
    for (u, v) in us.windows(2).flat_map(|u| vs.windows(2).map(move |v| (u, v))) {
        for (x, y) in [(0.05, 0.35), (0.65, 0.95)] {
            let uv = Vec2::new(inside(u, x), inside(v, y));
            if region.contains(uv) {
                let normal = base.normal(uv).unwrap_or_else(Vec3::zeros);
                let off = face.surface.point(uv) - (base.point(uv) + normal * distance);
                worst = worst.max(off.norm());
            }
        }
    }
    worst
}

/// The spline below nested offsets and their total distance [mm]; `None` for other surfaces.
pub(super) fn spline_below(surface: &RawSurface) -> Option<(&Surface, f64)> {
    let (mut base, mut distance) = (surface, 0.0);
    while let RawSurface::Offset { base: inner, distance: own } = base {
        (base, distance) = (inner, distance + own);
    }
    match base {
        RawSurface::Nurbs(s) if distance != 0.0 => Some((s, distance)),
        _ => None,
    }
}
