//! A piece of a patch: a convex part of its parameter domain, small enough for Newton, with a tight box
//! from the control net of that part and a bound that certifies the distance as convex over it.

use crate::geometry::{Aabb, Vec2, Vec3};
use crate::tool::Patch;

/// A convex polygon of three or four corners in the parameter plane, counter-clockwise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Domain {
    corners: [Vec2; 4],
    count: usize,
}

impl Domain {
    /// The whole domain of `patch`: `0 <= zeta <= eta <= 1` or the unit square.
    pub(super) fn whole(patch: &Patch) -> Self {
        let [o, e, d, z] =
            [Vec2::new(0.0, 0.0), Vec2::new(1.0, 0.0), Vec2::new(1.0, 1.0), Vec2::new(0.0, 1.0)];
        if patch.sides() == 3 {
            Self { corners: [o, e, d, d], count: 3 }
        } else {
            Self { corners: [o, e, d, z], count: 4 }
        }
    }

    pub(super) fn corners(&self) -> &[Vec2] {
        &self.corners[..self.count]
    }

    pub(super) fn centre(&self) -> Vec2 {
        self.corners().iter().sum::<Vec2>() / self.count as f64
    }

    /// Side k as a half-plane: `outward . x <= offset` inside, `outward` of length one.
    pub(super) fn side(&self, k: usize) -> (Vec2, f64) {
        let (a, b) = (self.corners[k], self.corners[(k + 1) % self.count]);
        let along = b - a;
        let outward = Vec2::new(along.y, -along.x) / along.norm();
        (outward, outward.dot(&a))
    }

    pub(super) fn sides(&self) -> usize {
        self.count
    }

    /// True inside, clear of every side.
    pub(super) fn holds(&self, x: &Vec2) -> bool {
        (0..self.count).all(|k| {
            let (outward, offset) = self.side(k);
            outward.dot(x) < offset - 1e-9
        })
    }

    /// The domain with every corner moved out from the centre by `share`.
    pub(super) fn widened(&self, share: f64) -> Self {
        let centre = self.centre();
        let corners = self.corners.map(|c| centre + (c - centre) * (1.0 + 2.0 * share));
        Self { corners, count: self.count }
    }

    /// Four equal parts.
    pub(super) fn quarters(&self) -> [Self; 4] {
        let c = self.corners;
        let mid = |a: usize, b: usize| 0.5 * (c[a] + c[b]);
        if self.count == 3 {
            let (m01, m12, m20) = (mid(0, 1), mid(1, 2), mid(2, 0));
            let tri = |a, b, c| Self { corners: [a, b, c, c], count: 3 };
            return [
                tri(c[0], m01, m20),
                tri(m01, c[1], m12),
                tri(m20, m12, c[2]),
                tri(m01, m12, m20),
            ];
        }
        let (m01, m12, m23, m30, o) = (mid(0, 1), mid(1, 2), mid(2, 3), mid(3, 0), self.centre());
        let quad = |a, b, c, d| Self { corners: [a, b, c, d], count: 4 };
        [
            quad(c[0], m01, o, m30),
            quad(m01, c[1], m12, o),
            quad(o, m12, c[2], m23),
            quad(m30, o, m23, c[3]),
        ]
    }

    /// Two halves, across the direction eta (`axis` 0) or zeta (1); rectangles only.
    fn halves(&self, axis: usize) -> [Self; 2] {
        let c = self.corners;
        let mid = |a: usize, b: usize| 0.5 * (c[a] + c[b]);
        let quad = |a, b, c, d| Self { corners: [a, b, c, d], count: 4 };
        if axis == 0 {
            let (low, high) = (mid(0, 1), mid(3, 2));
            [quad(c[0], low, high, c[3]), quad(low, c[1], c[2], high)]
        } else {
            let (left, right) = (mid(0, 3), mid(1, 2));
            [quad(c[0], c[1], right, left), quad(left, right, c[2], c[3])]
        }
    }
}

/// A piece of a patch.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    pub(super) patch: u32,
    pub(super) domain: Domain,
    /// Holds the piece for certain.
    pub(super) bounds: Aabb,
    /// Corners and centre in space, starting points of Newton.
    pub(super) samples: [Vec3; 5],
    /// The squared distance is convex over the piece for points nearer than this to all of it [mm].
    pub(super) convex_within: f64,
    /// The piece lies in a plane: a foot inside it is the only one, however its parameters are stretched.
    pub(super) planar: bool,
}

/// Bend of a piece out of its plane, over its size, that is nothing but rounding in the CAD.
const PLANAR: f64 = 1e-8;

