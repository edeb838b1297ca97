//! The condensed matrix is the derivative of the residual, tested for every equation: stick, slip, curvature,
//! constrained directions, travel.

use std::f64::consts::FRAC_PI_2;

use super::{body, setup, stage, steel, tool};
use crate::element::Want;
use crate::sheet::hex_mesh::rectangle;
use crate::system::system::System;
use crate::test_tools::{arc, revolved};
use crate::tools::role::Role;
use crate::{Constraints, Curve, Motion, SheetSide, Simulation};
use kanagata_contact::Location;
use kanagata_geometry::Vec3;

/// A small block under a ball of Nagata patches, pushed in and slightly rotated, with all admissible contacts active.
fn pressed(mu: f64, stiffness: Option<f64>) -> System {
    let mesh = rectangle(4.0, 4.0, 2.0, 4, 4, 2);
    let mut constraints = Constraints::none(mesh.nodes.len());
    constraints.symmetry_plane(&mesh.nodes, 2, 0.0, 1e-9);
    let ball = [arc(5, [0.0, 12.0], 10.0, [-FRAC_PI_2, 0.3], 1.0)];
    let tools =
        vec![tool("ball", revolved("ball", 6, FRAC_PI_2, &ball), -Vec3::z(), SheetSide::Top, mu)];
    let stages = vec![stage("press", vec![Motion::Force(Curve::constant(1.0))], 1.0)];
    let mut sys =
        Simulation::new(setup(body(mesh, steel()), constraints, tools, stages)).unwrap().sys;
    sys.roles[0] = Role::Force(1.0);
    sys.search();
    let forces = sys.candidate_forces();
    sys.commit_contact(&forces);
    let mut seed = 5_u64;
    for (i, u) in sys.u.iter_mut().enumerate() {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        *u =
            2e-3 * ((seed >> 33) as f64 / (1u64 << 31) as f64 - 0.5) - 0.01 * f64::from(i % 3 == 2);
    }
    sys.tools[0].travel = 0.05;
    update(&mut sys);
    for k in 0..sys.contact.candidates.len() {
        let foot = &sys.contact.candidates[k].foot;
        let clear = |x: f64| (0.01..0.99).contains(&x);
        let inside = clear(foot.eta) && clear(foot.zeta) && foot.location == Location::Inside;
        sys.contact.candidates[k].active = sys.can_touch(k) && inside && sys.lambda(k) > 0.0;
        sys.contact.candidates[k].sliding = false;
        sys.contact.candidates[k].newly_active = true;
    }
    sys.set_scales(stiffness);
    // Small enough for both branches of the friction law to occur.
    sys.scales.tangential *= 0.02;
    sys
}

fn update(sys: &mut System) {
    sys.evaluate(Want::ResidualAndTangent).unwrap();
    sys.search();
}

fn residual(sys: &mut System) -> (Vec<f64>, Vec<bool>) {
    update(sys);
    for c in &mut sys.contact.candidates {
        (c.sliding, c.newly_active) = (false, true);
    }
    sys.assemble();
    (sys.residual_vector(), sys.conditions.iter().map(|c| c.slipping).collect())
}

fn direction(n: usize) -> Vec<f64> {
    (0..n).map(|i| (1.7 * i as f64).sin() + 0.3 * (0.4 * i as f64).cos()).collect()
}

/// Puts the gap, which stands along the normal `now` in the equations of a node, along the normal `n` of the linearisation
/// point, and the other equations across it.
fn divide_along(equations: &mut [f64], n: &Vec3, now: &Vec3) {
    let vector = Vec3::from_column_slice(equations);
    let rest = vector - now * now.dot(&vector);
    let apart = n * now.dot(&vector) + rest - n * n.dot(&rest);
    equations.copy_from_slice(apart.as_slice());
}

/// Largest relative difference between the matrix and central differences, and the numbers of slipping and sticking
/// nodes.
fn mismatch(mu: f64, stiffness: Option<f64>) -> (f64, usize, usize) {
    let mut sys = pressed(mu, stiffness);
    let (_, states) = residual(&mut sys);
    let touching: Vec<usize> = sys
        .conditions
        .iter()
        .enumerate()
        .filter(|(_, c)| c.candidate.is_some())
        .map(|(k, _)| k)
        .collect();
    let slipping = touching.iter().filter(|&&k| states[k]).count();
    sys.condense();
    let d = direction(sys.u.len());
    let zero = vec![0.0; d.len()];
    let negative = sys.body.pattern().residuals(&sys.matrix.values, &[[&d, &zero]], None).remove(0);
    let column = sys.travel_column(0);
    let travel = 0.7;
    let linear: Vec<f64> = negative.iter().zip(&column).map(|(v, z)| -v - travel * z).collect();
    let base = (sys.u.clone(), sys.tools[0].travel);
    let normals: Vec<(usize, Vec3)> =
        touching.iter().map(|&k| (sys.conditions[k].node, sys.conditions[k].normal)).collect();
    let h = 1e-7;
    let mut at = |step: f64| {
        sys.u.iter_mut().zip(&base.0).zip(&d).for_each(|((u, b), d)| *u = b + step * d);
        sys.tools[0].travel = base.1 + step * travel;
        let (mut f, now) = residual(&mut sys);
        assert_eq!(now, states, "the difference must stay on one branch");
        for ((node, n), &k) in normals.iter().zip(&touching) {
            divide_along(&mut f[3 * node..3 * node + 3], n, &sys.conditions[k].normal);
        }
        f
    };
    let (plus, minus) = (at(h), at(-h));
    let size = linear.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let worst = (0..d.len())
        .map(|i| ((plus[i] - minus[i]) / (2.0 * h) - linear[i]).abs() / size)
        .fold(0.0, f64::max);
    (worst, slipping, touching.len() - slipping)
}

#[test]
fn condensed_matrix_is_the_derivative_of_the_residual() {
    let mut seen = (0, 0);
    for stiffness in [None, Some(1.0), Some(50.0)] {
        for mu in [0.0, 0.3, 3.0, 30.0] {
            let (worst, slip, stick) = mismatch(mu, stiffness);
            assert!(
                worst < 1e-6,
                "mu {mu}, {stiffness:?}: {worst:e} with {slip} slipping, {stick} sticking"
            );
            seen = (seen.0 + slip, seen.1 + stick);
        }
    }
    assert!(seen.0 > 10 && seen.1 > 3, "{seen:?}: both branches must have been tested");
}
