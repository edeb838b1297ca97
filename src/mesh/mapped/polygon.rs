//! Quads between the nodes on the border of a flat, without nodes inside: a flat needs no more, whatever their shape,
//! as patches with equal normals lie in their plane.

use super::patchwork::{Node, Patchwork};
use crate::cad::model::Face;
use crate::geometry::Vec3;

/// Corners of elements have at least this sine.
const WORST: f64 = 0.08;
/// More nodes than this are left to triangulation: the work grows with their fourth power.
const MOST_NODES: usize = 160;

/// The best way to fill what lies between a chord and the border: elements, then the sum of the reciprocal sines of
/// their worst corners, then the one element at the chord.
#[derive(Clone, Copy)]
struct Fill {
    elements: usize,
    badness: f64,
    apex: [usize; 2],
}

impl Fill {
    fn is_better(&self, other: Option<&Self>) -> bool {
        other.is_none_or(|o| (self.elements, self.badness) < (o.elements, o.badness))
    }
}

/// Cuts the ring into as few convex quads and triangles as there can be (an even ring into quads only, if it can),
/// by dynamic programming over its chords; with the sum of the reciprocal sines of the worst corners. `None` when there is no such cut with sound corners.
///
/// Elements that all turn the ring's way cannot overlap: together they wind once around every point inside.
pub fn quads(face: &Face, ring: &[Node], triangles: bool) -> Option<(Patchwork, f64)> {
    let count = ring.len();
    if !(3..=MOST_NODES).contains(&count) || (!triangles && count % 2 == 1) {
        return None;
    }
    let normal = face.surface.normal(ring[0].uv)?;
    let points: Vec<Vec3> = ring.iter().map(|n| n.point).collect();
    let cut = Cut { points: &points, normal, triangles };
    let mut fills: Vec<Option<Fill>> = vec![None; count * count];
    for k in 0..count - 1 {
        fills[k * count + k + 1] = Some(Fill { elements: 0, badness: 0.0, apex: [0, 0] });
    }
    for span in 2..count {
        for i in 0..count - span {
            fills[i * count + i + span] = cut.best(&fills, i, i + span);
        }
    }
    let badness = fills[count - 1]?.badness;
    let mut out = Patchwork { nodes: ring.to_vec(), elements: Vec::new() };
    let mut chords = vec![[0, count - 1]];
    while let Some([i, j]) = chords.pop() {
        let Some(Fill { apex: [k, l], .. }) = fills[i * count + j].filter(|f| f.elements > 0)
        else {
            continue;
        };
        let corners = if k == l { vec![i, k, j] } else { vec![i, k, l, j] };
        out.push(&corners.iter().map(|&n| n as u32).collect::<Vec<u32>>());
        chords.extend(corners.windows(2).map(|w| [w[0], w[1]]));
    }
    Some((out, badness))
}

struct Cut<'a> {
    points: &'a [Vec3],
    normal: Vec3,
    triangles: bool,
}

