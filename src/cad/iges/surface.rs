//! Surface types, rational B-spline surfaces (128) and parametric spline surfaces (114).

use super::file::Fault;
use super::reader::{POINTER_DEPTH_MAX, Reader};
use super::splines::{is_clamped, normalised_weights, power_to_bezier, without_rounding};
use super::uv::UvMap;
use crate::raw::RawSurface;
use kanagata_geometry::nurbs::Surface;
use kanagata_geometry::{Affine, Vec2, Vec3};

/// Entity types that are surfaces by themselves.
pub(super) const SURFACES: [u32; 12] = [108, 114, 118, 120, 122, 128, 140, 190, 192, 194, 196, 198];

/// A surface with the data needed to trim it.
#[derive(Debug, Clone)]
pub(super) struct BasisSurface {
    /// The surface, in mm.
    pub surface: RawSurface,
    /// Maps from the file's parameters to those of `surface`: the convention of the standard first, then those of known
    /// writers. All have the same effect on the orientation. Empty when the file's parameters are meaningless.
    pub maps: Vec<UvMap>,
    /// Parameter range of `surface`, if bounded.
    pub domain: Option<[[f64; 2]; 2]>,
    /// `domain` is smaller than that of `surface`.
    pub narrowed: bool,
    /// Parameter curves are approximate (reparametrised generatrix); space curves are preferred.
    pub approximate: bool,
    /// The normal of `surface` is opposite to that of the file, in addition to the effect of `maps`.
    pub turned: bool,
}

impl BasisSurface {
    /// A surface with the parameters of the file.
    pub fn plain(surface: RawSurface, domain: Option<[[f64; 2]; 2]>) -> Self {
        let maps = vec![UvMap::identity()];
        Self { surface, maps, domain, narrowed: false, approximate: false, turned: false }
    }

    /// True when the normal of `surface` is opposite to that of the file.
    pub fn reversed(&self) -> bool {
        self.turned != self.maps.first().is_some_and(UvMap::mirrors)
    }
}

impl Reader<'_, '_> {
    /// The surface of an entity, transformed by its own matrix and `map`. `whole` requests the form with its own limits
    /// (no trimming curves follow).
    pub fn surface(&self, entity: usize, map: &Affine, whole: bool) -> Result<BasisSurface, Fault> {
        match self.file.entry(entity).kind {
            120 => self.revolution(entity, map, whole),
            122 => self.extrusion(entity, map, whole),
            _ => self.surface_at(entity, map, 0),
        }
    }

    /// The surface of an entity at a given pointer depth.
    pub fn surface_at(
        &self,
        entity: usize,
        map: &Affine,
        depth: usize,
    ) -> Result<BasisSurface, Fault> {
        if depth > POINTER_DEPTH_MAX {
            return Err(self.file.fault(
                entity,
                "surface-depth",
                "offset surfaces are cyclic or too deeply nested",
                format!("at most {POINTER_DEPTH_MAX} levels"),
            ));
        }
        match self.file.entry(entity).kind {
            108 => self.plane_108(entity, map),
            114 => self.spline_surface(entity, map),
            118 => self.ruled(entity, map),
            120 => self.revolution(entity, map, true),
            122 => self.extrusion(entity, map, true),
            128 => self.rational_surface(entity, map),
            140 => self.offset_surface(entity, map, depth),
            190 => self.plane_190(entity, map),
            192 | 194 | 196 | 198 => self.quadric(entity, map),
            kind => Err(self.file.fault(
                entity,
                "wrong-entity",
                format!("entity {kind} where a surface is needed"),
                "a surface: 108, 114, 118, 120, 122, 128, 140 or 190 to 198",
            )),
        }
    }

