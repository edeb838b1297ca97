//! Where the offset of a face folds: the smallest factor `1 + d k` over its region.
//!
//! The offset by `d` along the outward normal has the tangents `(1 + d k) t` along the principal directions, where `k`
//! is the principal curvature, positive where the surface bends away from the normal (do Carmo 1976, 3.5, exercise 11).
//! It folds where a factor is not positive.

use super::cell::{Cell, cells_of};
use crate::model::Face;
use crate::trim_region::TrimRegion;
use kanagata_geometry::nurbs::SurfaceDerivs;
use kanagata_geometry::{Vec2, Vec3};

/// Bisections of a knot span at most, in both directions together. Doubled: no smaller factor on the fillets of the tests.
const DEPTH_MAX: u32 = 20;
/// Cells of a face at most, in addition to four for each knot span.
const CELLS_MAX: usize = 20_000;
/// Variation of the factor within a cell below which it is not divided.
const VARIATION_MIN: f64 = 1e-6;
/// Points of every span of a trimming curve.
const BORDER_POINTS: usize = 16;
/// Length of a tangent over that of the other, times the widths of the parameter ranges, below which the point is
/// degenerate and has no curvatures.
const REGULAR_RATIO_MIN: f64 = 1e-6;

/// The tightest place of a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Tightest {
    /// Smallest factor `1 + d k`.
    pub factor: f64,
    /// The place [mm].
    pub at: Vec3,
}

impl Tightest {
    /// Radius of curvature [mm] for the offset `distance` [mm]; infinite where the face does not bend to its side.
    pub fn radius(&self, distance: f64) -> f64 {
        if self.factor < 1.0 { distance.abs() / (1.0 - self.factor) } else { f64::INFINITY }
    }
}

/// Principal curvatures of a face, positive where it bends away from its outward normal [1/mm]; `None` at degenerate
/// points.
pub(super) fn principal_curvatures(face: &Face, d: &SurfaceDerivs) -> Option<[f64; 2]> {
    let [along_u, along_v] = face.reach(d);
    if along_u.min(along_v) <= REGULAR_RATIO_MIN * along_u.max(along_v) {
        return None;
    }
    let cross = d.su.cross(&d.sv);
    let area = cross.norm_squared();
    let n = cross / area.sqrt() * if face.flipped { -1.0 } else { 1.0 };
    let [e, f, g] = [d.su.norm_squared(), d.su.dot(&d.sv), d.sv.norm_squared()];
    let [l, m, q] = [d.suu.dot(&n), d.suv.dot(&n), d.svv.dot(&n)];
    let mean = (e * q - 2.0 * f * m + g * l) / (2.0 * area);
    let gauss = (l * q - m * m) / area;
    let half = (mean * mean - gauss).max(0.0).sqrt();
    let found = [-mean - half, -mean + half];
    found.iter().all(|k| k.is_finite()).then_some(found)
}

/// Search over one face.
struct Search<'f> {
    face: &'f Face,
    region: &'f TrimRegion,
    distance: f64,
    best: Option<Tightest>,
}

/// The place of a face where the offset by `distance` [mm] is closest to folding; `None` for a face that is degenerate
/// everywhere.
///
/// Cells of the knot spans are divided where the factor could fall below the smallest one found, if it varied as much
/// beyond the points of the cell as between them. The trimming curves are sampled in addition.
pub(super) fn tightest(face: &Face, region: &TrimRegion, distance: f64) -> Option<Tightest> {
    let mut search = Search { face, region, distance, best: None };
    for used in face.loops.iter().flat_map(|l| &l.uses) {
        let mut ends = used.pcurve.knots().to_vec();
        ends.dedup();
        for w in ends.windows(2) {
            for k in 0..=BORDER_POINTS {
                let t = w[0] + (w[1] - w[0]) * k as f64 / BORDER_POINTS as f64;
                search.factor(used.pcurve.point(t), true);
            }
        }
    }
    let mut stack = cells_of(face, region);
    let mut left = CELLS_MAX + 4 * stack.len();
    while let Some(cell) = stack.pop() {
        if left == 0 {
            break;
        }
        left -= 1;
        if search.is_worth_dividing(&cell) {
            stack.extend(cell.quarters());
        }
    }
    search.best
}

impl Search<'_> {
    /// The smaller factor at a point, recorded if the point is in the region.
    fn factor(&mut self, uv: Vec2, is_inside: bool) -> Option<f64> {
        let d = self.face.surface.derivs(uv);
        let curvatures = principal_curvatures(self.face, &d)?;
        let factor =
            curvatures.map(|k| 1.0 + self.distance * k).into_iter().fold(f64::MAX, f64::min);
        if self.best.is_none_or(|b| factor < b.factor) && (is_inside || self.region.contains(uv)) {
            self.best = Some(Tightest { factor, at: d.s });
        }
        Some(factor)
    }

    /// Computes the factor at the points of a cell; true if it may be smaller elsewhere in it.
    fn is_worth_dividing(&mut self, cell: &Cell) -> bool {
        if !cell.is_in(self.region) {
            return false;
        }
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for uv in cell.points() {
            if let Some(factor) = self.factor(uv, false) {
                (low, high) = (low.min(factor), high.max(factor));
            }
        }
        let variation = high - low;
        let known = self.best.map_or(f64::INFINITY, |b| b.factor);
        cell.depth < DEPTH_MAX && variation > VARIATION_MIN && low - variation < known
    }
}
