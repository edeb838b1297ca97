//! One element in tension: r values and yield ratios of the steel of the paper (Table 1).

use std::f64::consts::FRAC_PI_4;
use std::sync::Arc;

use nalgebra::{Matrix3, SMatrix, SVector, SymmetricEigen};

use super::body;
use crate::assembly::Body;
use crate::assembly::Evaluation;
use crate::element::{ElementKind, Want};
use crate::material::card;
use crate::sheet::hex_mesh::rectangle;
use kanagata_geometry::Vec3;

/// Logarithmic strain: xx, yy, zz, 2 xy, 2 yz, 2 zx.
type Strain = [f64; 6];

fn stretch(e: &Strain) -> Matrix3<f64> {
    let (xy, yz, zx) = (0.5 * e[3], 0.5 * e[4], 0.5 * e[5]);
    let log = Matrix3::new(e[0], xy, zx, xy, e[1], yz, zx, yz, e[2]);
    let eigen = SymmetricEigen::new(log);
    let q = eigen.eigenvectors;
    q * Matrix3::from_diagonal(&eigen.eigenvalues.map(f64::exp)) * q.transpose()
}

/// For a rotated body.
fn displacement(body: &Body, turn: &Matrix3<f64>, e: &Strain) -> Vec<f64> {
    let u = turn * stretch(e) * turn.transpose() - Matrix3::identity();
    body.mesh().nodes.iter().flat_map(|x| (u * x).as_slice().to_vec()).collect()
}

/// Stresses equivalent to the nodal forces of the element: force times change of position by strain, over the volume.
fn stresses(body: &mut Body, turn: &Matrix3<f64>, e: &Strain) -> [f64; 6] {
    let mut out = Evaluation::default();
    body.evaluate(&displacement(body, turn, e), Want::Residual, &mut out).unwrap();
    let volume: f64 = 2.0 * 3.0 * 0.8;
    std::array::from_fn(|i| {
        let step = 1e-5;
        let shifted = |by: f64| {
            let mut s = *e;
            s[i] += by;
            displacement(body, turn, &s)
        };
        let (up, down) = (shifted(step), shifted(-step));
        let work: f64 = out
            .internal_force
            .iter()
            .zip(up.iter().zip(&down))
            .map(|(f, (a, b))| f * (a - b))
            .sum();
        work / (2.0 * step) / volume
    })
}

/// Strains at an axial strain for uniaxial stress; and the stress.
fn tension(body: &mut Body, turn: &Matrix3<f64>, axial: f64) -> (Strain, f64) {
    let mut e = [axial, -0.6 * axial, -0.4 * axial, 0.0, 0.0, 0.0];
    for _ in 0..30 {
        let now = stresses(body, turn, &e);
        if now[1..].iter().all(|s| s.abs() < 1e-8 * now[0]) {
            return (e, now[0]);
        }
        let step = 1e-7;
        let mut jacobian = SMatrix::<f64, 5, 5>::zeros();
        for c in 0..5 {
            let mut s = e;
            s[c + 1] += step;
            let moved = stresses(body, turn, &s);
            (0..5).for_each(|r| jacobian[(r, c)] = (moved[r + 1] - now[r + 1]) / step);
        }
        let rhs = SVector::<f64, 5>::from_fn(|r, _| -now[r + 1]);
        let change = jacobian.lu().solve(&rhs).unwrap();
        (0..5).for_each(|i| e[i + 1] += change[i]);
    }
    panic!("no tension at {axial}");
}

