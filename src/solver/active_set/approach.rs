//! What lies ahead of a tool on its way: the sheet, seen by going from its nodes towards the tool.

use rayon::prelude::*;

use crate::geometry::Vec3;
use crate::solver::contact::frame::NORMAL_FRACTION_MIN;
use crate::solver::system::system::System;
use crate::solver::tools::motion::Motion;
use crate::solver::tools::way::{STEP_MIN_REL, distance_along};

/// Gap of a node that touches but for rounding, over the shortest edge.
pub(super) const TOUCHING_GAP_REL: f64 = 1e-6;

impl System {
    /// How far a tool is from meeting a node that it could push, moved along the unit vector `along` [mm], if that is within
    /// `most` [mm].
    fn way_to_sheet(&self, tool: usize, along: &Vec3, most: f64) -> Option<f64> {
        let (surface, shift) = (&self.tools[tool].setup.surface, self.tools[tool].shift());
        let reach = self.lengths.longest_edge;
        let of_tool =
            self.contact.candidates.par_iter().with_min_len(64).filter(|c| c.tool == tool);
        let ways = of_tool.map(|c| {
            let place = self.position(c.node) - shift;
            let free = self.constraints.free_projector(c.node);
            let pushes = |normal: &Vec3| (free * normal).norm() > NORMAL_FRACTION_MIN;
            distance_along(surface, &place, along, [most, reach], pushes).unwrap_or(f64::INFINITY)
        });
        let least = ways.reduce(|| f64::INFINITY, f64::min);
        least.is_finite().then_some(least)
    }

    /// Whether a tool, moved along its direction, meets a candidate's node about where its foot has it, `way` [mm] on: not one
    /// beside it, whose foot lies on a face that bulges towards it.
    pub(in crate::solver) fn meets(&self, k: usize, way: f64) -> bool {
        let c = &self.contact.candidates[k];
        let (own, reach) = (&self.tools[c.tool], self.lengths.longest_edge);
        let place = self.position(c.node) - own.shift();
        let free = self.constraints.free_projector(c.node);
        let pushes = |normal: &Vec3| (free * normal).norm() > NORMAL_FRACTION_MIN;
        let most = way.max(0.0) + reach;
        distance_along(&own.setup.surface, &place, &own.setup.direction, [most, reach], pushes)
            .is_some()
    }

    /// How far a tool may be moved along its direction, however far, until it is about to meet the sheet [mm]: in round numbers,
    /// whatever patches it has beside the sheet.
    pub(in crate::solver) fn way_ahead(&self, tool: usize) -> Option<f64> {
        let own = &self.tools[tool];
        let direction = own.setup.direction;
        let bounds = own.setup.surface.bounds();
        let rear =
            bounds.corners().map(|p| p.dot(&direction)).into_iter().fold(f64::INFINITY, f64::min);
        let nodes =
            (0..self.node_count()).map(|n| (self.position(n) - own.shift()).dot(&direction));
        let most = nodes.fold(f64::NEG_INFINITY, f64::max) - rear;
        let round = STEP_MIN_REL * self.lengths.longest_edge;
        self.way_to_sheet(tool, &direction, most).map(|way| (way / round).floor() * round)
    }

    /// Whether a tool that does not touch the sheet comes to it in a stage, as the sheet lies now.
    pub(in crate::solver) fn comes(&self, tool: usize, motion: &Motion, carried: f64) -> bool {
        let start = self.tools[tool].travel;
        let meets = |[low, high]: [f64; 2]| {
            let direction = self.tools[tool].setup.direction;
            let on = self.way_to_sheet(tool, &direction, high - start);
            on.is_some() || self.way_to_sheet(tool, &-direction, start - low).is_some()
        };
        match motion {
            Motion::Hold | Motion::Release | Motion::Absent => false,
            Motion::Travel(curve) => meets(curve.starting_at(start).extent()),
            Motion::Advance(curve) => meets(curve.starting_at(0.0).extent().map(|x| start + x)),
            Motion::Force(curve) => curve.starting_at(carried).extent()[1] > 0.0,
            Motion::Spring { force, stiffness } => {
                let at_zero = force.starting_at(carried + stiffness * start).extent();
                meets(at_zero.map(|force| force / stiffness))
            }
        }
    }
}