    /// Rational B-spline surface (128): K1, K2, M1, M2, PROP1-5, knots of u and of v, weights and points (u fastest),
    /// U0, U1, V0, V1.
    fn rational_surface(&self, entity: usize, map: &Affine) -> Result<BasisSurface, Fault> {
        let mut p = self.file.params(entity)?;
        let upper = [p.count("upper index K1", 1)?, p.count("upper index K2", 1)?];
        let degrees = [p.count("degree M1", 1)?, p.count("degree M2", 1)?];
        for what in ["closed in u", "closed in v", "polynomial", "periodic in u", "periodic in v"] {
            p.integer_or(what, 0)?;
        }
        let counts = [upper[0] + 1, upper[1] + 1];
        let knot_counts = [counts[0] + degrees[0] + 1, counts[1] + degrees[1] + 1];
        let net = counts[0].saturating_mul(counts[1]);
        p.expect(
            net.saturating_mul(4).saturating_add(knot_counts[0] + knot_counts[1]),
            "knots, weights and points",
        )?;
        let knots = [
            without_rounding(p.reals(knot_counts[0], "knot of u")?),
            without_rounding(p.reals(knot_counts[1], "knot of v")?),
        ];
        let weights = normalised_weights(p.reals(net, "weight")?);
        let points = p.points(net, "control point")?;
        let mut range = [f64::NAN; 4];
        for value in &mut range {
            *value = p.real_or("range", f64::NAN)?;
        }
        let placed = self.placed(entity, map)?;
        let net_points = transpose(&points, counts, |q| placed.point(q));
        let weights = weights.map(|w| transpose(&w, counts, |w| *w));
        let surface = Surface::try_new(degrees, knots, net_points, weights)
            .map_err(|e| self.nurbs_fault(entity, &e))?;
        let range = [[range[0], range[1]], [range[2], range[3]]];
        Ok(narrowed(on_period(clamped(surface), range), range))
    }

    /// Parametric spline surface (114): CTYPE, PTYPE, M, N, M+1 and N+1 breakpoints, then for each of (M+1)(N+1)
    /// patches, v fastest, 16 coefficients each of x, y, z (s fastest). The last row and column of patches are unused
    /// and omitted by some writers.
    fn spline_surface(&self, entity: usize, map: &Affine) -> Result<BasisSurface, Fault> {
        let mut p = self.file.params(entity)?;
        p.integer_or("spline type", 0)?;
        p.integer_or("patch type", 0)?;
        let spans = [p.count("M", 48)?, p.count("N", 48)?];
        let patches = spans[0].saturating_mul(spans[1]);
        p.expect(patches.saturating_mul(48), "patch coefficients")?;
        let breaks =
            [p.reals(spans[0] + 1, "breakpoint of u")?, p.reals(spans[1] + 1, "breakpoint of v")?];
        let counts = [3 * spans[0] + 1, 3 * spans[1] + 1];
        let mut points = vec![Vec3::zeros(); counts[0] * counts[1]];
        let bare = p.remaining() <= 48 * patches + 8;
        for i in 0..spans[0] {
            for j in 0..spans[1] + usize::from(!bare) {
                let mut axes = [[[0.0; 4]; 4]; 3];
                for value in axes.iter_mut().flatten().flatten() {
                    *value = p.real("coefficient")?;
                }
                if j == spans[1] {
                    continue;
                }
                let (hu, hv) = (breaks[0][i + 1] - breaks[0][i], breaks[1][j + 1] - breaks[1][j]);
                let axes = axes.map(|c| patch_to_bezier(c, hu, hv));
                for (a, b) in (0..4).flat_map(|a| (0..4).map(move |b| (a, b))) {
                    let point = Vec3::new(axes[0][b][a], axes[1][b][a], axes[2][b][a]);
                    points[(3 * i + a) * counts[1] + 3 * j + b] = point;
                }
            }
        }
        let knots = breaks.map(|b| piecewise_cubic_knots(&b));
        let placed = self.placed(entity, map)?;
        points.iter_mut().for_each(|q| *q = placed.point(q));
        let surface = Surface::try_new([3, 3], knots, points, None)
            .map_err(|e| self.nurbs_fault(entity, &e))?;
        Ok(narrowed(surface, [[f64::NAN; 2]; 2]))
    }
}

