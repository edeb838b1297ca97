//! Draw-in: how far the border of a flat blank has moved inwards.
//!
//! A border has sides between its corners. The draw-in of a side is the component of the displacement along the inward
//! normal of that side of the blank; a corner belongs to both sides that meet there, and has a draw-in for each.

mod side;

use std::collections::BTreeMap;

pub use side::{BorderPoint, CORNER_MIN_DEG, Side, SidePoint};

use side::{Beyond, corners, sides};

use kanagata_geometry::{Vec2, Vec3};
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// Height of nodes of the blank over its size, above which it is not flat and has no draw-in.
const FLAT_REL: f64 = 1e-6;
/// Distance from a symmetry plane over the size of the blank, within which a node lies on it.
const ON_PLANE_REL: f64 = 1e-6;

/// A border of the blank: closed, or between symmetry planes. The outer one is the longest.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Border {
    /// The points in order, the first repeated at the end of a closed border. One with corners starts at a corner.
    pub points: Vec<BorderPoint>,
    /// Its sides between corners.
    pub sides: Vec<Side>,
}

impl Border {
    /// Length on the blank [mm].
    #[must_use]
    pub fn length_mm(&self) -> f64 {
        self.points.last().map_or(0.0, |point| point.arc_mm)
    }

    /// Smallest and largest draw-in of all sides, each with the index of its side; `None` without sides.
    #[must_use]
    pub fn extremes(&self) -> Option<[(usize, SidePoint); 2]> {
        let all = self.sides.iter().enumerate();
        let all: Vec<_> = all.filter_map(|(k, side)| Some((k, side.extremes()?))).collect();
        let least = all.iter().map(|&(k, [least, _])| (k, least));
        let most = all.iter().map(|&(k, [_, most])| (k, most));
        Some([
            least.reduce(|a, b| if b.1.draw_in < a.1.draw_in { b } else { a })?,
            most.reduce(|a, b| if b.1.draw_in > a.1.draw_in { b } else { a })?,
        ])
    }

    /// The point that has moved farthest in plan, the first of equal ones. Its displacement is at least the draw-in of any
    /// side in magnitude, and equal to it where a side moves along its normal.
    #[must_use]
    pub fn farthest_moved(&self) -> Option<BorderPoint> {
        let moved = |p: &BorderPoint| (p.now - p.initial).norm();
        self.points.iter().copied().reduce(|a, b| if moved(&b) > moved(&a) { b } else { a })
    }
}

/// The borders of a blank normal to z, the longest first. Sides on symmetry planes (axis, coordinate [mm]) are no
/// borders. Empty for a blank that is not flat.
#[must_use]
pub fn borders(mesh: &HexMesh, positions: &[Vec3], symmetry: &[(usize, f64)]) -> Vec<Border> {
    let top = mesh.top_nodes();
    let initial: Vec<Vec3> = top.iter().map(|&n| mesh.nodes[n as usize]).collect();
    let bounds = kanagata_geometry::Aabb::of_points(&initial);
    let size = bounds.diagonal();
    if initial.is_empty() || bounds.max.z - bounds.min.z > FLAT_REL * size {
        return Vec::new();
    }
    let on_plane = |a: usize, b: usize| {
        symmetry.iter().any(|&(axis, at)| {
            [a, b].iter().all(|&k| (initial[k][axis] - at).abs() <= ON_PLANE_REL * size)
        })
    };
    let mut next = next_on_border(mesh);
    next.retain(|&a, &mut b| !on_plane(a, b));
    let mirrored = |end: usize, neighbour: usize| {
        let on = |(axis, at): &&(usize, f64)| {
            *axis < 2 && (initial[end][*axis] - at).abs() <= ON_PLANE_REL * size
        };
        let &(axis, at) = symmetry.iter().find(on)?;
        let mut image = initial[neighbour].xy();
        image[axis] = 2.0 * at - image[axis];
        Some(image)
    };
    let mut found: Vec<Border> = Vec::new();
    for chain in chains(&next) {
        let last = chain.len() - 1;
        let closed = chain[0] == chain[last];
        let ends = [mirrored(chain[0], chain[1]), mirrored(chain[last], chain[last - 1])];
        let chain = if closed { from_corner(chain, &initial) } else { chain };
        let around = [chain[last - 1], chain[1]].map(|k| Some(initial[k].xy()));
        let now = |k: usize| positions[top[k] as usize].xy();
        let points = points(&chain, &|k| initial[k].xy(), &now);
        found.push(Border { sides: sides(&points, if closed { around } else { ends }), points });
    }
    found.sort_by(|a, b| b.length_mm().total_cmp(&a.length_mm()));
    found
}

