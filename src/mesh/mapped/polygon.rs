//! Division of a flat face into quadrilaterals between its boundary nodes. Patches with equal normals lie in their
//! plane, so that a flat face needs no interior nodes.

use super::edge_tangents::{EdgeTangents, INVERTED_CORNER_SINE};
use super::patchwork::{Node, Patchwork};
use super::sine::{corner_sine, sine};
use kanagata_cad::model::Face;
use kanagata_geometry::Vec3;

/// Smallest admissible sine of element corners.
const CORNER_SINE_MIN: f64 = 0.08;
/// Maximum number of nodes; larger rings are triangulated. The work grows with the fourth power.
const NODES_MAX: usize = 160;

/// The best division between a chord and the boundary: number of elements, sum of the reciprocal sines of their worst
/// corners, and the element at the chord.
#[derive(Clone, Copy)]
struct Fill {
    elements: usize,
    penalty: f64,
    apex: [usize; 2],
}

impl Fill {
    fn is_better(&self, other: Option<&Self>) -> bool {
        other.is_none_or(|o| (self.elements, self.penalty) < (o.elements, o.penalty))
    }
}

/// A chord with a division: its other end, and the number of elements and penalty of its [`Fill`].
#[derive(Clone, Copy)]
struct Chord {
    end: usize,
    elements: usize,
    penalty: f64,
}

/// The best divisions of all chords so far.
struct Fills {
    count: usize,
    /// Of chord `i`-`j` at `i * count + j`.
    all: Vec<Option<Fill>>,
    /// The chords from every node that have a division, in the order of their ends.
    from: Vec<Vec<Chord>>,
    /// Those to node `j` at `j * count + i`.
    to: Vec<Option<Chord>>,
}

impl Fills {
    /// Sides of the ring, which need no elements.
    fn of_sides(count: usize) -> Self {
        let all = vec![None; count * count];
        let mut fills =
            Self { count, all, from: vec![Vec::new(); count], to: vec![None; count * count] };
        for k in 0..count - 1 {
            fills.keep([k, k + 1], Fill { elements: 0, penalty: 0.0, apex: [0, 0] });
        }
        fills
    }

    /// Adds a chord. Chords from one node are added in the order of their ends.
    fn keep(&mut self, [i, j]: [usize; 2], fill: Fill) {
        let Fill { elements, penalty, .. } = fill;
        self.all[i * self.count + j] = Some(fill);
        self.from[i].push(Chord { end: j, elements, penalty });
        self.to[j * self.count + i] = Some(Chord { end: i, elements, penalty });
    }

    /// Chords from `i` to nodes before `j`.
    fn before(&self, i: usize, j: usize) -> impl Iterator<Item = &Chord> {
        self.from[i].iter().take_while(move |chord| chord.end < j)
    }
}

/// Divides the ring into the smallest number of convex quadrilaterals and triangles (an even ring into quadrilaterals
/// only, if possible) by dynamic programming over its chords. Also returns the sum of the reciprocal sines of the worst
/// corners. `None` when there is no division with admissible corners.
///
/// Elements with the orientation of the ring cannot overlap: together they wind once around every interior point.
pub fn quads(
    face: &Face,
    ring: &[Node],
    edge_tangents: &EdgeTangents,
    triangles: bool,
) -> Option<(Patchwork, f64)> {
    let count = ring.len();
    if !(3..=NODES_MAX).contains(&count) || (!triangles && count % 2 == 1) {
        return None;
    }
    let normal = face.surface.normal(ring[0].uv)?;
    let points: Vec<Vec3> = ring.iter().map(|n| n.point).collect();
    let cut = Cut { points: &points, sides: sides(ring, edge_tangents), normal, triangles };
    let mut fills = Fills::of_sides(count);
    for span in 2..count {
        for i in 0..count - span {
            if let Some(fill) = cut.best(&fills, i, i + span) {
                fills.keep([i, i + span], fill);
            }
        }
    }
    let fills = fills.all;
    let penalty = fills[count - 1]?.penalty;
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
    Some((out, penalty))
}

/// Rounding error of a sum of penalties.
const PENALTY_ROUNDING: f64 = 1e-9;

/// True when no division whose first chord is `first`, with `sides` sides of the ring behind it, is better than `best`:
/// `n` sides need at least `(n - 1) / 2` elements besides that at the chord, each with a penalty of at least 1.
fn is_hopeless(first: &Chord, sides: usize, best: Option<&Fill>) -> bool {
    let least = 1 + sides.saturating_sub(1) / 2;
    let penalty = first.penalty + least as f64 - PENALTY_ROUNDING;
    let bound = Fill { elements: first.elements + least, penalty, apex: [0, 0] };
    !bound.is_better(best)
}

