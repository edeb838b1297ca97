//! Quadrilaterals at poles: two adjacent triangles at a point with a unique normal become one quadrilateral, which
//! approximates the surface better.

use super::patchwork::Patchwork;
use super::sine::corner_sine;
use crate::Element;
use kanagata_cad::model::Face;
use kanagata_geometry::Vec3;

/// Sine of the worst corner angle below which a pair remains two triangles.
const CORNER_SINE_MIN: f64 = 0.3;
/// Difference (sine) of the normals around a pole above which it has no limit normal, as at the apex of a cone.
const NORMAL_SPREAD_SINE_MAX: f64 = 0.05;
/// Relative distance from the pole along a column at which its normal is evaluated.
const NORMAL_OFFSET_REL: f64 = 1e-3;

/// A row of triangles along a pole, counter-clockwise about it.
struct Fan {
    /// Elements.
    elements: Vec<usize>,
    /// Node of the pole in each column, one more than elements.
    poles: Vec<usize>,
    /// The adjacent node of each column.
    adjacent: Vec<usize>,
}

impl Fan {
    /// The rows at the four sides of a grid of `m` by `n` cells, from the lower side on.
    fn rows([m, n]: [usize; 2]) -> [Self; 4] {
        let at = |i: usize, j: usize| j * (m + 1) + i;
        let fan = |count: usize,
                   place: &dyn Fn(usize, bool) -> [usize; 2],
                   cell: &dyn Fn(usize) -> usize| {
            let nodes = |inner: bool| {
                (0..=count).map(|k| place(k, inner)).map(|[i, j]| at(i, j)).collect::<Vec<usize>>()
            };
            Self {
                elements: (0..count).map(cell).collect(),
                poles: nodes(false),
                adjacent: nodes(true),
            }
        };
        let step = usize::from;
        [
            fan(m, &|k, inner| [m - k, step(inner)], &|k| m - 1 - k),
            fan(n, &|k, inner| [m - step(inner), n - k], &|k| (n - 1 - k) * m + m - 1),
            fan(m, &|k, inner| [k, n - step(inner)], &|k| (n - 1) * m + k),
            fan(n, &|k, inner| [step(inner), k], &|k| k * m),
        ]
    }

    /// The triangles in columns `k` and `k + 1` as a quadrilateral; `None` where its corners are poor.
    fn quad(&self, face: &Face, work: &Patchwork, k: usize) -> Option<Element> {
        let normal = |k: usize| {
            let [pole, adjacent] = [self.poles[k], self.adjacent[k]].map(|n| work.nodes[n].uv);
            face.surface.normal(pole + (adjacent - pole) * NORMAL_OFFSET_REL)
        };
        let [first, limit, last] = [normal(k)?, normal(k + 1)?, normal(k + 2)?];
        let is_one =
            |n: &Vec3| n.cross(&limit).norm() <= NORMAL_SPREAD_SINE_MAX && n.dot(&limit) > 0.0;
        if !is_one(&first) || !is_one(&last) {
            return None;
        }
        let ring =
            [self.poles[k + 1], self.adjacent[k], self.adjacent[k + 1], self.adjacent[k + 2]];
        let point = |c: usize| &work.nodes[ring[c % 4]].point;
        let sine = |c: usize| {
            let normal =
                if c == 0 { limit } else { face.surface.normal(work.nodes[ring[c]].uv)? };
            Some(corner_sine(point(c + 3), point(c), point(c + 1), &normal))
        };
        let worst = (0..4).map(sine).try_fold(1.0f64, |worst, s| Some(worst.min(s?)))?;
        (worst >= CORNER_SINE_MIN).then(|| Element::quad(ring.map(|n| n as u32), 0))
    }
}

/// Recombines pairs of triangles at the poles of a grid of `cells`, where these make good quadrilaterals.
pub fn join(face: &Face, work: &mut Patchwork, cells: [usize; 2]) {
    // With split cells, or poles on both sides of one row, the element numbering is not that of rows.
    if work.elements.len() != cells[0] * cells[1] || cells.contains(&1) {
        return;
    }
    let mut dropped = vec![false; work.elements.len()];
    for fan in Fan::rows(cells) {
        let is_pole = fan.poles.iter().all(|&n| work.nodes[n].same(&work.nodes[fan.poles[0]]));
        let mut k = 0;
        while is_pole && k + 1 < fan.elements.len() {
            if let Some(quad) = fan.quad(face, work, k) {
                work.elements[fan.elements[k]] = quad;
                dropped[fan.elements[k + 1]] = true;
                k += 1;
            }
            k += 1;
        }
    }
    let mut kept = dropped.iter().map(|dropped| !dropped);
    work.elements.retain(|_| kept.next().unwrap_or(true));
}
