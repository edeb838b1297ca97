//! Plane in which a trimmed face is triangulated: its parameters, each scaled so that lengths approximate those in
//! space. On strongly curved surfaces the scale makes one division equally long in both directions, within limits.

use spade::Point2;

use crate::mapped::demand::fractional_divisions;
use crate::mapped::options::MappedOptions;
use crate::mapped::patchwork::Node;
use crate::mapped::sample::angle;
use kanagata_cad::model::{Face, SurfaceKind};
use kanagata_geometry::{Vec2, Vec3};

/// Intervals per direction of the grid on which the surface is sampled.
const GRID_INTERVALS: usize = 24;
/// Divisions per direction above which the plane is scaled by divisions; in each direction, for a lattice.
const DIVISIONS_MIN: f64 = 2.0;
/// Turning angle between grid neighbours above which the samples do not represent the surface [rad].
const SAMPLE_TURN_MAX_RAD: f64 = 0.9;
/// Largest aspect ratio of a cell in space ...
const CELL_ASPECT_MAX: f64 = 6.0;
/// ... and where the surface is singly curved.
const CELL_ASPECT_MAX_SINGLY_CURVED: f64 = 3.0;
/// Smallest number of divisions of an interval relative to the mean.
const DIVISIONS_MIN_REL: f64 = 0.05;

/// Divisions required in the intervals of a parameter, and their lengths [mm].
type Required = ([f64; GRID_INTERVALS], [f64; GRID_INTERVALS]);

/// One parameter and its coordinate in the plane at increasing stations; linear between them.
struct Axis {
    at: Vec<f64>,
    to: Vec<f64>,
}

impl Axis {
    fn linear(low: f64, scale: f64) -> Self {
        Self { at: vec![low, low + 1.0 / scale], to: vec![0.0, 1.0] }
    }

    /// Divisions accumulated over equal intervals of a range, with cells of at most `longest` [mm].
    fn by_divisions([low, high]: [f64; 2], (required, length): &Required, longest: f64) -> Self {
        let mean = required.iter().sum::<f64>() / GRID_INTERVALS as f64;
        let (mut at, mut to) = (vec![low], vec![0.0]);
        for i in 0..GRID_INTERVALS {
            let step = required[i].max(length[i] / longest).max(DIVISIONS_MIN_REL * mean);
            at.push(low + (high - low) * (i + 1) as f64 / GRID_INTERVALS as f64);
            to.push(to[i] + step);
        }
        Self { at, to }
    }

    /// Piecewise linear map of `x` from `from` to `to`; extrapolated beyond the ends.
    fn mapped(from: &[f64], to: &[f64], x: f64) -> f64 {
        let k = from.partition_point(|&f| f <= x).clamp(1, from.len() - 1);
        to[k - 1] + (x - from[k - 1]) * ((to[k] - to[k - 1]) / (from[k] - from[k - 1]))
    }
}

/// Map from (u, v) to the plane and back; the face has size one there.
pub(super) struct Plane {
    axes: [Axis; 2],
    /// Length of a division in the plane, where the surface needs a lattice.
    pub cell: Option<f64>,
}

impl Plane {
    pub fn to_plane(&self, uv: Vec2) -> Point2<f64> {
        // The triangulation rejects smaller coordinates other than zero.
        let clean = |x: f64| if x.abs() < spade::MIN_ALLOWED_VALUE { 0.0 } else { x };
        let [u, v] = &self.axes;
        let [x, y] = [(u, uv.x), (v, uv.y)].map(|(axis, p)| Axis::mapped(&axis.at, &axis.to, p));
        Point2::new(clean(x), clean(y))
    }

    pub fn to_uv(&self, p: Point2<f64>) -> Vec2 {
        let [u, v] = &self.axes;
        Vec2::new(Axis::mapped(&u.to, &u.at, p.x), Axis::mapped(&v.to, &v.at, p.y))
    }

    /// Largest coordinates of the face's boundary in the plane.
    pub fn extent(&self) -> [f64; 2] {
        [0, 1].map(|k| self.axes[k].to[self.axes[k].to.len() - 1])
    }
}

