//! Principal surface strains at the centre of every element, as measured by a grid on the sheet.
//!
//! With tangents `g_a` (current) and `G_a` (initial) at the centre of a face or of the mid-surface, the Green strain is
//! `E_ab = ½ (g_a·g_b - G_a·G_b)`. Its principal values `E_k` in orthonormal axes of the undeformed face are `½ (λ² -
//! 1)`. The logarithmic strains are `ln λ = ½ ln (1 + 2 E_k)`. They are principal strains within the surface,
//! independent of transverse shear and of the material.

use kanagata_geometry::Vec3;
use kanagata_solver::sheet::hex_mesh::HexMesh;

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

/// Strain of the sheet at the centre of an element.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SheetStrain {
    /// Principal logarithmic strains of the mid-surface of the sheet.
    pub principal: Principal,
    /// Logarithmic strain tensor of the mid-surface in orthonormal axes of the undeformed element: half of its trace, half
    /// of the difference of its normal components, its shear component. Twice the scalar product of two such triples is
    /// that of the tensors.
    pub tensor: [f64; 3],
    /// `ln(t/t0)` with the mean thickness `t` of the sheet, normal to its mid-surface.
    pub thickness: f64,
    /// Initial area of the mid-surface [mm2].
    pub area: f64,
}

/// Strains of the sheet at every element, at `displacements` (three per node [mm]).
///
/// The mid-surface is that of the whole sheet: the elements of a stack through the thickness have the same strain, free
/// of bending.
#[must_use]
pub fn of_sheet(mesh: &HexMesh, displacements: &[f64]) -> Vec<SheetStrain> {
    let moved = |node: u32| {
        let at = 3 * node as usize;
        Vec3::new(displacements[at], displacements[at + 1], displacements[at + 2])
    };
    let levels = mesh.nodes_per_column as u32;
    let strain = |element: &[u32; 8]| {
        let stack: [u32; 8] = std::array::from_fn(|k| match (levels, k) {
            (0 | 1, _) => element[k],
            (_, 0..4) => element[k] / levels * levels,
            _ => element[k] / levels * levels + levels - 1,
        });
        sheet_strain(&stack.map(|node| mesh.nodes[node as usize]), &stack.map(moved))
    };
    mesh.elements.iter().map(strain).collect()
}

fn sheet_strain(x: &[Vec3; 8], u: &[Vec3; 8]) -> SheetStrain {
    let middle = |of: &[Vec3; 8]| {
        let [a, b, c, d, e, f, g, h] = *of;
        let (low, high) = (tangents([a, b, c, d]), tangents([e, f, g, h]));
        [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])]
    };
    let (was, by) = (middle(x), middle(u));
    let now: [Vec3; 8] = std::array::from_fn(|k| x[k] + u[k]);
    let [xx, xy, yy] = green(was, by);
    let principal = principal_of([xx, xy, yy]);
    let (half, radius) = (0.5 * (principal.major - principal.minor), (0.5 * (xx - yy)).hypot(xy));
    // The logarithmic strain has the principal axes of the Green strain.
    let scale = if radius > 0.0 { half / radius } else { 0.0 };
    SheetStrain {
        principal,
        tensor: [0.5 * (principal.major + principal.minor), scale * 0.5 * (xx - yy), scale * xy],
        thickness: (height(&now, middle(&now)) / height(x, was)).ln(),
        area: 4.0 * was[0].cross(&was[1]).norm(),
    }
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
    principal_of(green(was, by))
}

/// Green strain `xx, xy, yy` of a surface with initial tangents `was` and their changes `by`, in orthonormal axes of which
/// the first is along the first tangent.
fn green(was: [Vec3; 2], by: [Vec3; 2]) -> [f64; 3] {
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
    [xx, xy, yy]
}

/// Principal logarithmic strains of a Green strain.
fn principal_of([xx, xy, yy]: [f64; 3]) -> Principal {
    let (mean, radius) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
    let logarithmic = |green: f64| 0.5 * (2.0 * green).ln_1p();
    Principal { major: logarithmic(mean + radius), minor: logarithmic(mean - radius) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_geometry::Mat3;
    use kanagata_solver::sheet::hex_mesh::rectangle;

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

    /// The tensor of a stretch along turned axes, in three layers, has the closed form; bending leaves no strain.
    #[test]
    fn the_strain_of_the_sheet_is_that_of_its_mid_surface() {
        let mesh = rectangle(2.0, 3.0, 0.9, 2, 2, 3);
        let (s, c) = 0.3_f64.sin_cos();
        let axes = Mat3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
        let stretch = Mat3::from_diagonal(&Vec3::new(1.3, 0.9, 0.7));
        let f = axes * stretch * axes.transpose();
        let (one, two) = (1.3_f64.ln(), 0.9_f64.ln());
        let (mean, half) = (0.5 * (one + two), 0.5 * (one - two));
        let expected = [mean, half * 0.6_f64.cos(), half * 0.6_f64.sin()];
        let mut area = 0.0;
        for found in of_sheet(&mesh, &displaced(&mesh, |x| f * x)) {
            near(found.principal, one, two);
            for (found, expected) in found.tensor.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-14, "{found} {expected}");
            }
            assert!((found.thickness - 0.7_f64.ln()).abs() < 1e-14);
            area += found.area / 3.0;
        }
        assert!((area - 6.0).abs() < 1e-14, "{area}");
        // Rolled about y: fibres at all heights have the same angle.
        let rolled = |x: &Vec3| {
            let (s, c) = (0.1 * x.x).sin_cos();
            let radius = 0.05 / 0.05_f64.sin() / 0.1 - (x.z - 0.45);
            Vec3::new(radius * s, x.y, radius * (1.0 - c) + x.z)
        };
        let bent = rectangle(4.0, 1.0, 0.9, 4, 1, 3);
        for found in of_sheet(&bent, &displaced(&bent, rolled)) {
            near(found.principal, 0.0, 0.0);
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
