//! Measures of edges and trimming curves: length, turning angle, points at equal lengths, foot points.

use std::borrow::Cow;

use kanagata_cad::model::{EdgeUse, Face};
use kanagata_geometry::nurbs::{Curve2, Curve3};
use kanagata_geometry::{Vec2, Vec3};

/// Turning angle above which a curve may be divided by it [rad].
const GRADED_TURN_MIN_RAD: f64 = 0.2;
/// Angle between the tangents before and after a point above which it is a corner [rad].
const CORNER_ANGLE_MIN_RAD: f64 = 0.05;
/// Ratio of the divisions needed at equal lengths to those at graded lengths, for equal error, above which graded
/// lengths are used.
const GRADING_RATIO_MIN: f64 = 6.0;
/// Parameter speed relative to the mean below which a curve is stationary.
const STATIONARY_SPEED_REL: f64 = 1e-9;
/// Intervals per knot span for the evaluation of lengths and turning angles.
const INTERVALS_PER_SPAN: usize = 16;
/// Nodes and weights of Gauss-Legendre quadrature with five points on [-1, 1].
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

/// Parameters that subdivide the domain of a knot vector, including every knot.
fn stations(knots: &[f64], domain: [f64; 2]) -> Vec<f64> {
    let mut breaks: Vec<f64> =
        knots.iter().copied().filter(|&k| k > domain[0] && k < domain[1]).collect();
    breaks.dedup();
    breaks.insert(0, domain[0]);
    breaks.push(domain[1]);
    // Curves of very many spans are evaluated at knots only.
    let pieces = (1024 / breaks.len()).clamp(1, INTERVALS_PER_SPAN);
    let mut out = vec![domain[0]];
    for pair in breaks.windows(2) {
        out.extend((1..=pieces).map(|k| {
            let s = k as f64 / pieces as f64;
            pair[0] * (1.0 - s) + pair[1] * s
        }));
    }
    out
}

/// Angle between two vectors [rad]; 0 when one is zero.
pub fn angle(a: &Vec3, b: &Vec3) -> f64 {
    let (cross, dot) = (a.cross(b).norm(), a.dot(b));
    if cross == 0.0 && dot == 0.0 { 0.0 } else { cross.atan2(dot) }
}

/// Lengths along a curve.
#[derive(Debug, Clone)]
pub struct Lengths {
    stations: Vec<f64>,
    lengths: Vec<f64>,
    /// For a curve of strongly uneven curvature the cumulative division density at each station, which is divided
    /// instead of the length.
    graded: Option<Vec<f64>>,
}

/// A curve parametrised by arc length.
pub struct MeasuredCurve<'c> {
    curve: &'c Curve3,
    along: Cow<'c, Lengths>,
}

impl<'c> MeasuredCurve<'c> {
    /// Measures `curve`; lengths are exact to about 1e-12 on arcs.
    pub fn new(curve: &'c Curve3) -> Self {
        let stations = stations(curve.knots(), curve.domain());
        let mut lengths = vec![0.0];
        let mut total = 0.0;
        for pair in stations.windows(2) {
            total += length_between(curve, pair[0], pair[1]);
            lengths.push(total);
        }
        Self { curve, along: Cow::Owned(Lengths { stations, lengths, graded: None }) }
    }

    /// A curve with its known lengths.
    pub fn with_lengths(curve: &'c Curve3, along: &'c Lengths) -> Self {
        Self { curve, along: Cow::Borrowed(along) }
    }

    /// Its lengths.
    pub fn into_lengths(self) -> Lengths {
        self.along.into_owned()
    }

    /// The same curve, to be divided by its turning angle if that is strongly uneven.
    pub fn by_turn(self) -> Self {
        let mut along = self.along.into_owned();
        along.graded = graded(self.curve, &along.stations, &along.lengths);
        Self { along: Cow::Owned(along), ..self }
    }

    /// Parameter at a fraction of the curve's divisions: of its length, or of its division density.
    fn parameter_at_fraction(&self, share: f64) -> f64 {
        let Some(graded) = &self.along.graded else { return self.parameter(self.length() * share) };
        let wanted = graded[graded.len() - 1] * share;
        let k = graded.partition_point(|&g| g <= wanted).clamp(1, graded.len() - 1);
        let fraction = ((wanted - graded[k - 1]) / (graded[k] - graded[k - 1])).clamp(0.0, 1.0);
        self.parameter(
            self.along.lengths[k - 1]
                + fraction * (self.along.lengths[k] - self.along.lengths[k - 1]),
        )
    }

