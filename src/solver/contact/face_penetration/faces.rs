//! Element faces that a tool may touch, and the depth of a point behind them.

use std::collections::HashMap;

use crate::numbers::tolerances::ROUNDING_REL;
use crate::sheet::hex_mesh::HexMesh;
use crate::tools::tool::SheetSide;
use kanagata_geometry::box_tree::BoxTree;
use kanagata_geometry::{Aabb, Vec3};

/// Local nodes of the faces of an element, counter-clockwise seen from outside.
const FACES: [[usize; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

/// A face: its element, its nodes, counter-clockwise seen from outside, and which of its sides are on the free border.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Face {
    pub(crate) element: u32,
    nodes: [u32; 4],
    border: [bool; 4],
}

impl Face {
    /// Corners of the face with nodes at `x` [mm].
    pub(crate) fn corners(&self, x: &[Vec3]) -> [Vec3; 4] {
        self.nodes.map(|n| x[n as usize])
    }
}

/// Outer faces of a mesh on one side of the sheet; all outer faces of a mesh without columns.
pub(crate) fn faces_of(mesh: &HexMesh, side: SheetSide) -> Vec<Face> {
    let levels = mesh.nodes_per_column;
    let of_element = |(k, e): (usize, &[u32; 8])| FACES.map(|face| (k as u32, face.map(|k| e[k])));
    let mut all: Vec<(u32, [u32; 4])> =
        mesh.elements.iter().enumerate().flat_map(of_element).collect();
    if levels > 1 {
        let on = |level: usize| move |f: &[u32; 4]| f.iter().all(|n| *n as usize % levels == level);
        let (low, high) = (on(0), on(levels - 1));
        all.retain(|(_, face)| match side {
            SheetSide::Top => high(face),
            SheetSide::Bottom => low(face),
            SheetSide::Both => low(face) || high(face),
        });
    } else {
        let key = |face: &[u32; 4]| {
            let mut nodes = *face;
            nodes.sort_unstable();
            nodes
        };
        let mut uses: HashMap<[u32; 4], usize> = HashMap::new();
        all.iter().for_each(|(_, face)| *uses.entry(key(face)).or_default() += 1);
        all.retain(|(_, face)| uses[&key(face)] == 1);
    }
    let side_of = |a: u32, b: u32| [a.min(b), a.max(b)];
    let mut sides: HashMap<[u32; 2], usize> = HashMap::new();
    for (_, f) in &all {
        (0..4).for_each(|k| *sides.entry(side_of(f[k], f[(k + 1) % 4])).or_default() += 1);
    }
    // Sides of elements on both sides of a hanging node are not on the border.
    for (node, [a, b]) in mesh.hanging_nodes().map(|(n, m)| (n as u32, m.map(|m| m as u32))) {
        for side in [side_of(node, a), side_of(node, b), side_of(a, b)] {
            sides.entry(side).and_modify(|uses| *uses += 1);
        }
    }
    let border = |f: &[u32; 4]| [0, 1, 2, 3].map(|k| sides[&side_of(f[k], f[(k + 1) % 4])] == 1);
    all.iter()
        .map(|(element, f)| Face { element: *element, nodes: *f, border: border(f) })
        .collect()
}

/// Faces in the current configuration.
pub(crate) struct Faces<'a> {
    faces: &'a [Face],
    corners: Vec<[Vec3; 4]>,
    tree: BoxTree,
    bounds: Aabb,
}

/// Closest point of the faces: a face, squared distance [mm²], sum of the normals of the faces that share it, and
/// whether it lies on the free border.
struct Nearest {
    face: usize,
    square: f64,
    foot: Vec3,
    normal: Vec3,
    border: bool,
}

impl<'a> Faces<'a> {
    pub(crate) fn new(faces: &'a [Face], x: &[Vec3]) -> Self {
        let corners: Vec<[Vec3; 4]> = faces.iter().map(|face| face.corners(x)).collect();
        let boxes: Vec<Aabb> = corners.iter().map(Aabb::of_points).collect();
        let bounds = boxes.iter().fold(Aabb::EMPTY, |sum, b| sum.union(b));
        Self { faces, corners, tree: BoxTree::build(&boxes), bounds }
    }