fn planar(patch: &Patch, domain: &Domain, size: f64) -> bool {
    let centre = domain.centre();
    let Some(n) = patch.normal(centre.x, centre.y) else { return false };
    domain.corners().iter().chain([&centre]).all(|x| {
        let d = patch.derivs(x.x, x.y);
        let out = [d.d1, d.d2, d.d11, d.d12, d.d22].map(|v| n.dot(&v).abs());
        out.into_iter().all(|o| o <= PLANAR * size)
    })
}

impl Piece {
    pub(super) fn new(id: u32, patch: &Patch, domain: Domain) -> Self {
        let mut samples = [Vec3::zeros(); 5];
        for (slot, x) in samples.iter_mut().zip(domain.corners()) {
            *slot = patch.derivs(x.x, x.y).s;
        }
        let centre = domain.centre();
        samples[4] = patch.derivs(centre.x, centre.y).s;
        if domain.sides() == 3 {
            samples[3] = samples[4];
        }
        let bounds = bounds(patch, &domain);
        Self {
            patch: id,
            domain,
            bounds,
            samples,
            convex_within: convex_within(patch, &domain),
            planar: planar(patch, &domain, bounds.diagonal()),
        }
    }

    /// Parameters of sample `k`.
    pub(super) fn sample_at(&self, k: usize) -> Vec2 {
        self.domain.corners().get(k).copied().unwrap_or_else(|| self.domain.centre())
    }

    /// Its four quarters.
    pub(super) fn quarters(&self, patch: &Patch) -> [Self; 4] {
        self.domain.quarters().map(|d| Self::new(self.patch, patch, d))
    }
}

/// Cuts a patch into pieces whose normals turn by at most about 25 degrees, at most 4^3 of them.
pub(super) fn pieces_of(id: u32, patch: &Patch) -> Vec<Piece> {
    const COS_TURN: f64 = 0.9;
    const MAX_DEPTH: u32 = 6;
    let mut done = Vec::new();
    let mut todo = vec![(Domain::whole(patch), 0)];
    while let Some((domain, depth)) = todo.pop() {
        let (turn, axis) = turning(patch, &domain);
        if turn >= COS_TURN || depth >= MAX_DEPTH {
            done.push(Piece::new(id, patch, domain));
        } else if domain.sides() == 3 {
            todo.extend(domain.quarters().map(|d| (d, depth + 2)));
        } else {
            todo.extend(domain.halves(axis).map(|d| (d, depth + 1)));
        }
    }
    done
}

/// Smallest cosine between the normals over the corners and the axis along which they turn more.
fn turning(patch: &Patch, domain: &Domain) -> (f64, usize) {
    let normals: Vec<_> = domain.corners().iter().filter_map(|x| patch.normal(x.x, x.y)).collect();
    let cosine = |a: usize, b: usize| match (normals.get(a), normals.get(b)) {
        (Some(n), Some(m)) => n.dot(m),
        _ => 1.0,
    };
    let along_eta = cosine(0, 1).min(cosine(3, 2));
    let along_zeta = cosine(1, 2).min(cosine(0, 3));
    let smallest = along_eta.min(along_zeta).min(cosine(0, 2)).min(cosine(1, 3));
    (smallest, usize::from(along_zeta < along_eta))
}

/// Box of the control net of `patch` over `domain`: holds the patch by the convex hull property.
fn bounds(patch: &Patch, domain: &Domain) -> Aabb {
    let mut out = Aabb::EMPTY;
    match patch {
        Patch::Bezier { degrees, points } => {
            let (low, high) = (domain.corners[0], domain.corners[2]);
            for p in sub_net(*degrees, points, low, high) {
                out.grow(&p);
            }
        }
        Patch::Triangle(_) => {
            let c = domain.corners();
            for k in 0..3 {
                let (a, b) = (c[k], c[(k + 1) % 3]);
                out.grow(&point(patch, a));
                out.grow(&middle_control(patch, a, b));
            }
        }
        Patch::Quad(_) => {
            for p in quadratic_net(patch, domain) {
                out.grow(&p);
            }
        }
    }
    out.widened(1e-14 * (1.0 + out.diagonal() + out.center().amax()))
}

fn point(patch: &Patch, x: Vec2) -> Vec3 {
    patch.derivs(x.x, x.y).s
}

/// Middle control point of the quadratic curve from `a` to `b`.
fn middle_control(patch: &Patch, a: Vec2, b: Vec2) -> Vec3 {
    2.0 * point(patch, 0.5 * (a + b)) - 0.5 * (point(patch, a) + point(patch, b))
}

