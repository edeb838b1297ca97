//! Small models of known shape.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use kanagata_cad::model::{Edge, EdgeUse, Face, Model, SurfaceKind, TrimLoop};
use kanagata_geometry::nurbs::{Curve2, Curve3, Surface};
use kanagata_geometry::{Frame, Vec2, Vec3};

pub(super) fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    ((*seed >> 33) as f64) / (1u64 << 31) as f64
}

pub(super) fn face(surface: Surface, rings: Vec<Vec<EdgeUse>>) -> Face {
    Face {
        surface,
        kind: SurfaceKind::Nurbs,
        analytic: None,
        loops: rings.into_iter().map(|uses| TrimLoop { uses }).collect(),
        flipped: false,
        source: String::new(),
        shell: None,
        attributes: Default::default(),
    }
}

pub(super) fn model(faces: Vec<Face>, curves: Vec<Curve3>) -> Model {
    let mut model = Model { faces, ..Model::default() };
    for curve in curves {
        let [a, b] = curve.domain();
        let vertices = [a, b].map(|t| {
            let p = curve.point(t);
            let known = model.vertices.iter().position(|q| (q - p).norm() < 1e-9);
            known.unwrap_or_else(|| {
                model.vertices.push(p);
                model.vertices.len() - 1
            })
        });
        model.edges.push(Edge { curve, vertices, uses: Vec::new() });
    }
    for (f, face) in model.faces.iter().enumerate() {
        for (l, ring) in face.loops.iter().enumerate() {
            for (k, used) in ring.uses.iter().enumerate() {
                if let Some(e) = used.edge {
                    model.edges[e].uses.push([f, l, k]);
                }
            }
        }
    }
    model
}

/// A whole surface as a face: collapsed boundaries are poles, coincident opposite boundaries are a seam.
pub(crate) fn whole(surface: Surface) -> Model {
    let [[u0, u1], [v0, v1]] = surface.domain();
    let [nu, nv] = surface.count();
    let [du, dv] = surface.degrees();
    let along = |ids: Vec<usize>, degree: usize, knots: &[f64]| {
        let points: Vec<Vec3> = ids.iter().map(|&k| surface.points()[k]).collect();
        let weights = ids.iter().map(|&k| surface.weights()[k]).collect();
        let pole = points.iter().all(|p| (p - points[0]).norm() < 1e-9);
        (!pole).then(|| Curve3::try_new(degree, knots.to_vec(), points, Some(weights)).unwrap())
    };
    let [ku, kv] = surface.knots();
    let sides = [
        along((0..nu).map(|i| i * nv).collect(), du, ku),
        along((0..nv).map(|j| (nu - 1) * nv + j).collect(), dv, kv),
        along((0..nu).map(|i| i * nv + nv - 1).collect(), du, ku),
        along((0..nv).collect(), dv, kv),
    ];
    let corners = [(u0, v0), (u1, v0), (u1, v1), (u0, v1)].map(|(u, v)| Vec2::new(u, v));
    let (mut curves, mut uses): (Vec<Curve3>, Vec<EdgeUse>) = (Vec::new(), Vec::new());
    for (k, side) in sides.into_iter().enumerate() {
        let edge = side.map(|c| {
            let same = |o: &Curve3| {
                o.points().len() == c.points().len()
                    && o.points().iter().zip(c.points()).all(|(a, b)| (a - b).norm() < 1e-9)
            };
            let found = curves.iter().position(same);
            found.unwrap_or_else(|| {
                curves.push(c);
                curves.len() - 1
            })
        });
        let pcurve = Curve2::line(corners[k], corners[(k + 1) % 4]);
        uses.push(EdgeUse { pcurve, edge, reversed: k >= 2 });
    }
    model(vec![face(surface, vec![uses])], curves)
}

/// Counter-clockwise circle in a parameter plane.
pub(super) fn circle(center: Vec2, ru: f64, rv: f64) -> Curve2 {
    let c = Curve3::ellipse_arc(&Frame::world(), ru, rv, 0.0, TAU);
    let points = c.points().iter().map(|p| center + Vec2::new(p.x, p.y)).collect();
    Curve2::try_new(2, c.knots().to_vec(), points, Some(c.weights().to_vec())).unwrap()
}

pub(super) fn tilted() -> Frame {
    let z = Vec3::new(0.3, -0.5, 0.8).normalize();
    let x = z.cross(&Vec3::x()).normalize();
    Frame { origin: Vec3::new(11.0, -4.0, 7.0), x, y: z.cross(&x), z }
}

