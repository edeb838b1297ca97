//! Seams along which windings are cut open: isoparametric lines that meet each winding once and no other loop.

use super::periods::whole_periods;
use super::side::{Path, Side};
use crate::native::Native;
use kanagata_geometry::Vec2;

/// Maximum number of corners at which a seam is tried.
const CORNERS_MAX: usize = 32;
/// Difference of parameters relative to the period below which they coincide.
const COINCIDENCE_TOLERANCE_REL: f64 = 1e-9;
/// Distance of a side from the end of the seam, relative to the seam, below which it only touches it.
const TOUCH_TOLERANCE_REL: f64 = 1e-6;

/// The connection from one winding to another, or to a pole.
pub(super) struct Seam<'n, 'a> {
    native: &'n Native<'a>,
    /// Index of the parameter along which the windings run.
    around: usize,
    period: f64,
    /// True when the face lies at larger values of the other parameter than the first winding.
    up: bool,
    /// Ranges of the period occupied by the other loops.
    occupied: OccupiedRanges,
}

/// Intersection of a winding with a seam: side, parameter on it (`None` at its start), surface parameters.
struct Crossing {
    side: usize,
    t: Option<f64>,
    uv: Vec2,
}

/// Ranges of a periodic parameter occupied by loops.
pub(super) struct OccupiedRanges {
    period: f64,
    ranges: Vec<[f64; 2]>,
}

impl OccupiedRanges {
    pub fn new(loops: &[Vec<Side>], around: usize, period: f64) -> Self {
        let range = |sides: &Vec<Side>| {
            let values = sides.iter().flat_map(|s| s.path.points()).map(|p| p[around]);
            let ends = [f64::INFINITY, f64::NEG_INFINITY];
            values.fold(ends, |[low, high], x| [low.min(x), high.max(x)])
        };
        Self { period, ranges: loops.iter().map(range).collect() }
    }

    /// True when a loop covers or touches this level.
    pub fn has(&self, level: f64) -> bool {
        let margin = TOUCH_TOLERANCE_REL * self.period;
        self.ranges.iter().any(|[low, high]| {
            let above = (level - low + margin).rem_euclid(self.period);
            above <= high - low + 2.0 * margin
        })
    }

    /// Midpoints of the gaps between the ranges and the additional levels, widest gap first.
    pub fn gaps(&self, levels: impl Iterator<Item = f64>) -> Vec<f64> {
        let ends = self.ranges.iter().flatten().copied();
        let mut at: Vec<f64> = ends.chain(levels).map(|x| x.rem_euclid(self.period)).collect();
        at.sort_by(f64::total_cmp);
        let next = at.iter().skip(1).copied().chain(at.first().map(|x| x + self.period));
        let mut gaps: Vec<[f64; 2]> = at.iter().copied().zip(next).map(<[f64; 2]>::from).collect();
        gaps.sort_by(|a, b| (b[1] - b[0]).total_cmp(&(a[1] - a[0])));
        gaps.iter().map(|g| 0.5 * (g[0] + g[1])).filter(|&level| !self.has(level)).collect()
    }
}

impl<'n, 'a> Seam<'n, 'a> {
    /// `others` are the non-winding loops of the face.
    pub fn new(
        native: &'n Native<'a>,
        first: &Path,
        left_is_inside: bool,
        others: &[Vec<Side>],
    ) -> Self {
        let (around, up) = inner_side(first, left_is_inside);
        let period = first.winding[around].abs();
        Self { native, around, period, up, occupied: OccupiedRanges::new(others, around, period) }
    }

    /// Whole periods that shift a point of the second winding to the end of the seam from `from`. Where both parameters
    /// are periodic, the end lies on the side of the first winding on which the face lies.
    pub fn shift(&self, from: Vec2, to: Vec2) -> Vec2 {
        let mut shift = whole_periods(self.native, from - to);
        let across = 1 - self.around;
        if let Some(period) = self.native.periods()[across] {
            let ahead = to[across] + shift[across] - from[across];
            if ahead.abs() > COINCIDENCE_TOLERANCE_REL * period && (ahead > 0.0) != self.up {
                shift[across] += if self.up { period } else { -period };
            }
        }
        shift
    }

    /// Rotates two windings to start at a common seam: the first line between their corners that crosses neither, if no
    /// other loop lies on it; otherwise another free line.
    pub fn of_two(&self, first: &Path, second: &Path) -> Option<(Path, Path)> {
        let nearest = self.along_a_line(first, second);
        if nearest.as_ref().is_some_and(|(a, b)| self.is_free([a, b])) {
            return nearest;
        }
        let moved = || Some(self.once_through(&[first, second])?.into_iter());
        moved().and_then(|mut paths| Some((paths.next()?, paths.next()?))).or(nearest)
    }

