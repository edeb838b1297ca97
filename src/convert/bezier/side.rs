//! Sides of elements as curves on the CAD.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::basis::{Basis, node};
use crate::edges::EdgeFinder;
use crate::normals::Feet;
use crate::searches::{SearchedFace, Searches};
use kanagata_cad::Model;
use kanagata_cad::model::Face;
use kanagata_geometry::nurbs::Curve3;
use kanagata_geometry::{Vec2, Vec3};
use kanagata_mesh::SurfaceMesh;

/// Number of steps of equal arc length at which a side is stored.
pub const STEPS: usize = 60;
/// Chords per step by which the arc length is measured.
const CHORDS_PER_STEP: usize = 8;

/// All sides of a mesh, by vertex numbers (lower first).
pub struct Sides<'a> {
    mesh: &'a SurfaceMesh,
    all: BTreeMap<[u32; 2], Side<'a>>,
}

/// One side, from its lower to its higher vertex number, parametrised by arc length.
pub struct Side<'a> {
    /// Points at steps of equal arc length.
    pub points: Vec<Vec3>,
    path: SidePath<'a>,
    /// Arc length up to equal steps of the path parameter, over the total length.
    length_fractions: Vec<f64>,
    /// The two vertices.
    ends: [Vec3; 2],
}

/// Curve on the CAD that a side follows.
enum SidePath<'a> {
    /// A CAD edge between two of its parameters. The second one may lie beyond the end of a closed curve.
    Edge(&'a Curve3, [f64; 2]),
    /// A straight line in the parameter plane of a face.
    Inside(&'a Face, u32, [Vec2; 2]),
    /// The chord, projected onto the face.
    Projected(SearchedFace<'a>, [Vec3; 2]),
}

impl SidePath<'_> {
    /// Point at `s` in [0, 1].
    fn point(&self, s: f64) -> Vec3 {
        match self {
            Self::Edge(curve, [a, b]) => {
                let [low, high] = curve.domain();
                let (t, turn) = (a + (b - a) * s, high - low);
                // A parameter beyond the end by rounding only is not wrapped to the other end.
                let rounding = 1e-9 * turn;
                let wrapped = if t > high + rounding {
                    t - turn
                } else if t < low - rounding {
                    t + turn
                } else {
                    t.clamp(low, high)
                };
                curve.point(wrapped)
            }
            Self::Inside(face, _, [a, b]) => face.surface.point(a + (b - a) * s),
            Self::Projected(face, [a, b]) => {
                face.face.surface.point(face.closest(&(a + (b - a) * s)).0)
            }
        }
    }
}

impl<'a> Sides<'a> {
    /// Computes the sides of all elements.
    pub fn of(
        model: &'a Model,
        mesh: &'a SurfaceMesh,
        feet: &'a Feet,
        searches: &'a Searches<'a>,
    ) -> Self {
        let mut faces: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
        for e in &mesh.elements {
            for [a, b] in e.sides() {
                faces.entry([a.min(b), a.max(b)]).or_default().push(e.face);
            }
        }
        let finder = EdgeFinder::new(model, mesh, feet, searches);
        let list: Vec<([u32; 2], Vec<u32>)> = faces.into_iter().collect();
        let all: Vec<([u32; 2], Side<'a>)> = list
            .par_iter()
            .map(|(ends, faces)| {
                let path = choose_path((model, mesh, feet), (&finder, searches), *ends, faces);
                (*ends, Side::new(path, ends.map(|v| mesh.vertices[v as usize])))
            })
            .collect();
        Self { mesh, all: all.into_iter().collect() }
    }

    /// The side between two vertices, lower number first.
    pub fn get(&self, ends: [u32; 2]) -> Option<&Side<'a>> {
        self.all.get(&ends)
    }

    /// Position of a vertex [mm].
    pub fn vertex(&self, id: u32) -> Vec3 {
        self.mesh.vertices[id as usize]
    }
}

/// Maximum distance between the middles of side and chord, over the chord. A semicircle has 0.5; a larger value is a
/// path on another branch.
const SAGITTA_RATIO_MAX: f64 = 0.6;

/// Chooses the path of a side. An interior side follows the parameter plane of its face, any other side its common CAD
/// edge. The other of the two is the fallback, and the projected chord the last resort.
fn choose_path<'a>(
    (model, mesh, feet): (&'a Model, &SurfaceMesh, &Feet),
    (finder, searches): (&EdgeFinder<'_>, &'a Searches<'a>),
    ends: [u32; 2],
    faces: &[u32],
) -> SidePath<'a> {
    let [a, b] = ends.map(|v| mesh.vertices[v as usize]);
    let distance = |path: &SidePath<'_>| (path.point(0.5) - (a + b) * 0.5).norm();
    let sound = |path: &SidePath<'_>| distance(path) <= SAGITTA_RATIO_MAX * (b - a).norm();
    let first = faces[0];
    let face = &model.faces[first as usize];
    let inside = || {
        let [p, q] = ends.map(|v| feet.get(&(v, first)).copied());
        Some(SidePath::Inside(face, first, [p?, q?])).filter(sound)
    };
    let along = |on: &[u32]| {
        let curve = &model.edges[finder.common_edge(ends, on)?].curve;
        let [low, high] = curve.domain();
        let [s, t] = [a, b].map(|p| curve.closest(&p).0);
        let period = high - low;
        let closed = (curve.point(low) - curve.point(high)).norm() <= 1e-6 * (1.0 + (b - a).norm());
        let other = if !closed {
            t
        } else if t > s {
            t - period
        } else {
            t + period
        };
        let paths = [SidePath::Edge(curve, [s, t]), SidePath::Edge(curve, [s, other])];
        paths.into_iter().min_by(|x, y| distance(x).total_cmp(&distance(y))).filter(sound)
    };
    let found = match *faces {
        [f, g] if f == g => inside().or_else(|| along(&[f])),
        _ => along(faces).or_else(inside),
    };
    found.unwrap_or(SidePath::Projected(searches.face(first), [a, b]))
}

impl<'a> Side<'a> {
    /// Measures the arc length of a path and stores its points.
    fn new(path: SidePath<'a>, ends: [Vec3; 2]) -> Self {
        // Each point of a projected chord costs a closest-point search; one chord per step suffices there.
        let count =
            if matches!(path, SidePath::Projected(..)) { STEPS } else { STEPS * CHORDS_PER_STEP };
        let mut length_fractions = vec![0.0];
        let mut before = path.point(0.0);
        for k in 1..=count {
            let p = path.point(k as f64 / count as f64);
            length_fractions.push(length_fractions[k - 1] + (p - before).norm());
            before = p;
        }
        let whole = length_fractions[count];
        if whole > 0.0 {
            length_fractions.iter_mut().for_each(|s| *s /= whole);
        } else {
            (0..=count).for_each(|k| length_fractions[k] = k as f64 / count as f64);
        }
        let mut side = Self { points: Vec::new(), path, length_fractions, ends };
        side.points = (0..=STEPS).map(|k| side.point(k as f64 / STEPS as f64)).collect();
        side
    }

    /// Path parameter at a fraction of the arc length.
    fn parameter(&self, fraction: f64) -> f64 {
        let last = self.length_fractions.len() - 1;
        let k = self.length_fractions.partition_point(|s| *s < fraction).clamp(1, last);
        let (a, b) = (self.length_fractions[k - 1], self.length_fractions[k]);
        let f = if b > a { (fraction - a) / (b - a) } else { 0.0 };
        ((k - 1) as f64 + f.clamp(0.0, 1.0)) / last as f64
    }

    /// Point at a fraction of the arc length; the ends are exactly the vertices.
    fn point(&self, fraction: f64) -> Vec3 {
        if fraction <= 0.0 {
            self.ends[0]
        } else if fraction >= 1.0 {
            self.ends[1]
        } else {
            self.path.point(self.parameter(fraction))
        }
    }

    /// Points at the interpolation nodes of `degree`.
    pub fn values(&self, degree: usize) -> Vec<Vec3> {
        (0..=degree).map(|k| self.point(node(degree, k))).collect()
    }

    /// Maximum deviation, across the edge, of the interpolating curve of `degree` from the CAD edge [mm]. It matters
    /// where a flat face has a curved border. Zero for sides that follow no edge.
    pub fn edge_deviation(&self, degree: usize, basis: &Basis) -> f64 {
        if !matches!(self.path, SidePath::Edge(..)) {
            return 0.0;
        }
        let control = basis.curve(degree, &self.values(degree));
        let deviation = |k: usize| {
            let vector = basis.value(&control, k as f64 / STEPS as f64) - self.points[k];
            let along = (self.points[k + 1] - self.points[k - 1]).try_normalize(0.0);
            along.map_or(vector, |along| vector - along * along.dot(&vector)).norm()
        };
        (1..STEPS).map(deviation).fold(0.0, f64::max)
    }

    /// Surface parameters at the steps of `points`; `None` unless the path lies in the parameter plane of `face`.
    pub fn feet(&self, face: u32) -> Option<Vec<Vec2>> {
        let SidePath::Inside(_, id, [a, b]) = &self.path else { return None };
        let foot = |k: usize| a + (b - a) * self.parameter(k as f64 / STEPS as f64);
        (*id == face).then(|| (0..=STEPS).map(foot).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_side_ends_where_its_edge_does_whatever_rounding_says() {
        let (a, b) = (-5.0, -1.8);
        assert!(a + (b - a) * 1.0 > b, "the end must lie beyond that of the curve by rounding");
        let ends = [Vec3::zeros(), Vec3::x() * 30.0];
        let curve = Curve3::line(ends[0], ends[1]).on_domain(a, b);
        let side = Side::new(SidePath::Edge(&curve, [a, b]), ends);
        for (k, p) in side.points.iter().enumerate() {
            let exact = ends[1] * (k as f64 / STEPS as f64);
            assert!((p - exact).norm() < 1e-9, "{k}: {p:?}");
        }
        let back = Side::new(SidePath::Edge(&curve, [b, a]), [ends[1], ends[0]]);
        assert!((back.points[STEPS / 2] - Vec3::x() * 15.0).norm() < 1e-9);
    }
}
