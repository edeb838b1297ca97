//! Quads between the nodes on the border of a flat, without nodes inside: a flat needs no more, whatever their shape,
//! as patches with equal normals lie in their plane.

use super::bends::{Bends, TURNED};
use super::patchwork::{Node, Patchwork};
use super::sine::{corner_sine, sine};
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
pub fn quads(
    face: &Face,
    ring: &[Node],
    bends: &Bends,
    triangles: bool,
) -> Option<(Patchwork, f64)> {
    let count = ring.len();
    if !(3..=MOST_NODES).contains(&count) || (!triangles && count % 2 == 1) {
        return None;
    }
    let normal = face.surface.normal(ring[0].uv)?;
    let points: Vec<Vec3> = ring.iter().map(|n| n.point).collect();
    let cut = Cut { points: &points, sides: sides(ring, bends), normal, triangles };
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
    /// For each node the directions in which the border goes back from it and on from it, where it is bent there.
    sides: Vec<[Option<Vec3>; 2]>,
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
            if sine >= WORST && fill.is_better(best.as_ref()) && !self.is_folded(corners) {
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

    /// Whether a corner is turned over along a bent border.
    fn is_folded(&self, corners: &[usize]) -> bool {
        let (count, all) = (corners.len(), self.points.len());
        let next = |a: usize, b: usize| (a + 1) % all == b;
        (0..count).any(|k| {
            let [before, at, after] = [k + count - 1, k, k + 1].map(|k| corners[k % count]);
            let [back, on] = self.sides[at];
            let (back, on) = (back.filter(|_| next(before, at)), on.filter(|_| next(at, after)));
            if back.is_none() && on.is_none() {
                return false;
            }
            let chord = |to: usize| self.points[to] - self.points[at];
            let (back, on) =
                (back.unwrap_or_else(|| chord(before)), on.unwrap_or_else(|| chord(after)));
            sine(&on, &back, &self.normal) <= TURNED
        })
    }

    fn worst_sine(&self, corners: &[usize]) -> f64 {
        let count = corners.len();
        let at = |k: usize| self.points[corners[k % count]];
        let sine = |k: usize| corner_sine(&at(k + count - 1), &at(k), &at(k + 1), &self.normal);
        (0..count).map(sine).fold(1.0, f64::min)
    }
}

/// For each node of a ring the directions in which the border goes back from it and on from it, where it is bent there.
fn sides(ring: &[Node], bends: &Bends) -> Vec<[Option<Vec3>; 2]> {
    let count = ring.len();
    let at = |k: usize| &ring[k % count];
    (0..count)
        .map(|k| {
            [
                bends.of(at(k + count - 1), at(k)).map(|b| b[1]),
                bends.of(at(k), at(k + 1)).map(|b| b[0]),
            ]
        })
        .collect()
}

#[cfg(test)]
pub(super) mod tests {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

    use super::*;
    use crate::cad::model::{SurfaceKind, TrimLoop};
    use crate::geometry::nurbs::Surface;
    use crate::geometry::{Frame, Vec2};
    use crate::mesh::Element;

    /// A plane of 20 by 20 about the origin, without loops of its own.
    pub(in crate::mesh::mapped) fn plane() -> Face {
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
        let work = quads(&plane(), &ring(&l), &Bends::default(), false).unwrap().0;
        assert_eq!(work.elements.len(), 2);
        assert!(work.elements.iter().all(|e| e.nodes().len() == 4));
        assert!((area(&work) - 12.0).abs() < 1e-12);
        let mut odd = l.to_vec();
        odd[5] = [0.0, 5.0];
        odd.insert(5, [1.0, 5.0]);
        assert!(quads(&plane(), &ring(&odd), &Bends::default(), false).is_none());
        let work = quads(&plane(), &ring(&odd), &Bends::default(), true).unwrap().0;
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
        let work = quads(&plane(), &ring(&points), &Bends::default(), false).unwrap().0;
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
        assert!(quads(&plane(), &ring(&needle), &Bends::default(), true).is_none());
        let turned = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]];
        assert!(quads(&plane(), &ring(&turned), &Bends::default(), true).is_none());
    }

    /// A rounded square with so many sides on each corner, and how its border leaves the nodes: turned over by little at
    /// the joints, where the CAD's tangents are off.
    fn rounded(sides: u32) -> (Vec<Node>, Bends) {
        let at = |corner: u32, k: u32| {
            let a = (f64::from(corner) + f64::from(k) / f64::from(sides)) * FRAC_PI_2;
            let middle = f64::from(corner) * FRAC_PI_2 + FRAC_PI_4;
            let center = Vec2::new(middle.cos(), middle.sin()) * 3.0;
            let tangent = a - if k == 0 { 1e-4 } else { 0.0 } + if k == sides { 1e-4 } else { 0.0 };
            let place = center + Vec2::new(a.cos(), a.sin());
            (place, Vec3::new(-tangent.sin(), tangent.cos(), 0.0))
        };
        let all = || (0..4).flat_map(|c| (0..=sides).map(move |k| (c, k)));
        let mut nodes = ring(&all().map(|(c, k)| at(c, k).0.into()).collect::<Vec<[f64; 2]>>());
        nodes.iter_mut().zip(0..).for_each(|(n, id)| n.id = Some(id));
        let mut bends = Bends::default();
        for corner in 0..4 {
            let ids: Vec<u32> = (0..=sides).map(|k| corner * (sides + 1) + k).collect();
            let tangents: Vec<Vec3> = (0..=sides).map(|k| at(corner, k).1).collect();
            bends.add(&ids, &tangents);
        }
        (nodes, bends)
    }

    /// Elements with a corner that is turned over along the border.
    fn folded(work: &Patchwork, bends: &Bends) -> usize {
        let suits = |e: &Element| {
            let nodes: Vec<&Node> = e.nodes().iter().map(|&n| &work.nodes[n as usize]).collect();
            bends.suit(&plane(), &nodes)
        };
        work.elements.iter().filter(|e| !suits(e)).count()
    }

    #[test]
    fn elements_have_no_corner_at_a_joint_that_is_turned_over() {
        let (nodes, bends) = rounded(2);
        let chords = quads(&plane(), &nodes, &Bends::default(), true).unwrap().0;
        let bent = quads(&plane(), &nodes, &bends, true).unwrap().0;
        assert!(folded(&chords, &bends) >= 1 && folded(&bent, &bends) == 0);
        // Without a node between the joints of a corner every cut has such an element.
        let (nodes, bends) = rounded(1);
        assert!(quads(&plane(), &nodes, &bends, true).is_none());
    }

    #[test]
    fn triangles_at_joints_that_are_turned_over_are_opened_by_nodes_inside() {
        use crate::mesh::mapped::{MappedOptions, trimmed};
        let (nodes, bends) = rounded(1);
        let made = |bends: &Bends| {
            trimmed::triangulate(
                &plane(),
                std::slice::from_ref(&nodes),
                bends,
                &MappedOptions::default(),
            )
            .unwrap()
        };
        let (closed, open) = (made(&Bends::default()), made(&bends));
        assert!(folded(&closed, &bends) >= 2 && folded(&open, &bends) == 0);
        assert!((area(&open) - area(&closed)).abs() < 1e-12);
    }

    #[test]
    fn parameters_are_kept() {
        let work = quads(
            &plane(),
            &ring(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]),
            &Bends::default(),
            false,
        )
        .unwrap()
        .0;
        assert_eq!(work.nodes[2].uv, Vec2::new(work.nodes[1].uv.x, work.nodes[3].uv.y));
    }
}
