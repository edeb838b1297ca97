//! Rigid tools: where they are, how they move, which nodes they may touch.

use std::sync::Arc;

use crate::contact::{Projection, ToolSurface};
use crate::geometry::{Aabb, Vec3};
use crate::solver::active_set::approach::way_to;
use crate::solver::sheet::hex_mesh::HexMesh;
use crate::tool::Patch;

/// Faces of the sheet a tool may touch.
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
    /// Nodes of a mesh that lie there.
    #[must_use]
    pub fn nodes(self, mesh: &HexMesh) -> Vec<u32> {
        match self {
            Self::Top => mesh.top_nodes(),
            Self::Bottom => mesh.bottom_nodes(),
            Self::Both => [mesh.top_nodes(), mesh.bottom_nodes()].concat(),
        }
    }
}

/// Where a tool stands when the run begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Placement {
    /// Where its file puts it, shifted by the tool's `offset`.
    AsGiven,
    /// From there, moved along its direction until it just touches the undeformed sheet.
    Touch,
}

/// A piecewise linear curve over the share of a stage's time, 0 to 1; constant beyond its ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    points: Vec<(f64, f64)>,
}

impl Curve {
    /// From `points` (share of the stage, value); sorted by share; no points mean zero throughout.
    #[must_use]
    pub fn new(mut points: Vec<(f64, f64)>) -> Self {
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self { points }
    }

    /// Linear from `from` to `to`.
    #[must_use]
    pub fn ramp(from: f64, to: f64) -> Self {
        Self::new(vec![(0.0, from), (1.0, to)])
    }

    /// Linear to `to` from what there is when the stage begins.
    #[must_use]
    pub fn to(to: f64) -> Self {
        Self::new(vec![(1.0, to)])
    }

    /// The curve of a stage that begins with `start`: that is its value at share 0 where it says none itself.
    #[must_use]
    pub fn starting_at(&self, start: f64) -> Self {
        let mut points = self.points.clone();
        if points.first().is_some_and(|first| first.0 > 0.0) {
            points.insert(0, (0.0, start));
        }
        Self { points }
    }

    /// The same value throughout.
    #[must_use]
    pub fn constant(value: f64) -> Self {
        Self::new(vec![(0.0, value)])
    }

    /// Smallest and largest value.
    #[must_use]
    pub fn extent(&self) -> [f64; 2] {
        let values = self.points.iter().map(|p| p.1);
        let all = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)]);
        if self.points.is_empty() { [0.0; 2] } else { all }
    }

    /// Shares inside the stage at which the curve turns: points without which it would be another, not those of a dense table
    /// of a smooth one.
    pub(in crate::solver) fn corners(&self) -> Vec<f64> {
        const FLAT: f64 = 1e-3;
        let [low, high] = self.extent();
        let off = FLAT * (high - low);
        let mut out = Vec::new();
        let mut points = self.points.iter();
        let Some(mut from) = points.next() else { return out };
        out.push(from.0);
        // Slopes of the lines from the last corner that pass no point since by more.
        let (mut least, mut most) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut before = from;
        for point in points {
            let slope = |value: f64| (value - from.1) / (point.0 - from.0);
            if !(least..=most).contains(&slope(point.1)) {
                (from, least, most) = (before, f64::NEG_INFINITY, f64::INFINITY);
                out.push(from.0);
            }
            let slope = |value: f64| (value - from.1) / (point.0 - from.0);
            (least, most) = (least.max(slope(point.1 - off)), most.min(slope(point.1 + off)));
            before = point;
        }
        out.retain(|share| *share > 0.0 && *share < 1.0);
        out
    }

    /// How fast it rises just before and just after `share`.
    pub(in crate::solver) fn rates(&self, share: f64) -> [f64; 2] {
        const NEAR: f64 = 1e-6;
        let now = self.at(share);
        [now - self.at(share - NEAR), self.at(share + NEAR) - now].map(|change| change / NEAR)
    }

    /// Value at `share` of the stage.
    #[must_use]
    pub fn at(&self, share: f64) -> f64 {
        let after = self.points.partition_point(|p| p.0 <= share);
        match (after.checked_sub(1).map(|k| self.points[k]), self.points.get(after)) {
            (None, None) => 0.0,
            (None, Some(first)) => first.1,
            (Some(last), None) => last.1,
            (Some((t0, v0)), Some(&(t1, v1))) => v0 + (v1 - v0) * (share - t0) / (t1 - t0),
        }
    }
}

