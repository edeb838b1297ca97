//! Principal surface strains at the centre of every element, as measured by a grid on the sheet.
//!
//! With tangents `g_a` (current) and `G_a` (initial) at the centre of a face or of the mid-surface, the Green strain is
//! `E_ab = ½ (g_a·g_b - G_a·G_b)`. Its principal values `E_k` in orthonormal axes of the undeformed face are `½ (λ² -
//! 1)`. The logarithmic strains are `ln λ = ½ ln (1 + 2 E_k)`. They are principal strains within the surface,
//! independent of transverse shear and of the material.

use crate::geometry::Vec3;
use crate::solver::sheet::hex_mesh::HexMesh;

/// Principal logarithmic strains of a surface.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Principal {
    /// Larger principal strain.
    pub major: f64,
    /// Smaller principal strain.
    pub minor: f64,
}

/// Strains at the centre of an element.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ElementStrains {
    /// Of the lower face.
    pub lower: Principal,
    /// Of the mid-surface.
    pub middle: Principal,
    /// Of the upper face.
    pub upper: Principal,
    /// `ln(t/t0)` with the mean thickness `t` of the element, normal to its mid-surface.
    pub thickness: f64,
}

/// Strains of every element at `displacements` (three per node [mm]).
#[must_use]
pub fn of_elements(mesh: &HexMesh, displacements: &[f64]) -> Vec<ElementStrains> {
    let moved = |node: u32| {
        let at = 3 * node as usize;
        Vec3::new(displacements[at], displacements[at + 1], displacements[at + 2])
    };
    let strains = |element: &[u32; 8]| {
        of_element(&element.map(|node| mesh.nodes[node as usize]), &element.map(moved))
    };
    mesh.elements.iter().map(strains).collect()
}

/// Tangents along `ξ` and `η` at the centre of a face with these corners.
fn tangents([a, b, c, d]: [Vec3; 4]) -> [Vec3; 2] {
    [0.25 * (b + c - a - d), 0.25 * (c + d - a - b)]
}

fn of_element(x: &[Vec3; 8], u: &[Vec3; 8]) -> ElementStrains {
    let faces = |of: &[Vec3; 8]| {
        let [a, b, c, d, e, f, g, h] = *of;
        [tangents([a, b, c, d]), tangents([e, f, g, h])]
    };
    let ([low, high], [low_by, high_by]) = (faces(x), faces(u));
    let between = |a: [Vec3; 2], b: [Vec3; 2]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
    let (middle, middle_by) = (between(low, high), between(low_by, high_by));
    let now: [Vec3; 8] = std::array::from_fn(|k| x[k] + u[k]);
    let [low_now, high_now] = faces(&now);
    let ratio = height(&now, between(low_now, high_now)) / height(x, middle);
    ElementStrains {
        lower: principal(low, low_by),
        middle: principal(middle, middle_by),
        upper: principal(high, high_by),
        thickness: ratio.ln(),
    }
}

/// Four times the thickness normal to a surface with these tangents [mm]. It uses the lengths of the fibres, which
/// diverge in a bent sheet, and their mean tilt.
fn height(x: &[Vec3; 8], tangents: [Vec3; 2]) -> f64 {
    let fibres = [0, 1, 2, 3].map(|k| x[k + 4] - x[k]);
    let direction = fibres.iter().sum::<Vec3>().normalize();
    let length: f64 = fibres.iter().map(Vec3::norm).sum();
    length * direction.dot(&tangents[0].cross(&tangents[1]).normalize())
}

/// Principal strains of a surface with initial tangents `was` and their changes `by`.
fn principal(was: [Vec3; 2], by: [Vec3; 2]) -> Principal {
    let change =
        |a: usize, b: usize| 0.5 * (was[a].dot(&by[b]) + by[a].dot(&was[b]) + by[a].dot(&by[b]));
    // `G_1 = a e_1`, `G_2 = a s e_1 + h e_2` in orthonormal axes.
    let a = was[0].norm();
    let slant = was[0].dot(&was[1]) / (a * a);
    let h = was[0].cross(&was[1]).norm() / a;
    let [e11, e12, e22] = [change(0, 0), change(0, 1), change(1, 1)];
    let xx = e11 / (a * a);
    let xy = (e12 - slant * e11) / (a * h);
    let yy = (e22 - 2.0 * slant * e12 + slant * slant * e11) / (h * h);
    let (mean, radius) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
    let logarithmic = |green: f64| 0.5 * (2.0 * green).ln_1p();
    Principal { major: logarithmic(mean + radius), minor: logarithmic(mean - radius) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Mat3;
    use crate::solver::sheet::hex_mesh::rectangle;

    fn near(found: Principal, major: f64, minor: f64) {
        let error = (found.major - major).abs().max((found.minor - minor).abs());
        assert!(error < 1e-14, "{found:?} is not {major}, {minor}");
    }

    fn displaced(mesh: &HexMesh, to: impl Fn(&Vec3) -> Vec3) -> Vec<f64> {
        mesh.nodes.iter().flat_map(|x| <[f64; 3]>::from(to(x) - x)).collect()
    }

    #[test]
    fn stretches_are_found_in_oblique_elements_however_the_sheet_is_turned_and_sheared_across() {
        let mut mesh = rectangle(2.0, 3.0, 0.8, 2, 2, 1);
        mesh.nodes.iter_mut().for_each(|x| *x = Vec3::new(x.x + 0.4 * x.y, x.y - 0.2 * x.x, x.z));
        assert_eq!(
            of_elements(&mesh, &vec![0.0; 3 * mesh.nodes.len()])[0],
            ElementStrains::default()
        );
        let (s, c) = 0.7_f64.sin_cos();
        let turn = Mat3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c);
        let along = Mat3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
        let stretch = Mat3::from_diagonal(&Vec3::new(1.3, 0.9, 0.7));
        let shear = Mat3::new(1.0, 0.0, 0.3, 0.0, 1.0, -0.2, 0.0, 0.0, 1.0);
        let f = turn * shear * along * stretch * along.transpose();
        for one in of_elements(&mesh, &displaced(&mesh, |x| f * x)) {
            for face in [one.lower, one.middle, one.upper] {
                near(face, 1.3_f64.ln(), 0.9_f64.ln());
            }
            assert!((one.thickness - 0.7_f64.ln()).abs() < 1e-14, "{}", one.thickness);
        }
    }

    #[test]
    fn the_faces_of_a_bent_sheet_differ() {
        // Chords of arcs of radius 5 about y; the mid-surface is unstretched along its chords.
        let mesh = rectangle(4.0, 2.0, 0.8, 4, 1, 1);
        let half = 0.1_f64;
        let rolled = |x: &Vec3| {
            let middle = 0.5 / half.sin();
            let (s, c) = (2.0 * half * x.x).sin_cos();
            let radius = middle - (x.z - 0.4);
            Vec3::new(radius * s, x.y, 0.4 + middle - radius * c)
        };
        for one in of_elements(&mesh, &displaced(&mesh, rolled)) {
            let share = 0.4 * 2.0 * half.sin();
            near(one.middle, 0.0, 0.0);
            near(one.lower, (1.0 + share).ln(), 0.0);
            near(one.upper, 0.0, (1.0 - share).ln());
            assert!(one.thickness.abs() < 1e-14, "{}", one.thickness);
        }
    }
}
