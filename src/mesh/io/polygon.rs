//! Division of polygons of mesh files into triangles and convex quadrilaterals.
//!
//! A polygon is projected along the normal of its mean plane, `n = 1/2 sum x_k x x_(k+1)` (Newell; Sutherland, Sproull
//! and Schumacker 1974), and divided by a constrained Delaunay triangulation of its corners.

use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::mesh_file::{CornerNormals, with_normals};
use crate::{Element, MeshError};
use kanagata_geometry::{Aabb, Vec3};

/// Largest distance of a corner from the mean plane relative to the polygon's diagonal, for five or more corners.
/// Doubled: polygons are accepted whose area depends on the division by more than about 10 %.
const OFF_PLANE_MAX_REL: f64 = 0.1;

type Plane = ConstrainedDelaunayTriangulation<Point2<f64>>;

/// Elements of a polygon given by vertex ids and normals: the polygon itself if it has three corners or is a convex
/// quadrilateral, otherwise triangles. Empty when fewer than three vertices differ.
///
/// # Errors
/// Description of a polygon that self-intersects, touches itself, has no area, or is far from planar.
pub(super) fn elements(
    ring: &[(u32, Vec3)],
    points: &[Vec3],
    face: u32,
) -> Result<Vec<(Element, CornerNormals)>, String> {
    let mut ring = ring.to_vec();
    ring.dedup_by_key(|corner| corner.0);
    if ring.len() > 1 && ring.first().map(|c| c.0) == ring.last().map(|c| c.0) {
        ring.pop();
    }
    if ring.len() < 4 {
        return Ok(with_normals(&ring, face).into_iter().collect());
    }
    let corners: Vec<Vec3> = ring.iter().map(|c| points[c.0 as usize]).collect();
    let part = |ids: &[usize]| {
        let ring: Vec<(u32, Vec3)> = ids.iter().map(|&k| ring[k]).collect();
        with_normals(&ring, face)
    };
    Ok(divided(&corners)?.iter().filter_map(|ids| part(ids)).collect())
}

/// Vertex ids of a ring of four different corners of a convex quadrilateral, the most frequent case.
pub(super) fn convex_quad(ring: &[(u32, Vec3)], points: &[Vec3]) -> Option<[u32; 4]> {
    let ids = <[(u32, Vec3); 4]>::try_from(ring).ok()?.map(|corner| corner.0);
    if (1..4).any(|k| ids[..k].contains(&ids[k])) {
        return None;
    }
    let corners = ids.map(|id| points[id as usize]);
    let view = View::of(&corners).ok()?;
    is_convex(&corners.map(|p| view.of_point(&p))).then_some(ids)
}

/// Error for a polygon at a location of a file.
pub(super) fn refused(file: &str, place: String, found: String) -> MeshError {
    let allowed = "flat polygons whose sides meet at their corners only".into();
    MeshError::Invalid { file: file.into(), place, found, allowed }
}

/// Corner indices of the parts of a polygon of four or more corners, in its orientation.
///
/// # Errors
/// As [`elements`].
pub(super) fn divided(corners: &[Vec3]) -> Result<Vec<Vec<usize>>, String> {
    let view = View::of(corners)?;
    let flat: Vec<Point2<f64>> = corners.iter().map(|p| view.of_point(p)).collect();
    if <&[_; 4]>::try_from(&flat[..]).is_ok_and(is_convex) {
        return Ok(vec![(0..4).collect()]);
    }
    triangles(&flat)
}

/// Projection in which a polygon is counter-clockwise: along the coordinate axis closest to its normal, so that
/// coordinates are unchanged.
struct View {
    axes: [usize; 2],
    turned: bool,
}

