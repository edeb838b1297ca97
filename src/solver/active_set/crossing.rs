//! Crossings: nodes that a step moves through a tool, or into it without contact. The result is an equilibrium on the
//! wrong side of the sheet.
//!
//! The path of a node relative to the tool since the last equilibrium is followed by conservative advancement
//! ([`advance`]); depths below its resolution are ignored. A node that slides around a radius, or separates, moves along
//! a chord: between entry and exit the surface turns by no more than a right angle. Any other path is a crossing.

use crate::contact::candidate::Candidate;
use crate::numbers::tolerances::ACCURACY_REL;
use crate::system::system::System;
use crate::tools::tool::Tool;
use crate::tools::way::{RESOLUTION_REL, advance};
use kanagata_geometry::Vec3;

/// Minimum cosine of the turn of the surface between entry and exit of a chord. A node that slides over a right-angled
/// corner in one step has a turn of 90 degrees; the margin of 6 degrees keeps rounding from deciding.
const CHORD_TURN_COS_MIN: f64 = -0.1;

/// Part of a path inside a tool.
struct Chord {
    /// Whether the path entered the tool; otherwise it started inside.
    entered: bool,
    /// Outward normal at the entry.
    normal: Vec3,
    /// Cosine between the path and the inward normal at the entry.
    inward: f64,
}

impl Chord {
    /// Whether the surface turns too far between the entry and a face with this normal.
    fn turns_to(&self, exit: &Vec3) -> bool {
        self.normal.dot(exit) < CHORD_TURN_COS_MIN
    }

    /// Whether a surface that is symmetric about the middle of the chord turns too far. Decides where the path has no
    /// exit.
    fn enters_steeply(&self) -> bool {
        1.0 - 2.0 * self.inward.max(0.0).powi(2) < CHORD_TURN_COS_MIN
    }
}

impl Candidate {
    /// Whether the node has crossed the tool since the last equilibrium: its path exits on another side, or ends inside
    /// although it came from outside and the node has no contact (`held`).
    fn passed_through(&self, x: &Vec3, tool: &Tool, reach: f64, held: bool) -> bool {
        let Some(before) = self.before else { return false };
        let path = x - tool.shift() - before;
        let length = path.norm();
        let along = path / length;
        let (mut chord, mut outside): (Option<Chord>, _) = (None, false);
        for (_, foot) in advance(&tool.setup.surface, &before, &along, [length, reach]) {
            let depth = if foot.past_border { 0.0 } else { -foot.gap };
            if depth > RESOLUTION_REL * reach {
                let (entered, normal) = (outside, foot.normal);
                chord.get_or_insert(Chord { entered, normal, inward: -normal.dot(&along) });
            } else if let Some(chord) = chord.take() {
                let past = foot.past_border;
                if (past && chord.enters_steeply()) || (!past && chord.turns_to(&foot.normal)) {
                    return true;
                }
            }
            outside |= depth <= ACCURACY_REL * reach;
        }
        chord.is_some_and(|chord| {
            let out_of_contact = chord.entered && !held;
            out_of_contact || chord.enters_steeply() || chord.turns_to(&self.foot.normal)
        })
    }
}

impl System {
    /// A node that crossed a tool since the last equilibrium. A node farther from the tool than it has moved was never
    /// inside. Of the others, with a relative displacement up to the longest edge, only those are followed that lie
    /// past the border, inside, or above the tangent plane of their start.
    pub(crate) fn passed_through(&self) -> Option<usize> {
        let (x, present) = (self.positions(), self.present());
        let reach = self.lengths.longest_edge;
        let resolution = RESOLUTION_REL * reach;
        let mut held = vec![false; x.len()];
        self.contact.active().for_each(|(_, c)| held[c.node] = true);
        let crossed = |c: &&Candidate| {
            let (x, tool) = (&x[c.node], &self.tools[c.tool]);
            let path = c.relative_displacement(x, tool);
            let moved = path.norm();
            let leaves = c.foot.past_border || path.dot(&c.foot.normal) > resolution;
            let inside = !held[c.node] && c.foot.gap < -resolution;
            let far = moved <= c.foot.gap.abs() || moved <= resolution;
            let is_followed = !far && (leaves || inside || moved > reach);
            is_followed && c.passed_through(x, tool, reach, held[c.node])
        };
        let found = self.contact.candidates.iter().filter(|c| present[c.tool]).find(crossed);
        found.map(|c| c.node)
    }
}
