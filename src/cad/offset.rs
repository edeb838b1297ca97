//! Conversion of offset surfaces to explicit surfaces: exact for planes, quadrics and tori, fitted for swept surfaces
//! and splines.

use super::model::Face;
use super::offset_fit::{cells_to_halve, through_points};
use super::raw::{RawFace, RawSurface};
use super::trim_region::TrimRegion;
use crate::geometry::frame::unit;
use crate::geometry::nurbs::{Curve3, Surface};
use crate::geometry::{Frame, Vec2, Vec3};

/// Maximum bisection depth of a fitted patch.
const BISECTION_DEPTH_MAX: u32 = 7;
/// Patches available to all offset surfaces of a file, in addition to one per [`BYTES_PER_PATCH`] bytes of the file.
const PATCHES_BASE: usize = 8_192;
/// See [`PATCHES_BASE`]. A bicubic patch takes more than 500 bytes of a file, and thus may yield more than 100 patches.
const BYTES_PER_PATCH: usize = 4;

/// Refinement limit of a fitted offset surface.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Fineness {
    /// Maximum number of patches of its spline.
    pub max_patches: usize,
    /// The limit was reached: the approximation exceeds the tolerance.
    pub coarse: bool,
}

/// Patch limits of the faces of a file of `bytes` bytes, in proportion to the spans of their bases. Zero once the spans
/// of this and the preceding faces exceed the total (one base shared by many faces).
pub(super) fn shares(faces: &[RawFace], bytes: usize) -> Vec<Fineness> {
    let total = PATCHES_BASE + bytes / BYTES_PER_PATCH;
    let mut sum = 0;
    let mut needed: Vec<(usize, usize)> =
        faces.iter().map(|f| spans_under(&f.surface, 0)).collect();
    for (spans, levels) in &mut needed {
        let all = spans.saturating_mul(*levels);
        *spans = if sum + all <= total { *spans } else { 0 };
        sum += if *spans > 0 { all } else { 0 };
    }
    let fraction = |(spans, _): (usize, usize)| spans * total / sum.max(1);
    needed.into_iter().map(|n| Fineness { max_patches: fraction(n), coarse: false }).collect()
}

/// Spans of the spline below nested offsets, and the nesting depth; zero for other surfaces.
fn spans_under(surface: &RawSurface, levels: usize) -> (usize, usize) {
    match surface {
        RawSurface::Offset { base, .. } => spans_under(base, levels + 1),
        RawSurface::Nurbs(s) if levels > 0 => {
            let domain = s.domain();
            let spans = |k: usize| breaks_of(s.knots()[k], domain[k]).len() - 1;
            (spans(0) * spans(1), levels)
        }
        _ => (0, levels),
    }
}

