//! Approach of tools: distance from a tool to the sheet along its direction, computed from the nodes.

use rayon::prelude::*;

use crate::contact::frame::NORMAL_FRACTION_MIN;
use crate::system::system::System;
use crate::tools::motion::Motion;
use crate::tools::way::{RESOLUTION_REL, distance_along};
use kanagata_geometry::Vec3;

impl System {
    /// Distance that a tool travels along the unit vector `along` until it meets a node that it can push [mm]; `None`
    /// beyond `distance_max` [mm].
    fn distance_to_sheet(&self, tool: usize, along: &Vec3, distance_max: f64) -> Option<f64> {
        let (surface, shift) = (&self.tools[tool].setup.surface, self.tools[tool].shift());
        let reach = self.lengths.longest_edge;
        let of_tool =
            self.contact.candidates.par_iter().with_min_len(64).filter(|c| c.tool == tool);
        let distances = of_tool.map(|c| {
            let place = self.position(c.node) - shift;
            let free = self.constraints.free_projector(c.node);
            let pushes = |normal: &Vec3| (free * normal).norm() > NORMAL_FRACTION_MIN;
            distance_along(surface, &place, along, [distance_max, reach], pushes)
                .unwrap_or(f64::INFINITY)
        });
        let least = distances.reduce(|| f64::INFINITY, f64::min);
        least.is_finite().then_some(least)
    }

    /// Whether a tool travelling along its direction meets the node of a candidate near its foot point, at the
    /// given `distance` [mm]. False for a node beside the tool whose foot point lies on a face that bulges towards it.
    pub(crate) fn meets(&self, k: usize, distance: f64) -> bool {
        let c = &self.contact.candidates[k];
        let (own, reach) = (&self.tools[c.tool], self.lengths.longest_edge);
        let place = self.position(c.node) - own.shift();
        let free = self.constraints.free_projector(c.node);
        let pushes = |normal: &Vec3| (free * normal).norm() > NORMAL_FRACTION_MIN;
        let distance_max = distance.max(0.0) + reach;
        distance_along(
            &own.setup.surface,
            &place,
            &own.setup.direction,
            [distance_max, reach],
            pushes,
        )
        .is_some()
    }

    /// Distance that a tool can travel along its direction until just before it meets the sheet [mm], without limit.
    /// Rounded down to a multiple of the step, so that patches beside the sheet have no effect.
    pub(crate) fn clear_travel(&self, tool: usize) -> Option<f64> {
        let own = &self.tools[tool];
        let direction = own.setup.direction;
        let bounds = own.setup.surface.bounds();
        let rear =
            bounds.corners().map(|p| p.dot(&direction)).into_iter().fold(f64::INFINITY, f64::min);
        let nodes =
            (0..self.node_count()).map(|n| (self.position(n) - own.shift()).dot(&direction));
        let distance_max = nodes.fold(f64::NEG_INFINITY, f64::max) - rear;
        let round = RESOLUTION_REL * self.lengths.longest_edge;
        self.distance_to_sheet(tool, &direction, distance_max)
            .map(|distance| (distance / round).floor() * round)
    }

    /// Whether a tool without contact meets the current configuration of the sheet in a stage.
    pub(crate) fn comes(&self, tool: usize, motion: &Motion, carried: f64) -> bool {
        let start = self.tools[tool].travel;
        let meets = |[low, high]: [f64; 2]| {
            let direction = self.tools[tool].setup.direction;
            let on = self.distance_to_sheet(tool, &direction, high - start);
            on.is_some() || self.distance_to_sheet(tool, &-direction, start - low).is_some()
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