/// Nine control points of a patch that is quadratic in each direction over a rectangle (Eq. 15 restated
/// by interpolation at thirds of the net: ends and middles).
fn quadratic_net(patch: &Patch, domain: &Domain) -> [Vec3; 9] {
    let (low, high) = (domain.corners[0], domain.corners[2]);
    let at = |i: usize, j: usize| {
        let t = Vec2::new(0.5 * i as f64, 0.5 * j as f64);
        point(patch, low + (high - low).component_mul(&t))
    };
    let mut net = [Vec3::zeros(); 9];
    for i in 0..3 {
        let [a, m, b] = [at(i, 0), at(i, 1), at(i, 2)];
        net[3 * i] = a;
        net[3 * i + 1] = 2.0 * m - 0.5 * (a + b);
        net[3 * i + 2] = b;
    }
    for j in 0..3 {
        net[3 + j] = 2.0 * net[3 + j] - 0.5 * (net[j] + net[6 + j]);
    }
    net
}

/// Control net over a part of the domain (de Casteljau in each direction).
fn sub_net(degrees: [usize; 2], points: &[Vec3], low: Vec2, high: Vec2) -> Vec<Vec3> {
    let [n, m] = degrees;
    let mut net = points.to_vec();
    for row in net.chunks_mut(m + 1) {
        sub_curve(row, low.y, high.y);
    }
    let mut column = vec![Vec3::zeros(); n + 1];
    for j in 0..=m {
        for (i, slot) in column.iter_mut().enumerate() {
            *slot = net[i * (m + 1) + j];
        }
        sub_curve(&mut column, low.x, high.x);
        for (i, p) in column.iter().enumerate() {
            net[i * (m + 1) + j] = *p;
        }
    }
    net
}

/// Replaces the control points of a curve by those of its part from `a` to `b`, `0 <= a < b <= 1`.
fn sub_curve(points: &mut [Vec3], a: f64, b: f64) {
    let n = points.len();
    for level in 1..n {
        for i in (level..n).rev() {
            points[i] = points[i - 1] * (1.0 - b) + points[i] * b;
        }
    }
    let t = a / b;
    for level in 1..n {
        for i in 0..n - level {
            points[i] = points[i] * (1.0 - t) + points[i + 1] * t;
        }
    }
}

/// Distance under which `|p - S|^2 / 2` is convex over the piece: Hessian = G - (p - S) . S_ij, with the
/// parameters scaled by the patch's size so that G is near one.
fn convex_within(patch: &Patch, domain: &Domain) -> f64 {
    let centre = domain.centre();
    let c = patch.derivs(centre.x, centre.y);
    let (l1, l2) = (c.d1.norm(), c.d2.norm());
    if !(l1 > 0.0 && l2 > 0.0) {
        return 0.0;
    }
    let (mut g_min, mut h_max) = (f64::INFINITY, 0.0_f64);
    for x in domain.corners().iter().chain(std::iter::once(&centre)) {
        let d = patch.derivs(x.x, x.y);
        let (a, b) = (d.d1 / l1, d.d2 / l2);
        let (e, f, g) = (a.norm_squared(), a.dot(&b), b.norm_squared());
        let spread = (0.25 * (e - g) * (e - g) + f * f).sqrt();
        g_min = g_min.min(0.5 * (e + g) - spread);
        let h = d.d11.norm_squared() / l1.powi(4)
            + 2.0 * d.d12.norm_squared() / (l1 * l2).powi(2)
            + d.d22.norm_squared() / l2.powi(4);
        h_max = h_max.max(h.sqrt());
    }
    // The metric inside a piece is bounded by its values at the corners up to its small variation.
    0.8 * g_min.max(0.0) / h_max.max(1e-300)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sub_curve_of_a_cubic_is_the_cubic() {
        let mut points = [
            Vec3::new(0.0, 0.0, 0.0),
            Vec3::new(1.0, 2.0, 0.0),
            Vec3::new(3.0, -1.0, 1.0),
            Vec3::new(4.0, 0.0, 2.0),
        ];
        let eval = |p: &[Vec3; 4], t: f64| {
            let s = 1.0 - t;
            p[0] * s * s * s + p[1] * 3.0 * s * s * t + p[2] * 3.0 * s * t * t + p[3] * t * t * t
        };
        let whole = points;
        let (a, b) = (0.3, 0.8);
        sub_curve(&mut points, a, b);
        for k in 0..=10 {
            let t = f64::from(k) / 10.0;
            assert!((eval(&points, t) - eval(&whole, a + (b - a) * t)).norm() < 1e-14);
        }
    }
}