struct Cut<'a> {
    points: &'a [Vec3],
    /// For each node the tangents of the boundary backward and forward, where it is curved.
    sides: Vec<[Option<Vec3>; 2]>,
    normal: Vec3,
    triangles: bool,
}

impl Cut<'_> {
    /// Best division at chord `i`-`j` from those of the shorter chords.
    fn best(&self, fills: &Fills, i: usize, j: usize) -> Option<Fill> {
        let to_end = &fills.to[j * fills.count..(j + 1) * fills.count];
        let mut best: Option<Fill> = None;
        for first in fills.before(i, j) {
            let k = first.end;
            if is_hopeless(first, j - k, best.as_ref()) {
                continue;
            }
            if self.triangles
                && let Some(last) = &to_end[k]
            {
                self.offer(
                    &mut best,
                    first.elements + last.elements,
                    first.penalty + last.penalty,
                    &[i, k, j],
                );
            }
            for middle in fills.before(k, j) {
                let l = middle.end;
                let Some(last) = &to_end[l] else { continue };
                let elements = first.elements + middle.elements + last.elements;
                let penalty = first.penalty + middle.penalty + last.penalty;
                self.offer(&mut best, elements, penalty, &[i, k, l, j]);
            }
        }
        best
    }

    /// Replaces `best` by the element at `corners` beside parts with `elements` and `penalty`, if that is better.
    #[inline]
    fn offer(&self, best: &mut Option<Fill>, elements: usize, penalty: f64, corners: &[usize]) {
        let apex = [corners[1], corners[corners.len() - 2]];
        // The element itself adds at least 1.
        let lower_bound = Fill { elements: elements + 1, penalty: penalty + 1.0, apex };
        if !lower_bound.is_better(best.as_ref()) {
            return;
        }
        let sine = self.worst_sine(corners);
        let fill = Fill { penalty: penalty + 1.0 / sine.max(CORNER_SINE_MIN), ..lower_bound };
        if sine >= CORNER_SINE_MIN && fill.is_better(best.as_ref()) && !self.is_folded(corners) {
            *best = Some(fill);
        }
    }

    /// True when a corner is inverted along a curved boundary.
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
            sine(&on, &back, &self.normal) <= INVERTED_CORNER_SINE
        })
    }

    fn worst_sine(&self, corners: &[usize]) -> f64 {
        let count = corners.len();
        let at = |k: usize| self.points[corners[k % count]];
        let sine = |k: usize| corner_sine(&at(k + count - 1), &at(k), &at(k + 1), &self.normal);
        (0..count).map(sine).fold(1.0, f64::min)
    }
}

/// For each node of a ring the tangents of the boundary backward and forward, where it is curved.
fn sides(ring: &[Node], edge_tangents: &EdgeTangents) -> Vec<[Option<Vec3>; 2]> {
    let count = ring.len();
    let at = |k: usize| &ring[k % count];
    (0..count)
        .map(|k| {
            [
                edge_tangents.of(at(k + count - 1), at(k)).map(|b| b[1]),
                edge_tangents.of(at(k), at(k + 1)).map(|b| b[0]),
            ]
        })
        .collect()
}

#[cfg(test)]
pub(super) mod tests {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

    use super::*;
    use crate::Element;
    use kanagata_cad::model::{SurfaceKind, TrimLoop};
    use kanagata_geometry::nurbs::Surface;
    use kanagata_geometry::{Frame, Vec2};

