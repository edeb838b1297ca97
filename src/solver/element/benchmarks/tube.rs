//! Tube of anisotropic steel under axial tension.

use super::*;
use crate::assembly::Evaluation;
use crate::material::card;
use crate::material::hill48::Hill48;
use crate::sheet::hex_mesh::thickened;

const RADIUS: f64 = 50.0;
const THICKNESS: f64 = 0.4;
const HEIGHT: f64 = 30.0;

/// Quarter of a tube about z with its outer face on top.
fn quarter() -> HexMesh {
    let (around, up) = (12, 3);
    let place = |i: usize, k: usize| {
        let angle = std::f64::consts::FRAC_PI_2 * i as f64 / around as f64;
        let [x, y] = if i == around { [0.0, 1.0] } else { [angle.cos(), angle.sin()] };
        Vec3::new(RADIUS * x, RADIUS * y, HEIGHT * k as f64 / up as f64)
    };
    let all = (0..=around).flat_map(|i| (0..=up).map(move |k| place(i, k)));
    let points: Vec<Vec3> = all.collect();
    let id = |i: usize, k: usize| (i * (up + 1) + k) as u32;
    let cells = (0..around).flat_map(|i| (0..up).map(move |k| (i, k)));
    let quads: Vec<[u32; 4]> =
        cells.map(|(i, k)| [id(i, k), id(i + 1, k), id(i + 1, k + 1), id(i, k + 1)]).collect();
    let mut mesh = thickened(&points, &quads, THICKNESS, 1);
    // Normals at the rims of the mesh are those of one element.
    for column in mesh.nodes.chunks_exact_mut(2) {
        let out = Vec3::new(column[0].x, column[0].y, 0.0) / RADIUS;
        column[1] = column[0] + THICKNESS * out;
    }
    mesh
}

/// Ratio of the hoop to the thickness plastic strain with the rolling direction along `rolling`.
fn r_value(rolling: &Vec3) -> f64 {
    let mesh = quarter();
    let steel = card::find("mild-steel-neto2012").unwrap().build(0.0).unwrap();
    let mut body = Body::new(mesh.clone(), SHELL_ENHANCED, steel).unwrap();
    body.set_rolling_direction(rolling).unwrap();
    let on = |axis: usize, at: f64| select(&mesh, |x| (x[axis] - at).abs() < 1e-9);
    let mut held: Vec<(usize, f64)> = (0..3)
        .flat_map(|axis| on(axis, 0.0).into_iter().map(move |node| (3 * node + axis, 0.0)))
        .collect();
    held.extend(on(2, HEIGHT).into_iter().map(|node| (3 * node + 2, 0.08 * HEIGHT)));
    let (u, _) = solve(&mut body, &Problem { held, loads: Vec::new(), steps: 60 });
    let moved =
        |node: usize| mesh.nodes[node] + Vec3::from_column_slice(&u[3 * node..3 * node + 3]);
    let mut out = Evaluation::default();
    body.evaluate(&u, Want::Residual, &mut out).unwrap();
    let force: f64 = on(2, HEIGHT).into_iter().map(|node| out.internal_force[3 * node + 2]).sum();
    let columns = mesh.nodes.len() / 2;
    let mean = |of: &dyn Fn(usize) -> f64| (0..columns).map(of).sum::<f64>() / columns as f64;
    let around = mean(&|c| {
        let radius = |x: Vec3, y: Vec3| (0.5 * (x + y)).xy().norm();
        let own = radius(mesh.nodes[2 * c], mesh.nodes[2 * c + 1]);
        (radius(moved(2 * c), moved(2 * c + 1)) / own).ln()
    });
    let through = mean(&|c| ((moved(2 * c + 1) - moved(2 * c)).norm() / THICKNESS).ln());
    let section = std::f64::consts::FRAC_PI_2 * (RADIUS + 0.5 * THICKNESS) * THICKNESS;
    let elastic = 0.3 / 210_000.0 * force / (section * (around + through).exp());
    (around + elastic) / (through + elastic)
}

/// Rolled along the axis the tube narrows with r0, rolled along the circumference with r90. The latter is given at
/// the middle of the quarter, at 45 degrees to the normals of both ends.
#[test]
fn a_tube_narrows_as_its_rolling_direction_says() {
    let hill = Hill48 { f: 0.251, g: 0.297, h: 0.703, l: 1.5, m: 1.5, n: 1.29 };
    let ways = [(Vec3::z(), 0.0), (Vec3::new(-1.0, 1.0, 0.0), std::f64::consts::FRAC_PI_2)];
    for (rolling, angle) in ways {
        let (found, exact) = (r_value(&rolling), hill.r_value(angle));
        // A wall of finite thickness cannot have both strains: their difference over t / R causes stresses.
        assert!((found / exact - 1.0).abs() < 0.01, "{rolling}: {found} {exact}");
    }
}
