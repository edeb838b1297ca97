//! Ironing: a rigid cylinder of Nagata patches pressed into an elastic slab, which is then drawn under it.

use std::f64::consts::PI;

use super::{body, setup, square, stage, steel, tool, tool_forces};
use crate::report::Energies;
use crate::sheet::hex_mesh::rectangle;
use crate::test_tools::Builder;
use crate::{Constraints, Control, Curve, IncrementReport, Motion, SheetSide, Simulation};
use kanagata_geometry::Vec3;

/// Forces of the cylinder on the slab (x, z) after each increment of the drawing, and the final energies.
fn iron(mu: f64) -> (Vec<[f64; 2]>, Energies) {
    let (length, height, edge, radius) = (8.0, 2.0, 0.1, 3.0);
    let mut mesh = rectangle(length, edge, height, (length / edge) as usize, 1, 8);
    // Finer towards the upper face.
    mesh.nodes.iter_mut().for_each(|x| x.z = height - height * (1.0 - x.z / height).powf(1.6));
    let mut constraints = Constraints::none(mesh.nodes.len());
    (0..mesh.nodes.len()).for_each(|node| constraints.hold(node, 1));
    let roll = Builder::new("roll")
        .grid(12, 1, |u, v| {
            let (s, c) = (PI * (u - 0.5)).sin_cos();
            let normal = Vec3::new(s, 0.0, -c);
            let centre = Vec3::new(4.0, 2.0 * v - 1.0, height + radius);
            (centre + normal * radius, normal)
        })
        .build();
    let tools = vec![
        tool("bed", square("bed", 0.0, true), Vec3::x(), SheetSide::Bottom, 5.0),
        tool("roll", roll, -Vec3::z(), SheetSide::Top, mu),
    ];
    let mut draw = stage("draw", vec![Motion::Travel(Curve::ramp(0.0, 0.6)), Motion::Hold], 0.01);
    draw.largest_step = 0.05;
    let mut press = stage("press", vec![Motion::Hold, Motion::Travel(Curve::ramp(0.0, 0.02))], 0.1);
    press.largest_step = 0.1;
    let stages = vec![press, draw];
    let mut sim = Simulation::new(setup(body(mesh, steel()), constraints, tools, stages)).unwrap();
    let (mut forces, mut energies) = (Vec::new(), Energies::default());
    sim.run(&mut |r: &IncrementReport<'_>| {
        let roll = tool_forces(r)[1];
        if r.stage == 1 {
            forces.push([roll.x, roll.z]);
        }
        energies = r.energies;
        Control::Continue
    })
    .unwrap();
    (forces, energies)
}

/// The tangential force is the Coulomb fraction of the normal force to 1 % of the latter (the contact is slightly
/// inclined, and nodes enter and leave it). The normal force is constant to 1 %, and energy is conserved.
#[test]
fn a_roll_irons_a_slab_with_a_steady_force() {
    for mu in [0.0, 0.3] {
        let (forces, energies) = iron(mu);
        let steady: Vec<&[f64; 2]> = forces.iter().skip(forces.len() / 2).collect();
        let force = |f: &[f64; 2]| -f[1];
        let mean = steady.iter().map(|f| force(f)).sum::<f64>() / steady.len() as f64;
        let spread = steady.iter().map(|f| (force(f) / mean - 1.0).abs()).fold(0.0, f64::max);
        let share = steady.iter().map(|f| (f[0] / f[1] - mu).abs()).fold(0.0, f64::max);
        let lost = energies.external - energies.elastic - energies.friction;
        println!(
            "{mu}: {} increments, spread {spread:.5}, share {share:.5}, {energies:?}",
            forces.len()
        );
        assert!(steady.len() >= 8 && spread < 0.01, "{mu}: {spread}");
        assert!(share < 0.01, "{mu}: {share}");
        assert!(lost.abs() < 0.01 * energies.external, "{mu}: {energies:?}");
    }
}
