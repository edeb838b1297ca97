//! Map from the parameters of a patch to its face, and distance of the patch from the face.

use super::basis::Basis;
use super::parameters;
use super::side::{self, Sides};
use crate::searches::SearchedFace;
use kanagata_geometry::{Vec2, Vec3};
use kanagata_mesh::Element;
use kanagata_tool::Patch;

/// Map and degrees of a patch; they determine its control points.
pub(super) struct PatchShape {
    pub(super) map: PatchMap,
    /// Degrees along eta and zeta.
    pub(super) degrees: [usize; 2],
}

/// Map from (eta, zeta) in the unit square to points of a face.
pub(super) struct PatchMap {
    /// The sides (eta, 0), (1, zeta), (eta, 1), (0, zeta).
    pub(super) sides: [PatchSide; 4],
    /// True when surface parameters cannot be blended (seam, pole). Points are blended instead and projected onto the
    /// face.
    projected: bool,
}

/// A side of a patch in the direction of the patch parameters.
pub(super) struct PatchSide {
    /// Key of the shared side; `None` for a side of zero length.
    pub(super) side: Option<[u32; 2]>,
    /// True when the patch traverses the shared side in the opposite direction.
    reversed: bool,
    /// Surface parameters of `points` on the face of the patch.
    feet: Vec<Vec2>,
    /// Points at `side::STEPS` steps of equal arc length.
    points: Vec<Vec3>,
}

/// True when the normal of a patch points against that of its face at one of 13 x 13 points. The patch should lie
/// within about `tolerance` [mm] of the face.
pub(super) fn is_folded(face: SearchedFace<'_>, patch: &Patch, tolerance: f64) -> bool {
    const STEPS: usize = 12;
    let enough = tolerance * tolerance;
    let mut last: Option<Vec2> = None;
    (0..(STEPS + 1) * (STEPS + 1)).any(|k| {
        // Rows alternate in direction, so that consecutive points are adjacent.
        let (row, along) = (k / (STEPS + 1), k % (STEPS + 1));
        let along = if row % 2 == 0 { along } else { STEPS - along };
        let at = |k: usize| k as f64 / STEPS as f64;
        let d = patch.derivs(at(row), at(along));
        let cross = d.d1.cross(&d.d2);
        let against = |uv: Vec2| {
            let against = |n: Vec3| cross.dot(&n) < -1e-9 * d.d1.norm() * d.d2.norm();
            face.face.normal(uv).is_some_and(against)
        };
        let global = || face.closest(&d.s).0;
        let near = last.map(|uv| face.closest_near(&d.s, uv, enough).0);
        let mut foot = near.unwrap_or_else(global);
        // Near a pole the search from the last foot point can end on the opposite side of the pole.
        if near.is_some() && against(foot) {
            foot = global();
        }
        last = Some(foot);
        against(foot)
    })
}

/// Maximum distance of a patch from the surface of its face [mm], at 9 x 9 points. Within a quarter of the `tolerance`
/// [mm] a distance is an upper bound: the search stops there.
pub(super) fn surface_error(
    face: SearchedFace<'_>,
    patch: &Patch,
    map: &PatchMap,
    tolerance: f64,
) -> f64 {
    surface_distances(face, patch, map, tolerance).fold(0.0, f64::max)
}

/// True when [`surface_error`] is at most `limit` [mm]; stops at the first point above it.
pub(super) fn is_within(
    face: SearchedFace<'_>,
    patch: &Patch,
    map: &PatchMap,
    [tolerance, limit]: [f64; 2],
) -> bool {
    surface_distances(face, patch, map, tolerance).all(|distance| distance <= limit)
}

/// Distances of a patch from the surface at the points of [`surface_error`] [mm].
fn surface_distances<'a>(
    face: SearchedFace<'a>,
    patch: &'a Patch,
    map: &'a PatchMap,
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