fn parameters(loops: &[Vec<Node>]) -> [Vec2; 2] {
    let nothing = [Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY)];
    let nodes = loops.iter().flatten();
    nodes.fold(nothing, |[low, high], n| [low.inf(&n.uv), high.sup(&n.uv)])
}

/// The plane scaled by lengths in space.
pub(super) fn by_lengths(face: &Face, loops: &[Vec<Node>]) -> Plane {
    let nodes = || loops.iter().flatten();
    let count = nodes().count().max(1) as f64;
    let [low, high] = parameters(loops);
    let mut metric = Vec2::zeros();
    for node in nodes() {
        let d = face.surface.derivs(node.uv);
        metric += Vec2::new(d.su.norm(), d.sv.norm()) / count;
    }
    let middle = face.surface.derivs((low + high) * 0.5);
    metric = (metric + Vec2::new(middle.su.norm(), middle.sv.norm())) * 0.5;
    let size = (high - low).component_mul(&metric).max();
    let axis = |k: usize| {
        let s = metric[k] / size;
        let sound = s.is_finite() && s > 0.0;
        Axis::linear(low[k], if sound { s } else { 1.0 / (high[k] - low[k]).max(1e-300) })
    };
    Plane { axes: [axis(0), axis(1)], cell: None }
}

/// Points and normals of the surface on a grid, between the loops.
struct SurfaceSamples {
    points: Vec<Option<(Vec3, Vec3)>>,
}

impl SurfaceSamples {
    fn new(face: &Face, loops: &[Vec<Node>], [low, high]: [Vec2; 2]) -> Self {
        let n = GRID_INTERVALS;
        let fraction = |k: usize| k as f64 / n as f64;
        let place = |i: usize, j: usize| {
            Vec2::new(
                low.x + (high.x - low.x) * fraction(i),
                low.y + (high.y - low.y) * fraction(j),
            )
        };
        let ring = |l: &Vec<Node>| l.iter().map(|n| Point2::new(n.uv.x, n.uv.y)).collect();
        let border: Vec<Vec<Point2<f64>>> = loops.iter().map(ring).collect();
        let mut points = vec![None; (n + 1) * (n + 1)];
        for j in 0..=n {
            // Slightly off the level of corners.
            let level = place(0, j).y + 1e-7 * (high.y - low.y) * if j == n { -1.0 } else { 1.0 };
            let crossings = crossings(&border, level);
            for i in 0..=n {
                let uv = place(i, j);
                let right = crossings.partition_point(|&x| x <= uv.x + 1e-9 * (high.x - low.x));
                let left = crossings.partition_point(|&x| x <= uv.x - 1e-9 * (high.x - low.x));
                if right % 2 == 1 || left % 2 == 1 {
                    let normal = face.surface.normal(uv);
                    points[i * (n + 1) + j] = normal.map(|n| (face.surface.point(uv), n));
                }
            }
        }
        Self { points }
    }

    /// Divisions required along parameter `k` between the stations of the grid, and the mean length of each interval
    /// [mm]. Their sum is the maximum over all lines, their distribution that of the maxima in each interval. `None`
    /// where the surface is too strongly curved for the grid.
    fn divisions(&self, k: usize, options: &MappedOptions) -> Option<Required> {
        let n = GRID_INTERVALS;
        let at = |i: usize, line: usize| match k {
            0 => self.points[i * (n + 1) + line],
            _ => self.points[line * (n + 1) + i],
        };
        let (mut maxima, mut length, mut lines) =
            ([0.0f64; GRID_INTERVALS], [0.0; GRID_INTERVALS], [0.0; GRID_INTERVALS]);
        let mut longest = 0.0f64;
        for line in 0..=n {
            let mut sum = 0.0;
            for i in 0..n {
                let (Some(a), Some(b)) = (at(i, line), at(i + 1, line)) else { continue };
                let long = (b.0 - a.0).norm();
                let turn = angle(&a.1, &b.1);
                if turn > SAMPLE_TURN_MAX_RAD {
                    return None;
                }
                let required = fractional_divisions(options, turn, long);
                maxima[i] = maxima[i].max(required);
                sum += required;
                length[i] += long;
                lines[i] += 1.0;
            }
            longest = longest.max(sum);
        }
        let whole: f64 = maxima.iter().sum();
        let scale = if whole > 0.0 { longest / whole } else { 0.0 };
        let mean = std::array::from_fn(|i| length[i] / f64::max(lines[i], 1.0));
        Some((maxima.map(|m| m * scale), mean))
    }
}