    pub(crate) fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Depth [mm] of a point of a tool with outward normal `normal` behind the closest face, up to `reach`, and the element
    /// of the face. `None` in front of the face, beside the sheet, and where both normals point in the same direction.
    pub(crate) fn depth(&self, p: &Vec3, normal: &Vec3, reach: f64) -> Option<(f64, u32)> {
        let mut best = Nearest {
            face: 0,
            square: reach * reach,
            foot: Vec3::zeros(),
            normal: Vec3::zeros(),
            border: false,
        };
        self.tree.nearest(p, reach * reach, |k, _| {
            self.update_closest(k as usize, p, &mut best);
            best.square * (1.0 + ROUNDING_REL)
        });
        let out = best.normal.try_normalize(0.0)?;
        let offset = best.foot - p;
        let depth = offset.norm();
        // A point whose foot is on the free border lies beside the sheet, unless it is exactly behind the border.
        let behind = if best.border { 1.0 - ROUNDING_REL } else { 0.0 };
        let inside = normal.dot(&out) < 0.0 && offset.dot(&out) > behind * depth;
        inside.then(|| (depth, self.faces[best.face].element))
    }

    /// Replaces the best point by that of face `k` if it is closer; adds the normal if both points coincide.
    fn update_closest(&self, k: usize, p: &Vec3, best: &mut Nearest) {
        let corners = &self.corners[k];
        let (foot, at) = closest(corners, p);
        let square = (foot - p).norm_squared();
        let length = (corners[2] - corners[0]).norm();
        let same = ROUNDING_REL * length * (length + best.square.sqrt());
        if square > best.square + same {
            return;
        }
        let normal = normal(corners, at).try_normalize(0.0).unwrap_or_default();
        let border = self.is_on_border(k, at);
        let shared =
            best.normal != Vec3::zeros() && (foot - best.foot).norm() <= ROUNDING_REL * length;
        if shared {
            best.normal += normal;
            best.border &= border;
            best.square = best.square.min(square);
        } else if square < best.square {
            *best = Nearest { face: k, square, foot, normal, border };
        }
    }

    fn is_on_border(&self, k: usize, [u, v]: [f64; 2]) -> bool {
        let on = [v == 0.0, u == 1.0, v == 1.0, u == 0.0];
        (0..4).any(|side| on[side] && self.faces[k].border[side])
    }
}

/// Bilinear shape functions at `(u, v)` of the unit square.
fn weights([u, v]: [f64; 2]) -> [f64; 4] {
    [(1.0 - u) * (1.0 - v), u * (1.0 - v), u * v, (1.0 - u) * v]
}

fn point(corners: &[Vec3; 4], at: [f64; 2]) -> Vec3 {
    corners.iter().zip(weights(at)).map(|(x, w)| x * w).sum()
}

fn tangents(c: &[Vec3; 4], [u, v]: [f64; 2]) -> [Vec3; 2] {
    [(c[1] - c[0]) * (1.0 - v) + (c[2] - c[3]) * v, (c[3] - c[0]) * (1.0 - u) + (c[2] - c[1]) * u]
}

/// Normal of a bilinear surface, not normalised.
fn normal(corners: &[Vec3; 4], at: [f64; 2]) -> Vec3 {
    let [a, b] = tangents(corners, at);
    a.cross(&b)
}

/// Closest point of a bilinear surface and its parameters in the unit square. Gauss-Newton steps from the centre, each
/// followed by exact minimisation along both parameters, in which the surface is linear, until the distance no longer
/// decreases.
fn closest(corners: &[Vec3; 4], p: &Vec3) -> (Vec3, [f64; 2]) {
    let square = |at: [f64; 2]| (p - point(corners, at)).norm_squared();
    let along_both = |from: [f64; 2]| {
        [0, 1].into_iter().fold(from, |mut at, axis| {
            at[axis] = minimise_along(corners, p, at, axis);
            at
        })
    };
    let mut at = [0.5, 0.5];
    let mut least = square(at);
    loop {
        // A Gauss-Newton step may overshoot on a warped face; minimisation alone cannot.
        let trials = [gauss_newton(corners, p, at), at].map(along_both);
        let Some(next) = trials.into_iter().find(|next| square(*next) < least) else { break };
        (at, least) = (next, square(next));
    }
    (point(corners, at), at)
}