impl PatchMap {
    /// Map of an element. A triangle starts at its pole, if it has one; its fourth side has zero length.
    pub(super) fn new(face: SearchedFace<'_>, element: &Element, sides: &Sides) -> Self {
        let mut ring = element.nodes().to_vec();
        let is_pole = |v: &u32| {
            let uv = face.closest(&sides.vertex(*v)).0;
            parameters::collapsed_parameter(face.face, uv).is_some()
        };
        if ring.len() == 3
            && let Some(pole) = ring.iter().position(is_pole)
        {
            ring.rotate_left(pole);
        }
        let centre = ring.iter().map(|&v| sides.vertex(v)).sum::<Vec3>() / ring.len() as f64;
        let near = face.closest(&centre).0;
        let curve = |a: u32, b: u32| PatchSide::new(face, element.face, sides, [a, b], near);
        let sides = match ring[..] {
            [a, b, c] => {
                let (out, back) = (curve(a, b), curve(a, c));
                let point = PatchSide::point(sides, a, [&out, &back]);
                [out, curve(b, c), back, point]
            }
            [a, b, c, d] => [curve(a, b), curve(b, c), curve(d, c), curve(a, d)],
            _ => [0, 1, 2, 3].map(|_| curve(ring[0], ring[1])),
        };
        let mut map = Self { sides, projected: false };
        // With a seam or a pole between the foot points, blended parameters map to points far from the blended points.
        let size = map.sides.iter().map(PatchSide::chord).fold(0.0, f64::max);
        let sound = |(eta, zeta): (f64, f64)| {
            let blend = map.blend(eta, zeta, |c, k| c.points[k]);
            let uv = map.parameters(eta, zeta);
            uv.is_some_and(|uv| (face.face.surface.point(uv) - blend).norm() <= 0.4 * size)
        };
        map.projected = ![(0.5, 0.5), (0.25, 0.75), (0.75, 0.25)].into_iter().all(sound);
        map
    }

    /// Coons blend at (eta, zeta) of the values `of(side, step)`, linear between the `side::STEPS` steps of the sides.
    fn blend<T>(&self, eta: f64, zeta: f64, of: impl Fn(&PatchSide, usize) -> T) -> T
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

    /// Surface parameters at (eta, zeta); `None` when points are blended instead.
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

    /// Maximum deviation of the two sides along `direction` from their CAD edges [mm].
    pub(super) fn edge_deviation(
        &self,
        direction: usize,
        degree: usize,
        sides: &Sides,
        basis: &Basis,
    ) -> f64 {
        let along = self.sides.iter().skip(direction).step_by(2);
        let known = along.filter_map(|curve| sides.get(curve.side?));
        known.map(|side| side.edge_deviation(degree, basis)).fold(0.0, f64::max)
    }

    /// Control points of the patch of these degrees. Those on the border are exactly the control points of the shared
    /// sides.
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

impl PatchSide {
    /// Side from vertex `a` to `b` of an element on face `id`, with parameters within half a period of `near`.
    fn new(face: SearchedFace<'_>, id: u32, sides: &Sides, [a, b]: [u32; 2], near: Vec2) -> Self {
        let key = [a.min(b), a.max(b)];
        let Some(side) = sides.get(key) else {
            // All sides of all elements exist; this branch only keeps the function total.
            let points = vec![sides.vertex(a); side::STEPS + 1];
            let feet = vec![face.closest(&points[0]).0; points.len()];
            return Self { side: None, reversed: false, feet, points };
        };
        let mut points: Vec<Vec3> = side.points.clone();
        let mut feet = side.feet(id).unwrap_or_else(|| parameters::foot_parameters(face, &points));
        parameters::unwrap_periods(face.face, &mut feet, near);
        if a > b {
            points.reverse();
            feet.reverse();
        }
        Self { side: Some(key), reversed: a > b, feet, points }
    }

    /// Side of zero length at a vertex where two others start. Its parameters vary linearly between their first
    /// parameters.
    fn point(sides: &Sides, vertex: u32, [out, back]: [&Self; 2]) -> Self {
        let (p, q) = (out.feet[0], back.feet[0]);
        let foot = |k: usize| p + (q - p) * (k as f64 / side::STEPS as f64);
        let points = vec![sides.vertex(vertex); side::STEPS + 1];
        Self { side: None, reversed: false, feet: (0..points.len()).map(foot).collect(), points }
    }

    /// Length of the chord [mm].
    fn chord(&self) -> f64 {
        self.points.last().map_or(0.0, |p| (p - self.points[0]).norm())
    }

    /// Control points of the side, identical to the last bit for both adjacent patches.
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
