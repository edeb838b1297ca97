//! Draw-in of a flange: the hoop strain varies along the radius, and the radial strain must vary with it.

use std::sync::Arc;

use super::*;
use crate::assembly::Evaluation;
use crate::material::hardening::Hardening;
use crate::material::hill48::Hill48;
use crate::material::plastic::Plastic;

/// Radial force [N] on the inner border of a quarter ring (radii 50 and 100 mm) of steel. The border is pulled in by
/// 10 mm in the plane and may thicken; `cells` elements along the radius, twice as many along the circumference.
fn drawn_in(kind: ElementKind, radial: usize) -> f64 {
    let mut mesh = hex_mesh::rectangle(1.0, 1.0, 0.8, radial, 2 * radial, 1);
    for x in &mut mesh.nodes {
        let (radius, angle) = (50.0 + 50.0 * x.x, std::f64::consts::FRAC_PI_2 * x.y);
        *x = Vec3::new(radius * angle.cos(), radius * angle.sin(), x.z);
    }
    let mut held = Vec::new();
    let mut inner = Vec::new();
    for (node, x) in mesh.nodes.iter().enumerate() {
        let radius = x.xy().norm();
        if radius < 50.0 + 1e-9 {
            inner.push((node, x.xy() / radius));
            held.extend((0..2).map(|k| (3 * node + k, -10.0 * x[k] / radius)));
        } else {
            held.extend((0..2).filter(|&k| x[k].abs() < 1e-9).map(|k| (3 * node + k, 0.0)));
        }
        if x.z < 1e-9 {
            held.push((3 * node + 2, 0.0));
        }
    }
    let swift = Hardening::Swift { k: 529.5, eps0: 0.00439, n: 0.268 };
    let elastic = Elastic { young: 210_000.0, poisson: 0.3 };
    let steel = Arc::new(Plastic::new(elastic, &Hill48::MISES, swift).unwrap());
    let mut body = Body::new(mesh, kind, steel).unwrap();
    let (u, _) = solve(&mut body, &Problem { held, loads: Vec::new(), steps: 90 });
    let mut out = Evaluation::default();
    body.evaluate(&u, Want::Residual, &mut out).unwrap();
    let along = |(node, d): (usize, nalgebra::Vector2<f64>)| {
        out.internal_force[3 * node] * d.x + out.internal_force[3 * node + 1] * d.y
    };
    inner.into_iter().map(along).sum()
}

/// With four elements along the radius, unmodified strains make the flange too stiff.
#[test]
fn a_flange_drawn_in_by_coarse_shells_is_not_too_stiff() {
    let fine = drawn_in(SHELL_ENHANCED, 10);
    let [assumed, plain] = [SHELL_ENHANCED, SHELL].map(|kind| drawn_in(kind, 4) / fine - 1.0);
    println!("flange: {fine:.1} N, {assumed:+.4} assumed, {plain:+.4} as they are");
    assert!(assumed.abs() < 0.012 && plain > 0.2, "{assumed} {plain}");
}
