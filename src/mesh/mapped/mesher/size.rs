//! Largest element size: faces with longer sides are meshed again.

use super::Mesher;
use crate::Element;
use crate::mapped::options::MeshStyle;
use crate::mapped::patchwork::Patchwork;

/// Relative excess of a side length over the largest size that is attributed to rounding.
const SIZE_ROUNDING_REL: f64 = 2e-6;

/// Smallest reduction factor of the target length: a smaller change may have no effect.
const REDUCTION_FACTOR_MIN: f64 = 1.05;

impl Mesher<'_> {
    /// Requests shorter sides on faces that exceed the largest size; false when none does.
    pub(super) fn request_size(
        &mut self,
        works: &[Patchwork],
        mapped: &[bool],
        counts: &[usize],
    ) -> bool {
        let Some(size) = self.options.max_size else { return false };
        let mut requested = false;
        for (f, work) in works.iter().enumerate() {
            let times = longest(work, self.options.style == MeshStyle::Triangles) / size;
            if times <= 1.0 + SIZE_ROUNDING_REL {
                continue;
            }
            requested = true;
            self.sizes[f] /= times.max(REDUCTION_FACTOR_MIN);
            let more = |n: usize| (n as f64 * times).ceil() as usize;
            if mapped[f] {
                self.density[f] = more(self.density[f]);
            }
            // Divided by turning angle, an edge has segments longer than the mean.
            if mapped[f] || self.options.by_turn {
                for e in self.edges_of(f) {
                    self.minima[e] = self.minima[e].max(more(counts[e]));
                }
            }
        }
        requested
    }
}

/// Longest side of an element, or of the two triangles into which a quadrilateral is cut [mm].
fn longest(work: &Patchwork, cut: bool) -> f64 {
    let length = |a: u32, b: u32| {
        let [a, b] = [a, b].map(|n| work.nodes[n as usize].point);
        (a - b).norm()
    };
    let of = |e: &Element| {
        let sides = e.sides().map(|[a, b]| length(a, b)).fold(0.0, f64::max);
        match *e.nodes() {
            [a, b, c, d] if cut => sides.max(length(a, c).min(length(b, d))),
            _ => sides,
        }
    };
    work.elements.iter().map(of).fold(0.0, f64::max)
}
