//! Motions of tools over a stage.

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
        const TURN_TOLERANCE: f64 = 1e-3;
        let [low, high] = self.extent();
        let off = TURN_TOLERANCE * (high - low);
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
        const SHARE_STEP: f64 = 1e-6;
        let now = self.at(share);
        [now - self.at(share - SHARE_STEP), self.at(share + SHARE_STEP) - now]
            .map(|change| change / SHARE_STEP)
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

#[cfg(test)]
mod tests {
    use super::*;

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