/// The same surface with clamped knot vectors (periodic splines have knots beyond the domain).
fn clamped(surface: Surface) -> Surface {
    let ([u, v], knots) = (surface.domain(), surface.knots());
    if is_clamped(knots[0], u) && is_clamped(knots[1], v) {
        return surface;
    }
    surface.trimmed(u, v).unwrap_or(surface)
}

/// Moves the seam of a closed surface to the period stated by the file. Some writers give a range, and parameter
/// curves, that begin within the knots and end one period later.
fn on_period(mut surface: Surface, range: [[f64; 2]; 2]) -> Surface {
    for (k, [from, to]) in range.into_iter().enumerate() {
        let [low, high] = surface.domain()[k];
        let tolerance = 1e-6 * (high - low);
        let is_period = (to - from - (high - low)).abs() <= tolerance;
        let is_beyond = from < low - tolerance || to > high + tolerance;
        if is_period && is_beyond && is_closed(&surface, k) {
            surface = surface.with_seam_at(k, from).unwrap_or(surface);
        }
    }
    surface
}

/// True when both boundary curves at the ends of parameter `k` coincide.
fn is_closed(surface: &Surface, k: usize) -> bool {
    const STEPS: usize = 8;
    let domain = surface.domain();
    let ([low, high], [a, b]) = (domain[k], domain[1 - k]);
    let at = |t: f64, step: usize| {
        let mut uv = Vec2::repeat(t);
        uv[1 - k] = a + (b - a) * step as f64 / STEPS as f64;
        surface.point(uv)
    };
    let first = at(low, 0);
    let size = surface.points().iter().map(|p| (p - first).norm()).fold(0.0, f64::max);
    (0..=STEPS).all(|step| (at(low, step) - at(high, step)).norm() <= 1e-6 * size)
}

/// Reorders a net from "u fastest" to "v fastest".
fn transpose<T, U>(net: &[T], counts: [usize; 2], map: impl Fn(&T) -> U) -> Vec<U> {
    let mut out = Vec::with_capacity(net.len());
    for i in 0..counts[0] {
        out.extend(net.iter().skip(i).step_by(counts[0].max(1)).map(&map));
    }
    out
}

/// Bezier ordinates `[along t][along s]` of `sum c[t][s] s^i t^j`.
fn patch_to_bezier(coefficients: [[f64; 4]; 4], hu: f64, hv: f64) -> [[f64; 4]; 4] {
    let along_u = coefficients.map(|row| power_to_bezier(row, hu));
    let mut out = [[0.0; 4]; 4];
    for s in 0..4 {
        let column =
            power_to_bezier([along_u[0][s], along_u[1][s], along_u[2][s], along_u[3][s]], hv);
        for t in 0..4 {
            out[t][s] = column[t];
        }
    }
    out
}

/// Knot vector of a piecewise cubic with these breakpoints.
fn piecewise_cubic_knots(breaks: &[f64]) -> Vec<f64> {
    let ends = breaks
        .first()
        .into_iter()
        .chain(breaks.iter().flat_map(|b| [b, b, b]))
        .chain(breaks.last());
    ends.copied().collect()
}

/// A rational B-spline surface with the parameter range stated in the file.
pub(super) fn narrowed(surface: Surface, range: [[f64; 2]; 2]) -> BasisSurface {
    let full = surface.domain();
    let mut domain = full;
    let mut less = false;
    for k in 0..2 {
        let tolerance = 1e-9 * (full[k][1] - full[k][0]);
        let (from, to) = (range[k][0].max(full[k][0]), range[k][1].min(full[k][1]));
        if to - from > tolerance && (from > full[k][0] + tolerance || to < full[k][1] - tolerance) {
            domain[k] = [from, to];
            less = true;
        }
    }
    BasisSurface { narrowed: less, ..BasisSurface::plain(RawSurface::Nurbs(surface), Some(domain)) }
}
