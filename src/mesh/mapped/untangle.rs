//! Untangling: moves interior nodes with inverted or nearly inverted adjacent elements, as at a boundary arc that
//! bulges into an element or a concave ring around a centre.

use super::patchwork::{Node, Patchwork};
use super::sine::corner_sine;
use kanagata_cad::model::Face;
use kanagata_geometry::{Vec2, Vec3};

/// Signed sine of the worst corner below which an element is improved.
const POOR_CORNER_SINE: f64 = 0.15;
/// Factor on the sine of a narrow corner between two interior sides, as in a fan around a small hole: it does not
/// indicate inversion.
const NARROW_CORNER_FACTOR: f64 = 6.0;
/// Maximum number of sweeps over the nodes.
const SWEEPS_MAX: usize = 12;
/// Bisections of the step in a sweep.
const STEP_BISECTIONS: usize = 5;

impl Patchwork {
    /// Moves free nodes to improve the worst corner of their adjacent elements, until no element is poor or no move
    /// helps.
    pub fn untangle(&mut self, face: &Face) {
        let mut around: Vec<Vec<usize>> = vec![Vec::new(); self.nodes.len()];
        for (k, e) in self.elements.iter().enumerate() {
            e.nodes().iter().for_each(|&n| around[n as usize].push(k));
        }
        let normals = self.nodes.iter().map(|n| face.surface.normal(n.uv)).collect();
        let mut work = Untangling { face, normals, patchwork: self };
        for _ in 0..SWEEPS_MAX {
            let free = |n: &usize| work.patchwork.nodes[*n].id.is_none();
            let poor: Vec<usize> = (0..work.normals.len())
                .filter(|n| free(n) && work.worst_of(&around[*n]) < POOR_CORNER_SINE)
                .collect();
            let moved = poor.iter().filter(|&&n| work.improve(n, &around[n])).count();
            if moved == 0 {
                return;
            }
        }
    }
}

struct Untangling<'a> {
    face: &'a Face,
    patchwork: &'a mut Patchwork,
    /// Surface normals at the nodes; `None` where degenerate.
    normals: Vec<Option<Vec3>>,
}

impl Untangling<'_> {
    fn worst_of(&self, elements: &[usize]) -> f64 {
        elements.iter().map(|&k| self.corner(k)).fold(1.0, f64::min)
    }

    /// Worst corner of one element.
    fn corner(&self, element: usize) -> f64 {
        let ring = self.patchwork.elements[element].nodes();
        let count = ring.len();
        let node = |k: usize| &self.patchwork.nodes[ring[k % count] as usize];
        let sine = |k: usize| {
            let Some(normal) = &self.normals[ring[k] as usize] else { return 1.0 };
            let [before, at, after] = [node(k + count - 1), node(k), node(k + 1)].map(|n| n.point);
            let sine = corner_sine(&before, &at, &after, normal);
            let narrow = node(k).id.is_none() && (before - at).dot(&(after - at)) > 0.0;
            if narrow { NARROW_CORNER_FACTOR * sine } else { sine }
        };
        (0..count).map(sine).fold(1.0, f64::min)
    }

    /// Moves node `n` and updates its normal.
    fn move_node(&mut self, n: usize, node: Node) {
        self.patchwork.nodes[n] = node;
        self.normals[n] = self.face.surface.normal(node.uv);
    }

    /// Pattern search around node `n`; true when a better position was found.
    fn improve(&mut self, n: usize, elements: &[usize]) -> bool {
        let start = self.patchwork.nodes[n];
        let reach = elements
            .iter()
            .flat_map(|&k| self.patchwork.elements[k].nodes())
            .map(|&m| (self.patchwork.nodes[m as usize].uv - start.uv).abs())
            .fold(Vec2::zeros(), |a, b| a.sup(&b));
        let (mut best, mut value) = (start, self.worst_of(elements));
        let mut step = reach * 0.25;
        for _ in 0..STEP_BISECTIONS {
            let centre = best.uv;
            for k in 0..9_i32 {
                let shift = Vec2::new(f64::from(k % 3 - 1), f64::from(k / 3 - 1));
                self.move_node(n, Node::inside(self.face, centre + step.component_mul(&shift)));
                let found = self.worst_of(elements);
                if found > value {
                    (best, value) = (self.patchwork.nodes[n], found);
                }
            }
            if best.uv == centre {
                step *= 0.5;
            }
        }
        self.move_node(n, best);
        best.uv != start.uv
    }
}