    /// Rotates a winding to another start when the line from its start to a pole is not free.
    pub fn of_one(&self, path: &Path) -> Option<Path> {
        if self.is_free([path]) {
            return None;
        }
        self.once_through(&[path])?.pop()
    }

    /// True when no other loop lies at the start of the windings and none of them crosses its own start level again.
    fn is_free<const N: usize>(&self, paths: [&Path; N]) -> bool {
        paths.iter().all(|path| {
            let Some(start) = path.sides.first().map(|s| s.start()[self.around]) else {
                return false;
            };
            let sense = path.winding[self.around].signum();
            let turns = |uv: Vec2| sense * (uv[self.around] - start) / self.period;
            let within = |uv: Vec2| {
                turns(uv) >= -TOUCH_TOLERANCE_REL && turns(uv) <= 1.0 + TOUCH_TOLERANCE_REL
            };
            !self.occupied.has(start) && path.sides.iter().all(|s| points_of(s).all(within))
        })
    }

    /// Rotates the windings to start on an isoparametric line that meets each of them once and no other loop: at common
    /// corners, at a corner of one, or between corners. `None` without such a line.
    pub fn once_through(&self, paths: &[&Path]) -> Option<Vec<Path>> {
        let corners = |path: &&Path| {
            let starts = path.sides.iter().map(|s| s.start()[self.around]);
            starts.take(CORNERS_MAX).collect::<Vec<f64>>()
        };
        let levels: Vec<f64> = paths.iter().flat_map(corners).collect();
        let mut at_a_corner = None;
        for &level in levels.iter().filter(|&&level| !self.occupied.has(level)) {
            let Some(hits) = self.hits(paths, level) else { continue };
            if hits.iter().all(|hit| hit.t.is_none()) {
                return self.rotated_to(paths, &hits);
            }
            at_a_corner.get_or_insert(hits);
        }
        let gaps = self.occupied.gaps(levels.into_iter());
        let between = || gaps.iter().take(CORNERS_MAX).find_map(|&x| self.hits(paths, x));
        self.rotated_to(paths, &at_a_corner.or_else(between)?)
    }

    fn hits(&self, paths: &[&Path], level: f64) -> Option<Vec<Crossing>> {
        paths.iter().map(|path| self.single_crossing(path, level)).collect()
    }

    fn rotated_to(&self, paths: &[&Path], hits: &[Crossing]) -> Option<Vec<Path>> {
        paths.iter().zip(hits).map(|(path, hit)| started_at(self.native, path, hit)).collect()
    }

    /// The intersection of a winding with a level, if there is exactly one.
    fn single_crossing(&self, path: &Path, level: f64) -> Option<Crossing> {
        let turns = |uv: Vec2| (uv[self.around] - level) / self.period;
        let corner = |(side, s): (usize, &Side)| {
            let (uv, turns) = (s.start(), turns(s.start()));
            ((turns - turns.round()).abs() <= COINCIDENCE_TOLERANCE_REL).then_some(Crossing {
                side,
                t: None,
                uv,
            })
        };
        let mut found: Vec<Crossing> = path.sides.iter().enumerate().filter_map(corner).collect();
        found.extend(self.crossings(path, level));
        let place = self.native.point(found.first()?.uv);
        let off = |uv: Vec2| (self.native.point(uv) - place).norm();
        let halfway = |s: &Side| s.path.point(0.5 * (s.path.domain()[0] + s.path.domain()[1]));
        let size =
            path.sides.iter().fold(0.0, |m: f64, s| m.max(off(s.start())).max(off(halfway(s))));
        let one = found.iter().all(|c| off(c.uv) <= TOUCH_TOLERANCE_REL * size);
        one.then(|| found.swap_remove(0))
    }

    /// Rotates both windings to start on an isoparametric line that crosses neither in between: from corner to corner,
    /// otherwise from a corner of the first to a side of the second, which is split there.
    pub fn along_a_line(&self, first: &Path, second: &Path) -> Option<(Path, Path)> {
        let corners = |path: &Path| path.sides.len().min(CORNERS_MAX);
        for i in 0..corners(first) {
            let from = first.sides[i].start();
            let level = |uv: Vec2| uv[self.around] + self.shift(from, uv)[self.around];
            let same = |uv: Vec2| {
                (level(uv) - from[self.around]).abs() <= COINCIDENCE_TOLERANCE_REL * self.period
            };
            for j in 0..corners(second) {
                let to = second.sides[j].start();
                if same(to) && self.clear(from, to, first, second) {
                    return Some((rotated(first, i), rotated(second, j)));
                }
            }
        }
        for i in 0..corners(first) {
            let from = first.sides[i].start();
            for hit in self.crossings(second, from[self.around]) {
                if self.clear(from, hit.uv, first, second) {
                    return Some((rotated(first, i), started_at(self.native, second, &hit)?));
                }
            }
        }
        None
    }

