//! Models constructed for tests.

use kanagata_cad::Model;
use kanagata_cad::model::{Edge, EdgeUse, Face, SurfaceKind, TrimLoop};
use kanagata_geometry::nurbs::{Curve2, Curve3, Surface};
use kanagata_geometry::{Vec2, Vec3};

/// Assembles faces: sides with equal ends and middle become one edge.
#[derive(Default)]
pub struct Builder {
    pub model: Model,
}

/// A side of a face: parameter curve and space curve, both in the direction of the loop.
pub type Side = (Curve2, Curve3);

impl Builder {
    fn vertex(&mut self, p: Vec3) -> usize {
        let known = self.model.vertices.iter().position(|v| (v - p).norm() < 1e-9);
        known.unwrap_or_else(|| {
            self.model.vertices.push(p);
            self.model.vertices.len() - 1
        })
    }

    fn edge(&mut self, c: &Curve3, place: [usize; 3]) -> Option<(usize, bool)> {
        let [t0, t1] = c.domain();
        let ends = [c.point(t0), c.point(t1)];
        let mid = c.point(0.5 * (t0 + t1));
        if (mid - ends[0]).norm() < 1e-9 && (mid - ends[1]).norm() < 1e-9 {
            return None;
        }
        let v = ends.map(|p| self.vertex(p));
        let same = |e: &Edge| {
            let d = e.curve.domain();
            let close = (e.curve.point(0.5 * (d[0] + d[1])) - mid).norm() < 1e-6;
            close && (e.vertices == v || e.vertices == [v[1], v[0]])
        };
        let e = self.model.edges.iter().position(same).unwrap_or_else(|| {
            self.model.edges.push(Edge { curve: c.clone(), vertices: v, uses: Vec::new() });
            self.model.edges.len() - 1
        });
        let edge = &mut self.model.edges[e];
        edge.uses.push(place);
        let reversed = (edge.curve.derivs(edge.curve.domain()[0]).c - ends[0]).norm() > 1e-9
            || edge.curve.derivs(edge.curve.domain()[0]).d1.dot(&c.derivs(t0).d1) < 0.0;
        Some((e, reversed))
    }

    pub fn face(mut self, surface: Surface, kind: SurfaceKind, loops: Vec<Vec<Side>>) -> Self {
        let f = self.model.faces.len();
        let mut made = Vec::new();
        for (l, sides) in loops.into_iter().enumerate() {
            let mut uses = Vec::new();
            for (k, (pcurve, curve)) in sides.into_iter().enumerate() {
                let found = self.edge(&curve, [f, l, k]);
                let (edge, reversed) = (found.map(|e| e.0), found.is_some_and(|e| e.1));
                uses.push(EdgeUse { pcurve, edge, reversed });
            }
            made.push(TrimLoop { uses });
        }
        let source = format!("face {f}");
        let loops = made;
        self.model.faces.push(Face {
            surface,
            kind,
            analytic: None,
            loops,
            flipped: false,
            source,
            shell: None,
            attributes: Default::default(),
        });
        self
    }

    /// A face that covers the entire domain of a surface.
    pub fn patch(self, surface: Surface, kind: SurfaceKind) -> Self {
        let [[u0, u1], [v0, v1]] = surface.domain();
        let c = [[u0, v0], [u1, v0], [u1, v1], [u0, v1]].map(|[u, v]| Vec2::new(u, v));
        let sides = (0..4).map(|k| {
            let (a, b) = (c[k], c[(k + 1) % 4]);
            (Curve2::line(a, b), border_curve(&surface, k))
        });
        let loops = vec![sides.collect()];
        self.face(surface, kind, loops)
    }
}

/// Boundary curve k of a clamped surface from its control net, counter-clockwise from v = low.
pub fn border_curve(s: &Surface, k: usize) -> Curve3 {
    let nv = s.knots()[1].len() - s.degrees()[1] - 1;
    let nu = s.points().len() / nv;
    let ids: Vec<usize> = match k {
        0 => (0..nu).map(|i| i * nv).collect(),
        1 => (0..nv).map(|j| (nu - 1) * nv + j).collect(),
        2 => (0..nu).map(|i| i * nv + nv - 1).collect(),
        _ => (0..nv).collect(),
    };
    let points = ids.iter().map(|&i| s.points()[i]).collect();
    let weights = ids.iter().map(|&i| s.weights()[i]).collect();
    let along = k % 2;
    let knots = s.knots()[along].to_vec();
    let curve = Curve3::try_new(s.degrees()[along], knots, points, Some(weights)).unwrap();
    if k < 2 { curve } else { curve.reversed() }
}

/// A side in the plane z = `z` seen from above, from its space curve.
pub fn flat_side(c: Curve3) -> Side {
    let points = c.points().iter().map(|p| Vec2::new(p.x, p.y)).collect();
    let weights = Some(c.weights().to_vec());
    let pcurve = Curve2::try_new(c.degree(), c.knots().to_vec(), points, weights).unwrap();
    (pcurve, c)
}

pub fn at(x: f64, y: f64, z: f64) -> Vec3 {
    Vec3::new(x, y, z)
}

pub fn line(a: Vec3, b: Vec3) -> Side {
    flat_side(Curve3::line(a, b))
}
