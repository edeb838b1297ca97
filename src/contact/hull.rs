//! Lower distance bounds for pieces with a poor parametrisation: the control net, and the piece as a height function
//! over the tangent plane at its centre.
//!
//! Nearly flat pieces with sides of very different length make `F(u, v)` non-convex by their parametrisation alone. Let
//! `h(x)` be the height of the piece at the place `x` in the plane and `(a, c)` the point. Then
//! `G(x) = |x - a|^2 / 2 + (h(x) - c)^2 / 2` has second derivatives of at least `mu = 1 - |h - c| |h''|`. Where that is
//! positive, a foot point `x` with gradient `g` gives `G(y) >= G(x) + g . (y - x) + mu |y - x|^2 / 2`.
//!
//! The bounds hold over a domain enlarged by [`DOMAIN_ENLARGEMENT`]. Its image contains the convex hull of that of the
//! piece, so that `h` is known on straight lines from the foot point to all points of the piece.

use super::form::{LocalDerivs, Shape};
use super::piece::Piece;
use kanagata_geometry::{Vec2, Vec3};
use kanagata_tool::bezier::along_both;

/// Factor on the corners of the domain. Doubled: hulls of strongly curved pieces are still contained, with looser
/// bounds.
const DOMAIN_ENLARGEMENT: f64 = 1.25;

/// Bounds of a piece, computed once because they are too expensive for a query.
#[derive(Debug, Clone)]
pub(super) struct Hull {
    /// Control net relative to the centre of the piece [mm].
    net: Box<[Vec3]>,
    height: Height,
}

/// The piece as a height function over the tangent plane at its centre.
#[derive(Debug, Clone, Copy)]
struct Height {
    normal: Vec3,
    /// Largest absolute height [mm].
    max_height: f64,
    /// Bound of the second derivatives with respect to place [1/mm]; infinite where the piece is no height function.
    bend: f64,
}

impl Hull {
    pub(super) fn of(piece: &Piece) -> Self {
        let net = control_net(piece).into();
        let flat = Height { normal: Vec3::z(), max_height: 0.0, bend: f64::INFINITY };
        Self { net, height: Height::of(piece).unwrap_or(flat) }
    }

    /// Control net relative to the centre of the piece [mm].
    pub(super) fn net(&self) -> &[Vec3] {
        &self.net
    }

    /// Lower bound of half the squared distance [mm^2] for a point at `w` from the centre and a foot point with
    /// derivatives `d`; minus infinity when unknown.
    pub(super) fn floor(&self, w: &Vec3, d: &LocalDerivs) -> f64 {
        const CONVEXITY_MIN: f64 = 0.05;
        let Height { normal, max_height, bend } = self.height;
        let mu = 1.0 - (normal.dot(w).abs() + max_height) * bend;
        if mu.is_nan() || mu < CONVEXITY_MIN {
            return f64::NEG_INFINITY;
        }
        let q = w - d.s;
        let in_plane = |v: &Vec3| v - normal * normal.dot(v);
        let (a, b) = (in_plane(&d.d1), in_plane(&d.d2));
        let (e, f, g) = (a.norm_squared(), a.dot(&b), b.norm_squared());
        let (along, across) = (-q.dot(&d.d1), -q.dot(&d.d2));
        let gradient =
            (a * (g * along - f * across) + b * (e * across - f * along)) / (e * g - f * f);
        let to_net = self.net.iter().map(|p| gradient.dot(&(p - d.s)));
        let linear = to_net.fold(f64::INFINITY, f64::min);
        0.5 * q.norm_squared() + linear.max(-0.5 * gradient.norm_squared() / mu)
    }
}

impl Height {
    /// `None` where the piece is no height function over the tangent plane at its centre, or its outline is too far
    /// from convex.
    fn of(piece: &Piece) -> Option<Self> {
        let (c1, c2) = (piece.form.low[3], piece.form.low[1]);
        // Parameters as lengths along the two tangents at the centre.
        let [u, v] = [c1.norm(), c2.norm()];
        let normal = c1.cross(&c2);
        let sine = normal.norm() / (u * v);
        if !(sine.is_finite() && sine > 1e-3) {
            return None;
        }
        let normal = normal.normalize();
        // Norm of the inverse of the matrix of both tangents, and the coefficient of each in a vector.
        let inverse = 1.0 / (1.0 - c1.dot(&c2).abs() / (u * v)).sqrt();
        let (reciprocal1, reciprocal2) =
            (c2.cross(&normal) / (v * sine), normal.cross(&c1) / (u * sine));
        let fraction = |c: &Vec3| reciprocal1.dot(c).hypot(reciprocal2.dot(c));
        let Sums { max_height, slope, up, plane, turn } =
            Sums::of(piece, &normal, [u, v], fraction);
        if turn >= 0.9 {
            return None;
        }
        let inverse = inverse / (1.0 - turn);
        let margin = (DOMAIN_ENLARGEMENT - 1.0) * narrowest(piece.shape) * u.min(v);
        if 3.0 * inverse * bulge(piece)? > margin {
            return None;
        }
        let bend = inverse * inverse * (up + inverse * slope * plane);
        Some(Self { normal, max_height: max_height * (1.0 + 1e-12), bend: bend * (1.0 + 1e-12) })
    }
}

