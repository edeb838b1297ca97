//! Tool models for tests, from exact points and normals (Eq. 7-12).

use kanagata_geometry::Vec3;
use kanagata_tool::model::PatchCorners;
use kanagata_tool::{Patch, ToolKind, ToolModel};

/// A point of a surface and its normal.
pub(crate) type Oriented = (Vec3, Vec3);

/// Collects patches and merges coincident corners.
pub(crate) struct Builder {
    model: ToolModel,
}

impl Builder {
    pub(crate) fn new(name: &str) -> Self {
        let model = ToolModel::of_patches(name, ToolKind::Nagata, vec![], vec![]);
        Self { model }
    }

    /// Patches over an `n` x `m` grid of the parameter square; coincident corners yield triangles.
    pub(crate) fn grid(mut self, n: usize, m: usize, at: impl Fn(f64, f64) -> Oriented) -> Self {
        for i in 0..n {
            for j in 0..m {
                let u = |k: usize| (i + k) as f64 / n as f64;
                let v = |k: usize| (j + k) as f64 / m as f64;
                self.patch(vec![at(u(0), v(0)), at(u(1), v(0)), at(u(1), v(1)), at(u(0), v(1))]);
            }
        }
        self
    }

    fn patch(&mut self, mut c: Vec<Oriented>) {
        let n = c.len();
        if let Some(k) = (0..n).find(|&k| (c[k].0 - c[(k + 1) % n].0).norm() < 1e-12) {
            c.remove(k);
        }
        let facing = (c[1].0 - c[0].0).cross(&(c[2].0 - c[0].0));
        if facing.dot(&c.iter().map(|p| p.1).sum::<Vec3>()) < 0.0 {
            c.reverse();
        }
        let ids: Vec<u32> = c.iter().map(|p| self.vertex(&p.0)).collect();
        let first = self.model.normals.len() as u32;
        self.model.normals.extend(c.iter().map(|p| p.1));
        let normals = (first..first + c.len() as u32).collect();
        self.model.corners.push(PatchCorners { vertices: ids, normals, face: 0 });
        self.model.faces.push(0);
        self.model.patches.push(nagata(&c));
    }

    fn vertex(&mut self, p: &Vec3) -> u32 {
        let known = self.model.vertices.iter().position(|q| (q - p).norm() < 1e-10);
        known.unwrap_or_else(|| {
            self.model.vertices.push(*p);
            self.model.vertices.len() - 1
        }) as u32
    }

    pub(crate) fn build(self) -> ToolModel {
        self.model
    }
}

fn edge(a: &Oriented, b: &Oriented) -> Vec3 {
    let d = b.0 - a.0;
    let (nu, dl) = (0.5 * (a.1 + b.1), 0.5 * (a.1 - b.1));
    if dl.norm() < 1e-9 {
        return Vec3::zeros();
    }
    nu * (dl.dot(&d) / nu.norm_squared()) + dl * (nu.dot(&d) / dl.norm_squared())
}

fn nagata(c: &[Oriented]) -> Patch {
    let x = |k: usize| c[k].0;
    if c.len() == 3 {
        let (c1, c2, c3) = (edge(&c[0], &c[1]), edge(&c[1], &c[2]), edge(&c[0], &c[2]));
        return Patch::Triangle([
            x(0),
            x(1) - x(0) - c1,
            x(2) - x(1) + c1 - c3,
            c3 - c1 - c2,
            c1,
            c2,
        ]);
    }
    let (c1, c2, c3, c4) =
        (edge(&c[0], &c[1]), edge(&c[1], &c[2]), edge(&c[3], &c[2]), edge(&c[0], &c[3]));
    Patch::Quad([
        x(0),
        x(1) - x(0) - c1,
        x(3) - x(0) - c4,
        x(2) - x(1) - x(3) + x(0) + c1 - c2 - c3 + c4,
        c1,
        c4,
        c3 - c1,
        c2 - c4,
    ])
}

/// A flat rectangle through `origin` spanned by `a` and `b`, with `normal`.
pub(crate) fn plane(name: &str, origin: Vec3, a: Vec3, b: Vec3, normal: Vec3) -> ToolModel {
    Builder::new(name).grid(1, 1, |u, v| (origin + a * u + b * v, normal)).build()
}

/// Point and normal at `t` in 0..1.
type Profile = dyn Fn(f64) -> ([f64; 2], [f64; 2]);

/// A part of a profile in the (r, z) half-plane: point and normal at `t` in 0..1.
pub(crate) struct Piece {
    pub(crate) cells: usize,
    pub(crate) at: Box<Profile>,
}

/// A straight part with one normal.
pub(crate) fn line(cells: usize, a: [f64; 2], b: [f64; 2], n: [f64; 2]) -> Piece {
    let at = move |t: f64| ([a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t], n);
    Piece { cells, at: Box::new(at) }
}

