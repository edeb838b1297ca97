//! Sheets under large in-plane strain: stability of an infinite mesh of equal elements against periodic perturbations
//! (Bloch waves).

use nalgebra::SMatrix;

use super::*;
use crate::assembly::Evaluation;
use crate::material::card;

const PI: f64 = std::f64::consts::PI;
/// Wave numbers along each axis, up to a wave length of two elements.
const WAVES: usize = 8;

/// Minimum stiffness of the waves `exp(i k·x)` on an infinite mesh of elements with this tangent, the lower side held
/// flat. Rows follow the nodes of the element; `k` is in fractions of the shortest wave.
fn weakest_wave(tangent: &[[f64; DOFS]; DOFS]) -> (f64, [f64; 2]) {
    let places = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let stiffness = |k: [f64; 2]| {
        // Real and imaginary parts of three displacements at the lower and three at the upper node.
        let mut sum = SMatrix::<f64, 12, 12>::zeros();
        for (a, b) in (0..8).flat_map(|a| (0..8).map(move |b| (a, b))) {
            let (p, q): ([f64; 2], [f64; 2]) = (places[a % 4], places[b % 4]);
            let (s, c) = (k[0] * (q[0] - p[0]) + k[1] * (q[1] - p[1])).sin_cos();
            for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                let value = tangent[3 * a + i][3 * b + j];
                let (row, column) = (3 * (a / 4) + i, 3 * (b / 4) + j);
                sum[(row, column)] += c * value;
                sum[(row + 6, column + 6)] += c * value;
                sum[(row + 6, column)] += s * value;
                sum[(row, column + 6)] -= s * value;
            }
        }
        for held in [2, 8] {
            sum.row_mut(held).fill(0.0);
            sum.column_mut(held).fill(0.0);
            sum[(held, held)] = 1e9;
        }
        ((sum + sum.transpose()) * 0.5).symmetric_eigenvalues().min()
    };
    let waves = (1..(WAVES + 1).pow(2)).map(|n| [n / (WAVES + 1), n % (WAVES + 1)]);
    waves
        .map(|n| n.map(|n| n as f64 / WAVES as f64))
        .map(|share| (stiffness(share.map(|share| PI * share)), share))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap()
}

/// Tangent of one element of 1 x 1 x 0.8 mm of the steel of the cross tool after given in-plane logarithmic strains
/// in 40 steps, free to thicken.
fn strained(kind: ElementKind, strain: [f64; 2]) -> [[f64; DOFS]; DOFS] {
    let steel = card::find("mild-steel-neto2012").unwrap().build(0.0).unwrap();
    let mesh = hex_mesh::rectangle(1.0, 1.0, 0.8, 1, 1, 1);
    let mut body = Body::new(mesh.clone(), kind, steel).unwrap();
    let mut out = Evaluation::default();
    let mut thickening = 0.0;
    let upper = select(&mesh, |x| x.z > 1e-9);
    let steps = 40;
    for step in 1..=steps {
        let share = f64::from(step) / f64::from(steps);
        let mut force = |body: &mut Body, thickening: f64| {
            let rates = [share * strain[0], share * strain[1], thickening].map(f64::exp_m1);
            let u: Vec<f64> =
                mesh.nodes.iter().flat_map(|x| [0, 1, 2].map(|i| rates[i] * x[i])).collect();
            body.evaluate(&u, Want::ResidualAndTangent, &mut out).unwrap();
            upper.iter().map(|&node| out.internal_force[3 * node + 2]).sum::<f64>()
        };
        for _ in 0..12 {
            let pull = force(&mut body, thickening);
            let more = force(&mut body, thickening + 1e-7);
            thickening -= 1e-7 * pull / (more - pull);
        }
        force(&mut body, thickening);
        body.commit();
    }
    let mut own = [0; 8];
    for (local, &node) in mesh.elements[0].iter().enumerate() {
        own[node as usize] = local;
    }
    let pattern = body.pattern();
    let mut tangent = [[0.0; DOFS]; DOFS];
    for row in 0..DOFS {
        for at in pattern.row_ptr[row]..pattern.row_ptr[row + 1] {
            let column = pattern.col_idx[at];
            tangent[3 * own[row / 3] + row % 3][3 * own[column / 3] + column % 3] = out.tangent[at];
        }
    }
    tangent
}

/// Draw-in of a flange: logarithmic strain +0.8 in one direction and -0.8 in the other. The shortest waves cost a
/// bilinear element less than the sheet, since it takes them for bending; their stiffness must stay positive.
#[test]
fn a_flange_drawn_in_far_resists_every_wave_of_its_mesh() {
    let far = [[0.4, -0.5], [0.8, -0.8], [-0.8, 0.8], [0.6, -0.9], [0.0, -0.8]];
    for strain in far {
        let (least, wave) = weakest_wave(&strained(SHELL_ENHANCED, strain));
        println!("{strain:?}: {least:.1} N/mm at {wave:?}");
        assert!(least > 0.0, "{strain:?}: {least} at {wave:?}");
    }
}

/// First strain (tension in one direction, compression in the other) at which some wave has no stiffness, up to 1.2
/// in steps of 0.1.
fn first_unstable_strain(kind: ElementKind) -> Option<f64> {
    let strains = (1..=12).map(|n| 0.1 * f64::from(n));
    strains.into_iter().find(|&e| weakest_wave(&strained(kind, [e, -e])).0 < 0.0)
}

/// Additive strain modes, as in `hex8-enhanced`, lose stability in a checkerboard pattern long before the sheet does.
#[test]
fn multiplicative_modes_are_stable_beyond_additive_ones() {
    let all = [SHELL, SHELL_ENHANCED, ElementKind::Hex8, ElementKind::Hex8Enhanced];
    let [plain, shell, brick, enhanced] = all.map(first_unstable_strain);
    println!("shell {plain:?}, enhanced {shell:?}; brick {brick:?}, enhanced {enhanced:?}");
    assert!(enhanced.is_some_and(|e| e < 0.35), "{enhanced:?}");
    assert!([plain, shell, brick] == [None; 3], "{plain:?} {shell:?} {brick:?}");
    let (least, wave) = weakest_wave(&strained(ElementKind::Hex8Enhanced, [0.8, -0.8]));
    assert!(least < -100.0 && wave == [1.0, 1.0], "{least} at {wave:?}");
}
