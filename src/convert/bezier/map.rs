//! How a patch's parameters go to its face, and how far the patch is from it.

use super::basis::Basis;
use super::parameters;
use super::side::{self, Sides};
use crate::convert::searches::SearchedFace;
use crate::geometry::{Vec2, Vec3};
use crate::mesh::Element;
use crate::tool::Patch;

/// A patch before its degrees are known: the points of its face at the nodes of every degree.
pub(super) struct Shape {
    pub(super) map: Map,
    /// Lowest degrees that keep the tolerance along eta and zeta.
    pub(super) degrees: [usize; 2],
}

/// How a patch's parameters go to its face.
pub(super) struct Map {
    /// The sides (eta, 0), (1, zeta), (eta, 1), (0, zeta).
    pub(super) sides: [Curve; 4],
    /// Parameters cannot be blended: points are, and projected on the face.
    projected: bool,
}

/// A side as a patch sees it, in its own direction, with feet on the patch's face.
pub(super) struct Curve {
    /// `None`: a side of no length.
    pub(super) side: Option<[u32; 2]>,
    reversed: bool,
    feet: Vec<Vec2>,
    points: Vec<Vec3>,
}

/// True when a patch that is about within `tolerance` [mm] of its face looks against it somewhere.
pub(super) fn folds(face: SearchedFace<'_>, patch: &Patch, tolerance: f64) -> bool {
    const STEPS: usize = 12;
    let enough = tolerance * tolerance;
    let mut last: Option<Vec2> = None;
    (0..(STEPS + 1) * (STEPS + 1)).any(|k| {
        // There and back: the next point is beside the last one.
        let (row, along) = (k / (STEPS + 1), k % (STEPS + 1));
        let along = if row % 2 == 0 { along } else { STEPS - along };
        let at = |k: usize| k as f64 / STEPS as f64;
        let d = patch.derivs(at(row), at(along));
        let cross = d.d1.cross(&d.d2);
        let against = |uv: Vec2| {
            let against = |n: Vec3| cross.dot(&n) < -1e-9 * d.d1.norm() * d.d2.norm();
            face.face.normal(uv).is_some_and(against)
        };
        let whole = || face.closest(&d.s).0;
        let near = last.map(|uv| face.closest_near(&d.s, uv, enough).0);
        let mut foot = near.unwrap_or_else(whole);
        // Beyond a pole the last foot leads to the other side of it.
        if near.is_some() && against(foot) {
            foot = whole();
        }
        last = Some(foot);
        against(foot)
    })
}

/// Largest distance of a patch from its face's surface at points between the nodes [mm]. Of points a fourth of the `tolerance`
/// [mm] off or less, the distance from where the map has them at most.
pub(super) fn error(face: SearchedFace<'_>, patch: &Patch, map: &Map, tolerance: f64) -> f64 {
    distances(face, patch, map, tolerance).fold(0.0, f64::max)
}

/// Whether [`error`] is at most `limit` [mm]; ends with the first point that is farther.
pub(super) fn is_within(
    face: SearchedFace<'_>,
    patch: &Patch,
    map: &Map,
    [tolerance, limit]: [f64; 2],
) -> bool {
    distances(face, patch, map, tolerance).all(|distance| distance <= limit)
}

/// The distances of [`error`].
fn distances<'a>(
    face: SearchedFace<'a>,
    patch: &'a Patch,
    map: &'a Map,
    tolerance: f64,
) -> impl Iterator<Item = f64> + 'a {
    const STEPS: usize = 9;
    let enough = (0.25 * tolerance).powi(2);
    (0..STEPS * STEPS).map(move |k| {
        let at = |k: usize| (k as f64 + 0.5) / STEPS as f64;
        let (eta, zeta) = (at(k / STEPS), at(k % STEPS));
        let p = patch.derivs(eta, zeta).s;
        let foot = map
            .parameters(eta, zeta)
            .map_or_else(|| face.closest(&p).0, |uv| face.closest_near(&p, uv, enough).0);
        (face.face.surface.point(foot) - p).norm()
    })
}

impl Map {
    pub(super) fn new(face: SearchedFace<'_>, element: &Element, sides: &Sides) -> Self {
        let mut ring = element.nodes().to_vec();
        let is_pole = |v: &u32| {
            let uv = face.closest(&sides.vertex(*v)).0;
            parameters::collapsed(face.face, uv).is_some()
        };
        if ring.len() == 3
            && let Some(pole) = ring.iter().position(is_pole)
        {
            ring.rotate_left(pole);
        }
        let centre = ring.iter().map(|&v| sides.vertex(v)).sum::<Vec3>() / ring.len() as f64;
        let near = face.closest(&centre).0;
        let curve = |a: u32, b: u32| Curve::new(face, element.face, sides, [a, b], near);
        let sides = match ring[..] {
            [a, b, c] => {
                let (out, back) = (curve(a, b), curve(a, c));
                let point = Curve::point(sides, a, [&out, &back]);
                [out, curve(b, c), back, point]
            }
            [a, b, c, d] => [curve(a, b), curve(b, c), curve(d, c), curve(a, d)],
            _ => [0, 1, 2, 3].map(|_| curve(ring[0], ring[1])),
        };
        let mut map = Self { sides, projected: false };
        // A seam or a pole between the feet: the middle of the map is far from the middle of the sides.
        let size = map.sides.iter().map(Curve::chord).fold(0.0, f64::max);
        let sound = |(eta, zeta): (f64, f64)| {
            let blend = map.blend(eta, zeta, |c, k| c.points[k]);
            let uv = map.parameters(eta, zeta);
            uv.is_some_and(|uv| (face.face.surface.point(uv) - blend).norm() <= 0.4 * size)
        };
        map.projected = ![(0.5, 0.5), (0.25, 0.75), (0.75, 0.25)].into_iter().all(sound);
        map
    }

