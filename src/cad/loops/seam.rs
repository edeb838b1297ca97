//! Where two windings are joined by a seam: along a line of one parameter that crosses no side.

use super::closed::inner_side;
use super::{Native, Path, Side, whole_periods};
use crate::geometry::Vec2;

/// Corners from which a seam is tried.
const MOST_CORNERS: usize = 32;
/// Parameters that differ by this share of a period are the same.
const SAME: f64 = 1e-9;
/// A side that comes this near to the seam's end, as a share of the seam, only touches it.
const TOUCH: f64 = 1e-6;

/// The way from one winding to the other.
pub(super) struct Seam<'n, 'a> {
    native: &'n Native<'a>,
    /// The parameter that the windings run along, and its period.
    around: usize,
    period: f64,
    /// The face lies at larger values of the other parameter than the first winding.
    up: bool,
}

/// A point of a winding at a seam's parameter: side, parameter on it, place.
struct Crossing {
    side: usize,
    t: f64,
    uv: Vec2,
}

impl<'n, 'a> Seam<'n, 'a> {
    pub fn new(native: &'n Native<'a>, first: &Path, left_is_inside: bool) -> Self {
        let (around, up) = inner_side(first, left_is_inside);
        Self { native, around, period: first.winding[around].abs(), up }
    }

    /// Whole periods that bring a point of the second winding to the end of the seam that begins at `from`: where
    /// both parameters are periodic, on the side of the first winding on which the face lies.
    pub fn shift(&self, from: Vec2, to: Vec2) -> Vec2 {
        let mut shift = whole_periods(self.native, from - to);
        let across = 1 - self.around;
        if let Some(period) = self.native.periods()[across] {
            let ahead = to[across] + shift[across] - from[across];
            if ahead.abs() > SAME * period && (ahead > 0.0) != self.up {
                shift[across] += if self.up { period } else { -period };
            }
        }
        shift
    }

    /// Both windings begun where a line of one parameter joins them: from corner to corner, else from a corner of the
    /// first to a side of the second, which is cut there. `None` where every such line crosses a side.
    pub fn along_a_line(&self, first: &Path, second: &Path) -> Option<(Path, Path)> {
        let corners = |path: &Path| path.sides.len().min(MOST_CORNERS);
        for i in 0..corners(first) {
            let from = first.sides[i].start();
            let level = |uv: Vec2| uv[self.around] + self.shift(from, uv)[self.around];
            let same = |uv: Vec2| (level(uv) - from[self.around]).abs() <= SAME * self.period;
            for j in 0..corners(second) {
                let to = second.sides[j].start();
                if same(to) && self.clear(from, to, first, second) {
                    return Some((rotated(first, i), rotated(second, j)));
                }
            }
        }
        for i in 0..corners(first) {
            let from = first.sides[i].start();
            for hit in self.crossings(second, from) {
                if self.clear(from, hit.uv, first, second) {
                    let cut = cut(self.native, second, &hit)?;
                    return Some((rotated(first, i), rotated(&cut, hit.side + 1)));
                }
            }
        }
        None
    }

    /// The seam from a point of the first winding to one of the second crosses neither.
    fn clear(&self, from: Vec2, to: Vec2, first: &Path, second: &Path) -> bool {
        let across = 1 - self.around;
        let (a, b) = (from[across], to[across] + self.shift(from, to)[across]);
        let margin = TOUCH * (b - a).abs();
        let between = |hit: &Crossing| {
            let middle = Vec2::repeat(0.5 * (a + b));
            let near = hit.uv[across] + whole_periods(self.native, middle - hit.uv)[across];
            near > a.min(b) + margin && near < a.max(b) - margin
        };
        ![first, second].iter().any(|path| self.crossings(path, from).iter().any(between))
    }

    /// Where a winding has the parameter of `at`.
    fn crossings(&self, path: &Path, at: Vec2) -> Vec<Crossing> {
        let mut found = Vec::new();
        for (side, s) in path.sides.iter().enumerate() {
            let turn = |t: f64| (s.path.point(t)[self.around] - at[self.around]) / self.period;
            let [low, high] = s.path.domain();
            let spans = s.path.knots().windows(2).filter(|w| w[0] < w[1]).count();
            let n = 8 * spans;
            let share = |k: usize| low + (high - low) * k as f64 / n as f64;
            for k in 0..n {
                let (mut a, mut b) = (share(k), share(k + 1));
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
                uv[self.around] = at[self.around] + level * self.period;
                found.push(Crossing { side, t: b, uv });
            }
        }
        found
    }
}

/// The winding begun at another corner.
fn rotated(path: &Path, begin: usize) -> Path {
    let (before, after) = path.sides.split_at(begin % path.sides.len().max(1));
    let before = before.iter().map(|s| s.shifted(path.winding));
    Path { sides: after.iter().cloned().chain(before).collect(), winding: path.winding }
}

/// The winding with one side cut in two.
fn cut(native: &Native<'_>, path: &Path, hit: &Crossing) -> Option<Path> {
    let whole = &path.sides[hit.side];
    let [low, high] = whole.path.domain();
    let ends = [whole.path.trimmed(low, hit.t).ok()?, whole.path.trimmed(hit.t, high).ok()?];
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
    Some(Path { sides, winding: path.winding })
}