/// A closed chain from its first corner on; as it is without corners.
fn from_corner(mut chain: Vec<usize>, initial: &[Vec3]) -> Vec<usize> {
    chain.pop();
    let plan: Vec<Vec2> = chain.iter().map(|&k| initial[k].xy()).collect();
    let beyond: Beyond = [plan.last().copied(), plan.first().copied()];
    chain.rotate_left(corners(&plan, beyond).first().copied().unwrap_or(0));
    chain.push(chain[0]);
    chain
}

/// The next column on the border, counter-clockwise around the sheet.
fn next_on_border(mesh: &HexMesh) -> BTreeMap<usize, usize> {
    let mut sides = BTreeMap::new();
    for polygon in mesh.upper_polygons() {
        for k in 0..polygon.len() {
            let [a, b] = [polygon[k], polygon[(k + 1) % polygon.len()]];
            if a != b && sides.remove(&(b, a)).is_none() {
                sides.insert((a, b), ());
            }
        }
    }
    sides.into_keys().collect()
}

/// Chains of columns; the first column of a closed one is repeated at its end.
fn chains(next: &BTreeMap<usize, usize>) -> Vec<Vec<usize>> {
    let mut left = next.clone();
    let mut out = Vec::new();
    let inner: std::collections::BTreeSet<usize> = next.values().copied().collect();
    let open = next.keys().copied().filter(|k| !inner.contains(k));
    let starts: Vec<usize> = open.chain(next.keys().copied()).collect();
    for start in starts {
        let mut chain = vec![start];
        while let Some(to) = left.remove(&chain[chain.len() - 1]) {
            chain.push(to);
        }
        if chain.len() > 1 {
            out.push(chain);
        }
    }
    out
}