    /// Total length [mm].
    pub fn length(&self) -> f64 {
        self.along.lengths.last().copied().unwrap_or(0.0)
    }

    /// Turning angle of the tangent along the curve [rad].
    pub fn turn(&self) -> f64 {
        let tangents = tangents_at(self.curve, &self.along.stations, self.length());
        tangents.windows(2).map(|w| angle(&w[0], &w[1])).sum()
    }

    /// Parameter at the arc length `s` [mm].
    fn parameter(&self, s: f64) -> f64 {
        let last = self.along.stations.len() - 1;
        let k = self.along.lengths.partition_point(|&l| l <= s).clamp(1, last);
        let (t0, t1) = (self.along.stations[k - 1], self.along.stations[k]);
        let (l0, l1) = (self.along.lengths[k - 1], self.along.lengths[k]);
        if l1 <= l0 {
            return t0;
        }
        let mut t = t0 + (t1 - t0) * ((s - l0) / (l1 - l0)).clamp(0.0, 1.0);
        for _ in 0..8 {
            let speed = self.curve.derivs(t).d1.norm();
            if speed == 0.0 {
                break;
            }
            let step = (s - l0 - length_between(self.curve, t0, t)) / speed;
            t = (t + step).clamp(t0, t1);
            if step.abs() <= 1e-14 * (t1 - t0) {
                break;
            }
        }
        t
    }

    /// Unit tangents at the `count + 1` points of [`Self::divide`].
    pub fn tangents(&self, count: usize) -> Vec<Vec3> {
        let at = |k: usize| self.parameter_at_fraction(k as f64 / count as f64);
        let tangent = |k: usize| self.curve.derivs(at(k)).d1.try_normalize(0.0);
        (0..=count).map(|k| tangent(k).unwrap_or_else(Vec3::zeros)).collect()
    }

    /// The `count + 1` points that divide the curve into equal lengths or, for strongly uneven curvature, into parts of
    /// about equal error, and their parameters.
    pub fn divide(&self, count: usize) -> Vec<(f64, Vec3)> {
        let [first, last] = self.curve.domain();
        let inner = (1..count).map(|k| self.parameter_at_fraction(k as f64 / count as f64));
        let all = std::iter::once(first).chain(inner).chain([last]);
        all.map(|t| (t, self.curve.point(t))).collect()
    }
}

/// Tangents of a curve of this length; where it is stationary the preceding tangent is used.
fn tangents_at(curve: &Curve3, stations: &[f64], length: f64) -> Vec<Vec3> {
    let [a, b] = curve.domain();
    let stationary = STATIONARY_SPEED_REL * length / (b - a);
    let mut last = Vec3::zeros();
    let tangent = |&t: &f64| {
        let own = curve.derivs(t).d1;
        last = if own.norm() > stationary { own } else { last };
        last
    };
    stations.iter().map(tangent).collect()
}

/// Integral of a division density up to each station; `None` unless equal lengths would need many times as many
/// divisions for the same error. The error of an edge of length h with curvature k is proportional to `k^3 h^4`, so
/// that h is chosen proportional to `k^(-3/4)`. The mean curvature is added, so that straight parts are also divided.
fn graded(curve: &Curve3, stations: &[f64], lengths: &[f64]) -> Option<Vec<f64>> {
    let whole = lengths[lengths.len() - 1];
    let tangents = tangents_at(curve, stations, whole);
    let turns: Vec<f64> = tangents.windows(2).map(|w| angle(&w[0], &w[1])).collect();
    let turn: f64 = turns.iter().sum();
    // No division resolves a corner: it would attract all of them.
    let has_corner = || {
        let before = |t: f64| curve.derivs(t.next_down()).d1;
        let inner = stations.iter().zip(&tangents).skip(1).take(turns.len() - 1);
        inner.into_iter().any(|(&t, after)| angle(&before(t), after) > CORNER_ANGLE_MIN_RAD)
    };
    if turn < GRADED_TURN_MIN_RAD || whole <= 0.0 || has_corner() {
        return None;
    }
    let span = |k: usize| lengths[k + 1] - lengths[k];
    let density = |turn: f64, length: f64| {
        if length > 1e-9 * whole { (turn / length * whole).powf(0.75) } else { 0.0 }
    };
    let max_density = (0..turns.len()).map(|k| density(turns[k], span(k))).fold(0.0, f64::max);
    let mean = turn.powf(0.75);
    let mut sum = vec![0.0];
    let mut last = 0.0;
    let mut plain = 0.0;
    for (k, turn) in turns.iter().enumerate() {
        plain += density(*turn, span(k)) * span(k);
        last += (density(*turn, span(k)) + mean) * span(k);
        sum.push(last);
    }
    (max_density * whole > GRADING_RATIO_MIN * plain).then_some(sum)
}

