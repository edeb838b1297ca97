//! Joins the loops of a flat face with holes to one ring by bridges traversed in both directions. Division of the ring
//! without interior nodes then needs few elements.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::patchwork::Node;
use kanagata_cad::model::Face;
use kanagata_geometry::{Vec2, Vec3};

/// Maximum number of nodes on all loops; larger faces are triangulated. Doubled: 16 times the longest division.
const NODES_MAX: usize = 96;
/// Distance of a node from a bridge relative to its length below which the node lies on it.
const ON_BRIDGE_TOLERANCE_REL: f64 = 1e-3;

/// A node of the ring with its coordinates in the plane of the face.
#[derive(Clone, Copy)]
struct Place {
    node: Node,
    at: Vec2,
    /// A bridge ends here, so that the corner is split.
    bridged: bool,
}

/// The ring over all loops, outer loop first; `None` where loops touch or intersect, or have too many nodes.
pub fn one_ring(face: &Face, loops: &[Vec<Node>]) -> Option<Vec<Node>> {
    let count: usize = loops.iter().map(Vec::len).sum();
    let outer = loops.first()?.first()?;
    if count > NODES_MAX || loops.iter().any(|l| l.len() < 2) {
        return None;
    }
    let [x, y] = axes(&face.surface.normal(outer.uv)?)?;
    let place = |node: &Node| {
        let p = node.point - outer.point;
        Place { node: *node, at: Vec2::new(p.dot(&x), p.dot(&y)), bridged: false }
    };
    let mut rings: Vec<Vec<Place>> = loops.iter().map(|l| l.iter().map(place).collect()).collect();
    if meet(&rings) {
        return None;
    }
    while rings.len() > 1 {
        let [h, a, b] = shortest_bridge(&rings)?;
        let mut hole = rings.remove(h);
        let ring = &mut rings[0];
        (ring[a].bridged, hole[b].bridged) = (true, true);
        hole.rotate_left(b);
        hole.push(hole[0]);
        hole.push(ring[a]);
        ring.splice(a + 1..a + 1, hole);
    }
    Some(rings[0].iter().map(|p| p.node).collect())
}

/// Two unit vectors normal to `normal`, counter-clockwise about it.
fn axes(normal: &Vec3) -> Option<[Vec3; 2]> {
    let x = normal.cross(&Vec3::ith(normal.iamin(), 1.0)).try_normalize(0.0)?;
    Some([x, normal.cross(&x)])
}

fn sides(ring: &[Place]) -> impl Iterator<Item = [Place; 2]> + '_ {
    (0..ring.len()).map(|k| [ring[k], ring[(k + 1) % ring.len()]])
}

/// True when loops have a common node or intersecting chords.
fn meet(rings: &[Vec<Place>]) -> bool {
    let other = |k: usize| rings[k + 1..].iter().flat_map(|r| sides(r));
    let crossed =
        |k: usize, s: &[Place; 2]| other(k).any(|o| o[0].node.same(&s[0].node) || cross(s, &o));
    (0..rings.len()).any(|k| sides(&rings[k]).any(|s| crossed(k, &s)))
}

/// True when two segments without a common end intersect.
fn cross([a, b]: &[Place; 2], [c, d]: &[Place; 2]) -> bool {
    let side = |p: &Place, q: &Place, r: &Place| (q.at - p.at).perp(&(r.at - p.at));
    side(a, b, c) * side(a, b, d) <= 0.0 && side(c, d, a) * side(c, d, b) <= 0.0
}

/// The shortest bridge: hole, index on the first ring, index on the hole.
fn shortest_bridge(rings: &[Vec<Place>]) -> Option<[usize; 3]> {
    // Lengths are not negative, so that their bits are in their order.
    let mut candidates: Vec<Reverse<(u64, [usize; 3])>> = Vec::new();
    for (h, hole) in rings.iter().enumerate().skip(1) {
        for (a, from) in rings[0].iter().enumerate().filter(|p| !p.1.bridged) {
            let candidate =
                |(b, to): (usize, &Place)| Reverse(((to.at - from.at).norm().to_bits(), [h, a, b]));
            candidates.extend(hole.iter().enumerate().map(candidate));
        }
    }
    // Nearly always one of the first is free: the others are not sorted.
    let mut candidates = BinaryHeap::from(candidates);
    let free = |&[h, a, b]: &[usize; 3]| is_free(rings, &[rings[0][a], rings[h][b]]);
    std::iter::from_fn(|| candidates.pop().map(|Reverse((_, ends))| ends)).find(free)
}

