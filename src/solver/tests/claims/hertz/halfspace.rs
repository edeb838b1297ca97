//! Half-space `z <= 0` under Hertz pressure (Boussinesq), and the forces that represent its rest on the faces of a
//! block cut out of it.

use std::f64::consts::{FRAC_PI_4, PI, TAU};

use crate::sheet::hex_mesh::HexMesh;
use kanagata_geometry::{Mat3, Vec3};

const YOUNG: f64 = 210_000.0;
const POISSON: f64 = 0.3;

/// Vertical surface forces that represent the Hertz pressure: six rings of eight.
pub(super) struct Pressed {
    /// Position and force [N].
    points: Vec<(Vec3, f64)>,
}

impl Pressed {
    /// `force` [N] over a disc of radius `a` [mm] about the origin.
    pub(super) fn new(force: f64, a: f64) -> Self {
        const RINGS: usize = 6;
        // Rings of equal area, hence equal steps of (r/a)^2; the pressure is proportional to the square root of 1 -
        // (r/a)^2.
        let inner = |k: usize| (1.0 - k as f64 / RINGS as f64).powf(1.5);
        let mut points = Vec::new();
        for k in 0..RINGS {
            let r = a * ((k as f64 + 0.5) / RINGS as f64).sqrt();
            for side in 0..8 {
                let (s, c) = (FRAC_PI_4 * (f64::from(side) + 0.5)).sin_cos();
                points
                    .push((Vec3::new(r * c, r * s, 0.0), force * (inner(k) - inner(k + 1)) / 8.0));
            }
        }
        Self { points }
    }

    /// Settlement of the half-space at `x` [mm].
    pub(super) fn sinks(&self, x: &Vec3) -> f64 {
        let one = |(at, force): &(Vec3, f64)| {
            let (rho, depth) = ((x - at).norm(), at.z - x.z);
            force * (1.0 + POISSON) / (TAU * YOUNG)
                * (depth * depth / rho.powi(3) + 2.0 * (1.0 - POISSON) / rho)
        };
        self.points.iter().map(one).sum()
    }

    /// Stress at `x` [MPa].
    fn stress(&self, x: &Vec3) -> Mat3 {
        self.points.iter().map(|(at, force)| point_stress(&(x - at)) * *force).sum()
    }

    /// Forces [N], three for each node, of the stress on the element faces at `x = size`, `y = size` and `z = -size`.
    pub(super) fn forces(&self, mesh: &HexMesh, size: f64) -> Vec<f64> {
        let mut forces = vec![0.0; 3 * mesh.nodes.len()];
        for (axis, at) in [(0, size), (1, size), (2, -size)] {
            let mut outward = Vec3::zeros();
            outward[axis] = at.signum();
            for face in faces(mesh, axis, at) {
                self.load(mesh, &face, &outward, &mut forces);
            }
        }
        forces
    }

    /// Adds the forces on one flat face by 3 x 3 Gauss points.
    fn load(&self, mesh: &HexMesh, face: &[usize; 4], outward: &Vec3, forces: &mut [f64]) {
        let root = 0.6_f64.sqrt();
        let gauss = [(-root, 5.0 / 9.0), (0.0, 8.0 / 9.0), (root, 5.0 / 9.0)];
        let corner = face.map(|node| mesh.nodes[node]);
        for ((u, wu), (v, wv)) in gauss.iter().flat_map(|u| gauss.iter().map(move |v| (*u, *v))) {
            let sides = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            let shape = sides.map(|(su, sv)| 0.25 * (1.0 + su * u) * (1.0 + sv * v));
            let along = |k: usize| sides[k].0 * 0.25 * (1.0 + sides[k].1 * v);
            let across = |k: usize| sides[k].1 * 0.25 * (1.0 + sides[k].0 * u);
            let sum = |weight: &dyn Fn(usize) -> f64| -> Vec3 {
                (0..4).map(|k| corner[k] * weight(k)).sum()
            };
            let area = sum(&along).cross(&sum(&across)).norm() * wu * wv;
            let traction = self.stress(&sum(&|k| shape[k])) * outward * area;
            for (node, n) in face.iter().zip(shape) {
                (0..3).for_each(|d| forces[3 * node + d] += n * traction[d]);
            }
        }
    }
}

/// Stress [MPa] of a half-space at `x` due to a vertical force of 1 N at the origin.
fn point_stress(x: &Vec3) -> Mat3 {
    let (r, rho, z) = (x.x.hypot(x.y), x.norm(), -x.z);
    let (s, c) = if r > 0.0 { (x.y / r, x.x / r) } else { (0.0, 1.0) };
    let free = (1.0 - 2.0 * POISSON) / (rho * (rho + z));
    let radial = free - 3.0 * z * r * r / rho.powi(5);
    let hoop = (1.0 - 2.0 * POISSON) * z / rho.powi(3) - free;
    let down = -3.0 * z.powi(3) / rho.powi(5);
    let shear = 3.0 * r * z * z / rho.powi(5);
    let (xx, yy) = (c * c * radial + s * s * hoop, s * s * radial + c * c * hoop);
    let xy = s * c * (radial - hoop);
    Mat3::new(xx, xy, c * shear, xy, yy, s * shear, c * shear, s * shear, down) / TAU
}

/// Faces of elements whose four nodes have coordinate `axis` equal to `at`.
fn faces(mesh: &HexMesh, axis: usize, at: f64) -> Vec<[usize; 4]> {
    const SIDES: [[usize; 4]; 6] =
        [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
    let on = |face: &[usize; 4]| {
        face.iter().all(|&node| (mesh.nodes[node][axis] - at).abs() < 1e-9 * at.abs())
    };
    let of = |element: &[u32; 8]| SIDES.map(|side| side.map(|k| element[k] as usize));
    mesh.elements.iter().flat_map(of).filter(on).collect()
}

/// Far away the surface settles as under a point force, and the faces of a block carry the force.
#[test]
fn surface_and_faces_are_those_of_hertz() {
    let (a, radius) = (0.03, 30.0);
    let force = 4.0 / 3.0 * YOUNG / 0.91 * a * a * a / radius;
    let pressed = Pressed::new(force, a);
    let far = Vec3::new(40.0 * a, 0.0, 0.0);
    let point = force * 0.91 / (PI * YOUNG * 40.0 * a);
    assert!((pressed.sinks(&far) / point - 1.0).abs() < 1e-3);
    let mut mesh = crate::sheet::hex_mesh::rectangle(1.0, 1.0, 1.0, 12, 12, 12);
    mesh.nodes.iter_mut().for_each(|x| *x = Vec3::new(x.x, x.y, x.z - 1.0) * (8.0 * a));
    let up: f64 = pressed.forces(&mesh, 8.0 * a).iter().skip(2).step_by(3).sum();
    assert!((4.0 * up / force - 1.0).abs() < 1e-4, "{}", 4.0 * up / force);
}
