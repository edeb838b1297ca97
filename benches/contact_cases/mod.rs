//! Points and synthetic models for the measurements of the contact search.

use kanagata::geometry::Vec3;
use kanagata::tool::build::build;
use kanagata::tool::edge::EdgeRule;
use kanagata::tool::exchange::to_bezier;
use kanagata::tool::model::PatchCorners;
use kanagata::tool::{ToolKind, ToolModel};

/// A small generator, the same everywhere.
pub struct Random(pub u64);

impl Random {
    /// 0 to 1.
    pub fn share(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as f64) / (1u64 << 31) as f64
    }

    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = Vec3::from_fn(|_, _| 2.0 * self.share() - 1.0);
            if (1e-3..1.0).contains(&v.norm()) {
                return v.normalize();
            }
        }
    }

    /// A point of the model's surface at random and its normal; on a side, a corner of a patch, or inside.
    fn on(&mut self, model: &ToolModel, place: usize) -> (Vec3, Vec3, [f64; 2]) {
        let patch = &model.patches[(self.share() * model.patches.len() as f64) as usize];
        let (mut eta, mut zeta) = (self.share(), self.share());
        if place > 0 {
            zeta = (self.share() * 2.0).floor();
        }
        if place > 1 {
            eta = (self.share() * 2.0).floor();
        }
        if patch.sides() == 3 && zeta > eta {
            (eta, zeta) = (zeta, eta);
        }
        let d = patch.derivs(eta, zeta);
        let n = patch.normal(eta, zeta).unwrap_or_else(Vec3::z);
        let curvature = |s: &Vec3, ss: &Vec3| n.dot(ss) / s.norm_squared().max(1e-12);
        (d.s, n, [curvature(&d.d1, &d.d11), curvature(&d.d2, &d.d22)])
    }
}

/// Kinds of points the searches are judged on.
pub const KINDS: [&str; 7] = [
    "within 0.5 mm",
    "within 5 mm",
    "within 100 mm",
    "at centres of curvature",
    "beyond centres of curvature",
    "over sides",
    "over corners",
];

/// A point of kind `k`.
pub fn point(model: &ToolModel, k: usize, random: &mut Random) -> Vec3 {
    let (s, n, curvature) = random.on(model, if k >= 5 { k - 4 } else { 0 });
    match k {
        0 => s + random.direction() * (0.5 * random.share()),
        1 => s + random.direction() * (5.0 * random.share()),
        2 => s + random.direction() * (100.0 * random.share()),
        3 | 4 => {
            let c = curvature[usize::from(random.share() < 0.5)];
            let radius = if c.abs() > 1e-3 { 1.0 / c } else { 50.0 };
            let times = if k == 3 { 1.0 } else { 1.0 + 2.0 * random.share() };
            s + n * (radius * times) + random.direction() * (1e-3 * random.share())
        }
        _ if random.share() < 0.2 => s,
        _ => s + n * (10.0 * random.share() - 5.0),
    }
}

/// A grid of `n` x `n` Nagata quadrilaterals over waves, 200 mm wide.
pub fn waves(n: usize) -> ToolModel {
    let at = |i: usize, j: usize| {
        let (x, y) = (200.0 * i as f64 / n as f64, 200.0 * j as f64 / n as f64);
        let (sx, cx) = (0.05 * x).sin_cos();
        let (sy, cy) = (0.07 * y).sin_cos();
        let normal = Vec3::new(-0.4 * cx * cy, 0.56 * sx * sy, 1.0).normalize();
        (Vec3::new(x, y, 8.0 * sx * cy), normal)
    };
    sheet("waves", n, n, false, at)
}

/// A closed surface of revolution with lobes of random size about the origin, radius about 10 mm; triangles at the
/// poles. Every other one as Bezier patches.
pub fn closed(seed: u64) -> ToolModel {
    let mut random = Random(seed.wrapping_mul(77) + 5);
    let lobes: Vec<[f64; 3]> = (0..4)
        .map(|_| [1.5 * random.share(), 1.0 + (3.0 * random.share()).floor(), 6.3 * random.share()])
        .collect();
    let radius = move |a: f64, b: f64| {
        let of = |l: &[f64; 3]| l[0] * (l[1] * a + l[2]).cos() * b.cos().powi(2);
        10.0 + lobes.iter().map(of).sum::<f64>()
    };
    let place = move |a: f64, b: f64| {
        Vec3::new(a.cos() * b.cos(), a.sin() * b.cos(), b.sin()) * radius(a, b)
    };
    let n = 8 + (12.0 * random.share()) as usize;
    let at = move |i: usize, j: usize| {
        let a = std::f64::consts::TAU * (i % (2 * n)) as f64 / (2 * n) as f64;
        let b = std::f64::consts::PI * (j as f64 / n as f64 - 0.5);
        if j == 0 || j == n {
            let up = if j == 0 { -1.0 } else { 1.0 };
            return (Vec3::z() * (10.0 * up), Vec3::z() * up);
        }
        let h = 1e-5;
        let n = (place(a + h, b) - place(a - h, b)).cross(&(place(a, b + h) - place(a, b - h)));
        (place(a, b), n.normalize())
    };
    let model = sheet("closed", 2 * n, n, true, at);
    if seed % 2 == 1 { to_bezier(&model) } else { model }
}

fn sheet(
    name: &str,
    n: usize,
    m: usize,
    closed: bool,
    at: impl Fn(usize, usize) -> (Vec3, Vec3),
) -> ToolModel {
    let wrap = |i: usize, j: usize| {
        let i = if closed && (j == 0 || j == m) {
            0
        } else if closed {
            i % n
        } else {
            i
        };
        (i * (m + 1) + j) as u32
    };
    let all: Vec<(Vec3, Vec3)> =
        (0..=n).flat_map(|i| (0..=m).map(move |j| (i, j))).map(|(i, j)| at(i, j)).collect();
    let (vertices, normals) = all.into_iter().unzip();
    let corners = (0..n)
        .flat_map(|i| (0..m).map(move |j| (i, j)))
        .map(|(i, j)| {
            let mut ids = vec![wrap(i, j), wrap(i + 1, j), wrap(i + 1, j + 1), wrap(i, j + 1)];
            ids.dedup();
            if ids.first() == ids.last() {
                ids.pop();
            }
            PatchCorners { vertices: ids.clone(), normals: ids, face: 0 }
        })
        .collect();
    build(name.into(), ToolKind::Nagata, vertices, normals, corners, EdgeRule::Guarded)
        .expect("a sound grid")
        .0
}