    /// A plane of 20 by 20 about the origin, without loops.
    pub(in crate::mapped) fn plane() -> Face {
        let frame = Frame::world();
        Face {
            surface: Surface::plane(&frame, [-10.0, 10.0], [-10.0, 10.0]),
            kind: SurfaceKind::Plane,
            analytic: None,
            loops: vec![TrimLoop { uses: vec![] }],
            flipped: false,
            source: "plane".into(),
            shell: None,
            attributes: Default::default(),
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
        let work = quads(&plane(), &ring(&l), &EdgeTangents::default(), false).unwrap().0;
        assert_eq!(work.elements.len(), 2);
        assert!(work.elements.iter().all(|e| e.nodes().len() == 4));
        assert!((area(&work) - 12.0).abs() < 1e-12);
        let mut odd = l.to_vec();
        odd[5] = [0.0, 5.0];
        odd.insert(5, [1.0, 5.0]);
        assert!(quads(&plane(), &ring(&odd), &EdgeTangents::default(), false).is_none());
        let work = quads(&plane(), &ring(&odd), &EdgeTangents::default(), true).unwrap().0;
        assert_eq!(work.elements.iter().filter(|e| e.nodes().len() == 3).count(), 1);
        assert_eq!(work.elements.len(), 3);
    }

    #[test]
    fn a_concave_arc_beside_a_far_corner_needs_no_node_inside() {
        // Every segment of the arc needs its own quadrilateral: the other sides have as many nodes.
        let mut points = vec![[9.0, 9.0], [6.0, 9.0], [3.0, 9.0], [0.0, 9.0], [0.0, 2.0]];
        for k in 1..6 {
            let a = std::f64::consts::FRAC_PI_2 * (1.0 - f64::from(k) / 6.0);
            points.push([2.0 * a.cos(), 2.0 * a.sin()]);
        }
        points.extend([[2.0, 0.0], [9.0, 0.0], [9.0, 3.0], [9.0, 6.0]]);
        let work = quads(&plane(), &ring(&points), &EdgeTangents::default(), false).unwrap().0;
        assert_eq!(work.elements.len(), points.len() / 2 - 1);
        let polygon: f64 = (0..points.len())
            .map(|k| {
                let ([a, b], [c, d]) = (points[k], points[(k + 1) % points.len()]);
                (a * d - b * c) / 2.0
            })
            .sum();
        assert!((area(&work) - polygon).abs() < 1e-12);
        assert!(work.worst_corner(&plane()) >= CORNER_SINE_MIN);
    }

    #[test]
    fn rings_that_have_no_sound_cut_are_refused() {
        let needle = [[0.0, 0.0], [9.0, 0.0], [9.0, 0.1]];
        assert!(quads(&plane(), &ring(&needle), &EdgeTangents::default(), true).is_none());
        let turned = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]];
        assert!(quads(&plane(), &ring(&turned), &EdgeTangents::default(), true).is_none());
    }

    /// A rounded square with `sides` sides at each corner, and its boundary tangents, inverted by a small angle at the
    /// joints, where the CAD tangents are inaccurate.
    fn rounded(sides: u32) -> (Vec<Node>, EdgeTangents) {
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
        let mut edge_tangents = EdgeTangents::default();
        for corner in 0..4 {
            let ids: Vec<u32> = (0..=sides).map(|k| corner * (sides + 1) + k).collect();
            let tangents: Vec<Vec3> = (0..=sides).map(|k| at(corner, k).1).collect();
            edge_tangents.add(&ids, &tangents);
        }
        (nodes, edge_tangents)
    }

    /// Number of elements with an inverted corner along the boundary.
    fn folded(work: &Patchwork, edge_tangents: &EdgeTangents) -> usize {
        let suits = |e: &Element| {
            let nodes: Vec<&Node> = e.nodes().iter().map(|&n| &work.nodes[n as usize]).collect();
            edge_tangents.has_valid_corners(&plane(), &nodes)
        };
        work.elements.iter().filter(|e| !suits(e)).count()
    }

    #[test]
    fn elements_have_no_corner_at_a_joint_that_is_turned_over() {
        let (nodes, edge_tangents) = rounded(2);
        let chords = quads(&plane(), &nodes, &EdgeTangents::default(), true).unwrap().0;
        let bent = quads(&plane(), &nodes, &edge_tangents, true).unwrap().0;
        assert!(folded(&chords, &edge_tangents) >= 1 && folded(&bent, &edge_tangents) == 0);
        // Without a node between the joints of a corner every division has such an element.
        let (nodes, edge_tangents) = rounded(1);
        assert!(quads(&plane(), &nodes, &edge_tangents, true).is_none());
    }

    #[test]
    fn triangles_at_joints_that_are_turned_over_are_opened_by_nodes_inside() {
        use crate::mapped::{MappedOptions, trimmed};
        let (nodes, edge_tangents) = rounded(1);
        let made = |edge_tangents: &EdgeTangents| {
            trimmed::triangulate(
                &plane(),
                std::slice::from_ref(&nodes),
                edge_tangents,
                &MappedOptions::default(),
            )
            .unwrap()
        };
        let (closed, open) = (made(&EdgeTangents::default()), made(&edge_tangents));
        assert!(folded(&closed, &edge_tangents) >= 2 && folded(&open, &edge_tangents) == 0);
        assert!((area(&open) - area(&closed)).abs() < 1e-12);
    }

    #[test]
    fn parameters_are_kept() {
        let work = quads(
            &plane(),
            &ring(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]),
            &EdgeTangents::default(),
            false,
        )
        .unwrap()
        .0;
        assert_eq!(work.nodes[2].uv, Vec2::new(work.nodes[1].uv.x, work.nodes[3].uv.y));
    }
}
