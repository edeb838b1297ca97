//! A forming limit curve, its continuation beyond its ends, and the failure ratio of a strain state.

/// A forming limit curve: points joined by straight lines, in logarithmic strains.
///
/// To the left of the first point the curve continues with slope -1, the line of constant thickness strain of a local
/// neck (Hill 1952). To the right of the last point it is horizontal.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitCurve {
    points: Vec<[f64; 2]>,
}

impl LimitCurve {
    /// A curve through `points`, minor and major strain, by strictly increasing minor strain; major strains above 0.
    #[must_use]
    pub fn new(points: Vec<[f64; 2]>) -> Self {
        Self { points }
    }

    /// Its points: minor and major logarithmic strain.
    #[must_use]
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points
    }

    /// Limit of the major strain at a minor strain.
    #[must_use]
    pub fn major_at(&self, minor: f64) -> f64 {
        let next = self.points.partition_point(|point| point[0] < minor);
        match (next.checked_sub(1).map(|k| self.points[k]), self.points.get(next)) {
            (None, Some(first)) => first[1] + (first[0] - minor),
            (Some(a), Some(b)) => {
                let part = (minor - a[0]) / (b[0] - a[0]);
                (1.0 - part) * a[1] + part * b[1]
            }
            (Some(last), None) => last[1],
            (None, None) => f64::INFINITY,
        }
    }

    /// Failure ratio of a strain state: its length over that of the limit on the straight path from the origin through
    /// it. Above 1 the state is beyond the limit. 0 for a path that never meets the curve, and without major strain.
    #[must_use]
    pub fn failure_ratio(&self, minor: f64, major: f64) -> f64 {
        if major <= 0.0 {
            return 0.0;
        }
        // The path meets the curve first where 1 / ratio is smallest.
        let pieces = self.points.windows(2).map(|pair| crossing(pair[0], pair[1], minor, major));
        let left = self.points.first().map(|first| {
            // major s = first.major + first.minor - minor s
            let ratio = (major + minor) / (first[1] + first[0]);
            let there = ratio > 0.0 && minor <= first[0] * ratio;
            if there { ratio } else { 0.0 }
        });
        let right = self.points.last().map(|last| {
            let ratio = major / last[1];
            if minor >= last[0] * ratio { ratio } else { 0.0 }
        });
        pieces.chain(left).chain(right).fold(0.0, f64::max)
    }
}

/// Failure ratio for the piece from `a` to `b`; 0 if the path does not meet it.
fn crossing(a: [f64; 2], b: [f64; 2], minor: f64, major: f64) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    // s (minor, major) = a + t along: cross products with the path and with the piece.
    let facing = minor * along[1] - major * along[0];
    let base = a[0] * along[1] - a[1] * along[0];
    let t = (a[0] * major - a[1] * minor) / facing;
    let ratio = facing / base;
    if (0.0..=1.0).contains(&t) && ratio > 0.0 && ratio.is_finite() { ratio } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve() -> LimitCurve {
        LimitCurve::new(vec![[-0.2, 0.5], [0.0, 0.3], [0.1, 0.32], [0.3, 0.4]])
    }

    #[test]
    fn the_curve_is_straight_between_points_and_continued_beyond_them() {
        let curve = curve();
        let near = |minor: f64, major: f64| {
            let found = curve.major_at(minor);
            assert!((found - major).abs() < 1e-15, "{minor}: {found} {major}");
        };
        near(-0.2, 0.5);
        near(-0.1, 0.4);
        near(0.0, 0.3);
        near(0.05, 0.31);
        near(0.2, 0.36);
        near(0.3, 0.4);
        near(-0.5, 0.8);
        near(0.9, 0.4);
    }

    #[test]
    fn the_failure_ratio_is_measured_along_the_straight_path() {
        let curve = curve();
        // On the curve it is 1, and it is proportional to the state on each path.
        for k in -60..=60 {
            let minor = 0.01 * f64::from(k);
            let major = curve.major_at(minor);
            if minor + major <= 0.0 || major < minor {
                continue;
            }
            for scale in [0.01, 0.5, 1.0, 1.7] {
                let found = curve.failure_ratio(scale * minor, scale * major);
                assert!((found - scale).abs() < 1e-12, "{minor} {major} {scale}: {found}");
            }
        }
        // Paths that thicken the sheet never meet the curve.
        for state in [[-0.3, 0.3], [-0.5, 0.1], [-0.2, -0.1], [0.0, 0.0]] {
            assert_eq!(curve.failure_ratio(state[0], state[1]), 0.0);
        }
        // Equibiaxial stretching meets the horizontal continuation.
        assert!((curve.failure_ratio(0.2, 0.2) - 0.5).abs() < 1e-15);
    }
}
