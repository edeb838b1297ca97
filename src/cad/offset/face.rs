//! The offset of a face, with the parameters of the face.

use super::budget::Fineness;
use super::fit::offset_spline;
use super::surface::offset;
use crate::cad::analytic::Analytic;
use crate::cad::model::{Face, SurfaceKind};
use crate::cad::native::Native;
use crate::cad::trim_region::TrimRegion;
use crate::geometry::Vec2;
use crate::geometry::nurbs::Surface;

/// Distance between control points of a face and of the surface made anew from its closed form, relative to their size,
/// up to which the closed form is used.
const SAME_SURFACE_REL: f64 = 1e-9;

/// Error of a tensor-product interpolation over that of its lines, which the fit limits: one plus the Lebesgue constant
/// of the six nodes (2.0), and a margin for errors between the points compared.
const ERROR_PER_LINE_ERROR: f64 = 4.0;

/// The offset of a face by `distance` [mm] along its outward normal: exact for planes, cylinders, cones, spheres and
/// tori, fitted within `tolerance` [mm] otherwise, over the rectangle that the loops enter.
///
/// # Errors
/// The reason why the surface has no offset there within the tolerance.
pub(super) fn offset_face(
    face: &Face,
    distance: f64,
    tolerance: f64,
    max_patches: usize,
) -> Result<Face, String> {
    let signed = if face.flipped { -distance } else { distance };
    if let Some((surface, analytic)) = exact(face, signed) {
        return Ok(Face { surface, analytic: Some(analytic), ..face.clone() });
    }
    let region = TrimRegion::new(face);
    let [u, v] = [0, 1].map(|k| [region.low[k], region.high[k]]);
    let base = face.surface.trimmed(u, v).map_err(|e| e.to_string())?;
    let mut fineness = Fineness { max_patches, coarse: false };
    let fit = tolerance / ERROR_PER_LINE_ERROR;
    let surface = offset_spline(&base, signed, fit, &mut fineness)?;
    let kind = match face.kind {
        swept @ (SurfaceKind::Extrusion | SurfaceKind::Revolution) => swept,
        _ => SurfaceKind::Offset,
    };
    let made = Face { surface, kind, analytic: None, ..face.clone() };
    let off = deviation(&base, signed, &made, &region);
    // The fit stops early where patches outside the loops fold.
    if off > tolerance {
        return Err(format!(
            "its approximation by {} patches deviates by {off:.2e} mm; allowed: {:.1e} mm",
            made.surface.points().len() / 25,
            tolerance
        ));
    }
    Ok(made)
}

/// The offset of a plane, quadric or torus, `None` for other faces.
fn exact(face: &Face, signed: f64) -> Option<(Surface, Analytic)> {
    let raw = face.analytic.as_ref()?.surface();
    let range = face.surface.domain();
    let (own, _) = Native::new(raw).to_nurbs(range);
    let size = crate::geometry::Aabb::of_points(own.points()).diagonal();
    let same = own.count() == face.surface.count()
        && own.domain() == range
        && own
            .points()
            .iter()
            .zip(face.surface.points())
            .all(|(a, b)| (a - b).norm() <= SAME_SURFACE_REL * size);
    if !same {
        return None;
    }
    let moved = offset(raw, signed, 0.0, &mut Fineness::default()).ok()?;
    let (surface, angles) = Native::new(&moved).to_nurbs(range);
    let analytic = Analytic::new(&moved, angles)?;
    Some((surface, analytic))
}

/// Largest distance [mm] of a fitted offset from the definition, at points of its patches within the loops.
fn deviation(base: &Surface, signed: f64, made: &Face, region: &TrimRegion) -> f64 {
    let domain = made.surface.domain();
    let [us, vs] = [0, 1].map(|k| super::budget::breaks_of(made.surface.knots()[k], domain[k]));
    let at = |w: &[f64], fraction: f64| w[0] + (w[1] - w[0]) * fraction;
    let mut worst = 0.0_f64;
    for (u, v) in us.windows(2).flat_map(|u| vs.windows(2).map(move |v| (u, v))) {
        for (x, y) in [(0.05, 0.35), (0.65, 0.95), (0.5, 0.5)] {
            let uv = Vec2::new(at(u, x), at(v, y));
            if let Some(n) = base.normal(uv).filter(|_| region.contains(uv)) {
                worst = worst.max((made.surface.point(uv) - base.point(uv) - n * signed).norm());
            }
        }
    }
    worst
}
