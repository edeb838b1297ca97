//! Where the sheet bends over a tool's free border. Conditions hold nodes only: what an edge presses into the sheet between them
//! is not seen, and a node drawn back over the edge comes from within the tool. It is told.

use crate::geometry::Vec3;
use crate::solver::contact::candidate::Candidate;
use crate::solver::system::system::System;
use crate::solver::tools::role::Role;

/// Depth of an edge in the straight line between two nodes that counts, over the thickness.
const EDGE_DEPTH_REL: f64 = 0.1;

/// Nodes beyond the free border of a tool, bent over it.
#[derive(Debug, Clone, PartialEq)]
pub struct OverEdge {
    /// Position of the tool.
    pub tool: usize,
    /// How many nodes.
    pub nodes: usize,
    /// Depth of the edge in the straight line from the deepest of them to one that the tool holds [mm].
    pub depth: f64,
    /// Where on the edge [mm].
    pub at: Vec3,
}

impl System {
    /// The tool over whose border the sheet is bent, if there is one; the deepest of several.
    pub(in crate::solver) fn over_edge(&self) -> Option<OverEdge> {
        let allowed = EDGE_DEPTH_REL * self.body.mesh().mean_thickness();
        let found = (0..self.tools.len()).filter(|&tool| self.roles[tool] != Role::Absent);
        let found = found.filter_map(|tool| self.over_edge_of(tool, allowed));
        found.max_by(|a, b| a.depth.total_cmp(&b.depth))
    }

    fn over_edge_of(&self, tool: usize, allowed: f64) -> Option<OverEdge> {
        let of_tool = || self.contact.candidates.iter().filter(|c| c.tool == tool);
        let mut held = vec![false; self.node_count()];
        of_tool().filter(|c| c.active).for_each(|c| held[c.node] = true);
        let shift = self.tools[tool].shift();
        let depths = of_tool().filter_map(|c| Some((c, self.depth_of_edge(c, &shift, &held)?)));
        let deep: Vec<_> = depths.filter(|(_, depth)| *depth > allowed).collect();
        let &(deepest, depth) = deep.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(OverEdge { tool, nodes: deep.len(), depth, at: deepest.foot.point + shift })
    }

    /// How deep the edge next to a node past the border lies in the straight lines from it to its neighbours that the tool holds.
    fn depth_of_edge(&self, c: &Candidate, shift: &Vec3, held: &[bool]) -> Option<f64> {
        // What lies beyond the reach of the search has no foot.
        if c.active || !c.foot.past_border || c.foot.gap.is_infinite() {
            return None;
        }
        let (edge, from) = (c.foot.point + shift, self.position(c.node));
        let depth = |node: usize| {
            let way = self.position(node) - from;
            let share = ((edge - from).dot(&way) / way.norm_squared()).clamp(0.0, 1.0);
            (edge - from - way * share).dot(&c.foot.normal)
        };
        self.neighbours(c.node).filter(|&node| held[node]).map(depth).max_by(f64::total_cmp)
    }
}
