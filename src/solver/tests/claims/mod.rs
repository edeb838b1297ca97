//! Closed-form solutions: Hertz, friction, contact patch test, ironing, springback.

mod friction;
mod hertz;
mod ironing;
mod patch;
mod springback;
mod springs;

use super::{body, setup, stage, steel, tool};
use crate::test_tools::plane;
use crate::{Control, IncrementReport, Simulation, SimulationSetup};
use kanagata_geometry::Vec3;

/// A flat square tool at a height, facing up or down.
pub(super) fn square(name: &str, z: f64, up: bool) -> kanagata_tool::ToolModel {
    let normal = if up { Vec3::z() } else { -Vec3::z() };
    plane(name, Vec3::new(-50.0, -50.0, z), Vec3::x() * 200.0, Vec3::y() * 200.0, normal)
}

/// Force vectors of all tools at the end of the run.
fn final_forces(setup: SimulationSetup) -> Vec<Vec3> {
    let mut forces = Vec::new();
    let mut sim = Simulation::new(setup).unwrap();
    sim.run(&mut |r: &IncrementReport<'_>| {
        forces = tool_forces(r);
        Control::Continue
    })
    .unwrap();
    forces
}

/// Force vectors of all tools of the modelled part [N].
fn tool_forces(r: &IncrementReport<'_>) -> Vec<Vec3> {
    r.tools.iter().map(|t| Vec3::from(t.force_vector)).collect()
}