    /// True when the seam from a point of the first winding to one of the second crosses neither.
    fn clear(&self, from: Vec2, to: Vec2, first: &Path, second: &Path) -> bool {
        let across = 1 - self.around;
        let (a, b) = (from[across], to[across] + self.shift(from, to)[across]);
        let margin = TOUCH_TOLERANCE_REL * (b - a).abs();
        let between = |hit: &Crossing| {
            let middle = Vec2::repeat(0.5 * (a + b));
            let near = hit.uv[across] + whole_periods(self.native, middle - hit.uv)[across];
            near > a.min(b) + margin && near < a.max(b) - margin
        };
        ![first, second]
            .iter()
            .any(|path| self.crossings(path, from[self.around]).iter().any(between))
    }

    /// Intersections of a winding with a level.
    fn crossings(&self, path: &Path, at: f64) -> Vec<Crossing> {
        let mut found = Vec::new();
        for (side, s) in path.sides.iter().enumerate() {
            let turn = |t: f64| (s.path.point(t)[self.around] - at) / self.period;
            let [low, high] = s.path.domain();
            let n = samples_of(s);
            let fraction = |k: usize| low + (high - low) * k as f64 / n as f64;
            for k in 0..n {
                let (mut a, mut b) = (fraction(k), fraction(k + 1));
                let (x, y) = (turn(a).floor(), turn(b).floor());
                if x == y {
                    continue;
                }
                let level = x.max(y);
                let below = turn(a) < level;
                for _ in 0..60 {
                    let middle = 0.5 * (a + b);
                    if (turn(middle) < level) == below {
                        a = middle;
                    } else {
                        b = middle;
                    }
                }
                let mut uv = s.path.point(b);
                uv[self.around] = at + level * self.period;
                found.push(Crossing { side, t: Some(b), uv });
            }
        }
        found
    }
}

/// Points of a side, eight per span.
pub(super) fn points_of(side: &Side) -> impl Iterator<Item = Vec2> + '_ {
    let [low, high] = side.path.domain();
    let n = samples_of(side);
    (0..=n).map(move |k| side.path.point(low + (high - low) * k as f64 / n as f64))
}

fn samples_of(side: &Side) -> usize {
    8 * side.path.knots().windows(2).filter(|w| w[0] < w[1]).count()
}

/// The winding starting at another corner.
fn rotated(path: &Path, begin: usize) -> Path {
    let (before, after) = path.sides.split_at(begin % path.sides.len().max(1));
    let before = before.iter().map(|s| s.shifted(path.winding));
    Path { sides: after.iter().cloned().chain(before).collect(), ..path.clone() }
}

/// The winding starting at an intersection, where its side is split.
fn started_at(native: &Native<'_>, path: &Path, hit: &Crossing) -> Option<Path> {
    let Some(t) = hit.t else { return Some(rotated(path, hit.side)) };
    let whole = &path.sides[hit.side];
    let [low, high] = whole.path.domain();
    let ends = [whole.path.trimmed(low, t).ok()?, whole.path.trimmed(t, high).ok()?];
    let curves = whole.curve.as_ref().and_then(|c| {
        let [low, high] = c.domain();
        let (t, _) = c.closest(&native.point(hit.uv));
        Some([c.trimmed(low, t).ok()?, c.trimmed(t, high).ok()?])
    });
    let [before, after] = curves.map_or([None, None], |[a, b]| [Some(a), Some(b)]);
    let [first, second] = ends;
    let halves = [
        Side { path: first.with_end(hit.uv), curve: before, edge_id: None },
        Side { path: second.with_start(hit.uv), curve: after, edge_id: None },
    ];
    let mut sides = path.sides.clone();
    sides.splice(hit.side..=hit.side, halves);
    Some(rotated(&Path { sides, ..path.clone() }, hit.side + 1))
}

/// Index of the parameter along a winding, and whether the face lies at larger values of the other one.
pub(super) fn inner_side(path: &Path, left_is_inside: bool) -> (usize, bool) {
    let around = usize::from(path.winding.x == 0.0);
    // Left of a side that runs along +u is +v; left of one that runs along +v is -u.
    let left = (path.winding[around] > 0.0) == (around == 0);
    (around, left == left_is_inside)
}
