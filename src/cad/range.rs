//! Native parameter range needed by a face, and the map from native parameters to those of its B-spline.

use super::loops::Side;
use super::native::Native;
use super::raw::RawSurface;
use kanagata_geometry::Vec2;
use kanagata_geometry::nurbs::{Curve2, Surface};

/// Maximum number of turns of a cylinder or cone covered by the loops of a face; each costs memory for any file size.
const TURNS_MAX: f64 = 100.0;
/// Relative deviation from a full turn that is attributed to rounding.
const ROUNDING_REL: f64 = 1e-9;

/// Native range that covers the loops: at most one turn of a closed surface, except for threads on cylinders and cones.
pub(super) fn range_of(native: &Native<'_>, loops: &[Vec<Side>]) -> Result<[[f64; 2]; 2], String> {
    let (low, high) = bounds_of(loops);
    let natural = native.natural_range();
    let threads = matches!(native.raw(), RawSurface::Cylinder { .. } | RawSurface::Cone { .. });
    let mut range = [[low.x, high.x], [low.y, high.y]];
    for (k, (r, period)) in range.iter_mut().zip(native.periods()).enumerate() {
        if let Some(p) = period {
            let turns = (r[1] - r[0]) / p;
            if turns > TURNS_MAX && threads {
                let text = format!(
                    "the loops cover {turns:.0} turns of the surface; allowed: {TURNS_MAX}"
                );
                return Err(text);
            }
            // An excess due to rounding is a full turn.
            if turns > 1.0 - ROUNDING_REL && (turns < 1.0 + ROUNDING_REL || !threads) {
                r[1] = r[0] + p;
            }
        } else if let Some(natural) = natural {
            *r = [r[0].max(natural[k][0]), r[1].min(natural[k][1])];
        }
    }
    let sound = range.iter().all(|r| r[0].is_finite() && r[1].is_finite() && r[1] > r[0]);
    if sound { Ok(range) } else { Err("the loops enclose no parameter range".into()) }
}

/// Smallest and largest native parameters of the loops.
fn bounds_of(loops: &[Vec<Side>]) -> (Vec2, Vec2) {
    let ends = loops.iter().flatten().flat_map(|s| [s.start(), s.end()]);
    let nothing = (Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY));
    let (mut low, mut high) = ends.fold(nothing, |(low, high), p| (low.inf(&p), high.sup(&p)));
    for side in loops.iter().flatten() {
        // A curve lies within the bounding box of its control points.
        let inside = |p: &Vec2| low.inf(p) == low && high.sup(p) == high;
        if side.path.points().iter().all(inside) {
            continue;
        }
        let [a, b] = side.path.domain();
        let spans = side.path.knots().windows(2).filter(|w| w[0] < w[1]).count();
        let n = 16 * spans;
        for k in 0..=n {
            let p = side.path.point(a + (b - a) * k as f64 / n as f64);
            low = low.inf(&p);
            high = high.sup(&p);
        }
    }
    (low, high)
}

/// Map from native parameters to those of the B-spline.
pub(super) struct ParameterMap {
    pub angles: [Option<[f64; 2]>; 2],
    pub extent: [f64; 2],
}

impl ParameterMap {
    fn point(&self, uv: Vec2) -> Vec2 {
        let map = |range: Option<[f64; 2]>, t: f64| {
            range.map_or(t, |r| Surface::arc_parameter_of_angle(r, t))
        };
        Vec2::new(map(self.angles[0], uv.x), map(self.angles[1], uv.y))
    }

    /// Image of a parameter curve. Exact for isoparametric lines (their image is straight) and where the map is the
    /// identity; fitted otherwise.
    pub fn curve(&self, path: &Curve2) -> Curve2 {
        let points = path.points();
        let (first, last) = (points[0], points[points.len() - 1]);
        let constant =
            |k: usize| points.iter().all(|p| (p[k] - first[k]).abs() <= 1e-12 * self.extent[k]);
        let plain = |k: usize| self.angles[k].is_none() || constant(k);
        if constant(0) || constant(1) {
            return Curve2::line(self.point(first), self.point(last));
        }
        if plain(0) && plain(1) {
            return path.mapped(|p| self.point(p));
        }
        let [a, b] = path.domain();
        let mut breaks: Vec<f64> =
            path.knots().iter().copied().filter(|t| *t >= a && *t <= b).collect();
        breaks.dedup();
        let extent = self.extent[0].max(self.extent[1]);
        Curve2::fitted(|t| self.point(path.point(t)), &breaks, 1e-11 * extent)
    }
}