/// Bounds over the enlarged domain of the terms of second and higher order; derivatives with respect to the lengths
/// along the tangents at the centre.
#[derive(Default)]
struct Sums {
    /// Bound of the height.
    max_height: f64,
    slope: f64,
    up: f64,
    /// Bound of the second derivatives of the place.
    plane: f64,
    /// Bound of the change of the first derivatives relative to those at the centre.
    turn: f64,
}

impl Sums {
    fn of(piece: &Piece, normal: &Vec3, [u, v]: [f64; 2], fraction: impl Fn(&Vec3) -> f64) -> Self {
        let (degrees, c) = piece.form.coefficients();
        let reach = DOMAIN_ENLARGEMENT * piece.shape.reach();
        let mut sums = Self::default();
        for (at, c) in c.iter().enumerate() {
            let (i, j) = (at / (degrees[1] + 1), at % (degrees[1] + 1));
            if i + j < 2 {
                continue;
            }
            let height = normal.dot(c).abs();
            let (x, y) = (i as f64, j as f64);
            let first = (x / u).hypot(y / v) * reach.powi((i + j - 1) as i32);
            let [xx, xy, yy] = [x * (x - 1.0) / (u * u), x * y / (u * v), y * (y - 1.0) / (v * v)];
            let second =
                (xx * xx + 2.0 * xy * xy + yy * yy).sqrt() * reach.powi((i + j - 2) as i32);
            sums.max_height += height * reach.powi((i + j) as i32);
            sums.slope += height * first;
            sums.up += height * second;
            sums.turn += fraction(c) * first;
            sums.plane += (c - normal * normal.dot(c)).norm() * second;
        }
        sums
    }
}

/// Distance between this domain and the boundary of one twice as large.
fn narrowest(shape: Shape) -> f64 {
    match shape {
        Shape::Square => 1.0,
        Shape::Triangle => 1.0 / 3.0 * std::f64::consts::FRAC_1_SQRT_2,
    }
}

/// Largest distance of the sides from their chords, projected along the normal at the centre [mm]; `None` when the
/// corners do not form a convex polygon.
fn bulge(piece: &Piece) -> Option<f64> {
    let (e1, e2) = (piece.form.low[3].normalize(), piece.form.low[1]);
    let e2 = (e2 - e1 * e1.dot(&e2)).normalize();
    let flat = |p: &Vec3| Vec2::new(e1.dot(p), e2.dot(p));
    let sides = piece.shape.sides();
    let corners = piece.shape.corners();
    let at = |k: usize| flat(&piece.form.derivs(corners[k % sides].x, corners[k % sides].y).s);
    let mut max_distance = 0.0_f64;
    for k in 0..sides {
        let (a, b, c) = (at(k), at(k + 1), at(k + 2));
        if (b - a).perp(&(c - b)) < 0.0 {
            return None;
        }
        max_distance = max_distance.max(off_chord(
            piece,
            [corners[k % sides], corners[(k + 1) % sides]],
            flat,
        ));
    }
    Some(max_distance)
}

/// Bound of the distance of the side between two corners from its chord, by its second derivative.
fn off_chord(piece: &Piece, [from, to]: [Vec2; 2], flat: impl Fn(&Vec3) -> Vec2) -> f64 {
    let (degrees, c) = piece.form.coefficients();
    let half = 0.5 * (to - from);
    let reach = piece.shape.reach();
    let bend: f64 = c
        .iter()
        .enumerate()
        .map(|(at, c)| {
            let (i, j) = (at / (degrees[1] + 1), at % (degrees[1] + 1));
            let (x, y) = (i as f64, j as f64);
            let factor = x * (x - 1.0) * half.x * half.x
                + 2.0 * x * y * (half.x * half.y).abs()
                + y * (y - 1.0) * half.y * half.y;
            if i + j < 2 { 0.0 } else { flat(c).norm() * factor * reach.powi((i + j - 2) as i32) }
        })
        .sum();
    0.5 * bend
}

/// Bernstein control points relative to the centre of the piece [mm]; their convex hull contains the piece.
pub(super) fn control_net(piece: &Piece) -> Vec<Vec3> {
    let (degrees, c) = piece.form.coefficients();
    if piece.shape == Shape::Triangle {
        return triangle_net(piece);
    }
    along_both(degrees, c, to_bernstein)
}

/// Corners and middle control points of a quadratic triangle.
fn triangle_net(piece: &Piece) -> Vec<Vec3> {
    let corners = &piece.shape.corners()[..3];
    let at = |x: &Vec2| piece.form.derivs(x.x, x.y).s;
    let pairs = corners.iter().zip(corners.iter().cycle().skip(1));
    pairs
        .flat_map(|(a, b)| {
            let (p, q) = (at(a), at(b));
            [p, 2.0 * at(&(0.5 * (a + b))) - 0.5 * (p + q)]
        })
        .collect()
}

/// Converts monomial coefficients over [-1, 1] to Bernstein ones: `u = 2 t - 1`, then
/// `P_k = sum_i binomial(k, i) / binomial(n, i) a_i`.
fn to_bernstein(c: &mut [Vec3]) {
    let n = c.len() - 1;
    for level in 0..n {
        for k in (level..n).rev() {
            let next = c[k + 1];
            c[k] -= next;
        }
    }
    let mut factor = 1.0;
    for (i, x) in c.iter_mut().enumerate() {
        // 2^i / binomial(n, i)
        *x *= factor;
        factor *= 2.0 * (i + 1) as f64 / (n - i).max(1) as f64;
    }
    for level in 1..=n {
        for k in (level..=n).rev() {
            let last = c[k - 1];
            c[k] += last;
        }
    }
}
