//! Rigid tools: position, motion and the faces of the sheet they may touch.

use std::sync::Arc;

use super::way::{FACING_COS_MIN, distance_along};
use crate::sheet::hex_mesh::HexMesh;
use kanagata_contact::{Projection, ToolSurface};
use kanagata_geometry::{Aabb, Vec3};
use kanagata_tool::Patch;

/// Faces of the sheet that a tool may touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SheetSide {
    /// Nodes of the top face.
    Top,
    /// Nodes of the bottom face.
    Bottom,
    /// Nodes of both faces.
    Both,
}

impl SheetSide {
    /// Nodes of a mesh on these faces.
    #[must_use]
    pub fn nodes(self, mesh: &HexMesh) -> Vec<u32> {
        match self {
            Self::Top => mesh.top_nodes(),
            Self::Bottom => mesh.bottom_nodes(),
            Self::Both => [mesh.top_nodes(), mesh.bottom_nodes()].concat(),
        }
    }
}

/// Position of a tool at the start of the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Placement {
    /// At the position in its file, shifted by its `offset`.
    AsGiven,
    /// Moved from there along its direction until it touches the undeformed sheet.
    Touch,
}

/// Definition of a tool in the scene.
#[derive(Clone)]
pub struct ToolSetup {
    /// Name in history and messages.
    pub name: String,
    /// Surface; may be shared between tools.
    pub surface: Arc<ToolSurface>,
    /// Shift from the frame of the tool file to the world at travel zero [mm].
    pub offset: Vec3,
    /// Unit vector of positive travel, towards the sheet.
    pub direction: Vec3,
    /// Position at the start.
    pub placement: Placement,
    /// Coulomb friction coefficient, >= 0.
    pub friction: f64,
    /// Faces it may touch.
    pub side: SheetSide,
    /// Maximum travel under a force or spring [mm], if it has a stop.
    pub stop: Option<f64>,
}

impl ToolSetup {
    /// Message for a tool that cannot be placed at the nodes `points` [mm]: probable cause and remedy.
    pub(crate) fn placement_remedy(&self, points: &[Vec3]) -> String {
        let mut message = if self.looks_back() {
            "its foremost faces look away from the sheet: turn their normals round, or its `direction`, which points towards the sheet"
        } else {
            "check its `direction`, or put it there with `place`"
        }
        .to_owned();
        let [sheet, own] = [Aabb::of_points(points), self.surface.bounds()].map(|b| b.diagonal());
        message += &format!(
            ". The sheet is {sheet:.3} mm across and the tool {own:.3} mm; both must be in millimetres"
        );
        message
    }

    /// Whether the foremost patch along the direction faces away from the sheet: the tool is inverted or rotated.
    pub(crate) fn looks_back(&self) -> bool {
        let seen = |patch: &Patch| {
            let (eta, zeta) = (0.5, 0.25);
            Some((patch.derivs(eta, zeta).s.dot(&self.direction), patch.normal(eta, zeta)?))
        };
        let faces = self.surface.model().patches.iter().filter_map(seen);
        let foremost = faces.max_by(|a, b| a.0.total_cmp(&b.0));
        foremost.is_some_and(|(_, normal)| normal.dot(&self.direction) < 0.0)
    }
}

/// State of a tool during the run.
#[derive(Clone)]
pub(crate) struct Tool {
    pub(crate) setup: ToolSetup,
    /// Travel [mm].
    pub(crate) travel: f64,
}

impl Tool {
    /// Current shift from the frame of the tool to the world [mm].
    pub(crate) fn shift(&self) -> Vec3 {
        self.setup.offset + self.setup.direction * self.travel
    }

    /// Closest point for a world point; the foot point is in the frame of the tool.
    pub(crate) fn closest(&self, x: &Vec3, hint: Option<u32>) -> Projection {
        self.setup.surface.closest(&(x - self.shift()), hint)
    }

    /// As [`Tool::closest`] within a distance of `reach` [mm]; no foot point beyond.
    pub(crate) fn within(&self, x: &Vec3, hint: Option<u32>, reach: f64) -> Projection {
        self.setup.surface.within(&(x - self.shift()), hint, reach)
    }

    /// Projection onto the extension of the patch of `from`; `None` if too far beyond its sides.
    pub(crate) fn extended_projection(&self, x: &Vec3, from: &Projection) -> Option<Projection> {
        self.setup.surface.extended_projection(&(x - self.shift()), from)
    }