/// What a tool does during a stage. A curve whose first share is above 0 comes from the travel, or the force, that the tool
/// has when the stage begins.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// Stays where it is.
    Hold,
    /// Travel along its direction since the start of the run [mm].
    Travel(Curve),
    /// Travel along its direction since the start of the stage [mm].
    Advance(Curve),
    /// Force pushing it along its direction [N], of the whole process; its travel follows.
    Force(Curve),
    /// Held by a spring: pushes along its direction with `force - stiffness * travel`, travel since the start of the run
    /// [N, N/mm], of the whole process; its travel follows.
    Spring {
        /// Force at travel zero.
        force: Curve,
        /// Stiffness, > 0.
        stiffness: f64,
    },
    /// Taken away: its forces on the sheet fall linearly to zero over the stage (springback).
    Release,
    /// Not there.
    Absent,
}

impl Motion {
    /// The curve that it follows, if it does.
    pub(in crate::solver) fn curve(&self) -> Option<&Curve> {
        match self {
            Self::Travel(curve) | Self::Advance(curve) | Self::Force(curve) => Some(curve),
            Self::Spring { force, .. } => Some(force),
            Self::Hold | Self::Release | Self::Absent => None,
        }
    }
}

/// A tool as the scene gives it.
#[derive(Clone)]
pub struct ToolSetup {
    /// Name in the history and in messages.
    pub name: String,
    /// Its surface; may be shared between tools.
    pub surface: Arc<ToolSurface>,
    /// Shift from the tool file's frame to the world at travel zero [mm].
    pub offset: Vec3,
    /// Unit vector of positive travel, towards the sheet.
    pub direction: Vec3,
    /// Where it stands at the start.
    pub placement: Placement,
    /// Coulomb's coefficient, >= 0.
    pub friction: f64,
    /// Nodes it may touch.
    pub side: SheetSide,
    /// Travel past which no force and no spring moves it [mm], where it has a stop.
    pub stop: Option<f64>,
}

/// Cosine between a tool's way and the normal of a wall that the way goes along.
const WALL: f64 = 1e-3;

impl ToolSetup {
    /// What is likely to be wrong with a tool that cannot be placed touching nodes at `points` [mm], and what to do.
    pub(in crate::solver) fn why_not_touching(&self, points: &[Vec3]) -> String {
        /// Ratio of sizes from which one of the two is in another unit.
        const UNITS: f64 = 100.0;
        let mut said = if self.looks_back() {
            "its foremost faces look away from the sheet: turn their normals round (`kanagata convert FILE --flip`, or the other `--sheet-side`), or its `direction`, which points towards the sheet"
        } else {
            "check its `direction`, or put it there with `place`"
        }
        .to_owned();
        let [sheet, own] = [Aabb::of_points(points), self.surface.bounds()].map(|b| b.diagonal());
        if (sheet / own).max(own / sheet) >= UNITS {
            said += &format!(
                ". The sheet is {sheet:.3} mm across and the tool {own:.3} mm: check the units"
            );
        }
        said
    }

    /// Whether its face foremost along its direction looks back: a tool turned inside out, or turned round.
    fn looks_back(&self) -> bool {
        let seen = |patch: &Patch| {
            let (eta, zeta) = (0.5, 0.25);
            Some((patch.derivs(eta, zeta).s.dot(&self.direction), patch.normal(eta, zeta)?))
        };
        let faces = self.surface.model().patches.iter().filter_map(seen);
        let foremost = faces.max_by(|a, b| a.0.total_cmp(&b.0));
        foremost.is_some_and(|(_, normal)| normal.dot(&self.direction) < 0.0)
    }
}

/// A tool during the run.
#[derive(Clone)]
pub(in crate::solver) struct Tool {
    pub(in crate::solver) setup: ToolSetup,
    /// Travel [mm].
    pub(in crate::solver) travel: f64,
}

impl Tool {
    /// Shift from the tool's frame to the world now [mm].
    pub(in crate::solver) fn shift(&self) -> Vec3 {
        self.setup.offset + self.setup.direction * self.travel
    }

    /// Closest point for a world point; the foot stays in the tool's frame.
    pub(in crate::solver) fn closest(&self, x: &Vec3, hint: Option<u32>) -> Projection {
        self.setup.surface.closest(&(x - self.shift()), hint)
    }

    /// The same where the tool is not farther than `reach` [mm]; else nowhere.
    pub(in crate::solver) fn within(&self, x: &Vec3, hint: Option<u32>, reach: f64) -> Projection {
        self.setup.surface.within(&(x - self.shift()), hint, reach)
    }

    /// Projection on the patch of `from` carried on past its sides; `None` when too far past.
    pub(in crate::solver) fn carried_on(&self, x: &Vec3, from: &Projection) -> Option<Projection> {
        self.setup.surface.carried_on(&(x - self.shift()), from)
    }