fn length_between(curve: &Curve3, t0: f64, t1: f64) -> f64 {
    let (mid, half) = (0.5 * (t0 + t1), 0.5 * (t1 - t0));
    half * GAUSS.iter().map(|(x, w)| w * curve.derivs(mid + half * x).d1.norm()).sum::<f64>()
}

/// A trimming curve lifted onto the surface of its face.
pub struct Lifted<'f> {
    face: &'f Face,
    curve: &'f Curve2,
}

impl<'f> Lifted<'f> {
    /// The lifted curve of one edge use.
    pub fn new(face: &'f Face, side: &'f EdgeUse) -> Self {
        Self { face, curve: &side.pcurve }
    }

    /// Parameters at `t`.
    pub fn uv(&self, t: f64) -> Vec2 {
        self.curve.point(t)
    }

    /// Domain of the trimming curve.
    pub fn domain(&self) -> [f64; 2] {
        self.curve.domain()
    }

    /// Tangent at the start or end, in the direction of the loop. Where the derivative vanishes a short chord is used,
    /// long enough to leave a stationary part of the curve.
    pub fn end_tangent(&self, at_end: bool) -> Vec3 {
        let [t0, t1] = self.domain();
        let t = if at_end { t1 } else { t0 };
        let uv = self.curve.derivs(t);
        let s = self.face.surface.derivs(uv.c);
        let tangent = s.su * uv.d1.x + s.sv * uv.d1.y;
        let away = |share: f64| {
            let inside = t + (t0 + t1 - 2.0 * t) * share;
            (self.face.surface.point(self.uv(inside)) - s.s) * if at_end { -1.0 } else { 1.0 }
        };
        let stationary = STATIONARY_SPEED_REL
            * (1..=8).map(|k| away(f64::from(k) / 8.0).norm()).fold(0.0, f64::max);
        let shares = (0..9).map(|k| 1e-3 * f64::from(1 << k));
        let chords = shares.map(|share| (share, away(share)));
        let Some((share, chord)) = chords.into_iter().find(|(_, c)| c.norm() > stationary) else {
            return tangent;
        };
        let speed = chord.norm() / (share * (t1 - t0));
        if tangent.norm() > 1e-3 * speed { tangent } else { chord }
    }

    /// Turning angle of the surface normal along the curve [rad].
    pub fn normal_turn(&self) -> f64 {
        let stations = stations(self.curve.knots(), self.domain());
        // A straight trimming curve on a curved surface has few knots: sample it finely.
        let normals: Vec<Vec3> =
            stations.iter().filter_map(|&t| self.face.surface.normal(self.uv(t))).collect();
        normals.windows(2).map(|w| angle(&w[0], &w[1])).sum()
    }

    /// Parameters (u, v) of `points` on the trimming curve: foot points in increasing order, ends at ends.
    pub fn feet(&self, points: &[Vec3]) -> Vec<Vec2> {
        let [t0, t1] = self.domain();
        let stations = stations(self.curve.knots(), [t0, t1]);
        let places: Vec<Vec3> =
            stations.iter().map(|&t| self.face.surface.point(self.uv(t))).collect();
        let mut lengths = vec![0.0];
        for w in places.windows(2) {
            lengths.push(lengths[lengths.len() - 1] + (w[1] - w[0]).norm());
        }
        let chord: Vec<f64> = points.windows(2).map(|w| (w[1] - w[0]).norm()).collect();
        let whole: f64 = chord.iter().sum();
        let mut out = vec![self.uv(t0)];
        let (mut before, mut run) = (t0, 0.0);
        for (k, p) in points.iter().enumerate().skip(1).take(points.len().saturating_sub(2)) {
            run += chord[k - 1];
            let share = if whole > 0.0 { run / whole } else { k as f64 / points.len() as f64 };
            let guess = invert(&stations, &lengths, share * lengths[lengths.len() - 1]);
            let t = self.foot(p, guess, [before, t1]);
            out.push(self.uv(t));
            before = t;
        }
        out.push(self.uv(t1));
        out
    }

