//! Tight bounding boxes of trimmed faces.

use super::model::{Face, Model};
use super::trim_region::TrimRegion;
use kanagata_geometry::nurbs::Curve2;
use kanagata_geometry::{Aabb, Vec2, Vec3};

impl Face {
    /// Tight bounding box of the trimmed face: its boundary curves, and interior points with a stationary coordinate.
    #[must_use]
    pub fn bbox(&self) -> Aabb {
        let mut bounds = Aabb::EMPTY;
        for used in self.loops.iter().flat_map(|l| &l.uses) {
            self.border_extremes(&used.pcurve, &mut bounds);
        }
        let region = TrimRegion::new(self);
        let Ok(piece) =
            self.surface.trimmed([region.low.x, region.high.x], [region.low.y, region.high.y])
        else {
            return bounds;
        };
        // No interior point lies outside the box of the control points.
        let hull = Aabb::of_points(piece.points());
        let margin = 1e-13 * hull.diagonal();
        for axis in 0..3 {
            if axis == 0
                && (hull.max - bounds.max).max().max((bounds.min - hull.min).max()) > margin
            {
                self.crease_extremes(&region, &mut bounds);
            }
            if hull.max[axis] > bounds.max[axis] + margin {
                self.interior_extremes(&region, axis, 1.0, &mut bounds);
            }
            if hull.min[axis] < bounds.min[axis] - margin {
                self.interior_extremes(&region, axis, -1.0, &mut bounds);
            }
        }
        bounds
    }