/// Parameters after a Gauss-Newton step, within the unit square; unchanged where the surface is degenerate.
fn gauss_newton(corners: &[Vec3; 4], p: &Vec3, at: [f64; 2]) -> [f64; 2] {
    let r = p - point(corners, at);
    let [a, b] = tangents(corners, at);
    let (aa, ab, bb) = (a.dot(&a), a.dot(&b), b.dot(&b));
    let (ra, rb) = (r.dot(&a), r.dot(&b));
    let det = aa * bb - ab * ab;
    if det <= 1e-12 * aa * bb {
        return at;
    }
    let step = [(bb * ra - ab * rb) / det, (aa * rb - ab * ra) / det];
    [0, 1].map(|k| (at[k] + step[k]).clamp(0.0, 1.0))
}

/// Minimiser of the distance along one parameter with the other fixed.
fn minimise_along(corners: &[Vec3; 4], p: &Vec3, at: [f64; 2], axis: usize) -> f64 {
    let mut from = at;
    from[axis] = 0.0;
    let tangent = tangents(corners, at)[axis];
    let square = tangent.norm_squared();
    if square == 0.0 {
        return at[axis];
    }
    ((p - point(corners, from)).dot(&tangent) / square).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sheet::hex_mesh::rectangle;

    #[test]
    fn the_closest_point_of_a_warped_face_is_no_farther_than_any_sample() {
        let corners = [
            Vec3::new(0.0, 0.0, 0.0),
            Vec3::new(3.0, 0.5, 0.4),
            Vec3::new(3.5, 2.0, -0.3),
            Vec3::new(0.6, 2.5, 0.5),
        ];
        for k in 0..60_u32 {
            let f = |m: u32| f64::from(k.wrapping_mul(m) % 61) / 61.0;
            let p = Vec3::new(5.0 * f(7) - 1.0, 4.0 * f(11) - 1.0, 1.2 * f(29) - 0.6);
            let (foot, _) = closest(&corners, &p);
            let grid = (0..=200).flat_map(|i| (0..=200).map(move |j| [i, j]));
            let least = grid
                .map(|at| (point(&corners, at.map(|i| f64::from(i) / 200.0)) - p).norm())
                .fold(f64::INFINITY, f64::min);
            let found = (foot - p).norm();
            assert!(found < least + 1e-6, "{p:?}: {found} {least}");
        }
    }

    #[test]
    fn depth_is_measured_behind_the_face_and_not_beside_the_sheet() {
        let mesh = rectangle(8.0, 6.0, 1.0, 4, 3, 2);
        let all = faces_of(&mesh, SheetSide::Top);
        assert_eq!(all.len(), 12);
        assert_eq!(faces_of(&mesh, SheetSide::Both).len(), 24);
        let faces = Faces::new(&all, &mesh.nodes);
        let found = |x: f64, y: f64, z: f64| faces.depth(&Vec3::new(x, y, z), &-Vec3::z(), 2.0);
        let depth = |x: f64, y: f64, z: f64| found(x, y, z).map_or(0.0, |(depth, _)| depth);
        // The second of four elements along x, the second along y, in the upper of two layers.
        let element = &mesh.elements[found(3.1, 2.7, 0.7).unwrap().1 as usize];
        let centre: Vec3 = element.iter().map(|node| mesh.nodes[*node as usize] / 8.0).sum();
        assert!((centre - Vec3::new(3.0, 3.0, 0.75)).norm() < 1e-12, "{centre}");
        // Inside a face, on a common side and corner, at the border, beside it, in front, out of range.
        for (x, y, z, expected) in [
            (3.1, 2.7, 0.7, 0.3),
            (4.0, 2.7, 0.4, 0.6),
            (4.0, 2.0, 0.9, 0.1),
            (0.0, 3.0, 0.8, 0.2),
            (-0.01, 3.0, 0.8, 0.0),
            (3.0, 3.0, 1.2, 0.0),
            (3.0, 3.0, -1.5, 0.0),
        ] {
            assert!((depth(x, y, z) - expected).abs() < 1e-12, "{x} {y} {z}");
        }
        // Back of a tool.
        assert_eq!(faces.depth(&Vec3::new(3.0, 3.0, 0.5), &Vec3::z(), 2.0), None);
    }
}