    /// Moves `offset` along the direction until the smallest gap to `points` is zero. Returns the shift along the
    /// direction [mm], or `None` if the tool passes all points.
    ///
    /// The tool starts clear of the points and advances by the smallest gap in each iteration (no point can be
    /// reached earlier); the last iterations are Newton steps.
    pub(crate) fn place_touching(&mut self, points: &[Vec3]) -> Option<f64> {
        let d = self.setup.direction;
        let start = self.setup.offset;
        let bounds = self.setup.surface.bounds();
        let reach = |p: &Vec3| p.dot(&d);
        let nearest = points.iter().map(reach).fold(f64::INFINITY, f64::min);
        let corner = |k: usize| {
            let pick = |axis: usize| if k >> axis & 1 == 0 { bounds.min } else { bounds.max }[axis];
            Vec3::new(pick(0), pick(1), pick(2)) + start
        };
        let front = (0..8).map(|k| reach(&corner(k))).fold(f64::NEG_INFINITY, f64::max);
        let size = bounds.diagonal().max(1e-300);
        let mut along = nearest - front - 0.01 * size;
        for step in 0..500 {
            self.setup.offset = start + d * along;
            let Some((gap, rate)) = self.smallest_gap(points, size) else {
                // Walls of the tool may surround the sheet, with the facing surface behind them.
                let distance = if step == 0 { self.distance_along(points, size) } else { None };
                along += distance?;
                continue;
            };
            if gap.abs() <= 1e-13 * size {
                return Some(along);
            }
            along += if rate > 0.2 && gap < 0.05 * size { gap / rate } else { gap };
        }
        None
    }

    /// Distance along the direction to first contact with one of the points [mm].
    fn distance_along(&self, points: &[Vec3], size: f64) -> Option<f64> {
        use rayon::prelude::*;
        let (surface, direction) = (&self.setup.surface, self.setup.direction);
        let sheet = Aabb::of_points(points).diagonal();
        let distances = points.par_iter().filter_map(|x| {
            let place = x - self.shift();
            distance_along(surface, &place, &direction, [2.0 * (size + sheet), 0.01 * size], |_| {
                true
            })
        });
        let smallest = distances.reduce(|| f64::INFINITY, f64::min);
        smallest.is_finite().then_some(smallest)
    }

    /// Smallest gap to the points above the tool and its rate per travel, excluding walls parallel to the direction.
    /// Small search radii are tried first.
    fn smallest_gap(&self, points: &[Vec3], size: f64) -> Option<(f64, f64)> {
        use rayon::prelude::*;
        [0.02, 0.1, 0.5, 4.0].iter().find_map(|radius_ratio| {
            let all: Vec<(f64, f64)> = points
                .par_iter()
                .map(|x| {
                    let foot = self.within(x, None, radius_ratio * size);
                    let rate = foot.normal.dot(&self.setup.direction);
                    let is_wall = foot.gap > 0.0 && rate < FACING_COS_MIN;
                    let gap = if foot.past_border || is_wall { f64::INFINITY } else { foot.gap };
                    (gap, rate)
                })
                .collect();
            let smallest = all.into_iter().reduce(|a, b| if b.0 < a.0 { b } else { a });
            smallest.filter(|g| g.0.is_finite())
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, TAU};

    use super::*;
    use crate::sheet::hex_mesh::rectangle;
    use crate::test_tools::{arc, revolved};

    /// Places a ball on a sheet of 4 x 4 mm from above: shift, or message.
    fn placed(radius: f64, side: f64) -> Result<f64, String> {
        let profile = [arc(12, [0.0, radius], radius, [-FRAC_PI_2, FRAC_PI_2], side)];
        let setup = ToolSetup {
            name: "ball".into(),
            surface: Arc::new(ToolSurface::new(revolved("ball", 12, TAU, &profile))),
            offset: Vec3::new(2.0, 2.0, 9.0),
            direction: -Vec3::z(),
            placement: Placement::Touch,
            friction: 0.0,
            side: SheetSide::Top,
            stop: None,
        };
        let points = rectangle(4.0, 4.0, 1.0, 4, 4, 1).nodes;
        let why = setup.placement_remedy(&points);
        Tool { setup, travel: 0.0 }.place_touching(&points).ok_or(why)
    }

    #[test]
    fn a_ball_turned_inside_out_and_one_in_metres_are_named() {
        assert!((placed(7.0, 1.0).unwrap() - 8.0).abs() < 1e-9);
        let why = placed(7.0, -1.0).unwrap_err();
        assert!(why.contains("look away") && why.contains("normals round"), "{why}");
        assert!(!why.contains("units"), "{why}");
        let why = placed(7e-3, -1.0).unwrap_err();
        assert!(why.contains("The sheet is 5.745 mm across and the tool 0.024 mm"), "{why}");
    }
}
