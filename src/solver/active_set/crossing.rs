//! Crossings: nodes that a step moves through a tool, or into it without contact. The result is an equilibrium on the
//! wrong side of the sheet.

use crate::geometry::Vec3;
use crate::solver::contact::candidate::Candidate;
use crate::solver::system::system::System;
use crate::solver::tools::tool::Tool;
use crate::solver::tools::way::STEP_MIN_REL;

/// Minimum cosine between the path of a node and the normal of a face that it exits.
const EXIT_COS_MIN: f64 = 0.5;

/// Depth of a node that left the tool past its border without sliding off, over the search radius.
const CROSSING_DEPTH_REL: f64 = 0.25;

/// Depth that counts as rounding, over the search radius.
const DEPTH_ROUNDING_REL: f64 = 1e-9;

/// Maximum cosine between normals of faces on opposite sides of a tool.
const OPPOSITE_SIDE_COS_MAX: f64 = -0.1;

/// Minimum cosine between normals of faces on the same side, for a node that enters perpendicularly.
const SAME_SIDE_COS_MIN: f64 = 0.5;

/// Minimum cosine between a path and the inward normal for perpendicular entry, and for entry.
const PERPENDICULAR_COS_MIN: f64 = 0.9;
const ENTRY_COS_MIN: f64 = 0.7;

/// Entry of a path into a tool, and its depth.
struct Entry {
    /// Length of the path before the entry [mm].
    at: f64,
    /// Outward normal at the entry.
    side: Vec3,
    /// Cosine between the path and the inward normal.
    inward: f64,
    /// Maximum depth [mm].
    depth: f64,
}

impl Entry {
    /// Whether a path that exits past the border of the tool has crossed it.
    fn crosses(&self, reach: f64) -> bool {
        self.depth > CROSSING_DEPTH_REL * reach
            || (self.inward > ENTRY_COS_MIN && self.depth > STEP_MIN_REL * reach)
    }

    /// Whether a face with this normal is on another side of the tool.
    fn is_other_side(&self, normal: &Vec3, reach: f64) -> bool {
        let along = self.side.dot(normal);
        let straight = self.inward > PERPENDICULAR_COS_MIN && self.depth > STEP_MIN_REL * reach;
        along < OPPOSITE_SIDE_COS_MAX || (straight && along < SAME_SIDE_COS_MIN)
    }
}

impl Candidate {
    /// Whether the node has crossed the tool since the last equilibrium: it is on the far side, or inside although it
    /// came from outside and has no contact (`held`). The relative path is traced in steps of the distance from the
    /// tool, at least [`STEP_MIN_REL`] times `reach`. A path that enters and exits on the same side is a chord, as of a
    /// node that slid around a radius or separated. A path that exits past the border slid off the tool, unless it
    /// was deep inside or entered steeply.
    fn passed_through(&self, x: &Vec3, tool: &Tool, reach: f64, held: bool) -> bool {
        let Some(before) = self.before else { return false };
        let path = x - tool.shift() - before;
        let (length, mut travelled) = (path.norm(), 0.0);
        let mut entered: Option<Entry> = None;
        loop {
            let position = before + path * (travelled / length).min(1.0);
            let foot = tool.setup.surface.within(&position, None, length + reach);
            let depth = if foot.past_border { 0.0 } else { -foot.gap };
            if depth > DEPTH_ROUNDING_REL * reach {
                let side = foot.normal;
                let inward = -side.dot(&path) / length;
                let entry = entered.get_or_insert(Entry { at: travelled, side, inward, depth });
                entry.depth = entry.depth.max(depth);
            } else if let Some(entry) = entered.take() {
                let out_of_back = foot.past_border && entry.crosses(reach);
                if out_of_back || (!foot.past_border && entry.is_other_side(&foot.normal, reach)) {
                    return true;
                }
            }
            if travelled >= length {
                return entered.is_some_and(|entry| {
                    let came_in = entry.at > 0.0 && depth > STEP_MIN_REL * reach;
                    (came_in && !held) || entry.is_other_side(&self.foot.normal, reach)
                });
            }
            let past = foot.past_border && foot.gap.is_finite();
            let clear = if past { (position - foot.point).norm() } else { foot.gap.abs() };
            travelled += clear.max(STEP_MIN_REL * reach);
        }
    }
}

impl System {
    /// A node that crossed a tool since the last equilibrium. Among nodes with a relative displacement up to the
    /// longest edge, only those are traced that moved away from their closest face, lie past the border, or are
    /// inside.
    pub(in crate::solver) fn passed_through(&self) -> Option<usize> {
        let (x, present) = (self.positions(), self.present());
        let reach = self.lengths.longest_edge;
        let mut held = vec![false; x.len()];
        self.contact.active().for_each(|(_, c)| held[c.node] = true);
        let crossed = |c: &&Candidate| {
            let (x, tool) = (&x[c.node], &self.tools[c.tool]);
            let path = c.relative_displacement(x, tool);
            let moved = path.norm();
            let leaves = c.foot.past_border || path.dot(&c.foot.normal) > EXIT_COS_MIN * moved;
            let inside = !held[c.node] && c.foot.gap < -STEP_MIN_REL * reach;
            // A node farther from the tool than it has moved was never inside.
            let far = moved <= c.foot.gap.abs() || moved <= DEPTH_ROUNDING_REL * reach;
            let is_traced = !far && (leaves || inside || moved > reach);
            is_traced && c.passed_through(x, tool, reach, held[c.node])
        };
        let found = self.contact.candidates.iter().filter(|c| present[c.tool]).find(crossed);
        found.map(|c| c.node)
    }
}
