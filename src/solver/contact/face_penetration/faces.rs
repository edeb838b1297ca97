//! Faces of the elements that a tool may touch, and the depth of a point behind them.

use std::collections::HashMap;

use crate::geometry::box_tree::BoxTree;
use crate::geometry::{Aabb, Vec3};
use crate::solver::sheet::hex_mesh::HexMesh;
use crate::solver::tools::tool::SheetSide;

/// Local nodes of the faces of an element, counter-clockwise seen from outside.
const FACES: [[usize; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
/// Distances that are the same, over the length of a face: feet on a common side of two faces.
const SAME_FOOT_REL: f64 = 1e-9;
/// Cosine between a point's offset and the face's normal below which the point lies beside the face, not behind it.
const BEHIND_COS: f64 = 0.5;
/// The same over the free border of the faces, where all that is not straight behind lies beside the sheet.
const BEHIND_BORDER_COS: f64 = 1.0 - 1e-9;

/// A face: its nodes, counter-clockwise seen from outside, and which of its sides no other face has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::solver) struct Face {
    nodes: [u32; 4],
    border: [bool; 4],
}

impl Face {
    /// Its corners, nodes being at `x` [mm].
    pub(in crate::solver) fn corners(&self, x: &[Vec3]) -> [Vec3; 4] {
        self.nodes.map(|n| x[n as usize])
    }
}

/// Outer faces of a mesh on a side of the sheet; of a mesh without columns all outer faces.
pub(in crate::solver) fn faces_of(mesh: &HexMesh, side: SheetSide) -> Vec<Face> {
    let levels = mesh.nodes_per_column;
    let mut all: Vec<[u32; 4]> =
        mesh.elements.iter().flat_map(|e| FACES.map(|face| face.map(|k| e[k]))).collect();
    if levels > 1 {
        let on = |level: usize| move |f: &[u32; 4]| f.iter().all(|n| *n as usize % levels == level);
        let (low, high) = (on(0), on(levels - 1));
        all.retain(|face| match side {
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
        all.iter().for_each(|face| *uses.entry(key(face)).or_default() += 1);
        all.retain(|face| uses[&key(face)] == 1);
    }
    let side_of = |a: u32, b: u32| [a.min(b), a.max(b)];
    let mut sides: HashMap<[u32; 2], usize> = HashMap::new();
    for f in &all {
        (0..4).for_each(|k| *sides.entry(side_of(f[k], f[(k + 1) % 4])).or_default() += 1);
    }
    let border = |f: &[u32; 4]| [0, 1, 2, 3].map(|k| sides[&side_of(f[k], f[(k + 1) % 4])] == 1);
    all.iter().map(|f| Face { nodes: *f, border: border(f) }).collect()
}

/// Faces where they are now.
pub(in crate::solver) struct Faces<'a> {
    faces: &'a [Face],
    corners: Vec<[Vec3; 4]>,
    tree: BoxTree,
    bounds: Aabb,
}

/// The nearest point of the faces: its squared distance [mm²], the sum of the normals of the faces that have it, and whether it
/// lies on the free border.
struct Nearest {
    square: f64,
    foot: Vec3,
    normal: Vec3,
    border: bool,
}

impl<'a> Faces<'a> {
    pub(in crate::solver) fn new(faces: &'a [Face], x: &[Vec3]) -> Self {
        let corners: Vec<[Vec3; 4]> = faces.iter().map(|face| face.corners(x)).collect();
        let boxes: Vec<Aabb> = corners.iter().map(Aabb::of_points).collect();
        let bounds = boxes.iter().fold(Aabb::EMPTY, |sum, b| sum.union(b));
        Self { faces, corners, tree: BoxTree::build(&boxes), bounds }
    }

    pub(in crate::solver) fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Depth of a point of a tool with this outward normal behind the nearest face, up to `reach` [mm]; 0 in front of it, beside
    /// the sheet, and where the tool looks the way that the face does.
    pub(in crate::solver) fn depth(&self, p: &Vec3, normal: &Vec3, reach: f64) -> f64 {
        let mut best = Nearest {
            square: reach * reach,
            foot: Vec3::zeros(),
            normal: Vec3::zeros(),
            border: false,
        };
        self.tree.nearest(p, reach * reach, |k, _| {
            self.offer(k as usize, p, &mut best);
            best.square * (1.0 + SAME_FOOT_REL)
        });
        let Some(out) = best.normal.try_normalize(0.0) else { return 0.0 };
        let offset = best.foot - p;
        let depth = offset.norm();
        let behind = if best.border { BEHIND_BORDER_COS } else { BEHIND_COS };
        if normal.dot(&out) < 0.0 && offset.dot(&out) > behind * depth { depth } else { 0.0 }
    }

    /// The nearest point of face `k` in place of the best, or its normal added to that of the same point.
    fn offer(&self, k: usize, p: &Vec3, best: &mut Nearest) {
        let corners = &self.corners[k];
        let (foot, at) = closest(corners, p);
        let square = (foot - p).norm_squared();
        let length = (corners[2] - corners[0]).norm();
        let same = SAME_FOOT_REL * length * (length + best.square.sqrt());
        if square > best.square + same {
            return;
        }
        let normal = normal(corners, at).try_normalize(0.0).unwrap_or_default();
        let border = self.is_on_border(k, at);
        let shared =
            best.normal != Vec3::zeros() && (foot - best.foot).norm() <= SAME_FOOT_REL * length;
        if shared {
            best.normal += normal;
            best.border &= border;
            best.square = best.square.min(square);
        } else if square < best.square {
            *best = Nearest { square, foot, normal, border };
        }
    }

    fn is_on_border(&self, k: usize, [u, v]: [f64; 2]) -> bool {
        let on = [v == 0.0, u == 1.0, v == 1.0, u == 0.0];
        (0..4).any(|side| on[side] && self.faces[k].border[side])
    }
}

/// Weights of the corners of a bilinear surface at `(u, v)` of the unit square.
fn weights([u, v]: [f64; 2]) -> [f64; 4] {
    [(1.0 - u) * (1.0 - v), u * (1.0 - v), u * v, (1.0 - u) * v]
}

fn point(corners: &[Vec3; 4], at: [f64; 2]) -> Vec3 {
    corners.iter().zip(weights(at)).map(|(x, w)| x * w).sum()
}

fn tangents(c: &[Vec3; 4], [u, v]: [f64; 2]) -> [Vec3; 2] {
    [(c[1] - c[0]) * (1.0 - v) + (c[2] - c[3]) * v, (c[3] - c[0]) * (1.0 - u) + (c[2] - c[1]) * u]
}

/// Normal of a bilinear surface, of no particular length.
fn normal(corners: &[Vec3; 4], at: [f64; 2]) -> Vec3 {
    let [a, b] = tangents(corners, at);
    a.cross(&b)
}

/// Closest point of a bilinear surface and its parameters in the unit square: Gauss-Newton steps from the middle, then lines of
/// either parameter in turn, along which the surface is straight and the minimum exact.
fn closest(corners: &[Vec3; 4], p: &Vec3) -> (Vec3, [f64; 2]) {
    /// Steps: a face warped by less than its length is at its minimum to rounding after a few.
    const STEPS: usize = 8;
    let mut at = [0.5, 0.5];
    for _ in 0..STEPS {
        let r = p - point(corners, at);
        let [a, b] = tangents(corners, at);
        let (aa, ab, bb) = (a.dot(&a), a.dot(&b), b.dot(&b));
        let (ra, rb) = (r.dot(&a), r.dot(&b));
        let det = aa * bb - ab * ab;
        let step = if det > 1e-12 * aa * bb {
            [(bb * ra - ab * rb) / det, (aa * rb - ab * ra) / det]
        } else {
            [0.0, 0.0]
        };
        let next = [0, 1].map(|k| (at[k] + step[k]).clamp(0.0, 1.0));
        if next == at {
            break;
        }
        at = next;
        for axis in [0, 1] {
            at[axis] = along(corners, p, at, axis);
        }
    }
    (point(corners, at), at)
}

/// The minimum of the distance along one parameter, the other kept.
fn along(corners: &[Vec3; 4], p: &Vec3, at: [f64; 2], axis: usize) -> f64 {
    let mut from = at;
    from[axis] = 0.0;
    let way = tangents(corners, at)[axis];
    let square = way.norm_squared();
    if square == 0.0 {
        return at[axis];
    }
    ((p - point(corners, from)).dot(&way) / square).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::sheet::hex_mesh::rectangle;

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
        let depth = |x: f64, y: f64, z: f64| faces.depth(&Vec3::new(x, y, z), &-Vec3::z(), 2.0);
        // Inside a face, on a common side and corner, at the border, beside it, in front, out of reach.
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
        // The back of a tool.
        assert_eq!(faces.depth(&Vec3::new(3.0, 3.0, 0.5), &Vec3::z(), 2.0), 0.0);
    }
}