impl View {
    /// Projection of a polygon.
    fn of(corners: &[Vec3]) -> Result<Self, String> {
        let n = corners.len();
        let origin = corners[0];
        let normal: Vec3 =
            (0..n).map(|k| (corners[k] - origin).cross(&(corners[(k + 1) % n] - origin))).sum();
        let diagonal = Aabb::of_points(corners).diagonal();
        if normal.norm() <= 1e-12 * diagonal * diagonal || !normal.norm().is_finite() {
            return Err(format!("a polygon of {n} corners without area, or whose sides cross"));
        }
        let unit = normal / normal.norm();
        let mean = corners.iter().map(|p| p - origin).sum::<Vec3>() / n as f64;
        let off = corners.iter().map(|p| (p - origin - mean).dot(&unit).abs()).fold(0.0, f64::max);
        if n > 4 && off > OFF_PLANE_MAX_REL * diagonal {
            return Err(format!(
                "a polygon of {n} corners that lie up to {off:.4} off their plane, {:.0} % of its size ({:.0} % allowed)",
                100.0 * off / diagonal,
                100.0 * OFF_PLANE_MAX_REL
            ));
        }
        let axis = unit.iamax();
        Ok(Self { axes: [(axis + 1) % 3, (axis + 2) % 3], turned: unit[axis] < 0.0 })
    }

    fn of_point(&self, p: &Vec3) -> Point2<f64> {
        // The triangulation rejects non-zero coordinates below 1e-142.
        let clean = |x: f64| if x.abs() < 1e-100 { 0.0 } else { x };
        let [x, y] = self.axes.map(|axis| clean(p[axis]));
        if self.turned { Point2::new(y, x) } else { Point2::new(x, y) }
    }
}

/// True when a counter-clockwise quadrilateral has no reflex corner.
fn is_convex(flat: &[Point2<f64>; 4]) -> bool {
    let turns_left = |k: usize| {
        let [a, b, c] = [0, 1, 2].map(|i| flat[(k + i) % 4]);
        (b.x - a.x) * (c.y - b.y) - (b.y - a.y) * (c.x - b.x) >= 0.0
    };
    (0..4).all(turns_left)
}

/// Triangles inside a counter-clockwise polygon.
fn triangles(flat: &[Point2<f64>]) -> Result<Vec<Vec<usize>>, String> {
    let n = flat.len();
    let mut plane = Plane::new();
    let mut handles: Vec<FixedVertexHandle> = Vec::with_capacity(n);
    for &p in flat {
        handles.push(plane.insert(p).map_err(|e| format!("a polygon of {n} corners: {e}"))?);
    }
    if plane.num_vertices() != n {
        return Err(format!("a polygon of {n} corners that touches itself in one of them"));
    }
    for k in 0..n {
        let [from, to] = [handles[k], handles[(k + 1) % n]];
        if !plane.can_add_constraint(from, to) {
            return Err(format!("a polygon of {n} corners whose sides cross"));
        }
        plane.add_constraint(from, to);
    }
    let mut number = vec![0; n];
    for (k, handle) in handles.iter().enumerate() {
        number[handle.index()] = k;
    }
    let inside = inside(&plane);
    let of_face = |face: spade::handles::FaceHandle<'_, spade::handles::InnerTag, _, _, _, _>| {
        face.vertices().iter().map(|v| number[v.fix().index()]).collect()
    };
    Ok(plane.inner_faces().filter(|f| inside[f.fix().index()]).map(of_face).collect())
}

