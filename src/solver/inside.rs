//! Nodes that are inside a tool where it stands: before the sheet is formed, or when a tool comes in at a later stage.

use std::fmt;

use super::Simulation;
use super::blank::HexMesh;
use super::system::Role;
use super::tools::{Tool, ToolSetup};
use crate::geometry::Vec3;

/// Depth over the thickness that counts: shape errors of tools are less.
const DEEP: f64 = 0.02;
/// How far inside nodes are looked for, over the size of the elements or the thickness.
const REACH: f64 = 5.0;

/// Nodes inside a tool.
#[derive(Debug, Clone, PartialEq)]
pub struct Inside {
    /// Name of the tool.
    pub tool: String,
    /// How many nodes.
    pub nodes: usize,
    /// Depth of the deepest [mm].
    pub depth: f64,
    /// Where the deepest is [mm].
    pub at: Vec3,
}

impl fmt::Display for Inside {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tool, nodes, depth, at } = self;
        let (x, y, z) = (at.x, at.y, at.z);
        let of_sheet = if *nodes == 1 { "node of the sheet is" } else { "nodes of the sheet are" };
        write!(
            f,
            "{nodes} {of_sheet} inside {tool}, the deepest by {depth:.3} mm at ({x:.1}, {y:.1}, {z:.1}) mm"
        )
    }
}

/// Nodes of a sheet that are inside a tool. `place`: where a node is [mm]; `shift`: from the tool's frame to the world [mm];
/// `size`: of the elements [mm].
#[must_use]
pub fn inside(
    tool: &ToolSetup,
    shift: Vec3,
    mesh: &HexMesh,
    place: impl Fn(usize) -> Vec3,
    size: f64,
) -> Option<Inside> {
    let thickness = mesh.mean_thickness();
    let reach = REACH * size.max(thickness);
    let depth = |x: &Vec3| {
        let foot = tool.surface.within(&(x - shift), None, reach);
        (!foot.past_border && foot.gap < -DEEP * thickness).then_some(-foot.gap)
    };
    let nodes = tool.side.nodes(mesh).into_iter().map(|node| place(node as usize));
    let all: Vec<(Vec3, f64)> = nodes.filter_map(|x| Some((x, depth(&x)?))).collect();
    let &(at, depth) = all.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(Inside { tool: tool.name.clone(), nodes: all.len(), depth, at })
}

impl Simulation {
    /// Tools that the sheet is inside of where both are now, as after a tool has come in where the sheet had been formed to.
    #[must_use]
    pub fn inside(&self) -> Vec<Inside> {
        let sys = &self.sys;
        let there = sys.tools.iter().zip(&sys.roles).filter(|(_, role)| **role != Role::Absent);
        let place = |node: usize| sys.position(node);
        let size = sys.lengths.longest_edge;
        let of =
            |(tool, _): (&Tool, _)| inside(&tool.setup, tool.shift(), sys.body.mesh(), place, size);
        there.filter_map(of).collect()
    }
}