/// Revolution about the z axis of the tilted frame of a curve in its (x, z) plane.
pub(super) fn turned(generatrix: &Curve3, angles: [f64; 2]) -> Surface {
    let f = tilted();
    let placed = generatrix.mapped(|p| f.point(&p));
    Surface::revolution(&placed, f.origin, f.z, angles)
}

/// Arc about (x, 0, z) in the (x, z) plane, angle from x towards z.
pub(super) fn arc(x: f64, z: f64, r: f64, from: f64, to: f64) -> Curve3 {
    let frame = Frame { origin: Vec3::new(x, 0.0, z), x: Vec3::x(), y: Vec3::z(), z: -Vec3::y() };
    Curve3::ellipse_arc(&frame, r, r, from, to)
}

pub(super) fn cylinder(r: f64, h: f64) -> Model {
    let line = Curve3::line(Vec3::new(r, 0.0, 0.0), Vec3::new(r, 0.0, h));
    whole(turned(&line, [0.0, TAU]))
}

pub(crate) fn sphere(r: f64) -> Model {
    whole(turned(&arc(0.0, 0.0, r, -FRAC_PI_2, FRAC_PI_2), [0.0, TAU]))
}

pub(super) fn cone(r: f64, h: f64) -> Model {
    let line = Curve3::line(Vec3::new(r, 0.0, 0.0), Vec3::new(0.0, 0.0, h));
    whole(turned(&line, [0.0, TAU]))
}

/// Fillet of radius `r` between a plane and a cylinder of radius `big`, a quarter of a revolution.
pub(crate) fn fillet(big: f64, r: f64) -> Model {
    whole(turned(&arc(big + r, 0.0, r, FRAC_PI_2, PI), [0.0, FRAC_PI_2]))
}

/// Square of side 100 about the origin with a round hole about (10, 5).
pub(crate) fn holed_square(radius: f64) -> Model {
    let corner = |k: usize| [(-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0)][k % 4];
    let at2 = |k: usize| Vec2::new(corner(k).0, corner(k).1);
    let at3 = |k: usize| Vec3::new(corner(k).0, corner(k).1, 0.0);
    let mut outer = Vec::new();
    let mut curves = Vec::new();
    for k in 0..4 {
        outer.push(EdgeUse {
            pcurve: Curve2::line(at2(k), at2(k + 1)),
            edge: Some(k),
            reversed: false,
        });
        curves.push(Curve3::line(at3(k), at3(k + 1)));
    }
    let ring = circle(Vec2::new(10.0, 5.0), radius, radius).reversed();
    let frame = Frame { origin: Vec3::new(10.0, 5.0, 0.0), ..Frame::world() };
    curves.push(Curve3::ellipse_arc(&frame, radius, radius, 0.0, TAU));
    let hole = EdgeUse { pcurve: ring, edge: Some(4), reversed: true };
    let plane = Surface::plane(&Frame::world(), [-50.0, 50.0], [-50.0, 50.0]);
    model(vec![face(plane, vec![outer, vec![hole]])], curves)
}

/// Models combined without shared edges.
pub(crate) fn joined(models: Vec<Model>) -> Model {
    let mut out = Model::default();
    for mut other in models {
        let [faces, edges, vertices] = [out.faces.len(), out.edges.len(), out.vertices.len()];
        for used in other.faces.iter_mut().flat_map(|f| &mut f.loops).flat_map(|l| &mut l.uses) {
            used.edge = used.edge.map(|e| e + edges);
        }
        for edge in &mut other.edges {
            edge.vertices.iter_mut().for_each(|v| *v += vertices);
            edge.uses.iter_mut().for_each(|u| u[0] += faces);
        }
        out.faces.extend(other.faces);
        out.edges.extend(other.edges);
        out.vertices.extend(other.vertices);
    }
    out
}

/// A wavy bicubic rational surface with interior knots.
pub(crate) fn wavy(seed: u64) -> Model {
    let mut s = seed;
    let knots = |n: usize| {
        let mut k = vec![0.0; 4];
        k.extend((1..n - 3).map(|i| i as f64));
        k.extend([(n - 3) as f64; 4]);
        k
    };
    let (nu, nv) = (8, 7);
    let points = (0..nu * nv)
        .map(|k| {
            let jitter = Vec3::new(random(&mut s), random(&mut s), 6.0 * random(&mut s));
            Vec3::new(4.0 * (k / nv) as f64, 4.0 * (k % nv) as f64, 0.0) + jitter * 2.0
        })
        .collect();
    let weights = (0..nu * nv).map(|_| 0.6 + random(&mut s)).collect();
    whole(Surface::try_new([3, 3], [knots(nu), knots(nv)], points, Some(weights)).unwrap())
}

pub(super) fn relative(found: f64, exact: f64) -> f64 {
    (found / exact - 1.0).abs()
}