    /// Moves `offset` along the direction until the smallest gap to `points` is zero; returns the shift
    /// along the direction [mm], or `None` when the tool passes by every point.
    ///
    /// The tool starts clear of the points and comes nearer by the smallest gap each time (no point can be
    /// reached earlier); the last steps are Newton's.
    pub(in crate::solver) fn place_touching(&mut self, points: &[Vec3]) -> Option<f64> {
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
                // Its walls may stand around the sheet, and what faces it lie behind them.
                let far = if step == 0 { self.way_to(points, size) } else { None };
                along += far?;
                continue;
            };
            if gap.abs() <= 1e-13 * size {
                return Some(along);
            }
            along += if rate > 0.2 && gap < 0.05 * size { gap / rate } else { gap };
        }
        None
    }

    /// How far the tool is from the first of the points along its direction [mm].
    fn way_to(&self, points: &[Vec3], size: f64) -> Option<f64> {
        use rayon::prelude::*;
        let (surface, direction) = (&self.setup.surface, self.setup.direction);
        let sheet = Aabb::of_points(points).diagonal();
        let ways = points.par_iter().filter_map(|x| {
            let place = x - self.shift();
            way_to(surface, &place, &direction, [2.0 * (size + sheet), 0.01 * size], |_| true)
        });
        let least = ways.reduce(|| f64::INFINITY, f64::min);
        least.is_finite().then_some(least)
    }

    /// Smallest gap to the points that lie over the tool, and how fast travel closes it; not to walls that the way goes along.
    /// Looks near first.
    fn smallest_gap(&self, points: &[Vec3], size: f64) -> Option<(f64, f64)> {
        use rayon::prelude::*;
        [0.02, 0.1, 0.5, 4.0].iter().find_map(|share| {
            let all: Vec<(f64, f64)> = points
                .par_iter()
                .map(|x| {
                    let foot = self.within(x, None, share * size);
                    let rate = foot.normal.dot(&self.setup.direction);
                    let is_wall = foot.gap > 0.0 && rate < WALL;
                    let gap = if foot.past_border || is_wall { f64::INFINITY } else { foot.gap };
                    (gap, rate)
                })
                .collect();
            let least = all.into_iter().reduce(|a, b| if b.0 < a.0 { b } else { a });
            least.filter(|g| g.0.is_finite())
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, TAU};

    use super::*;
    use crate::contact::test_tools::{arc, revolved};
    use crate::solver::sheet::hex_mesh::rectangle;

    /// Tries to place a ball on a sheet of 4 x 4 mm from above: how far it was moved, or why not.
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
        let why = setup.why_not_touching(&points);
        Tool { setup, travel: 0.0 }.place_touching(&points).ok_or(why)
    }

    #[test]
    fn a_ball_turned_inside_out_and_one_in_metres_are_named() {
        assert!((placed(7.0, 1.0).unwrap() - 8.0).abs() < 1e-9);
        let why = placed(7.0, -1.0).unwrap_err();
        assert!(why.contains("look away") && why.contains("--flip"), "{why}");
        assert!(!why.contains("units"), "{why}");
        let why = placed(7e-3, -1.0).unwrap_err();
        assert!(why.contains("The sheet is 5.745 mm across and the tool 0.024 mm"), "{why}");
    }

    #[test]
    fn curve_is_linear_between_points_and_constant_outside() {
        let c = Curve::new(vec![(0.5, 2.0), (1.0, 4.0), (0.0, 0.0)]);
        assert_eq!([c.at(-1.0), c.at(0.25), c.at(0.75), c.at(2.0)], [0.0, 1.0, 3.0, 4.0]);
        assert_eq!(Curve::new(vec![]).at(0.3), 0.0);
        assert_eq!(Curve::to(4.0).starting_at(2.0), Curve::ramp(2.0, 4.0));
        assert_eq!(c.starting_at(2.0), c);
    }

    #[test]
    fn corners_are_where_a_curve_turns() {
        let corners = |points: &[(f64, f64)]| Curve::new(points.to_vec()).corners();
        assert_eq!(corners(&[(0.0, 0.0), (1.0, 3.0)]), [] as [f64; 0]);
        assert_eq!(corners(&[(0.25, 2.0), (0.75, -2.0), (1.0, 0.0)]), [0.25, 0.75]);
        assert_eq!(corners(&[(0.0, 0.0), (0.5, 1.0), (1.0, 2.0)]), [] as [f64; 0]);
        let pulse = [(0.0, 1.0), (0.49, 1.0), (0.5, 6.0), (0.51, 1.0), (1.0, 1.0)];
        assert_eq!(corners(&pulse), [0.49, 0.5, 0.51]);
        let line = |k: u32| (f64::from(k) / 1e5, f64::from(k));
        assert_eq!(corners(&(0..=100_000).map(line).collect::<Vec<_>>()), [] as [f64; 0]);
        // A thousand points of half a sine are as many straight stretches as it takes to keep to a thousandth of it.
        let sine =
            |k: u32| (f64::from(k) / 1e3, (f64::from(k) * 1e-3 * std::f64::consts::PI).sin());
        let few = corners(&(0..=1000).map(sine).collect::<Vec<_>>()).len();
        assert!((20..60).contains(&few), "{few}");
    }
}
