//! Crossings of the sides of a face with the plan curve.

use super::cut::Cut;
use crate::loops::Side;

/// Crossings of a side searched for at most.
const SIDE_INTERVALS_MAX: usize = 20_000;
/// Bisections that locate a crossing.
const BISECTIONS: usize = 60;

impl Cut<'_> {
    /// A side cut at its crossings with the curve, each piece with its place: inside, outside or along the curve.
    pub(super) fn pieces(&self, side: &Side) -> Result<Vec<(Side, Option<bool>)>, String> {
        let [low, high] = side.path.domain();
        let snap = 2.0 * self.tolerance;
        let signed = |t: f64| self.signed(side.path.point(t));
        if (0..=32).all(|k| signed(low + (high - low) * f64::from(k) / 32.0).abs() <= snap) {
            return Ok(vec![(side.clone(), None)]);
        }
        let at = |t: f64| self.point(side.path.point(t));
        let near = |t: f64, end: f64| (at(t) - at(end)).norm() <= snap;
        let mut cuts = self.crossings(side)?;
        cuts.retain(|&t| !near(t, low) && !near(t, high));
        cuts.dedup_by(|b, a| near(*b, *a));
        let placed = |piece: Side| {
            let place = self.place(&piece);
            (piece, place)
        };
        Ok(self.cut_at(side, &cuts).into_iter().map(placed).collect())
    }

    /// Parameters at which a side crosses the curve, in ascending order.
    fn crossings(&self, side: &Side) -> Result<Vec<f64>, String> {
        let [low, high] = side.path.domain();
        let at = |t: f64| self.point(side.path.point(t));
        let signed = |t: f64| self.signed(side.path.point(t));
        let snap = 2.0 * self.tolerance;
        let spans = side.path.knots().windows(2).filter(|w| w[0] < w[1]).count();
        let n = 8 * spans.max(2);
        let first: Vec<f64> = (0..=n).map(|k| low + (high - low) * k as f64 / n as f64).collect();
        let mut open: Vec<[f64; 2]> = first.windows(2).rev().map(|w| [w[0], w[1]]).collect();
        let mut before: Option<(f64, f64)> = None;
        let (mut cuts, mut done) = (Vec::new(), 0);
        while let Some([a, b]) = open.pop() {
            done += 1;
            if done > SIDE_INTERVALS_MAX {
                return Err("a side of it runs along the curve or crosses it too often".into());
            }
            let (fa, fb) = (signed(a), signed(b));
            let middle = 0.5 * (a + b);
            // The distance changes by at most the length: a short interval has no further crossing.
            let length = 1.2 * ((at(middle) - at(a)).norm() + (at(b) - at(middle)).norm());
            let is_short = length <= fa.abs() + fb.abs() + 2.0 * snap;
            if !is_short && middle > a && middle < b {
                open.extend([[middle, b], [a, middle]]);
                continue;
            }
            for (t, f) in [(a, fa), (b, fb)].into_iter().filter(|(_, f)| f.abs() > snap) {
                if let Some((from, _)) = before.filter(|(_, g)| (*g > 0.0) != (f > 0.0)) {
                    cuts.push(root(&signed, from, t));
                }
                before = Some((t, f));
            }
        }
        Ok(cuts)
    }

    fn cut_at(&self, side: &Side, cuts: &[f64]) -> Vec<Side> {
        let [low, high] = side.path.domain();
        if cuts.is_empty() {
            return vec![side.clone()];
        }
        let bounds = [&[low], cuts, &[high]].concat();
        let part = |w: &[f64]| {
            let path = side.path.trimmed(w[0], w[1]).ok()?;
            let ends = [path.points()[0], path.points()[path.points().len() - 1]];
            let curve = side.curve.as_ref().and_then(|c| {
                let [a, b] = ends.map(|uv| c.closest(&self.point(uv)).0);
                c.trimmed(a, b).ok()
            });
            Some(Side { path, curve, edge_id: None })
        };
        bounds.windows(2).filter_map(part).collect()
    }

    /// Whether a side is inside, by its point farthest from the curve; `None` along the curve.
    fn place(&self, side: &Side) -> Option<bool> {
        const SAMPLES: u32 = 16;
        let [low, high] = side.path.domain();
        let at = |k: u32| low + (high - low) * f64::from(k) / f64::from(SAMPLES);
        let all = (0..=SAMPLES).map(|k| self.signed(side.path.point(at(k))));
        let widest = all.max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
        (widest.abs() > 2.0 * self.tolerance).then_some(widest > 0.0)
    }
}

/// Parameter at which a function changes its sign between `from` and `to`.
fn root(f: &impl Fn(f64) -> f64, mut from: f64, mut to: f64) -> f64 {
    let positive = f(from) > 0.0;
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (from + to);
        if (f(middle) > 0.0) == positive {
            from = middle;
        } else {
            to = middle;
        }
    }
    0.5 * (from + to)
}
