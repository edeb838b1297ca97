//! Motions of tools over a stage.

use crate::numbers::tolerances::NEGLIGIBLE_REL;

/// Piecewise linear curve over the fraction of the time of a stage, 0 to 1; constant beyond its ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    points: Vec<(f64, f64)>,
}

impl Curve {
    /// From `points` (fraction of the stage, value), sorted by fraction; without points zero throughout.
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

    /// Linear to `to` from the value at the start of the stage.
    #[must_use]
    pub fn to(to: f64) -> Self {
        Self::new(vec![(1.0, to)])
    }

    /// Curve of a stage with initial value `start`, which applies if the curve has no point at fraction 0.
    #[must_use]
    pub fn starting_at(&self, start: f64) -> Self {
        let mut points = self.points.clone();
        if points.first().is_some_and(|first| first.0 > 0.0) {
            points.insert(0, (0.0, start));
        }
        Self { points }
    }

    /// Constant value.
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

    /// Fractions inside the stage at which the slope of the curve changes. Points within [`NEGLIGIBLE_REL`] of
    /// the extent of the curve from a straight line, as in a dense table of a smooth curve, are not corners.
    pub(crate) fn corners(&self) -> Vec<f64> {
        let [low, high] = self.extent();
        let tolerance = NEGLIGIBLE_REL * (high - low);
        let mut out = Vec::new();
        let mut points = self.points.iter();
        let Some(mut from) = points.next() else { return out };
        out.push(from.0);
        // Slopes of the lines from the last corner that pass all later points within the tolerance.
        let (mut slope_min, mut slope_max) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut before = from;
        for point in points {
            let slope = |value: f64| (value - from.1) / (point.0 - from.0);
            if !(slope_min..=slope_max).contains(&slope(point.1)) {
                (from, slope_min, slope_max) = (before, f64::NEG_INFINITY, f64::INFINITY);
                out.push(from.0);
            }
            let slope = |value: f64| (value - from.1) / (point.0 - from.0);
            (slope_min, slope_max) = (
                slope_min.max(slope(point.1 - tolerance)),
                slope_max.min(slope(point.1 + tolerance)),
            );
            before = point;
        }
        out.retain(|fraction| *fraction > 0.0 && *fraction < 1.0);
        out
    }

    /// Slopes of the lines that end and begin at `fraction`; both are that of the line around it if it is no point of
    /// the curve.
    pub(crate) fn rates(&self, fraction: f64) -> [f64; 2] {
        let ends = [
            self.points.partition_point(|p| p.0 < fraction),
            self.points.partition_point(|p| p.0 <= fraction),
        ];
        ends.map(|end| match (end.checked_sub(1).map(|k| self.points[k]), self.points.get(end)) {
            (Some((t0, v0)), Some(&(t1, v1))) => (v1 - v0) / (t1 - t0),
            _ => 0.0,
        })
    }

    /// Value at `fraction` of the stage.
    #[must_use]
    pub fn at(&self, fraction: f64) -> f64 {
        let after = self.points.partition_point(|p| p.0 <= fraction);
        match (after.checked_sub(1).map(|k| self.points[k]), self.points.get(after)) {
            (None, None) => 0.0,
            (None, Some(first)) => first.1,
            (Some(last), None) => last.1,
            (Some((t0, v0)), Some(&(t1, v1))) => v0 + (v1 - v0) * (fraction - t0) / (t1 - t0),
        }
    }
}

/// Motion of a tool during a stage. A curve whose first fraction is above 0 starts from the travel or force at the
/// start of the stage.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// No motion.
    Hold,
    /// Travel along its direction since the start of the run [mm].
    Travel(Curve),
    /// Travel along its direction since the start of the stage [mm].
    Advance(Curve),
    /// Force along the direction [N], of the complete process; the travel is an unknown.
    Force(Curve),
    /// Spring: pushes along the direction with `force - stiffness * travel`, with the travel since the start of the
    /// run [N, N/mm], of the complete process; the travel is an unknown.
    Spring {
        /// Force at travel zero.
        force: Curve,
        /// Stiffness, > 0.
        stiffness: f64,
    },
    /// Removed: its forces on the sheet decrease linearly to zero over the stage (springback).
    Release,
    /// Absent.
    Absent,
}

impl Motion {
    /// Curve of the motion, if it has one.
    pub(crate) fn curve(&self) -> Option<&Curve> {
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
        let rates = [0.0, 0.25, 0.5, 1.0].map(|fraction| Curve::ramp(1.0, 3.0).rates(fraction));
        assert_eq!(rates, [[0.0, 2.0], [2.0, 2.0], [2.0, 2.0], [2.0, 0.0]]);
        let bent = Curve::new(vec![(0.0, 0.0), (0.5, 1.0), (1.0, -1.0)]);
        assert_eq!(bent.rates(0.5), [2.0, -4.0]);
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
        // A thousand points of half a sine wave reduce to the straight lines needed for an accuracy of one
        // thousandth.
        let sine =
            |k: u32| (f64::from(k) / 1e3, (f64::from(k) * 1e-3 * std::f64::consts::PI).sin());
        let few = corners(&(0..=1000).map(sine).collect::<Vec<_>>()).len();
        assert!((20..60).contains(&few), "{few}");
    }
}