/// For each face of the triangulation, true when an odd number of polygon sides separates it from the outside.
fn inside(plane: &Plane) -> Vec<bool> {
    let mut inside = vec![false; plane.num_all_faces()];
    let mut seen = vec![false; plane.num_all_faces()];
    let outer = plane.outer_face().fix();
    seen[outer.index()] = true;
    // Start at the sides of the hull and proceed across the edges of each face.
    let mut open: Vec<_> = plane.convex_hull().map(|e| e.fix().rev()).collect();
    let mut next = 0;
    while let Some(&edge) = open.get(next) {
        next += 1;
        let edge = plane.directed_edge(edge);
        let (to, from) = (edge.face().fix(), edge.rev().face().fix());
        if std::mem::replace(&mut seen[to.index()], true) {
            continue;
        }
        inside[to.index()] = inside[from.index()] ^ edge.is_constraint_edge();
        open.extend([edge.next(), edge.prev()].map(|e| e.rev().fix()));
    }
    inside
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[Vec3], parts: &[Vec<usize>]) -> f64 {
        let fan = |ids: &Vec<usize>| {
            let p = |k: usize| corners[ids[k]];
            let sum: Vec3 = (2..ids.len()).map(|k| (p(k - 1) - p(0)).cross(&(p(k) - p(0)))).sum();
            0.5 * sum.norm()
        };
        parts.iter().map(fan).sum()
    }

    fn flat(points: &[[f64; 2]]) -> Vec<Vec3> {
        points.iter().map(|p| Vec3::new(p[0], p[1], 0.0)).collect()
    }

    /// Star with `n` tips; the concave corners are at half the radius.
    fn star(n: usize) -> Vec<Vec3> {
        let at = |k: usize| {
            let (radius, turn) = (if k.is_multiple_of(2) { 2.0 } else { 1.0 }, k as f64 / n as f64);
            let (sin, cos) = (std::f64::consts::PI * turn).sin_cos();
            Vec3::new(radius * cos, radius * sin, 0.0)
        };
        (0..2 * n).map(at).collect()
    }

    #[test]
    fn parts_have_the_area_of_the_polygon_and_turn_as_it_does() {
        let l =
            flat(&[[20.0, 0.0], [20.0, 10.0], [10.0, 10.0], [10.0, 20.0], [0.0, 20.0], [0.0, 0.0]]);
        let dart = flat(&[[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]]);
        let straight = flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]);
        let tip = (std::f64::consts::PI / 7.0).sin();
        for (corners, exact) in [(l, 300.0), (dart, 4.0), (straight, 4.0), (star(7), 14.0 * tip)] {
            let turn = kanagata_geometry::Vec3::new(1.0, 2.0, -0.5).normalize();
            for turned in [false, true] {
                let tilted = |p: &Vec3| if turned { p - turn * (2.0 * p.dot(&turn)) } else { *p };
                let corners: Vec<Vec3> = corners.iter().map(tilted).collect();
                let parts = divided(&corners).unwrap();
                assert!((area(&corners, &parts) - exact).abs() < 1e-9 * exact, "{parts:?}");
                assert!(parts.iter().map(|p| p.len() - 2).sum::<usize>() <= corners.len() - 2);
                let n = corners.len();
                let whole: Vec3 = (0..n).map(|k| corners[k].cross(&corners[(k + 1) % n])).sum();
                for part in &parts {
                    let [a, b, c] = [0, 1, 2].map(|k| corners[part[k]]);
                    assert!((b - a).cross(&(c - b)).dot(&whole) > 0.0, "{part:?}");
                }
            }
        }
    }

    #[test]
    fn convex_quadrilaterals_stay_also_warped_ones() {
        let mut quad = flat(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]);
        quad[2].z = 0.4;
        assert_eq!(divided(&quad).unwrap(), [vec![0, 1, 2, 3]]);
        // Three collinear corners.
        let straight = flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 2.0]]);
        assert_eq!(divided(&straight).unwrap(), [vec![0, 1, 2, 3]]);
    }

    #[test]
    fn polygons_that_cross_or_touch_themselves_or_are_not_flat_are_refused() {
        let bow = flat(&[[0.0, 0.0], [4.0, 3.0], [4.0, 0.0], [0.0, 2.0]]);
        let eight = flat(&[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]]);
        let touching =
            flat(&[[0.0, 0.0], [2.0, 0.0], [1.0, 1.0], [2.0, 2.0], [0.0, 2.0], [1.0, 1.0]]);
        let mut bent = flat(&[[0.0, 0.0], [2.0, 0.0], [3.0, 1.0], [2.0, 2.0], [0.0, 2.0]]);
        bent[2].z = 2.0;
        let cases =
            [(bow, "cross"), (eight, "cross"), (touching, "touches"), (bent, "off their plane")];
        for (corners, what) in cases {
            let message = divided(&corners).unwrap_err();
            assert!(message.contains(what), "{message}");
        }
    }
}
