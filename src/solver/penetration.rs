//! Nodes inside a tool before forming starts, or when a tool is added in a later stage.

use std::fmt;

use crate::Simulation;
use crate::sheet::hex_mesh::HexMesh;
use crate::tools::role::Role;
use crate::tools::tool::{SheetSide, Tool, ToolSetup};
use kanagata_geometry::Vec3;

/// Minimum depth that counts, over the thickness; shape errors of tools are smaller.
const INSIDE_DEPTH_REL_MIN: f64 = 0.02;
/// Maximum depth that counts on the face that the tool may not touch, over the thickness. A tool that touches the
/// wrong face penetrates the other one by the thickness. A node deeper than this may lie behind a tool without a
/// back.
const OTHER_FACE_DEPTH_REL_MAX: f64 = 2.0;
/// Search radius over the larger of element size and thickness.
const SEARCH_REACH_REL: f64 = 5.0;

/// Nodes of either face that are inside a tool.
#[derive(Debug, Clone, PartialEq)]
pub struct Inside {
    /// Name of the tool.
    pub tool: String,
    /// Number of nodes.
    pub nodes: usize,
    /// Largest depth [mm].
    pub depth: f64,
    /// Position of the deepest node [mm].
    pub at: Vec3,
    /// Whether that node is on the face that the tool may not touch.
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

/// Nodes of both faces of a sheet that are inside a tool. `place` is the position of a node [mm], `shift` the shift
/// from the frame of the tool to the world [mm], `size` the element size [mm].
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
    let depth = |x: &Vec3, depth_max: f64| {
        let foot = tool.surface.within(&(x - shift), None, reach);
        let counts = -foot.gap > INSIDE_DEPTH_REL_MIN * thickness && -foot.gap < depth_max;
        (!foot.past_border && counts).then_some(-foot.gap)
    };
    let of = |face: SheetSide, depth_max: f64, wrong: bool| -> Vec<(Vec3, f64, bool)> {
        let nodes = face.nodes(mesh).into_iter().map(|node| place(node as usize));
        nodes.filter_map(|x| Some((x, depth(&x, depth_max)?, wrong))).collect()
    };
    let mut all = of(tool.side, f64::INFINITY, false);
    match tool.side {
        SheetSide::Top => {
            all.extend(of(SheetSide::Bottom, OTHER_FACE_DEPTH_REL_MAX * thickness, true))
        }
        SheetSide::Bottom => {
            all.extend(of(SheetSide::Top, OTHER_FACE_DEPTH_REL_MAX * thickness, true))
        }
        SheetSide::Both => {}
    }
    let &(at, depth, wrong_face) = all.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(Inside { tool: tool.name.clone(), nodes: all.len(), depth, at, wrong_face })
}

impl Simulation {
    /// Penetrated tools in the current configuration, for example after a tool was added to a formed sheet.
    #[must_use]
    pub fn inside(&self) -> Vec<Inside> {
        let sys = &self.sys;
        let present = sys.tools.iter().zip(&sys.roles).filter(|(_, role)| **role != Role::Absent);
        let place = |node: usize| sys.position(node);
        let size = sys.lengths.longest_edge;
        let of =
            |(tool, _): (&Tool, _)| inside(&tool.setup, tool.shift(), sys.body.mesh(), place, size);
        present.filter_map(of).collect()
    }
}
