//! Nodes that are inside a tool where it stands: before the sheet is formed, or when a tool comes in at a later stage.

use std::fmt;

use crate::geometry::Vec3;
use crate::solver::Simulation;
use crate::solver::sheet::hex_mesh::HexMesh;
use crate::solver::tools::role::Role;
use crate::solver::tools::tool::{SheetSide, Tool, ToolSetup};

/// Depth over the thickness that counts: shape errors of tools are less.
const INSIDE_DEPTH_REL: f64 = 0.02;
/// And up to which it does on the face that the tool is not to touch: a tool that touches the wrong face stands in the other by
/// the thickness; deeper than that the sheet may have come round behind a tool that has no back.
const OTHER_FACE_DEPTH_REL: f64 = 2.0;
/// How far inside nodes are looked for, over the size of the elements or the thickness.
const SEARCH_REACH_REL: f64 = 5.0;

/// Nodes of either face that are inside a tool.
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
    /// Whether that lies on the face that the tool is not to touch.
    pub wrong_face: bool,
}

impl fmt::Display for Inside {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tool, nodes, depth, at, .. } = self;
        let (x, y, z) = (at.x, at.y, at.z);
        let of_sheet = if *nodes == 1 { "node of the sheet is" } else { "nodes of the sheet are" };
        write!(
            f,
            "{nodes} {of_sheet} inside {tool}, the deepest by {depth:.3} mm at ({x:.1}, {y:.1}, {z:.1}) mm"
        )
    }
}

/// Nodes of a sheet, of both faces, that are inside a tool. `place`: where a node is [mm]; `shift`: from the tool's frame to the
/// world [mm]; `size`: of the elements [mm].
#[must_use]
pub fn inside(
    tool: &ToolSetup,
    shift: Vec3,
    mesh: &HexMesh,
    place: impl Fn(usize) -> Vec3,
    size: f64,
) -> Option<Inside> {
    let thickness = mesh.mean_thickness();
    let reach = SEARCH_REACH_REL * size.max(thickness);
    let depth = |x: &Vec3, most: f64| {
        let foot = tool.surface.within(&(x - shift), None, reach);
        let counts = -foot.gap > INSIDE_DEPTH_REL * thickness && -foot.gap < most;
        (!foot.past_border && counts).then_some(-foot.gap)
    };
    let of = |face: SheetSide, most: f64, wrong: bool| -> Vec<(Vec3, f64, bool)> {
        let nodes = face.nodes(mesh).into_iter().map(|node| place(node as usize));
        nodes.filter_map(|x| Some((x, depth(&x, most)?, wrong))).collect()
    };
    let mut all = of(tool.side, f64::INFINITY, false);
    match tool.side {
        SheetSide::Top => all.extend(of(SheetSide::Bottom, OTHER_FACE_DEPTH_REL * thickness, true)),
        SheetSide::Bottom => all.extend(of(SheetSide::Top, OTHER_FACE_DEPTH_REL * thickness, true)),
        SheetSide::Both => {}
    }
    let &(at, depth, wrong_face) = all.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(Inside { tool: tool.name.clone(), nodes: all.len(), depth, at, wrong_face })
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
