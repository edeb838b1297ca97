//! The plane a trimmed face is triangulated in: its parameters, each stretched so that lengths are near those in space, or,
//! where the surface curves much, so that what asks for one division is as long both ways, within bounds.

use spade::Point2;

use crate::cad::model::{Face, SurfaceKind};
use crate::geometry::{Vec2, Vec3};
use crate::mesh::mapped::demand::shares;
use crate::mesh::mapped::options::MappedOptions;
use crate::mesh::mapped::patchwork::Node;
use crate::mesh::mapped::sample::angle;

/// Intervals of the grid on which the surface is looked at, each way.
const INTERVALS: usize = 24;
/// Divisions from which on the plane goes by them; each way, for a lattice.
const LEAST: f64 = 2.0;
/// Turn between neighbours on that grid beyond which they do not say how the surface runs between them [rad].
const SEEN: f64 = 0.9;
/// A cell is at most this many times as long as it is wide in space...
const LONGEST: f64 = 6.0;
/// ...and where the surface curves one way only.
const LONGEST_STRAIGHT: f64 = 3.0;
/// An interval has at least this share of the mean's divisions.
const LEAST_SHARE: f64 = 0.05;

/// Divisions that the intervals of a parameter ask for, and their lengths [mm].
type Asked = ([f64; INTERVALS], [f64; INTERVALS]);

/// One parameter and its coordinate in the plane, at rising stations; linear between.
struct Axis {
    at: Vec<f64>,
    to: Vec<f64>,
}

impl Axis {
    fn linear(low: f64, scale: f64) -> Self {
        Self { at: vec![low, low + 1.0 / scale], to: vec![0.0, 1.0] }
    }

    /// Divisions summed up over equal intervals of a range, and cells no longer than `longest` [mm].
    fn by_divisions([low, high]: [f64; 2], (asked, length): &Asked, longest: f64) -> Self {
        let mean = asked.iter().sum::<f64>() / INTERVALS as f64;
        let (mut at, mut to) = (vec![low], vec![0.0]);
        for i in 0..INTERVALS {
            let step = asked[i].max(length[i] / longest).max(LEAST_SHARE * mean);
            at.push(low + (high - low) * (i + 1) as f64 / INTERVALS as f64);
            to.push(to[i] + step);
        }
        Self { at, to }
    }

    /// What `x` among `from` is among `to`; beyond the ends as in the last interval.
    fn mapped(from: &[f64], to: &[f64], x: f64) -> f64 {
        let k = from.partition_point(|&f| f <= x).clamp(1, from.len() - 1);
        to[k - 1] + (x - from[k - 1]) * ((to[k] - to[k - 1]) / (from[k] - from[k - 1]))
    }
}

/// (u, v) to the plane and back; the face is of size one there.
pub(super) struct Plane {
    axes: [Axis; 2],
    /// Length of a division in the plane, where the surface asks for a lattice of them.
    pub cell: Option<f64>,
}

impl Plane {
    pub fn to_plane(&self, uv: Vec2) -> Point2<f64> {
        // The triangulation refuses coordinates below 1e-142 that are not zero.
        let clean = |x: f64| if x.abs() < 1e-100 { 0.0 } else { x };
        let [u, v] = &self.axes;
        let [x, y] = [(u, uv.x), (v, uv.y)].map(|(axis, p)| Axis::mapped(&axis.at, &axis.to, p));
        Point2::new(clean(x), clean(y))
    }

    pub fn to_uv(&self, p: Point2<f64>) -> Vec2 {
        let [u, v] = &self.axes;
        Vec2::new(Axis::mapped(&u.to, &u.at, p.x), Axis::mapped(&v.to, &v.at, p.y))
    }

    /// Largest coordinates in the plane of the face's border.
    pub fn extent(&self) -> [f64; 2] {
        [0, 1].map(|k| self.axes[k].to[self.axes[k].to.len() - 1])
    }
}