    /// Samples a boundary curve and refines the local extrema of each coordinate.
    fn border_extremes(&self, curve: &Curve2, bounds: &mut Aabb) {
        let [a, b] = curve.domain();
        let spans = curve.knots().windows(2).filter(|w| w[0] < w[1]).count();
        let inner = self.surface.knots().iter().map(|k| k.len()).max().unwrap_or(8);
        let n = (16 * spans).max(4 * inner).min(2000);
        let at = |k: usize| a + (b - a) * k as f64 / n as f64;
        let point = |t: f64| self.surface.point(curve.point(t));
        let samples: Vec<Vec3> = (0..=n).map(|k| point(at(k))).collect();
        samples.iter().for_each(|p| bounds.grow(p));
        for (axis, sign) in (0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]) {
            let value = |k: usize| sign * samples[k][axis];
            for k in 1..n {
                let (before, here, after) = (value(k - 1), value(k), value(k + 1));
                let reach = (here - before).max(here - after);
                let end = if sign > 0.0 { bounds.max[axis] } else { -bounds.min[axis] };
                // A smooth maximum exceeds its sample by less than the sample exceeds its neighbours.
                if here >= before && here >= after && reach > 0.0 && here + reach > end {
                    let t = maximum_at(|t| sign * point(t)[axis], at(k - 1), at(k + 1));
                    bounds.grow(&point(t));
                }
            }
        }
    }

    /// Extrema on the knot lines where the surface is only C0: no derivative vanishes there.
    fn crease_extremes(&self, region: &TrimRegion, bounds: &mut Aabb) {
        for (axis, [low, high]) in self.surface.domain().into_iter().enumerate() {
            let (knots, degree) = (self.surface.knots()[axis], self.surface.degrees()[axis]);
            let mut lines: Vec<f64> =
                knots.iter().copied().filter(|t| *t > low && *t < high).collect();
            lines.dedup();
            lines.retain(|t| knots.iter().filter(|k| *k == t).count() >= degree);
            for line in lines {
                self.extremes_along(region, (axis, line), bounds);
            }
        }
    }

    /// Extrema over an isoparametric line of the trimmed region: points at the knots, samples between them, and refined
    /// maxima.
    fn extremes_along(&self, region: &TrimRegion, (axis, line): (usize, f64), bounds: &mut Aabb) {
        const PIECES_A_SPAN: usize = 8;
        let along = 1 - axis;
        let [low, high] = self.surface.domain()[along];
        let mut breaks: Vec<f64> = self.surface.knots()[along].to_vec();
        breaks.retain(|t| *t >= low && *t <= high);
        breaks.dedup();
        let at = |t: f64| if axis == 0 { Vec2::new(line, t) } else { Vec2::new(t, line) };
        let piece = |w: &[f64], k: usize| w[0] + (w[1] - w[0]) * k as f64 / PIECES_A_SPAN as f64;
        let spans = breaks.windows(2).flat_map(|w| (0..PIECES_A_SPAN).map(move |k| piece(w, k)));
        let steps: Vec<f64> = spans.chain(breaks.last().copied()).collect();
        let mut grow = |t: f64| {
            if region.contains(at(t)) {
                bounds.grow(&self.surface.point(at(t)));
            }
        };
        steps.iter().for_each(|&t| grow(t));
        for (coordinate, sign) in (0..3).flat_map(|k| [(k, 1.0), (k, -1.0)]) {
            let value = |t: f64| sign * self.surface.point(at(t))[coordinate];
            for w in steps.windows(3) {
                if value(w[1]) >= value(w[0]).max(value(w[2])) {
                    grow(maximum_at(value, w[0], w[2]));
                }
            }
        }
    }

    /// Stationary points of one coordinate inside the trimmed region, by Newton iteration from every local maximum of a
    /// grid.
    fn interior_extremes(&self, region: &TrimRegion, axis: usize, sign: f64, bounds: &mut Aabb) {
        let count = |k: usize| (4 * self.surface.count()[k]).clamp(12, 96);
        let (nu, nv) = (count(0), count(1));
        let at = |i: usize, j: usize| {
            let fraction = Vec2::new(i as f64 / nu as f64, j as f64 / nv as f64);
            region.low + (region.high - region.low).component_mul(&fraction)
        };
        let value = |uv: Vec2| sign * self.surface.point(uv)[axis];
        let grid: Vec<f64> = (0..=nu)
            .flat_map(|i| (0..=nv).map(move |j| (i, j)))
            .map(|(i, j)| value(at(i, j)))
            .collect();
        for (i, j) in (0..=nu).flat_map(|i| (0..=nv).map(move |j| (i, j))) {
            let here = grid[i * (nv + 1) + j];
            let around = (i.saturating_sub(1)..=(i + 1).min(nu))
                .flat_map(|a| (j.saturating_sub(1)..=(j + 1).min(nv)).map(move |b| (a, b)));
            if around.into_iter().any(|(a, b)| grid[a * (nv + 1) + b] > here) {
                continue;
            }
            let uv = self.ascend(at(i, j), region, axis, sign);
            if region.contains(uv) {
                bounds.grow(&self.surface.point(uv));
            }
        }
    }

    /// Newton iteration towards a stationary point of a coordinate, as long as the coordinate increases.
    fn ascend(&self, mut uv: Vec2, region: &TrimRegion, axis: usize, sign: f64) -> Vec2 {
        for _ in 0..40 {
            let d = self.surface.derivs(uv);
            let g = Vec2::new(d.su[axis], d.sv[axis]);
            let h = nalgebra::Matrix2::new(d.suu[axis], d.suv[axis], d.suv[axis], d.svv[axis]);
            let Some(step) = h.try_inverse().map(|i| i * g) else { break };
            if !step.iter().all(|s| s.is_finite()) {
                break;
            }
            let next = (uv - step).sup(&region.low).inf(&region.high);
            let rise = sign * (self.surface.point(next)[axis] - d.s[axis]);
            if (next - uv).norm() <= 1e-15 * uv.norm() || rise < 0.0 {
                break;
            }
            uv = next;
        }
        uv
    }
}

/// Argument of the maximum of a function of one variable by golden-section search.
fn maximum_at(f: impl Fn(f64) -> f64, mut a: f64, mut b: f64) -> f64 {
    const RATIO: f64 = 0.618_033_988_749_894_9;
    for _ in 0..60 {
        let (c, d) = (b - RATIO * (b - a), a + RATIO * (b - a));
        if f(c) > f(d) {
            b = d;
        } else {
            a = c;
        }
    }
    0.5 * (a + b)
}

impl Model {
    /// Tight bounding box of all faces.
    #[must_use]
    pub fn bbox(&self) -> Aabb {
        use rayon::prelude::*;
        let boxes: Vec<Aabb> = self.faces.par_iter().map(Face::bbox).collect();
        boxes.iter().fold(Aabb::EMPTY, |sum, b| if b.is_empty() { sum } else { sum.union(b) })
    }
}