    /// Transfinite blend of what the sides have at (eta, zeta) (Coons); sides are given at `side::STEPS` steps.
    fn blend<T>(&self, eta: f64, zeta: f64, of: impl Fn(&Curve, usize) -> T) -> T
    where
        T: std::ops::Add<Output = T> + std::ops::Sub<Output = T> + std::ops::Mul<f64, Output = T>,
    {
        let last = side::STEPS;
        let at = |k: usize, t: f64| {
            let x = (t * last as f64).clamp(0.0, last as f64);
            let i = (x.floor() as usize).min(last - 1);
            let f = x - i as f64;
            of(&self.sides[k], i) * (1.0 - f) + of(&self.sides[k], i + 1) * f
        };
        let corner = |k: usize, i: usize| of(&self.sides[k], i);
        at(0, eta) * (1.0 - zeta)
            + at(2, eta) * zeta
            + at(3, zeta) * (1.0 - eta)
            + at(1, zeta) * eta
            - (corner(0, 0) * (1.0 - eta) + corner(0, last) * eta) * (1.0 - zeta)
            - (corner(2, 0) * (1.0 - eta) + corner(2, last) * eta) * zeta
    }

    /// Parameters on the face at (eta, zeta).
    fn parameters(&self, eta: f64, zeta: f64) -> Option<Vec2> {
        (!self.projected).then(|| self.blend(eta, zeta, |c, k| c.feet[k]))
    }

    /// Point of the face at (eta, zeta).
    fn point(&self, face: SearchedFace<'_>, eta: f64, zeta: f64) -> Vec3 {
        match self.parameters(eta, zeta) {
            Some(uv) => face.face.surface.point(uv),
            None => {
                let p = self.blend(eta, zeta, |c, k| c.points[k]);
                face.face.surface.point(face.closest(&p).0)
            }
        }
    }

    /// By how much the sides along a direction miss the edges that they follow [mm].
    pub(super) fn miss(
        &self,
        direction: usize,
        degree: usize,
        sides: &Sides,
        basis: &Basis,
    ) -> f64 {
        let along = self.sides.iter().skip(direction).step_by(2);
        let known = along.filter_map(|curve| sides.get(curve.side?));
        known.map(|side| side.miss(degree, basis)).fold(0.0, f64::max)
    }

    /// Control points of the patch of these degrees.
    pub(super) fn net(
        &self,
        face: SearchedFace<'_>,
        degrees: [usize; 2],
        sides: &Sides,
        basis: &Basis,
    ) -> Vec<Vec3> {
        let [n, m] = degrees;
        let borders: Vec<Vec<Vec3>> =
            (0..4).map(|k| self.sides[k].control(sides, degrees[k % 2], basis)).collect();
        let on_side = |k: usize, t: f64| basis.value(&borders[k], t);
        let mut values = vec![Vec3::zeros(); (n + 1) * (m + 1)];
        for i in 0..=n {
            for j in 0..=m {
                let (eta, zeta) = (basis.node(n, i), basis.node(m, j));
                values[i * (m + 1) + j] = match (i, j) {
                    (_, 0) => on_side(0, eta),
                    (_, j) if j == m => on_side(2, eta),
                    (0, _) => on_side(3, zeta),
                    (i, _) if i == n => on_side(1, zeta),
                    _ => self.point(face, eta, zeta),
                };
            }
        }
        let mut net = basis.tensor(degrees, &values);
        for i in 0..=n {
            (net[i * (m + 1)], net[i * (m + 1) + m]) = (borders[0][i], borders[2][i]);
        }
        for j in 0..=m {
            (net[j], net[n * (m + 1) + j]) = (borders[3][j], borders[1][j]);
        }
        net
    }
}

impl Curve {
    fn new(face: SearchedFace<'_>, id: u32, sides: &Sides, [a, b]: [u32; 2], near: Vec2) -> Self {
        let key = [a.min(b), a.max(b)];
        let Some(side) = sides.get(key) else {
            // Every side of every element is known; this keeps the map whole should one not be.
            let points = vec![sides.vertex(a); side::STEPS + 1];
            let feet = vec![face.closest(&points[0]).0; points.len()];
            return Self { side: None, reversed: false, feet, points };
        };
        let mut points: Vec<Vec3> = side.points.clone();
        let mut feet = side.feet(id).unwrap_or_else(|| parameters::feet(face, &points));
        parameters::unwrap(face.face, &mut feet, near);
        if a > b {
            points.reverse();
            feet.reverse();
        }
        Self { side: Some(key), reversed: a > b, feet, points }
    }

    /// The side of no length where two others begin; its parameters go from those of one to those of the other.
    fn point(sides: &Sides, vertex: u32, [out, back]: [&Self; 2]) -> Self {
        let (p, q) = (out.feet[0], back.feet[0]);
        let foot = |k: usize| p + (q - p) * (k as f64 / side::STEPS as f64);
        let points = vec![sides.vertex(vertex); side::STEPS + 1];
        Self { side: None, reversed: false, feet: (0..points.len()).map(foot).collect(), points }
    }

    fn chord(&self) -> f64 {
        self.points.last().map_or(0.0, |p| (p - self.points[0]).norm())
    }

    /// Control points of the side, the same to the bit for both its patches.
    fn control(&self, sides: &Sides, degree: usize, basis: &Basis) -> Vec<Vec3> {
        let Some(side) = self.side.and_then(|key| sides.get(key)) else {
            return vec![self.points[0]; degree + 1];
        };
        let mut control = basis.curve(degree, &side.values(degree));
        (control[0], control[degree]) = (side.points[0], side.points[side::STEPS]);
        if self.reversed {
            control.reverse();
        }
        control
    }
}