/// True when a bridge crosses no chord and passes through no node.
fn is_free(rings: &[Vec<Place>], bridge: &[Place; 2]) -> bool {
    let is_end = |p: &Place| bridge.iter().any(|end| end.node.same(&p.node));
    let direction = bridge[1].at - bridge[0].at;
    let length = direction.norm();
    let on = |p: &Place| {
        let from = p.at - bridge[0].at;
        let along = from.dot(&direction) / length;
        along > 0.0
            && along < length
            && direction.perp(&from).abs() <= ON_BRIDGE_TOLERANCE_REL * length * length
    };
    rings.iter().all(|ring| {
        ring.iter().all(|p| is_end(p) || !on(p))
            && sides(ring).all(|s| s.iter().any(is_end) || !cross(bridge, &s))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mapped::edge_tangents::EdgeTangents;
    use crate::mapped::polygon::quads;
    use crate::mapped::polygon::tests::plane;

    /// Nodes of a regular polygon, numbered from `first`, clockwise for negative `turn`.
    fn polygon(centre: [f64; 2], radius: f64, count: u32, turn: f64, first: u32) -> Vec<Node> {
        let node = |k: u32| {
            let a = turn * (0.4 + f64::from(k) / f64::from(count) * std::f64::consts::TAU);
            let p = Vec3::new(centre[0] + radius * a.cos(), centre[1] + radius * a.sin(), 0.0);
            let (uv, _) = plane().surface.closest(&p);
            Node { uv, point: p, id: Some(first + k) }
        };
        (0..count).map(node).collect()
    }

    #[test]
    fn a_flat_with_holes_is_cut_between_its_nodes() {
        let outer = polygon([0.0, 0.0], 8.0, 4, 1.0, 0);
        let holes = [polygon([1.0, 1.0], 1.5, 6, -1.0, 4), polygon([-2.0, -1.0], 1.0, 6, -1.0, 10)];
        let ring = one_ring(&plane(), &[outer, holes[0].clone(), holes[1].clone()]).unwrap();
        // Two additional nodes per bridge.
        assert_eq!(ring.len(), 16 + 4);
        let work = quads(&plane(), &ring, &EdgeTangents::default(), true).unwrap().0;
        // 18 triangles, most of them recombined.
        assert!(work.elements.len() <= 11, "{}", work.elements.len());
        let half = |p: [Vec3; 3]| 0.5 * (p[1] - p[0]).cross(&(p[2] - p[0])).z;
        let of = |e: &crate::Element| -> f64 {
            let p: Vec<Vec3> = e.nodes().iter().map(|&n| work.nodes[n as usize].point).collect();
            (2..p.len()).map(|k| half([p[0], p[k - 1], p[k]])).sum()
        };
        let area: f64 = work.elements.iter().map(of).sum();
        let hexagon = |r: f64| 1.5 * 3.0_f64.sqrt() * r * r;
        assert!((area - (128.0 - hexagon(1.5) - hexagon(1.0))).abs() < 1e-9, "{area}");
    }

    #[test]
    fn loops_that_touch_or_cross_are_no_ring() {
        let outer = polygon([0.0, 0.0], 8.0, 4, 1.0, 0);
        let mut hole = polygon([0.0, 0.0], 2.0, 5, -1.0, 4);
        hole[0] = outer[0];
        assert!(one_ring(&plane(), &[outer.clone(), hole]).is_none());
        let across = polygon([6.0, 6.0], 4.0, 5, -1.0, 4);
        assert!(one_ring(&plane(), &[outer, across]).is_none());
    }
}