/// An arc about `c` from angle `from` to `to` [rad]; with `side` +1 the normal points away from the centre.
pub(crate) fn arc(cells: usize, c: [f64; 2], r: f64, [from, to]: [f64; 2], side: f64) -> Piece {
    let at = move |t: f64| {
        let (s, k) = (from + (to - from) * t).sin_cos();
        ([c[0] + r * k, c[1] + r * s], [side * k, side * s])
    };
    Piece { cells, at: Box::new(at) }
}

/// Revolution of the profile about z through `angle` [rad] from the x axis.
pub(crate) fn revolved(name: &str, around: usize, angle: f64, profile: &[Piece]) -> ToolModel {
    profile
        .iter()
        .fold(Builder::new(name), |b, piece| {
            b.grid(piece.cells, around, |u, v| {
                let (p, n) = (piece.at)(u);
                let (s, c) = (angle * v).sin_cos();
                let turn = |q: [f64; 2]| Vec3::new(q[0] * c, q[0] * s, q[1]);
                (turn(p), turn(n))
            })
        })
        .build()
}

/// Outline of the quarter cross opening (half length 65, half width 30, convex R 20, concave R 14) at `t` in 0..1 of
/// part `k` in 0..7: point and unit normal away from the opening.
fn outline(k: usize, t: f64) -> ([f64; 2], [f64; 2]) {
    let straight = |a: [f64; 2], b: [f64; 2], m: [f64; 2]| {
        ([a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t], m)
    };
    let corner = |c: [f64; 2], r: f64, from: f64, to: f64, side: f64| {
        let (s, k) = (from + (to - from) * t).to_radians().sin_cos();
        ([c[0] + r * k, c[1] + r * s], [side * k, side * s])
    };
    match k {
        0 => straight([65.0, 0.0], [65.0, 10.0], [1.0, 0.0]),
        1 => corner([45.0, 10.0], 20.0, 0.0, 90.0, 1.0),
        2 => straight([45.0, 30.0], [44.0, 30.0], [0.0, 1.0]),
        3 => corner([44.0, 44.0], 14.0, 270.0, 180.0, -1.0),
        4 => straight([30.0, 44.0], [30.0, 45.0], [1.0, 0.0]),
        5 => corner([10.0, 45.0], 20.0, 0.0, 90.0, 1.0),
        _ => straight([10.0, 65.0], [0.0, 65.0], [0.0, 1.0]),
    }
}

/// A surface swept along the cross outline: `at(point, outward normal, v)`.
fn swept(
    b: Builder,
    cells: usize,
    across: usize,
    at: impl Fn([f64; 2], [f64; 2], f64) -> Oriented,
) -> Builder {
    (0..7).fold(b, |b, k| {
        let n = if k % 2 == 1 { cells } else { 1 };
        b.grid(n, across, |u, v| {
            let (q, m) = outline(k, u);
            at(q, m, v)
        })
    })
}

fn flat_to_square(q: [f64; 2], m: [f64; 2], off: f64, size: f64, v: f64, n: Vec3) -> Oriented {
    let p = Vec3::new(q[0] + off * m[0], q[1] + off * m[1], 0.0);
    (p * (1.0 + (size / p.amax() - 1.0) * v), n)
}

/// Die, holder and punch of the quarter cross tool, with `cells` patches per corner and fillet.
pub(crate) fn cross(cells: usize) -> [ToolModel; 3] {
    let size = 140.0;
    let turn = |v: f64| (v * std::f64::consts::FRAC_PI_2).sin_cos();
    let die = swept(Builder::new("die"), cells, 1, |q, m, v| {
        flat_to_square(q, m, 7.0, size, v, Vec3::z())
    });
    let die = swept(die, cells, cells, |q, m, v| {
        let (s, c) = turn(v);
        let (off, z) = (7.0 - 7.0 * s, -7.0 + 7.0 * c);
        (Vec3::new(q[0] + off * m[0], q[1] + off * m[1], z), Vec3::new(-s * m[0], -s * m[1], c))
    });
    let die = swept(die, cells, 1, |q, m, v| {
        (Vec3::new(q[0], q[1], -7.0 - 73.0 * v), Vec3::new(-m[0], -m[1], 0.0))
    });
    let holder = swept(Builder::new("holder"), cells, 1, |q, m, v| {
        flat_to_square(q, m, 1.0, size, v, -Vec3::z())
    });
    let punch = swept(Builder::new("punch"), cells, 1, |q, m, v| {
        (Vec3::new(q[0] - 10.8 * m[0], q[1] - 10.8 * m[1], 0.0) * (1.0 - v), -Vec3::z())
    });
    let punch = swept(punch, cells, cells, |q, m, v| {
        let (s, c) = turn(v);
        let off = -10.8 + 10.0 * s;
        let p = Vec3::new(q[0] + off * m[0], q[1] + off * m[1], 10.0 - 10.0 * c);
        (p, Vec3::new(s * m[0], s * m[1], -c))
    });
    let punch = swept(punch, cells, 1, |q, m, v| {
        let p = Vec3::new(q[0] - 0.8 * m[0], q[1] - 0.8 * m[1], 10.0 + 80.0 * v);
        (p, Vec3::new(m[0], m[1], 0.0))
    });
    [die.build(), holder.build(), punch.build()]
}