/// BENCHMARKS 2: r = 2.367, 1.854, 2.801; yield over that along rolling 1, 1.1308, 1.0238, from F, G, H, N.
#[test]
fn r_values_and_yield_ratios_of_one_element_in_tension() {
    let (f, g, h, n) = (0.251_f64, 0.297_f64, 0.703_f64, 1.29_f64);
    let steel = card::find("mild-steel-neto2012").unwrap();
    let (young, poisson) = (steel.young_mpa, steel.poisson);
    let flow = |p: f64| 529.5 * (0.00439_f64 + p).powf(0.268);
    let cases = [
        (0.0, h / g, 1.0),
        (FRAC_PI_4, n / (f + g) - 0.5, (4.0 * (g + h) / (f + g + 2.0 * n)).sqrt()),
        (2.0 * FRAC_PI_4, h / f, ((g + h) / (f + h)).sqrt()),
    ];
    for (angle, r, ratio) in cases {
        let material = steel.build(angle).unwrap();
        let mut body = body(rectangle(2.0, 3.0, 0.8, 1, 1, 1), Arc::clone(&material));
        let (e, stress) = tension(&mut body, &Matrix3::identity(), 0.08);
        let plastic = |i: usize| e[i] + poisson * stress / young;
        let found = plastic(1) / plastic(2);
        assert!((found - r).abs() < 1e-6, "r at {angle}: {found} {r}");
        // Work: stress times plastic axial strain is flow stress times equivalent plastic strain.
        body.commit();
        let p = body.element_states().unwrap()[0].mean.plastic_strain;
        let found = stress / flow(p);
        assert!((found - ratio).abs() < 1e-6, "yield at {angle}: {found} {ratio}");
    }
}

/// Strips pulled along x at an angle to the rolling direction, which lies in their plane for any rotation about x.
#[test]
fn a_vertical_strip_behaves_as_a_horizontal_one() {
    let cards =
        ["mild-steel-neto2012", "aa2090-t3-barlat2005"].map(|name| card::find(name).unwrap());
    for (card, angle) in cards.iter().flat_map(|card| [0.0, 0.6].map(|angle| (card, angle))) {
        let flat = rectangle(2.0, 3.0, 0.8, 1, 1, 1);
        let mut lying = body(flat.clone(), card.build(angle).unwrap());
        assert!(lying.material_axes().is_none());
        let (e, stress) = tension(&mut lying, &Matrix3::identity(), 0.05);
        for degrees in [0.0_f64, 45.0, 90.0, 200.0] {
            let (s, c) = degrees.to_radians().sin_cos();
            let turn = Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c);
            let mut mesh = flat.clone();
            mesh.nodes.iter_mut().for_each(|x| *x = turn * *x);
            let mut upright = body(mesh, card.build(0.0).unwrap());
            // The component normal to the sheet is excluded.
            let rolling = Vec3::new(angle.cos(), angle.sin(), 0.7);
            upright.set_rolling_direction(&(turn * rolling)).unwrap();
            let own = stresses(&mut upright, &turn, &e);
            assert!((own[0] / stress - 1.0).abs() < 1e-9, "{own:?} {stress}");
            let lying = stresses(&mut lying, &Matrix3::identity(), &e);
            for (found, flat) in own.iter().zip(&lying) {
                let off = (found - flat).abs() / stress;
                assert!(off < 1e-9, "{} at {angle}, {degrees} degrees: {off:e}", card.name);
            }
        }
    }
}

/// With two points the square of the height, in which the thickness strain varies, is constant: modes without
/// stiffness.
#[test]
fn solid_shells_accept_three_to_ten_points_through_the_thickness() {
    for points in 1..=11 {
        let kind = ElementKind::SolidShell { points, membrane: true };
        let made = Body::new(rectangle(2.0, 3.0, 0.8, 2, 2, 1), kind, super::steel());
        let Ok(mut body) = made else {
            assert!(!(3..=10).contains(&points), "{points}: {}", made.err().unwrap());
            continue;
        };
        assert!((3..=10).contains(&points), "{points}");
        let u = displacement(&body, &Matrix3::identity(), &[0.01, 0.0, 0.0, 0.0, 0.0, 0.0]);
        body.evaluate(&u, Want::ResidualAndTangent, &mut Evaluation::default()).unwrap();
    }
}
