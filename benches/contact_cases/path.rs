//! Jumps of gap and normal where a point that glides over a tool changes patches.

use kanagata::contact::{Projection, ToolSurface};
use kanagata::tool::ToolModel;

use super::cases::Random;

/// Largest jumps met on the way.
#[derive(Default, Clone, Copy)]
pub struct Jumps {
    /// Changes of patch.
    pub crossings: usize,
    /// Of the gap [mm].
    pub gap: f64,
    /// Of the normal, creases left out [deg].
    pub normal_deg: f64,
    /// Changes of patch over creases (the normal turns by more than 5 degrees).
    pub creases: usize,
}

/// Straight paths at random through the tool's box; only where the tool is nearer than `reach` [mm].
pub fn along_paths(model: &ToolModel, surface: &ToolSurface, paths: usize, reach: f64) -> Jumps {
    const STEPS: usize = 4000;
    let mut random = Random(17);
    let mut jumps = Jumps::default();
    for _ in 0..paths {
        let [a, b] = [0, 1].map(|_| super::cases::point(model, 0, &mut random));
        let at = |t: f64| a + (b - a) * t;
        let find = |t: f64| surface.closest(&at(t), None);
        let mut last = (0.0, find(0.0));
        for step in 1..=STEPS {
            let now = (step as f64 / STEPS as f64, find(step as f64 / STEPS as f64));
            let near = last.1.gap.abs() < reach && now.1.gap.abs() < reach;
            if near && last.1.patch != now.1.patch && !last.1.past_border && !now.1.past_border {
                jumps.add(&crossing(&find, last, now, (b - a).norm()));
            }
            last = now;
        }
    }
    jumps
}

type At = (f64, Projection);

/// The two answers beside the last change of patch between two.
fn crossing(
    find: &impl Fn(f64) -> Projection,
    mut a: At,
    mut b: At,
    length: f64,
) -> [Projection; 2] {
    while (b.0 - a.0) * length > 1e-9 {
        let t = 0.5 * (a.0 + b.0);
        let middle = (t, find(t));
        if middle.1.patch == b.1.patch {
            b = middle;
        } else {
            a = middle;
        }
    }
    [a.1, b.1]
}

impl Jumps {
    fn add(&mut self, [a, b]: &[Projection; 2]) {
        const CREASE_DEG: f64 = 5.0;
        // The foot itself jumps where two parts of the tool are equally near: no matter of smoothness.
        if (a.point - b.point).norm() > 1e-6 {
            return;
        }
        let turn = a.normal.cross(&b.normal).norm().atan2(a.normal.dot(&b.normal)).to_degrees();
        self.crossings += 1;
        if turn > CREASE_DEG {
            self.creases += 1;
            return;
        }
        self.gap = self.gap.max((a.gap - b.gap).abs());
        self.normal_deg = self.normal_deg.max(turn);
    }
}
