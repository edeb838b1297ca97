//! Sides of elements as curves on the CAD.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::basis::{Basis, node};
use crate::cad::Model;
use crate::cad::model::Face;
use crate::convert::edges::Finder;
use crate::convert::normals::Feet;
use crate::convert::searches::{SearchedFace, Searches};
use crate::geometry::nurbs::Curve3;
use crate::geometry::{Vec2, Vec3};
use crate::mesh::SurfaceMesh;

/// Steps of equal length a side is known at.
pub const STEPS: usize = 60;
/// Points by which length is measured, in each of those steps.
const FINE: usize = 8;

/// All sides of a mesh, by their vertex ids (smaller first).
pub struct Sides<'a> {
    mesh: &'a SurfaceMesh,
    all: BTreeMap<[u32; 2], Side<'a>>,
}

/// One side, from its lower vertex id to its higher one.
pub struct Side<'a> {
    /// Points at equal steps of length.
    pub points: Vec<Vec3>,
    way: Way<'a>,
    /// Where the way is at equal steps of its own parameter: share of the length.
    shares: Vec<f64>,
    ends: [Vec3; 2],
}

/// What a side follows.
enum Way<'a> {
    /// An edge of the CAD between two of its parameters (the second may lie past the end of a closed curve).
    Edge(&'a Curve3, [f64; 2]),
    /// A straight line in the parameters of a face.
    Inside(&'a Face, u32, [Vec2; 2]),
    /// The chord, projected on the face.
    Projected(SearchedFace<'a>, [Vec3; 2]),
}

impl Way<'_> {
    fn at(&self, s: f64) -> Vec3 {
        match self {
            Self::Edge(curve, [a, b]) => {
                let [low, high] = curve.domain();
                let (t, turn) = (a + (b - a) * s, high - low);
                // An end that rounding puts beyond the curve's is that end, not the other one.
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
        let finder = Finder::new(model, mesh, feet, searches);
        let list: Vec<([u32; 2], Vec<u32>)> = faces.into_iter().collect();
        let all: Vec<([u32; 2], Side<'a>)> = list
            .par_iter()
            .map(|(ends, faces)| {
                let way = way((model, mesh, feet), (&finder, searches), *ends, faces);
                (*ends, Side::new(way, ends.map(|v| mesh.vertices[v as usize])))
            })
            .collect();
        Self { mesh, all: all.into_iter().collect() }
    }

    pub fn get(&self, ends: [u32; 2]) -> Option<&Side<'a>> {
        self.all.get(&ends)
    }

    pub fn vertex(&self, id: u32) -> Vec3 {
        self.mesh.vertices[id as usize]
    }
}

/// Largest distance of a side's middle from its chord's, over the chord.
const SAGITTA: f64 = 0.6;

fn way<'a>(
    (model, mesh, feet): (&'a Model, &SurfaceMesh, &Feet),
    (finder, searches): (&Finder<'_>, &'a Searches<'a>),
    ends: [u32; 2],
    faces: &[u32],
) -> Way<'a> {
    let [a, b] = ends.map(|v| mesh.vertices[v as usize]);
    let sound = |way: &Way<'_>| (way.at(0.5) - (a + b) * 0.5).norm() <= SAGITTA * (b - a).norm();
    let first = faces[0];
    let face = &model.faces[first as usize];
    let inside = || {
        let [p, q] = ends.map(|v| feet.get(&(v, first)).copied());
        Some(Way::Inside(face, first, [p?, q?])).filter(sound)
    };
    let along = |on: &[u32]| {
        let curve = &model.edges[finder.edge(ends, on)?].curve;
        let [low, high] = curve.domain();
        let [s, t] = [a, b].map(|p| curve.closest(&p).0);
        let turn = high - low;
        let closed = (curve.point(low) - curve.point(high)).norm() <= 1e-6 * (1.0 + (b - a).norm());
        let other = if !closed {
            t
        } else if t > s {
            t - turn
        } else {
            t + turn
        };
        let ways = [Way::Edge(curve, [s, t]), Way::Edge(curve, [s, other])];
        let off = |w: &Way<'_>| (w.at(0.5) - (a + b) * 0.5).norm();
        ways.into_iter().min_by(|x, y| off(x).total_cmp(&off(y))).filter(sound)
    };
    let found = match *faces {
        [f, g] if f == g => inside().or_else(|| along(&[f])),
        _ => along(faces).or_else(inside),
    };
    found.unwrap_or(Way::Projected(searches.face(first), [a, b]))
}

impl<'a> Side<'a> {
    fn new(way: Way<'a>, ends: [Vec3; 2]) -> Self {
        // Each point of a projected chord is a search: those of the steps do, by which it is no less smooth.
        let count = if matches!(way, Way::Projected(..)) { STEPS } else { STEPS * FINE };
        let mut shares = vec![0.0];
        let mut before = way.at(0.0);
        for k in 1..=count {
            let p = way.at(k as f64 / count as f64);
            shares.push(shares[k - 1] + (p - before).norm());
            before = p;
        }
        let whole = shares[count];
        if whole > 0.0 {
            shares.iter_mut().for_each(|s| *s /= whole);
        } else {
            (0..=count).for_each(|k| shares[k] = k as f64 / count as f64);
        }
        let mut side = Self { points: Vec::new(), way, shares, ends };
        side.points = (0..=STEPS).map(|k| side.at(k as f64 / STEPS as f64)).collect();
        side
    }

    /// The way's own parameter at a share of the length.
    fn parameter(&self, share: f64) -> f64 {
        let last = self.shares.len() - 1;
        let k = self.shares.partition_point(|s| *s < share).clamp(1, last);
        let (a, b) = (self.shares[k - 1], self.shares[k]);
        let f = if b > a { (share - a) / (b - a) } else { 0.0 };
        ((k - 1) as f64 + f.clamp(0.0, 1.0)) / last as f64
    }

    /// Point at a share of the length; the ends are the vertices.
    fn at(&self, share: f64) -> Vec3 {
        if share <= 0.0 {
            self.ends[0]
        } else if share >= 1.0 {
            self.ends[1]
        } else {
            self.way.at(self.parameter(share))
        }
    }

    /// Points at the nodes of `degree`.
    pub fn values(&self, degree: usize) -> Vec<Vec3> {
        (0..=degree).map(|k| self.at(node(degree, k))).collect()
    }

    /// Largest distance across an edge of the CAD that the side follows by which the curve of `degree` misses it [mm]: what bounds a
    /// face may be curved where the face is not. Nothing for sides that follow no edge.
    pub fn miss(&self, degree: usize, basis: &Basis) -> f64 {
        if !matches!(self.way, Way::Edge(..)) {
            return 0.0;
        }
        let control = basis.curve(degree, &self.values(degree));
        let off = |k: usize| {
            let off = basis.value(&control, k as f64 / STEPS as f64) - self.points[k];
            let along = (self.points[k + 1] - self.points[k - 1]).try_normalize(0.0);
            along.map_or(off, |along| off - along * along.dot(&off)).norm()
        };
        (1..STEPS).map(off).fold(0.0, f64::max)
    }

    /// Parameters on the face the side runs inside of, at the steps of `points`.
    pub fn feet(&self, face: u32) -> Option<Vec<Vec2>> {
        let Way::Inside(_, id, [a, b]) = &self.way else { return None };
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
        assert!(a + (b - a) * 1.0 > b, "an end beyond the curve's by rounding");
        let ends = [Vec3::zeros(), Vec3::x() * 30.0];
        let curve = Curve3::line(ends[0], ends[1]).on_domain(a, b);
        let side = Side::new(Way::Edge(&curve, [a, b]), ends);
        for (k, p) in side.points.iter().enumerate() {
            let exact = ends[1] * (k as f64 / STEPS as f64);
            assert!((p - exact).norm() < 1e-9, "{k}: {p:?}");
        }
        let back = Side::new(Way::Edge(&curve, [b, a]), [ends[1], ends[0]]);
        assert!((back.points[STEPS / 2] - Vec3::x() * 15.0).norm() < 1e-9);
    }
}
