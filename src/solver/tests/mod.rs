//! Contact, friction, Newton's method and step size control, with analytic tools.

mod carried;
mod claims;
mod coming;
mod cross;
mod cup;
mod dragged;
mod edges;
mod floating;
mod folded;
mod followed;
mod going_back;
mod hanging;
mod held;
mod increment_error;
mod passage;
mod pressed;
mod refined_disc;
mod released;
mod snap;
mod stability;
mod steadied;
mod stop;
mod tangent;
mod tension;
mod thrown;
mod turned;

use std::sync::Arc;

use crate::assembly::Body;
use crate::element::ElementKind;
use crate::material::Material;
use crate::material::elastic::Elastic;
use crate::sheet::hex_mesh::HexMesh;
use crate::{
    Constraints, Curve, Limits, Motion, Placement, SheetSide, SimulationSetup, Stage, ToolSetup,
};
use kanagata_contact::ToolSurface;
use kanagata_geometry::Vec3;
use kanagata_tool::ToolModel;

pub(super) fn steel() -> Arc<Elastic> {
    Arc::new(Elastic { young: 210_000.0, poisson: 0.3 })
}

pub(super) fn body(mesh: HexMesh, material: Arc<dyn Material>) -> Body {
    Body::new(mesh, ElementKind::Hex8, material).unwrap()
}

fn tool(name: &str, model: ToolModel, direction: Vec3, side: SheetSide, mu: f64) -> ToolSetup {
    ToolSetup {
        name: name.into(),
        surface: Arc::new(ToolSurface::new(model)),
        offset: Vec3::zeros(),
        direction,
        placement: Placement::AsGiven,
        friction: mu,
        side,
        stop: None,
    }
}

fn stage(name: &str, motions: Vec<Motion>, first_step: f64) -> Stage {
    Stage {
        name: name.into(),
        duration: 1.0,
        motions,
        load: Curve::constant(0.0),
        first_step,
        largest_step: 1.0,
        ends: Vec::new(),
    }
}

pub(super) fn setup(
    body: Body,
    constraints: Constraints,
    tools: Vec<ToolSetup>,
    stages: Vec<Stage>,
) -> SimulationSetup {
    SimulationSetup {
        body,
        constraints,
        loads: Vec::new(),
        tools,
        stages,
        limits: Limits { force_tolerance: 1e-8, ..Limits::default() },
        share: 1.0,
    }
}