/// The surface at `distance` [mm] along the normal of `base`, with its parametrisation, within `tolerance` [mm] as far
/// as `fineness` permits.
///
/// # Errors
/// The surface degenerates, or the base has no normal.
pub(super) fn offset(
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

fn breaks_of(knots: &[f64], [a, b]: [f64; 2]) -> Vec<f64> {
    let mut out: Vec<f64> = knots.iter().copied().filter(|t| *t >= a && *t <= b).collect();
    out.dedup();
    out
}

/// Offset of a spline surface: biquintic patches over its spans, bisected until the tolerance is met.
fn offset_spline(
    base: &Surface,
    distance: f64,
    tolerance: f64,
    fineness: &mut Fineness,
) -> Result<Surface, String> {
    let at = |u: f64, v: f64| {
        let uv = Vec2::new(u, v);
        base.point(uv) + base.normal(uv).unwrap_or_else(Vec3::zeros) * distance
    };
    let mut breaks = spans_to_fit(base, fineness.max_patches)?;
    for _ in 0..BISECTION_DEPTH_MAX {
        let split = [0, 1].map(|k| cells_to_halve(&at, &breaks, k, tolerance));
        if split.iter().all(Vec::is_empty) {
            break;
        }
        let [u, v] = [0, 1].map(|k| breaks[k].len() - 1 + split[k].len());
        if u * v > fineness.max_patches {
            fineness.coarse = true;
            break;
        }
        for (list, more) in breaks.iter_mut().zip(split) {
            list.extend(more);
            list.sort_by(f64::total_cmp);
        }
    }
    through_points(&at, &breaks)
}

/// Span boundaries of a spline surface to be offset, at most `limit` spans.
fn spans_to_fit(base: &Surface, limit: usize) -> Result<[Vec<f64>; 2], String> {
    let domain = base.domain();
    let breaks = [0, 1].map(|k| breaks_of(base.knots()[k], domain[k]));
    let middle = |r: [f64; 2]| 0.5 * (r[0] + r[1]);
    if base.normal(Vec2::new(middle(domain[0]), middle(domain[1]))).is_none() {
        return Err("an offset of a surface that has no normal".into());
    }
    let spans = (breaks[0].len() - 1) * (breaks[1].len() - 1);
    if spans > limit {
        return Err(format!(
            "an offset of a surface of {spans} spans; allowed: {limit} here (all offsets of a file together: {PATCHES_BASE}, \
             and one for every {BYTES_PER_PATCH} bytes)"
        ));
    }
    Ok(breaks)
}

/// Largest distance [mm] of a face from the exact offset surface, at two points inside each patch of its spline within
/// the trimming loops. Zero for surfaces other than offsets of splines.
pub(super) fn deviation(surface: &RawSurface, face: &Face) -> f64 {
    let (mut base, mut distance) = (surface, 0.0);
    while let RawSurface::Offset { base: inner, distance: own } = base {
        (base, distance) = (inner, distance + own);
    }
    let RawSurface::Nurbs(base) = base else { return 0.0 };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cad::offset_fit::DEGREE;

    const FREE: Fineness = Fineness { max_patches: 10_000, coarse: false };

    #[test]
    fn a_spline_offset_stays_at_its_distance() {
        let (f, r) = (Frame::world(), 10.0);
        let meridian = Frame { y: f.z, z: -f.y, ..f };
        let arc = Curve3::ellipse_arc(&meridian, r, r, -1.0, 1.2);
        let sphere = Surface::revolution(&arc, Vec3::zeros(), Vec3::z(), [0.2, 3.0]);
        let out = offset_spline(&sphere, 1.5, 1e-9, &mut FREE.clone()).unwrap();
        for k in 0..400 {
            let t = |m: f64| (f64::from(k) * m).fract();
            let [u, v] = sphere.domain();
            let uv = Vec2::new(u[0] + (u[1] - u[0]) * t(0.618), v[0] + (v[1] - v[0]) * t(0.414));
            assert!((out.point(uv).norm() - 11.5).abs() < 3e-9);
            assert!((out.point(uv) - sphere.point(uv) * 1.15).norm() < 3e-9);
        }
    }

    /// Waves of height 4 on a grid of `n` x `n` spans, on which an offset by 1.5 self-intersects.
    fn waves(n: usize) -> Surface {
        let at = |i: usize, j: usize| Vec3::new(i as f64, j as f64, ((7 * i + 3 * j) % 5) as f64);
        let points = (0..n + 3).flat_map(|i| (0..n + 3).map(move |j| at(i, j))).collect();
        let inner = (0..=n).map(|k| k as f64);
        let knots: Vec<f64> = [vec![0.0; 3], inner.collect(), vec![n as f64; 3]].concat();
        Surface::try_new([3, 3], [knots.clone(), knots], points, None).unwrap()
    }

    #[test]
    fn an_offset_that_folds_is_followed_as_finely_as_the_file_is_large() {
        let face = |surface: RawSurface| RawFace {
            surface,
            loops: Vec::new(),
            flipped: false,
            source: "#1".into(),
            shell: None,
            attributes: Default::default(),
        };
        let base = RawSurface::Nurbs(waves(10));
        let over =
            |base: &RawSurface| RawSurface::Offset { base: Box::new(base.clone()), distance: 1.5 };
        let faces = [face(base.clone()), face(over(&base)), face(over(&over(&base)))];
        let shares = shares(&faces, 4_000);
        // 100 spans at one level and, for the other two faces, at two levels, of 9192 patches.
        assert_eq!([0, 1, 2].map(|k| shares[k].max_patches), [0, 3064, 3064]);
        let mut own = shares[1];
        let Ok(RawSurface::Nurbs(found)) = offset(&base, 1.5, 1e-9, &mut own) else {
            panic!("a spline's offset is a spline");
        };
        assert!(own.coarse);
        let pieces = found.points().len() / (DEGREE * DEGREE);
        assert!((100..=3300).contains(&pieces), "{pieces}");
        assert!(
            offset(&base, 1.5, 1e-9, &mut Fineness { max_patches: 99, coarse: false }).is_err()
        );
    }

    #[test]
    fn a_base_that_many_faces_share_is_offset_only_so_often() {
        let surface =
            RawSurface::Offset { base: Box::new(RawSurface::Nurbs(waves(40))), distance: 0.1 };
        let face = RawFace {
            surface,
            loops: Vec::new(),
            flipped: false,
            source: "#1".into(),
            shell: None,
            attributes: Default::default(),
        };
        let shares = shares(&vec![face; 20], 0);
        let given: usize = shares.iter().map(|s| s.max_patches).sum();
        assert_eq!(shares.iter().filter(|s| s.max_patches >= 1600).count(), 5);
        assert!(given <= PATCHES_BASE, "{given}");
    }

    #[test]
    fn a_cone_offset_keeps_its_parameters() {
        let cone = RawSurface::Cone { frame: Frame::world(), radius: 5.0, semi_angle: 0.4 };
        let Ok(RawSurface::Cone { frame, radius, .. }) =
            offset(&cone, 2.0, 1e-9, &mut FREE.clone())
        else {
            panic!("a cone's offset is a cone");
        };
        let v = 3.0;
        let base = Vec3::new(5.0 + v * 0.4f64.tan(), 0.0, v);
        let normal = Vec3::new(0.4f64.cos(), 0.0, -0.4f64.sin());
        let found = frame.point(&Vec3::new(radius + v * 0.4f64.tan(), 0.0, v));
        assert!((found - (base + normal * 2.0)).norm() < 1e-12);
        let ball = RawSurface::Sphere { frame: Frame::world(), radius: 1.0 };
        assert!(offset(&ball, -1.0, 1e-9, &mut FREE.clone()).is_err());
    }

    /// Inwards by more than the radius at v = 0: the apex moves past v = 0, and the cone beyond it stays the offset.
    #[test]
    fn a_cone_offset_past_its_reference_circle_is_the_offset_beyond_the_apex() {
        for radius in [0.0, 1.0] {
            let (semi_angle, distance) = (0.4f64, -2.0);
            let cone = RawSurface::Cone { frame: Frame::world(), radius, semi_angle };
            let found = offset(&cone, distance, 1e-9, &mut FREE.clone()).unwrap();
            let native = crate::cad::native::Native::new(&found);
            for (u, v) in [(0.0, 5.0), (1.0, 6.0), (-2.0, 40.0)] {
                let around = Vec3::new(f64::cos(u), f64::sin(u), 0.0);
                let base = around * (radius + v * semi_angle.tan()) + Vec3::z() * v;
                let normal = around * semi_angle.cos() - Vec3::z() * semi_angle.sin();
                let expected = base + normal * distance;
                assert!((native.point(Vec2::new(u, v)) - expected).norm() < 1e-12, "{u} {v}");
                let back = native.inverse(&expected, None);
                assert!((back - Vec2::new(u, v)).norm() < 1e-12, "{back}");
            }
        }
    }
}