/// The plane scaled by divisions; `None` where the surface requires few, or elements of uniform size.
pub(super) fn by_divisions(
    face: &Face,
    loops: &[Vec<Node>],
    options: &MappedOptions,
) -> Option<Plane> {
    let [low, high] = parameters(loops);
    // A plane has no curvature to sample.
    let nothing_required = face.kind == SurfaceKind::Plane && options.max_size.is_none();
    if nothing_required
        || options.unstructured
        || !(high - low).iter().all(|x| x.is_finite() && *x > 0.0)
    {
        return None;
    }
    let samples = SurfaceSamples::new(face, loops, [low, high]);
    let (u, v) = (samples.divisions(0, options)?, samples.divisions(1, options)?);
    let sum = |x: &[f64; GRID_INTERVALS]| x.iter().sum::<f64>();
    if sum(&u.0).max(sum(&v.0)) < DIVISIONS_MIN {
        return None;
    }
    let curves_both_ways = sum(&u.0).min(sum(&v.0)) >= DIVISIONS_MIN;
    let longest = if curves_both_ways { CELL_ASPECT_MAX } else { CELL_ASPECT_MAX_SINGLY_CURVED };
    let width = |x: &Required| sum(&x.1) / sum(&x.0).max(1e-9);
    let axes = [
        Axis::by_divisions([low.x, high.x], &u, longest * width(&v)),
        Axis::by_divisions([low.y, high.y], &v, longest * width(&u)),
    ];
    let plane = Plane { axes, cell: None };
    let size = plane.extent().into_iter().fold(0.0, f64::max);
    let axes = plane.axes.map(|mut axis| {
        axis.to.iter_mut().for_each(|x| *x /= size);
        axis
    });
    Some(Plane { axes, cell: curves_both_ways.then_some(1.0 / size) })
}

/// Segments of all loops.
pub(super) fn segments(loops: &[Vec<Point2<f64>>]) -> impl Iterator<Item = [Point2<f64>; 2]> + '_ {
    loops.iter().flat_map(|l| (0..l.len()).map(|k| [l[k], l[(k + 1) % l.len()]]))
}

/// Coordinates where the boundary crosses a level, increasing.
pub(super) fn crossings(loops: &[Vec<Point2<f64>>], level: f64) -> Vec<f64> {
    let crosses = segments(loops).filter(|[a, b]| (a.y > level) != (b.y > level));
    let mut found: Vec<f64> =
        crosses.map(|[a, b]| a.x + (b.x - a.x) * (level - a.y) / (b.y - a.y)).collect();
    found.sort_by(f64::total_cmp);
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions of a file with components of 1e-47 give such parameters.
    #[test]
    fn coordinates_beside_zero_are_taken_by_the_triangulation() {
        use super::super::triangulator::Delaunay;
        use spade::Triangulation;
        let axis = || Axis { at: vec![0.0, 1.0], to: vec![0.0, 1.0] };
        let plane = Plane { axes: [axis(), axis()], cell: None };
        for x in [0.0, 1e-150, -2e-47, 1.7e-43, 1.8e-43, 1e-30] {
            let mut triangulation = Delaunay::new();
            assert!(triangulation.insert(plane.to_plane(Vec2::new(x, 1.0))).is_ok(), "{x}");
        }
    }

    #[test]
    fn a_plane_is_mapped_back_and_forth() {
        let axis = |at: &[f64], to: &[f64]| Axis { at: at.to_vec(), to: to.to_vec() };
        let axes = [axis(&[1.0, 2.0, 4.0], &[0.0, 0.7, 1.0]), axis(&[-1.0, 3.0], &[0.0, 0.5])];
        let plane = Plane { axes, cell: None };
        for (u, v) in [(1.0, -1.0), (1.3, 0.2), (2.0, 3.0), (3.7, 2.9), (0.8, -1.2), (4.4, 3.5)] {
            let uv = Vec2::new(u, v);
            assert!((plane.to_uv(plane.to_plane(uv)) - uv).norm() < 1e-14);
        }
    }
}
