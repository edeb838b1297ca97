//! Draw-in: how far the border of a flat blank has moved inwards.

use std::collections::BTreeMap;

use crate::geometry::{Vec2, Vec3};
use crate::solver::sheet::hex_mesh::HexMesh;

/// Height of nodes of the blank over its size, above which it is not flat and has no draw-in.
const FLAT_REL: f64 = 1e-6;
/// Distance from a symmetry plane over the size of the blank, within which a node lies on it.
const ON_PLANE_REL: f64 = 1e-6;

/// A point of the border.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BorderPoint {
    /// Length along the border of the blank from the first point [mm].
    pub arc_mm: f64,
    /// Position on the blank [mm].
    pub initial: Vec2,
    /// Current position in plan [mm].
    pub now: Vec2,
    /// Component of the displacement along the inward normal of the blank's border [mm]; negative where the border moves
    /// outwards.
    pub draw_in: f64,
}

/// A border of the blank: closed, or between symmetry planes. The outer one is the longest.
pub type Border = Vec<BorderPoint>;

/// The borders of a blank normal to z, the longest first. Sides on symmetry planes (axis, coordinate [mm]) are no
/// borders. Empty for a blank that is not flat.
#[must_use]
pub fn borders(mesh: &HexMesh, positions: &[Vec3], symmetry: &[(usize, f64)]) -> Vec<Border> {
    let top = mesh.top_nodes();
    let initial: Vec<Vec3> = top.iter().map(|&n| mesh.nodes[n as usize]).collect();
    let bounds = crate::geometry::Aabb::of_points(&initial);
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
    let plan = |k: usize| Vec2::new(initial[k].x, initial[k].y);
    let now = |k: usize| {
        let at = positions[top[k] as usize];
        Vec2::new(at.x, at.y)
    };
    let mut found: Vec<Border> =
        chains(&next).iter().map(|chain| border(chain, &plan, &now)).collect();
    let length = |border: &Border| border.last().map_or(0.0, |point| point.arc_mm);
    found.sort_by(|a, b| length(b).total_cmp(&length(a)));
    found
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

fn border(chain: &[usize], plan: &impl Fn(usize) -> Vec2, now: &impl Fn(usize) -> Vec2) -> Border {
    let closed = chain.first() == chain.last();
    let last = chain.len() - 1;
    let mut arc_mm = 0.0;
    let point = |k: usize| {
        let before = if k > 0 {
            k - 1
        } else if closed {
            last - 1
        } else {
            0
        };
        let after = if k < last {
            k + 1
        } else if closed {
            1
        } else {
            last
        };
        let initial = plan(chain[k]);
        if k > 0 {
            arc_mm += (initial - plan(chain[k - 1])).norm();
        }
        // Mean of the normals of both sides, to the left of a counter-clockwise border.
        let normal = |a: usize, b: usize| {
            let along = plan(chain[b]) - plan(chain[a]);
            Vec2::new(-along.y, along.x).try_normalize(0.0).unwrap_or_default()
        };
        let inward = (normal(before, k) + normal(k, after)).try_normalize(0.0).unwrap_or_default();
        let draw_in = (now(chain[k]) - initial).dot(&inward);
        BorderPoint { arc_mm, initial, now: now(chain[k]), draw_in }
    };
    (0..chain.len()).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::sheet::hex_mesh::rectangle;
    use crate::solver::sheet::refine::{Refinement, plan_elements};

    /// A square that shrinks about its middle by 10 %: every side moves inwards by 5 % of its length, corners by
    /// sqrt(2) times that.
    #[test]
    fn a_border_that_shrinks_is_drawn_in_along_its_normals() {
        let mesh = rectangle(10.0, 10.0, 1.0, 5, 5, 2);
        let middle = Vec3::new(5.0, 5.0, 0.0);
        let moved: Vec<Vec3> = mesh.nodes.iter().map(|x| middle + (x - middle) * 0.9).collect();
        let found = borders(&mesh, &moved, &[]);
        assert_eq!((found.len(), found[0].len()), (1, 21));
        assert!((found[0].last().unwrap().arc_mm - 40.0).abs() < 1e-12);
        for point in &found[0] {
            let corner =
                [point.initial.x, point.initial.y].iter().all(|x| *x < 1e-9 || *x > 10.0 - 1e-9);
            let expected = if corner { 0.5 * 2.0_f64.sqrt() } else { 0.5 };
            assert!((point.draw_in - expected).abs() < 1e-12, "{point:?}");
        }
    }

    #[test]
    fn sides_on_symmetry_planes_are_no_borders_and_a_bent_blank_has_none() {
        let mesh = rectangle(10.0, 4.0, 1.0, 5, 2, 1);
        let moved: Vec<Vec3> = mesh.nodes.iter().map(|x| x - Vec3::x() * 0.3).collect();
        let found = borders(&mesh, &moved, &[(0, 0.0), (1, 0.0)]);
        assert_eq!((found.len(), found[0].len()), (1, 8));
        assert_eq!(found[0][0].initial, Vec2::new(10.0, 0.0));
        assert!((found[0][1].draw_in - 0.3).abs() < 1e-12);
        assert!((found[0][6].draw_in).abs() < 1e-12);
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
        assert_eq!(found.len(), 1);
        assert!((found[0].last().unwrap().arc_mm - 24.0).abs() < 1e-12);
    }

    #[test]
    fn a_hole_is_a_border_of_its_own() {
        let mut mesh = rectangle(6.0, 6.0, 1.0, 3, 3, 1);
        mesh.elements.remove(4);
        let found = borders(&mesh, &mesh.nodes.clone(), &[]);
        let lengths: Vec<f64> = found.iter().map(|b| b.last().unwrap().arc_mm).collect();
        assert_eq!(lengths, [24.0, 8.0]);
    }
}
