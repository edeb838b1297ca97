//! The offset of a face, with the parameters of the face.

use super::budget::{Fineness, breaks_of};
use super::fit::offset_spline;
use super::sharp::largest_kink;
use super::surface::offset;
use crate::analytic::Analytic;
use crate::model::{Face, SurfaceKind};
use crate::native::Native;
use crate::trim_region::TrimRegion;
use kanagata_geometry::nurbs::Surface;
use kanagata_geometry::{Aabb, Vec2, Vec3};

/// Distance between control points of a face and of the surface made anew from its closed form, relative to their size,
/// up to which the closed form is used.
const SAME_SURFACE_REL: f64 = 1e-9;

/// Error allowed at a knot line over the jump of the definition there: the interpolation beside it overshoots.
const KINK_MARGIN: f64 = 2.0;
/// Distance of control points from a plane, relative to their size, up to which a spline is flat.
const FLAT_REL: f64 = 1e-12;
/// Error of a tensor-product interpolation over that of its lines, which the fit limits: one plus the Lebesgue constant
/// of the six nodes (2.0), and a margin for errors between the points compared.
const ERROR_PER_LINE_ERROR: f64 = 4.0;

/// The offset of a face by `distance` [mm] along its outward normal, and its accuracy [mm]: exact (0) for planes,
/// cylinders, cones, spheres, tori and flat splines; fitted to `tolerance` [mm] otherwise, over the rectangle that the
/// loops enter. Splines of files may have kinks that no fit follows: an error up to `limit` [mm] is accepted, or that of
/// the kinks.
///
/// # Errors
/// The reason why the surface has no offset there within the limit.
pub(super) fn offset_face(
    face: &Face,
    distance: f64,
    (tolerance, limit): (f64, f64),
    max_patches: usize,
) -> Result<(Face, f64), String> {
    let signed = if face.flipped { -distance } else { distance };
    if let Some((surface, analytic)) = exact(face, signed) {
        return Ok((Face { surface, analytic: Some(analytic), ..face.clone() }, 0.0));
    }
    if let Some(surface) = flat(face, signed) {
        return Ok((Face { surface, ..face.clone() }, 0.0));
    }
    let region = TrimRegion::new(face);
    let [u, v] = [0, 1].map(|k| [region.low[k], region.high[k]]);
    let base = face.surface.trimmed(u, v).map_err(|e| e.to_string())?;
    let mut fineness = Fineness { max_patches, coarse: false };
    // The definition jumps at knot lines where the normal does; no fit is closer.
    let jump = KINK_MARGIN * distance.abs() * largest_kink(face);
    let fit = jump.max(tolerance / ERROR_PER_LINE_ERROR);
    let surface = offset_spline(&base, signed, fit, &mut fineness)?;
    let kind = match face.kind {
        swept @ (SurfaceKind::Extrusion | SurfaceKind::Revolution) => swept,
        _ => SurfaceKind::Offset,
    };
    let made = Face { surface, kind, analytic: None, ..face.clone() };
    let off = deviation(&base, signed, &made, &region);
    // The fit stops early where patches outside the loops fold.
    if off > jump.max(limit) {
        return Err(format!(
            "its approximation by {} patches deviates by {off:.2e} mm; allowed: {:.1e} mm",
            made.surface.points().len() / 25,
            jump.max(limit)
        ));
    }
    Ok((made, off.max(tolerance)))
}

/// The offset of a plane, quadric or torus, `None` for other faces.
fn exact(face: &Face, signed: f64) -> Option<(Surface, Analytic)> {
    let raw = face.analytic.as_ref()?.surface();
    let range = face.surface.domain();
    let (own, _) = Native::new(raw).to_nurbs(range);
    let size = Aabb::of_points(own.points()).diagonal();
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

/// The offset of a spline whose control points lie in a plane: the spline, moved. `None` for other splines.
fn flat(face: &Face, signed: f64) -> Option<Surface> {
    let spline = &face.surface;
    let [u, v] = spline.domain();
    let n = spline.normal(0.5 * Vec2::new(u[0] + u[1], v[0] + v[1]))?;
    let first = spline.points()[0];
    let size = Aabb::of_points(spline.points()).diagonal();
    let in_plane = |p: &Vec3| (p - first).dot(&n).abs() <= FLAT_REL * size;
    let moved = || {
        let points = spline.points().iter().map(|p| p + n * signed).collect();
        let knots = spline.knots().map(<[f64]>::to_vec);
        Surface::try_new(spline.degrees(), knots, points, Some(spline.weights().to_vec())).ok()
    };
    spline.points().iter().all(in_plane).then(moved)?
}

/// Largest distance [mm] of a fitted offset from the definition, at points of its patches within the loops.
fn deviation(base: &Surface, signed: f64, made: &Face, region: &TrimRegion) -> f64 {
    let domain = made.surface.domain();
    let [us, vs] = [0, 1].map(|k| breaks_of(made.surface.knots()[k], domain[k]));
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
