//! Exact shapes, patches over them and their exact closest points.

use kanagata::audit::reference::{ReferenceFoot, ReferenceSurface};
use kanagata::geometry::Vec3;
use kanagata::tool::ToolModel;
use kanagata::tool::build::build;
use kanagata::tool::edge::EdgeRule;
use kanagata::tool::model::{PatchCorners, ToolKind};

/// A torus about the z axis: centre line of radius `line`, tube of radius `tube`; normals out of the tube.
#[derive(Clone, Copy)]
pub struct Torus {
    pub line: f64,
    pub tube: f64,
}

impl Torus {
    /// Normal at the angle `phi` round the tube (0: farthest from the axis) and `theta` round the axis.
    pub fn normal(theta: f64, phi: f64) -> Vec3 {
        Vec3::new(phi.cos() * theta.cos(), phi.cos() * theta.sin(), phi.sin())
    }

    pub fn point(&self, theta: f64, phi: f64) -> Vec3 {
        Vec3::new(theta.cos(), theta.sin(), 0.0) * self.line + Self::normal(theta, phi) * self.tube
    }
}

impl ReferenceSurface for Torus {
    fn closest(&self, p: &Vec3, face: u32) -> Option<ReferenceFoot> {
        let centre = Vec3::new(p.x, p.y, 0.0).try_normalize(0.0)? * self.line;
        let normal = (p - centre).try_normalize(0.0)?;
        let point = centre + normal * self.tube;
        Some(ReferenceFoot { point, normal, own_normal: None, face, on_border: false })
    }
}

/// A cylinder about the y axis.
#[derive(Clone, Copy)]
pub struct Cylinder(pub f64);

impl ReferenceSurface for Cylinder {
    fn closest(&self, p: &Vec3, face: u32) -> Option<ReferenceFoot> {
        let normal = Vec3::new(p.x, 0.0, p.z).try_normalize(0.0)?;
        let point = normal * self.0 + Vec3::y() * p.y;
        Some(ReferenceFoot { point, normal, own_normal: None, face, on_border: false })
    }
}

/// A sphere about the origin.
#[derive(Clone, Copy)]
pub struct Sphere(pub f64);

impl ReferenceSurface for Sphere {
    fn closest(&self, p: &Vec3, face: u32) -> Option<ReferenceFoot> {
        let normal = p.try_normalize(0.0)?;
        Some(ReferenceFoot {
            point: normal * self.0,
            normal,
            own_normal: None,
            face,
            on_border: false,
        })
    }
}

/// How a cell of a grid is covered.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Cells {
    Quads,
    /// Cut from the cell's first corner to its third.
    Triangles,
    /// Cut the other way.
    TrianglesAcross,
}

/// A grid of `n x n` cells over the unit square, placed by `at` (point and normal at `(s, t)`, with
/// `S_s x S_t` along the normal).
pub fn grid(n: u32, cells: Cells, at: impl Fn(f64, f64) -> (Vec3, Vec3)) -> ToolModel {
    rectangle([n, n], cells, ToolKind::Nagata, at)
}

/// The same with `n x m` cells of some kind.
pub fn rectangle(
    [n, m]: [u32; 2],
    cells: Cells,
    kind: ToolKind,
    at: impl Fn(f64, f64) -> (Vec3, Vec3),
) -> ToolModel {
    let (mut vertices, mut normals, mut corners) = (vec![], vec![], vec![]);
    for i in 0..=n {
        for j in 0..=m {
            let (x, normal) = at(f64::from(i) / f64::from(n), f64::from(j) / f64::from(m));
            vertices.push(x);
            normals.push(normal);
        }
    }
    let id = |i: u32, j: u32| i * (m + 1) + j;
    let mut push = |ids: &[u32]| {
        corners.push(PatchCorners { vertices: ids.to_vec(), normals: ids.to_vec(), face: 0 });
    };
    for i in 0..n {
        for j in 0..m {
            let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            match cells {
                Cells::Quads => push(&[a, b, c, d]),
                Cells::Triangles => {
                    push(&[a, b, c]);
                    push(&[a, c, d]);
                }
                Cells::TrianglesAcross => {
                    push(&[a, b, d]);
                    push(&[b, c, d]);
                }
            }
        }
    }
    build("test".into(), kind, vertices, normals, corners, EdgeRule::Guarded).unwrap().0
}

pub fn nagata(
    vertices: Vec<Vec3>,
    normals: Vec<Vec3>,
    corners: Vec<PatchCorners>,
    rule: EdgeRule,
) -> ToolModel {
    build("test".into(), ToolKind::Nagata, vertices, normals, corners, rule).unwrap().0
}

/// The octant of a unit sphere in `n * n` triangles: the flat octant's regular grid pushed out to the sphere.
pub fn octant(n: u32) -> ToolModel {
    let mut vertices = vec![];
    let mut id = std::collections::BTreeMap::new();
    for i in 0..=n {
        for j in 0..=n - i {
            id.insert((i, j), vertices.len() as u32);
            let x = Vec3::new(f64::from(i), f64::from(j), f64::from(n - i - j));
            vertices.push(x.normalize());
        }
    }
    let mut corners = vec![];
    let mut push = |ring: [(u32, u32); 3]| {
        let ids: Vec<u32> = ring.iter().map(|k| id[k]).collect();
        corners.push(PatchCorners { vertices: ids.clone(), normals: ids, face: 0 });
    };
    for i in 0..n {
        for j in 0..n - i {
            push([(i, j), (i + 1, j), (i, j + 1)]);
            if i + j + 2 <= n {
                push([(i + 1, j), (i + 1, j + 1), (i, j + 1)]);
            }
        }
    }
    nagata(vertices.clone(), vertices, corners, EdgeRule::Guarded)
}