impl Cut<'_> {
    /// Best fill of chord `i`-`j` from those of the shorter chords.
    fn best(&self, fills: &[Option<Fill>], i: usize, j: usize) -> Option<Fill> {
        let count = self.points.len();
        let mut best: Option<Fill> = None;
        let mut offer = |parts: &[Fill], corners: &[usize], apex: [usize; 2]| {
            let elements = 1 + parts.iter().map(|p| p.elements).sum::<usize>();
            let before = parts.iter().map(|p| p.badness).sum::<f64>();
            // The element itself adds one at least.
            let least = Fill { elements, badness: before + 1.0, apex };
            if !least.is_better(best.as_ref()) {
                return;
            }
            let sine = self.worst_sine(corners);
            let fill = Fill { elements, badness: before + 1.0 / sine.max(WORST), apex };
            if sine >= WORST && fill.is_better(best.as_ref()) {
                best = Some(fill);
            }
        };
        for k in i + 1..j {
            let Some(first) = fills[i * count + k] else { continue };
            if self.triangles
                && let Some(last) = fills[k * count + j]
            {
                offer(&[first, last], &[i, k, j], [k, k]);
            }
            for l in k + 1..j {
                if let (Some(middle), Some(last)) = (fills[k * count + l], fills[l * count + j]) {
                    offer(&[first, middle, last], &[i, k, l, j], [k, l]);
                }
            }
        }
        best
    }

    fn worst_sine(&self, corners: &[usize]) -> f64 {
        let count = corners.len();
        let at = |k: usize| self.points[corners[k % count]];
        let sine =
            |k: usize| super::corner_sine(&at(k + count - 1), &at(k), &at(k + 1), &self.normal);
        (0..count).map(sine).fold(1.0, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cad::model::{SurfaceKind, TrimLoop};
    use crate::geometry::nurbs::Surface;
    use crate::geometry::{Frame, Vec2};

    fn plane() -> Face {
        let frame = Frame::world();
        Face {
            surface: Surface::plane(&frame, [-10.0, 10.0], [-10.0, 10.0]),
            kind: SurfaceKind::Plane,
            analytic: None,
            loops: vec![TrimLoop { uses: vec![] }],
            flipped: false,
            source: "plane".into(),
            shell: None,
        }
    }

    fn ring(points: &[[f64; 2]]) -> Vec<Node> {
        let node = |&[x, y]: &[f64; 2]| {
            let face = plane();
            let (uv, _) = face.surface.closest(&Vec3::new(x, y, 0.0));
            Node { uv, point: face.surface.point(uv), id: None }
        };
        points.iter().map(node).collect()
    }

    fn area(work: &Patchwork) -> f64 {
        let p = |n: u32| work.nodes[n as usize].point;
        let of = |ring: &[u32]| -> f64 {
            (1..ring.len() - 1)
                .map(|k| (p(ring[k]) - p(ring[0])).cross(&(p(ring[k + 1]) - p(ring[0]))).z / 2.0)
                .sum()
        };
        work.elements.iter().map(|e| of(e.nodes())).sum()
    }

    #[test]
    fn an_even_ring_becomes_quads_only_and_an_odd_one_gets_one_triangle() {
        let l = [[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [2.0, 2.0], [2.0, 4.0], [0.0, 4.0]];
        let work = quads(&plane(), &ring(&l), false).unwrap().0;
        assert_eq!(work.elements.len(), 2);
        assert!(work.elements.iter().all(|e| e.nodes().len() == 4));
        assert!((area(&work) - 12.0).abs() < 1e-12);
        let mut odd = l.to_vec();
        odd[5] = [0.0, 5.0];
        odd.insert(5, [1.0, 5.0]);
        assert!(quads(&plane(), &ring(&odd), false).is_none());
        let work = quads(&plane(), &ring(&odd), true).unwrap().0;
        assert_eq!(work.elements.iter().filter(|e| e.nodes().len() == 3).count(), 1);
        assert_eq!(work.elements.len(), 3);
    }

    #[test]
    fn a_concave_arc_beside_a_far_corner_needs_no_node_inside() {
        // Every segment of the arc needs a quad of its own: the other sides have as many nodes.
        let mut points = vec![[9.0, 9.0], [6.0, 9.0], [3.0, 9.0], [0.0, 9.0], [0.0, 2.0]];
        for k in 1..6 {
            let a = std::f64::consts::FRAC_PI_2 * (1.0 - f64::from(k) / 6.0);
            points.push([2.0 * a.cos(), 2.0 * a.sin()]);
        }
        points.extend([[2.0, 0.0], [9.0, 0.0], [9.0, 3.0], [9.0, 6.0]]);
        let work = quads(&plane(), &ring(&points), false).unwrap().0;
        assert_eq!(work.elements.len(), points.len() / 2 - 1);
        let polygon: f64 = (0..points.len())
            .map(|k| {
                let ([a, b], [c, d]) = (points[k], points[(k + 1) % points.len()]);
                (a * d - b * c) / 2.0
            })
            .sum();
        assert!((area(&work) - polygon).abs() < 1e-12);
        assert!(work.worst_corner(&plane()) >= WORST);
    }

    #[test]
    fn rings_that_have_no_sound_cut_are_refused() {
        let needle = [[0.0, 0.0], [9.0, 0.0], [9.0, 0.1]];
        assert!(quads(&plane(), &ring(&needle), true).is_none());
        let turned = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]];
        assert!(quads(&plane(), &ring(&turned), true).is_none());
    }

    #[test]
    fn parameters_are_kept() {
        let work = quads(&plane(), &ring(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), false)
            .unwrap()
            .0;
        assert_eq!(work.nodes[2].uv, Vec2::new(work.nodes[1].uv.x, work.nodes[3].uv.y));
    }
}
