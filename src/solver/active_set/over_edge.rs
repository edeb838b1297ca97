//! Overhang: the sheet bends over a free border of a tool. Conditions act on nodes only, so the indentation by an
//! edge between nodes is not modelled, and a node drawn back over the edge starts inside the tool. An overhang is
//! reported.

use crate::contact::candidate::Candidate;
use crate::system::system::System;
use crate::tools::role::Role;
use kanagata_geometry::Vec3;

/// Nodes past the free border of a tool where the sheet overhangs it.
#[derive(Debug, Clone, PartialEq)]
pub struct OverEdge {
    /// Index of the tool.
    pub tool: usize,
    /// Number of nodes.
    pub nodes: usize,
    /// Depth of the edge below the straight line from the deepest of these nodes to a neighbour in contact [mm].
    pub depth: f64,
    /// Position on the edge [mm].
    pub at: Vec3,
}

impl System {
    /// The deepest overhang, if an edge is deeper below the straight line between two nodes than `depth_rel` times the
    /// thickness.
    pub(crate) fn over_edge(&self, depth_rel: f64) -> Option<OverEdge> {
        let allowed = depth_rel * self.body.mesh().mean_thickness();
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

    /// Depth of the edge closest to a node past the border, below the straight lines to its neighbours in contact.
    fn depth_of_edge(&self, c: &Candidate, shift: &Vec3, held: &[bool]) -> Option<f64> {
        // Beyond the search radius there is no foot point.
        if c.active || !c.foot.past_border || c.foot.gap.is_infinite() {
            return None;
        }
        let (edge, from) = (c.foot.point + shift, self.position(c.node));
        let depth = |node: usize| {
            let line = self.position(node) - from;
            let parameter = ((edge - from).dot(&line) / line.norm_squared()).clamp(0.0, 1.0);
            (edge - from - line * parameter).dot(&c.foot.normal)
        };
        self.neighbours(c.node).filter(|&node| held[node]).map(depth).max_by(f64::total_cmp)
    }
}
