//! Reference search: dense samples of every patch that a bounding sphere does not exclude, descent from the best of
//! each, and a compass search from the overall best. It shares no bound, tree or Newton iteration with
//! [`super::ToolSurface`]. Every distance it returns is that of a point of the tool, so that a search with a larger
//! result has missed a point.

use kanagata_geometry::{Vec2, Vec3};
use kanagata_tool::{Patch, ToolModel};

/// Number of sample intervals along each direction of a patch.
const DIVISIONS: usize = 8;

/// A model with its samples.
pub struct Oracle<'a> {
    model: &'a ToolModel,
    patches: Vec<Sampled>,
}

struct Sampled {
    centre: Vec3,
    /// Radius of a bounding sphere of the samples, with a margin [mm].
    radius: f64,
    samples: Vec<(Vec3, Vec2)>,
    /// Largest distance between neighbouring samples [mm].
    spacing: f64,
}

fn inside(patch: &Patch, x: Vec2) -> Vec2 {
    let (eta, zeta) = (x.x.clamp(0.0, 1.0), x.y.clamp(0.0, 1.0));
    if patch.sides() == 4 || zeta <= eta {
        return Vec2::new(eta, zeta);
    }
    let mean = (0.5 * (x.x + x.y)).clamp(0.0, 1.0);
    Vec2::new(mean, mean)
}

impl Sampled {
    fn of(patch: &Patch) -> Self {
        let n = DIVISIONS as f64;
        let mut samples = Vec::new();
        let mut spacing = 0.0_f64;
        for i in 0..=DIVISIONS {
            for j in 0..=DIVISIONS {
                let (a, b) = (i as f64 / n, j as f64 / n);
                let x = if patch.sides() == 3 { Vec2::new(a, a * b) } else { Vec2::new(a, b) };
                let d = patch.derivs(x.x, x.y);
                samples.push((d.s, x));
                spacing = spacing.max(d.d1.norm() / n).max(d.d2.norm() / n);
            }
        }
        let centre = samples[samples.len() / 2].0;
        let radius = samples.iter().map(|s| (s.0 - centre).norm()).fold(0.0, f64::max);
        Self { centre, radius: radius + spacing, samples, spacing }
    }
}

impl<'a> Oracle<'a> {
    /// Samples every patch of the model.
    #[must_use]
    pub fn new(model: &'a ToolModel) -> Self {
        Self { model, patches: model.patches.iter().map(Sampled::of).collect() }
    }

    /// Distance from `p` to the nearest point found [mm].
    #[must_use]
    pub fn distance(&self, p: &Vec3) -> f64 {
        let to_centre: Vec<f64> = self.patches.iter().map(|s| (p - s.centre).norm()).collect();
        let mut bound = to_centre.iter().fold(f64::INFINITY, |a, &b| a.min(b));
        let mut found: Vec<(f64, usize, Vec2)> = Vec::new();
        for (k, patch) in self.patches.iter().enumerate() {
            if to_centre[k] - patch.radius > bound {
                continue;
            }
            let best = patch.samples.iter().map(|(s, x)| ((p - s).norm_squared(), *x));
            if let Some((d, x)) = best.min_by(|a, b| a.0.total_cmp(&b.0)) {
                bound = bound.min(d.sqrt());
                found.push((d.sqrt(), k, x));
            }
        }
        found.retain(|f| f.0 - 2.0 * self.patches[f.1].spacing <= bound);
        for (d, k, x) in &mut found {
            (*d, *x) = self.descend(p, *k, *x);
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.iter().take(2).map(|f| self.compass(p, f)).fold(f64::INFINITY, f64::min)
    }

    /// Damped descent; the distance never increases.
    fn descend(&self, p: &Vec3, k: usize, start: Vec2) -> (f64, Vec2) {
        let patch = &self.model.patches[k];
        let (mut x, mut damping) = (start, 0.0);
        let mut d = patch.derivs(x.x, x.y);
        for _ in 0..40 {
            let q = p - d.s;
            let (a, b, c) = (
                d.d1.norm_squared() - q.dot(&d.d11),
                d.d1.dot(&d.d2) - q.dot(&d.d12),
                d.d2.norm_squared() - q.dot(&d.d22),
            );
            let scale = d.d1.norm_squared() + d.d2.norm_squared();
            let (a, c) = (a + damping * scale, c + damping * scale);
            let g = Vec2::new(q.dot(&d.d1), q.dot(&d.d2));
            let det = a * c - b * b;
            let step = if a > 0.0 && det > 1e-12 * a * c {
                Vec2::new(c * g.x - b * g.y, a * g.y - b * g.x) / det
            } else {
                g / scale
            };
            let next = inside(patch, x + step);
            let at = patch.derivs(next.x, next.y);
            if (p - at.s).norm_squared() < q.norm_squared() {
                let moved = (next - x).amax();
                (x, d, damping) = (next, at, damping * 0.2);
                if moved < 1e-13 {
                    break;
                }
            } else {
                damping = (damping * 8.0).max(1e-3);
                if damping > 1e6 {
                    break;
                }
            }
        }
        ((p - d.s).norm(), x)
    }

    /// Derivative-free compass search with decreasing step.
    fn compass(&self, p: &Vec3, start: &(f64, usize, Vec2)) -> f64 {
        let (mut best, k, mut x) = *start;
        let patch = &self.model.patches[k];
        let mut h = 1e-2;
        while h > 1e-9 {
            let mut moved = false;
            for (i, j) in [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1)] {
                let next = inside(patch, x + Vec2::new(f64::from(i), f64::from(j)) * h);
                let d = (p - patch.derivs(next.x, next.y).s).norm();
                if d < best {
                    (best, x, moved) = (d, next, true);
                }
            }
            if !moved {
                h *= 0.25;
            }
        }
        best
    }
}