fn parameters(loops: &[Vec<Node>]) -> [Vec2; 2] {
    let nothing = [Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY)];
    let nodes = loops.iter().flatten();
    nodes.fold(nothing, |[low, high], n| [low.inf(&n.uv), high.sup(&n.uv)])
}

/// The plane by lengths in space.
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

/// Points and normals of the surface on a grid, those between the loops.
struct Looked {
    points: Vec<Option<(Vec3, Vec3)>>,
}

impl Looked {
    fn new(face: &Face, loops: &[Vec<Node>], [low, high]: [Vec2; 2]) -> Self {
        let n = INTERVALS;
        let share = |k: usize| k as f64 / n as f64;
        let place = |i: usize, j: usize| {
            Vec2::new(low.x + (high.x - low.x) * share(i), low.y + (high.y - low.y) * share(j))
        };
        let ring = |l: &Vec<Node>| l.iter().map(|n| Point2::new(n.uv.x, n.uv.y)).collect();
        let border: Vec<Vec<Point2<f64>>> = loops.iter().map(ring).collect();
        let mut points = vec![None; (n + 1) * (n + 1)];
        for j in 0..=n {
            // A little off the level of corners.
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

    /// Divisions asked for along parameter `k`, between the stations of the grid: their sum is the most that a line asks
    /// for, their distribution that of the most in each interval; and the mean length of each [mm]. None where the surface
    /// turns too much to be seen on such a grid.
    fn divisions(&self, k: usize, options: &MappedOptions) -> Option<Asked> {
        let n = INTERVALS;
        let at = |i: usize, line: usize| match k {
            0 => self.points[i * (n + 1) + line],
            _ => self.points[line * (n + 1) + i],
        };
        let (mut most, mut length, mut lines) =
            ([0.0f64; INTERVALS], [0.0; INTERVALS], [0.0; INTERVALS]);
        let mut longest = 0.0f64;
        for line in 0..=n {
            let mut sum = 0.0;
            for i in 0..n {
                let (Some(a), Some(b)) = (at(i, line), at(i + 1, line)) else { continue };
                let long = (b.0 - a.0).norm();
                let turn = angle(&a.1, &b.1);
                if turn > SEEN {
                    return None;
                }
                let asked = shares(options, turn, long);
                most[i] = most[i].max(asked);
                sum += asked;
                length[i] += long;
                lines[i] += 1.0;
            }
            longest = longest.max(sum);
        }
        let whole: f64 = most.iter().sum();
        let scale = if whole > 0.0 { longest / whole } else { 0.0 };
        let mean = std::array::from_fn(|i| length[i] / f64::max(lines[i], 1.0));
        Some((most.map(|m| m * scale), mean))
    }
}

/// The plane by divisions; none where the surface asks for few, or for elements of about equal size.
pub(super) fn by_divisions(
    face: &Face,
    loops: &[Vec<Node>],
    options: &MappedOptions,
) -> Option<Plane> {
    let [low, high] = parameters(loops);
    // A plane turns nowhere: nothing to look at.
    let nothing_asked = face.kind == SurfaceKind::Plane && options.max_size.is_none();
    if nothing_asked
        || options.unstructured
        || !(high - low).iter().all(|x| x.is_finite() && *x > 0.0)
    {
        return None;
    }
    let looked = Looked::new(face, loops, [low, high]);
    let (u, v) = (looked.divisions(0, options)?, looked.divisions(1, options)?);
    let sum = |x: &[f64; INTERVALS]| x.iter().sum::<f64>();
    if sum(&u.0).max(sum(&v.0)) < LEAST {
        return None;
    }
    let curves_both_ways = sum(&u.0).min(sum(&v.0)) >= LEAST;
    let longest = if curves_both_ways { LONGEST } else { LONGEST_STRAIGHT };
    let width = |x: &Asked| sum(&x.1) / sum(&x.0).max(1e-9);
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

/// Where the border crosses a level, rising.
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
