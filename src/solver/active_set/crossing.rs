//! Nodes that a step takes through a tool, or into it where nothing holds them: a balance on the wrong side of the sheet.

use crate::geometry::Vec3;
use crate::solver::contact::candidate::Candidate;
use crate::solver::system::system::System;
use crate::solver::tools::tool::Tool;
use crate::solver::tools::way::STEP_MIN_REL;

/// Cosine between a node's way and the normal of a face that it comes out of.
const LEAVING_COS: f64 = 0.5;

/// How deep in a tool a node was that left it past its border and did not slide off it, over the reach of the search.
const DEEP_REL: f64 = 0.25;

/// Depth that is nothing but rounding, over the reach of the search.
const DEPTH_ROUNDING_REL: f64 = 1e-9;

/// Cosine between normals of faces that look to other sides.
const OTHER_SIDE_COS: f64 = -0.1;

/// Cosine between normals of faces of which a node that goes straight in through one does not come out of the other.
const SAME_SIDE_COS: f64 = 0.5;

/// Cosine between a way into a tool and the inward normal where it goes straight in, and where it goes in.
const STRAIGHT_COS: f64 = 0.9;
const ENTERING_COS: f64 = 0.7;

/// Where a way goes into a tool, and how deep.
struct Entry {
    /// Length of the way before [mm].
    at: f64,
    /// Outward normal there.
    side: Vec3,
    /// Cosine between the way and the inward normal.
    inward: f64,
    /// Greatest depth [mm].
    depth: f64,
}

impl Entry {
    /// Whether a way that goes on past the tool's border has gone through it.
    fn goes_through(&self, reach: f64) -> bool {
        self.depth > DEEP_REL * reach
            || (self.inward > ENTERING_COS && self.depth > STEP_MIN_REL * reach)
    }

    /// Whether a face with this normal is on another side of the tool.
    fn is_other_side(&self, normal: &Vec3, reach: f64) -> bool {
        let along = self.side.dot(normal);
        let straight = self.inward > STRAIGHT_COS && self.depth > STEP_MIN_REL * reach;
        along < OTHER_SIDE_COS || (straight && along < SAME_SIDE_COS)
    }
}

impl Candidate {
    /// Whether the tool stood in the node's way since the last balance and the node is on its far side now, or inside it though
    /// it came from outside and no tool holds it (`held`). The way is followed by the distance that there is from the tool, at
    /// least a small share of `reach` [mm]. One that goes in and comes out on the same side is a chord: of a node that slid
    /// round a radius, or that touched and has been left. One that comes out past the tool's border slid off it, unless it was
    /// deep in the tool or went into it rather than along it.
    fn passed_through(&self, x: &Vec3, tool: &Tool, reach: f64, held: bool) -> bool {
        let Some(before) = self.before else { return false };
        let way = x - tool.shift() - before;
        let (length, mut done) = (way.norm(), 0.0);
        let mut entered: Option<Entry> = None;
        loop {
            let place = before + way * (done / length).min(1.0);
            let foot = tool.setup.surface.within(&place, None, length + reach);
            let depth = if foot.past_border { 0.0 } else { -foot.gap };
            if depth > DEPTH_ROUNDING_REL * reach {
                let side = foot.normal;
                let inward = -side.dot(&way) / length;
                let entry = entered.get_or_insert(Entry { at: done, side, inward, depth });
                entry.depth = entry.depth.max(depth);
            } else if let Some(entry) = entered.take() {
                let out_of_back = foot.past_border && entry.goes_through(reach);
                if out_of_back || (!foot.past_border && entry.is_other_side(&foot.normal, reach)) {
                    return true;
                }
            }
            if done >= length {
                return entered.is_some_and(|entry| {
                    let came_in = entry.at > 0.0 && depth > STEP_MIN_REL * reach;
                    (came_in && !held) || entry.is_other_side(&self.foot.normal, reach)
                });
            }
            let past = foot.past_border && foot.gap.is_finite();
            let clear = if past { (place - foot.point).norm() } else { foot.gap.abs() };
            done += clear.max(STEP_MIN_REL * reach);
        }
    }
}

impl System {
    /// A node in whose way a tool stood since the last balance, and that is on its far side now: clear of it, held off the
    /// face that looks the other way, or within it. Of nodes that moved no farther past a tool than the longest edge only those
    /// are looked at that moved out of the face that is next to them now, or past the tool's border, or are inside it.
    pub(in crate::solver) fn passed_through(&self) -> Option<usize> {
        let (x, present) = (self.positions(), self.present());
        let reach = self.lengths.longest_edge;
        let mut held = vec![false; x.len()];
        self.contact.active().for_each(|(_, c)| held[c.node] = true);
        let gone = |c: &&Candidate| {
            let (x, tool) = (&x[c.node], &self.tools[c.tool]);
            let way = c.relative_displacement(x, tool);
            let moved = way.norm();
            let leaves = c.foot.past_border || way.dot(&c.foot.normal) > LEAVING_COS * moved;
            let inside = !held[c.node] && c.foot.gap < -STEP_MIN_REL * reach;
            // What ends farther from the tool than it has moved was never inside.
            let far = moved <= c.foot.gap.abs() || moved <= DEPTH_ROUNDING_REL * reach;
            let looked_at = !far && (leaves || inside || moved > reach);
            looked_at && c.passed_through(x, tool, reach, held[c.node])
        };
        let found = self.contact.candidates.iter().filter(|c| present[c.tool]).find(gone);
        found.map(|c| c.node)
    }
}
