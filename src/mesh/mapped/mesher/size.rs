//! The largest size: faces with longer sides are meshed again, until there are none.

use super::Mesher;
use crate::mesh::Element;
use crate::mesh::mapped::options::MeshStyle;
use crate::mesh::mapped::patchwork::Patchwork;

/// Sides longer than the largest size by less than this share of it are not.
const ROUNDING: f64 = 2e-6;

/// What a face is asked for is at least so much shorter than before: a little less may change nothing.
const LEAST: f64 = 1.05;

impl Mesher<'_> {
    /// Asks for shorter sides on the faces that have longer ones than the largest size; false when none has.
    pub(super) fn ask_for_size(
        &mut self,
        works: &[Patchwork],
        mapped: &[bool],
        counts: &[usize],
    ) -> bool {
        let Some(size) = self.options.max_size else { return false };
        let mut asked = false;
        for (f, work) in works.iter().enumerate() {
            let times = longest(work, self.options.style == MeshStyle::Triangles) / size;
            if times <= 1.0 + ROUNDING {
                continue;
            }
            asked = true;
            self.sizes[f] /= times.max(LEAST);
            let more = |n: usize| (n as f64 * times).ceil() as usize;
            if mapped[f] {
                self.density[f] = more(self.density[f]);
            }
            // Divided by turn, an edge has parts longer than its mean.
            if mapped[f] || self.options.by_turn {
                for e in self.edges_of(f) {
                    self.minima[e] = self.minima[e].max(more(counts[e]));
                }
            }
        }
        asked
    }
}

/// The longest side of an element, or of the two triangles that a quad will be cut into [mm].
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