/// The points of a chain of columns.
fn points(
    chain: &[usize],
    plan: &impl Fn(usize) -> Vec2,
    now: &impl Fn(usize) -> Vec2,
) -> Vec<BorderPoint> {
    let mut arc_mm = 0.0;
    let mut before = chain[0];
    let point = |&k: &usize| {
        arc_mm += (plan(k) - plan(before)).norm();
        before = k;
        BorderPoint { arc_mm, initial: plan(k), now: now(k) }
    };
    chain.iter().map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_solver::sheet::hex_mesh::{disc, rectangle, thickened};
    use kanagata_solver::sheet::refine::{Refinement, plan_elements};

    /// Draw-in of each side: smallest and largest.
    fn by_side(border: &Border) -> Vec<[f64; 2]> {
        let of = |side: &Side| side.extremes().unwrap().map(|point| point.draw_in);
        border.sides.iter().map(of).collect()
    }

    /// A rectangle whose sides move by known and different lengths: each side has one draw-in, its corners included.
    #[test]
    fn each_side_of_a_rectangle_is_drawn_in_along_its_own_normal() {
        let mesh = rectangle(10.0, 4.0, 1.0, 5, 2, 2);
        let moved: Vec<Vec3> = mesh
            .nodes
            .iter()
            .map(|x| x + Vec3::new(0.2 - 0.07 * x.x, -0.1 + 0.01 * x.y, 3.0))
            .collect();
        let found = borders(&mesh, &moved, &[]);
        assert_eq!((found.len(), found[0].points.len(), found[0].sides.len()), (1, 15, 4));
        assert!((found[0].length_mm() - 28.0).abs() < 1e-12);
        // Lower, right, upper and left side: inward is up, left, down and right.
        for ([least, most], expected) in by_side(&found[0]).iter().zip([-0.1, 0.5, 0.06, 0.2]) {
            assert!((least - expected).abs() < 1e-12 && (most - expected).abs() < 1e-12, "{least}");
        }
        let [(from, least), (to, most)] = found[0].extremes().unwrap();
        assert_eq!((from, to), (0, 1));
        assert!((least.draw_in + 0.1).abs() < 1e-12 && (most.draw_in - 0.5).abs() < 1e-12);
        let far = found[0].farthest_moved().unwrap();
        assert!(((far.now - far.initial).norm() - 0.5_f64.hypot(0.1)).abs() < 1e-12);
    }

    /// A strip of one element across, whose nodes are all at corners: its end moves by 9.15 mm.
    #[test]
    fn the_end_of_a_strip_of_one_element_is_drawn_in_by_its_displacement() {
        let mesh = rectangle(60.0, 2.0, 1.0, 1, 1, 1);
        let end = |x: &Vec3| if x.x > 1.0 { x - Vec3::x() * 9.15 } else { *x };
        let moved: Vec<Vec3> = mesh.nodes.iter().map(end).collect();
        for planes in [&[][..], &[(0, 0.0), (1, 0.0)]] {
            let found = borders(&mesh, &moved, planes);
            let [_, (_, most)] = found[0].extremes().unwrap();
            assert!((most.draw_in - 9.15).abs() < 1e-12, "{most:?}");
            assert_eq!(most.point.initial.x, 60.0);
            let far = found[0].farthest_moved().unwrap();
            assert!(((far.now - far.initial).norm() - most.draw_in).abs() < 1e-12);
        }
    }

    /// A disc that shrinks by 10 %, whole and as a quarter between symmetry planes, with unequal elements on its rim.
    #[test]
    fn a_disc_is_drawn_in_along_its_radius_at_every_node() {
        let (points, quads) = disc(20.0, 8, 6);
        let whole = thickened(&points, &quads, 1.0, 1);
        let kept = |e: &&[u32; 8]| {
            e.iter().all(|&n| whole.nodes[n as usize].xy().iter().all(|x| *x > -1e-9))
        };
        let quarter = HexMesh {
            elements: whole.elements.iter().filter(kept).copied().collect(),
            ..whole.clone()
        };
        for (mesh, planes) in [(&whole, &[][..]), (&quarter, &[(0, 0.0), (1, 0.0)])] {
            let moved: Vec<Vec3> = mesh.nodes.iter().map(|x| x * 0.9).collect();
            let found = borders(mesh, &moved, planes);
            assert_eq!((found.len(), found[0].sides.len()), (1, 1));
            let [least, most] = by_side(&found[0])[0];
            assert!((least - 2.0).abs() < 1e-12 && (most - 2.0).abs() < 1e-12, "{least} {most}");
        }
    }

    /// An eighth of a ring with two arcs and two straight sides, which shrinks towards its centre.
    #[test]
    fn a_free_outline_has_sides_between_its_corners() {
        let mut mesh = rectangle(5.0, 1.0, 1.0, 3, 8, 1);
        for x in &mut mesh.nodes {
            let (radius, angle) = (5.0 + x.x, x.y * std::f64::consts::FRAC_PI_4);
            (x.x, x.y) = (radius * angle.cos(), radius * angle.sin());
        }
        let moved: Vec<Vec3> = mesh.nodes.iter().map(|x| x * 0.9).collect();
        let found = borders(&mesh, &moved, &[]);
        assert_eq!(found[0].sides.len(), 4);
        // The straight side along x, the outer arc, the other straight side, the inner arc.
        for ([least, most], expected) in by_side(&found[0]).iter().zip([0.0, 1.0, 0.0, -0.5]) {
            assert!((least - expected).abs() < 1e-12 && (most - expected).abs() < 1e-12, "{least}");
        }
    }

    #[test]
    fn sides_on_symmetry_planes_are_no_borders_and_a_bent_blank_has_none() {
        let mesh = rectangle(10.0, 4.0, 1.0, 5, 2, 1);
        let moved: Vec<Vec3> = mesh.nodes.iter().map(|x| x - Vec3::x() * 0.3).collect();
        let found = borders(&mesh, &moved, &[(0, 0.0), (1, 0.0)]);
        assert_eq!((found.len(), found[0].points.len(), found[0].sides.len()), (1, 8, 2));
        assert_eq!(found[0].points[0].initial, Vec2::new(10.0, 0.0));
        let sides = by_side(&found[0]);
        assert!(sides[0].iter().all(|d| (d - 0.3).abs() < 1e-12), "{sides:?}");
        assert!(sides[1].iter().all(|d| d.abs() < 1e-12), "{sides:?}");
        let mut bent = mesh.clone();
        bent.nodes.iter_mut().for_each(|x| x.z += 0.1 * x.x);
        assert!(borders(&bent, &moved, &[]).is_empty());
    }

    #[test]
    fn sides_beside_hanging_nodes_are_no_borders() {
        let base = rectangle(6.0, 6.0, 1.0, 3, 3, 1);
        let levels = vec![2, 0, 0, 0, 1, 0, 0, 0, 0];
        let mesh = Refinement::balanced(plan_elements(&base), levels).mesh(&base, None);
        assert!(!mesh.hanging.is_empty());
        let found = borders(&mesh, &mesh.nodes.clone(), &[]);
        assert_eq!((found.len(), found[0].sides.len()), (1, 4));
        assert!((found[0].length_mm() - 24.0).abs() < 1e-12);
    }

    #[test]
    fn a_hole_is_a_border_of_its_own() {
        let mut mesh = rectangle(6.0, 6.0, 1.0, 3, 3, 1);
        mesh.elements.remove(4);
        let found = borders(&mesh, &mesh.nodes.clone(), &[]);
        let lengths: Vec<f64> = found.iter().map(Border::length_mm).collect();
        assert_eq!(lengths, [24.0, 8.0]);
        assert_eq!(found[1].sides.len(), 4);
    }
}