    fn foot(&self, p: &Vec3, guess: f64, range: [f64; 2]) -> f64 {
        let mut t = guess.clamp(range[0], range[1]);
        for _ in 0..20 {
            let c = self.curve.derivs(t);
            let s = self.face.surface.derivs(c.c);
            let d = s.su * c.d1.x + s.sv * c.d1.y;
            let square = d.norm_squared();
            if square == 0.0 {
                break;
            }
            let next = (t + (p - s.s).dot(&d) / square).clamp(range[0], range[1]);
            let step = (next - t).abs();
            t = next;
            if step <= 1e-14 * (range[1] - range[0]) {
                break;
            }
        }
        t
    }
}

fn invert(stations: &[f64], lengths: &[f64], s: f64) -> f64 {
    let k = lengths.partition_point(|&l| l <= s).clamp(1, stations.len() - 1);
    let gap = lengths[k] - lengths[k - 1];
    let share = if gap > 0.0 { ((s - lengths[k - 1]) / gap).clamp(0.0, 1.0) } else { 0.0 };
    stations[k - 1] + share * (stations[k] - stations[k - 1])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spans(curve: &Curve3, count: usize) -> [Vec<f64>; 2] {
        let gaps = |m: MeasuredCurve<'_>| {
            m.divide(count).windows(2).map(|w| (w[1].1 - w[0].1).norm()).collect::<Vec<f64>>()
        };
        [gaps(MeasuredCurve::new(curve)), gaps(MeasuredCurve::new(curve).by_turn())]
    }

    /// A long leg, a turn of 90 degrees within 1 % of it, and another long leg.
    #[test]
    fn a_sharp_bend_between_long_legs_is_divided_where_it_turns() {
        let p = |x: f64, y: f64| Vec3::new(x, y, 0.0);
        let points = vec![
            p(-50.0, 0.0),
            p(-20.0, 0.0),
            p(-0.5, 0.0),
            p(0.0, 0.0),
            p(0.0, 0.5),
            p(0.0, 20.0),
            p(0.0, 50.0),
        ];
        let knots = vec![0.0, 0.0, 0.0, 1.0, 1.1, 1.2, 1.3, 2.3, 2.3, 2.3];
        let curve = Curve3::try_new(2, knots, points, None).unwrap();
        let [even, graded] = spans(&curve, 6);
        assert!(even.iter().all(|s| (s - even[0]).abs() < 0.3 * even[0]), "{even:?}");
        let at_bend = graded[2].max(graded[3]);
        assert!(at_bend < 0.5 * graded[0] && at_bend < 0.6 * even[2], "{graded:?}");
        assert!((graded.iter().sum::<f64>() - 100.0).abs() < 2.0);
    }

    #[test]
    fn arcs_and_ellipses_keep_equal_lengths() {
        let w = std::f64::consts::FRAC_1_SQRT_2;
        for height in [1.0, 3.0] {
            let points = vec![
                Vec3::new(1.0, 0.0, 0.0),
                Vec3::new(1.0, height, 0.0),
                Vec3::new(0.0, height, 0.0),
            ];
            let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
            let arc = Curve3::try_new(2, knots, points, Some(vec![1.0, w, 1.0])).unwrap();
            let [even, graded] = spans(&arc, 5);
            assert_eq!(even, graded);
        }
    }

    /// Two straight legs at 90 degrees, with a parameter range in between on which the curve is stationary.
    #[test]
    fn where_a_curve_rests_it_does_not_turn() {
        let legs =
            [Vec3::new(-0.1, 0.3, 0.7), Vec3::new(10.1, 0.3, 0.7), Vec3::new(10.1, 7.3, 0.7)];
        let mut points: Vec<Vec3> =
            (0..3).map(|k| legs[0].lerp(&legs[1], f64::from(k) / 3.0)).collect();
        points.extend([legs[1]; 4]);
        points.extend((1..=3).map(|k| legs[1].lerp(&legs[2], f64::from(k) / 3.0)));
        let knots = [0.0, 1.0, 2.0, 3.0].into_iter().flat_map(|k| [k; 3]);
        let knots: Vec<f64> = std::iter::once(0.0).chain(knots).chain([3.0]).collect();
        let curve = Curve3::try_new(3, knots, points, None).unwrap();
        let measured = MeasuredCurve::new(&curve);
        assert!((measured.length() - 17.2).abs() < 1e-12);
        assert!(
            (measured.turn() - std::f64::consts::FRAC_PI_2).abs() < 1e-12,
            "{}",
            measured.turn()
        );
    }
}
