//! Conversion of tool models: Nagata (and facets) to Bezier exactly, and back with a known discrepancy.

use rustc_hash::FxHashMap;

use super::bezier::{of_nagata, turned};
use super::build::{EdgeChoice, ToolError, build, edge_ends};
use super::edge::{EdgeRule, edge_curve, nearest_coefficient};
use super::model::{GivenCurve, PatchCorners, ToolKind, ToolModel};
use super::patch::Patch;
use kanagata_geometry::frame::unit;
use kanagata_geometry::{Aabb, Vec3};

/// The identical shape as biquadratic Bezier patches (Eq. 15); a Bezier model is unchanged.
#[must_use]
pub fn to_bezier(tool: &ToolModel) -> ToolModel {
    let patches = tool.patches.iter().map(of_nagata).collect();
    let model = ToolModel::of_patches(&tool.name, ToolKind::Bezier, patches, tool.faces.clone());
    ToolModel { border_gap_mm: tool.border_gap_mm, ..model }
}

/// Discrepancy of a conversion to Nagata patches.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Discrepancy {
    /// Largest distance of points at equal parameters [mm].
    pub max_mm: f64,
    /// Patch of the largest distance.
    pub patch: u32,
}

/// Distance between corners relative to the size of the model below which they are one vertex.
const VERTEX_TOLERANCE_REL: f64 = 1e-7;
/// Angle between normals at a vertex below which they are one normal [rad].
const NORMAL_TOLERANCE_RAD: f64 = 0.5 * std::f64::consts::PI / 180.0;
/// Difference of coefficients relative to the edge length below which they are equal.
const COEFFICIENT_TOLERANCE_REL: f64 = 1e-13;
/// Intervals of the grid on which the discrepancy is measured.
const GRID_INTERVALS: usize = 8;

/// The Nagata model with the corners, corner normals and edge midpoints of a Bezier model. Of a biquadratic patch only
/// the term of `eta^2 zeta^2` is lost (the last one of Eq. 14): `|c22| / 16`. A patch with a collapsed side becomes a
/// triangle. A model of another kind is unchanged.
///
/// # Errors
/// [`ToolError`] names a patch that is degenerate.
pub fn to_nagata(tool: &ToolModel) -> Result<(ToolModel, Discrepancy), ToolError> {
    if tool.kind != ToolKind::Bezier {
        return Ok((tool.clone(), Discrepancy::default()));
    }
    let all: Vec<Vec3> = tool.patches.iter().flat_map(|p| ring(p).map(|c| c.0)).collect();
    let near = (VERTEX_TOLERANCE_REL * Aabb::of_points(&all).diagonal()).max(f64::MIN_POSITIVE);
    let mut weld = Weld { near, ..Weld::default() };
    let (mut patches, mut corners, mut wanted) = (Vec::new(), Vec::new(), FxHashMap::default());
    for (id, (patch, &face)) in tool.patches.iter().zip(&tool.faces).enumerate() {
        let patch = with_collapsed_side_first(patch, near);
        let ring = ring(&patch);
        let collapsed = (ring[0].0 - ring[3].0).norm() <= near;
        let last = if collapsed { 3 } else { 4 };
        let (vertices, normals) = weld.corners(&ring[..last], id)?;
        for k in 0..last {
            let (a, b) = (vertices[k], vertices[(k + 1) % last]);
            let chord = (ring[k].0 + ring[(k + 1) % last].0) * 0.5;
            let c = (chord - middle(&patch, k)) * 4.0;
            wanted.entry([a.min(b), a.max(b)]).or_insert(c);
        }
        corners.push(PatchCorners { vertices, normals, face });
        patches.push(patch);
    }
    let quadratic =
        |p: &Patch| matches!(p, Patch::Bezier { degrees: [n, m], .. } if *n.max(m) <= 2);
    let given = given(&weld, &corners, &wanted, patches.iter().all(quadratic));
    let choice = EdgeChoice { rule: EdgeRule::Guarded, given };
    let (vertices, normals) = (weld.vertices, weld.normals);
    let (mut made, _) =
        build(tool.name.clone(), ToolKind::Nagata, vertices, normals, corners, choice)?;
    let lost = discrepancy(&patches, &made.patches);
    if tool.border_gap_mm > 0.0 {
        made.border_gap_mm = tool.border_gap_mm + 2.0 * lost.max_mm;
    }
    Ok((made, lost))
}

/// Edges whose coefficient differs from that of Eq. 8.
fn given(
    weld: &Weld,
    corners: &[PatchCorners],
    wanted: &FxHashMap<[u32; 2], Vec3>,
    exact: bool,
) -> Vec<GivenCurve> {
    let mut given = Vec::new();
    for (vertices, ends) in edge_ends(corners) {
        let Some(c) = wanted.get(&vertices) else { continue };
        let [a, b] = vertices.map(|v| weld.vertices[v as usize]);
        let d = b - a;
        let pairs: Vec<[Vec3; 2]> =
            ends.iter().map(|p| p.map(|n| weld.normals[n as usize])).collect();
        // A quadratic side is reproduced exactly; one of higher degree is replaced by a curve perpendicular to the
        // normals.
        let c = if exact { *c } else { nearest_coefficient(&d, &pairs, c).c };
        if (c - edge_curve(&d, &pairs, EdgeRule::Guarded).c).norm()
            > COEFFICIENT_TOLERANCE_REL * d.norm()
        {
            given.push(GivenCurve { vertices, c: c.into() });
        }
    }
    given
}

const CORNERS: [(f64, f64); 4] = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];

/// Corners and their normals.
fn ring(patch: &Patch) -> [(Vec3, Option<Vec3>); 4] {
    CORNERS.map(|(e, z)| {
        let d = patch.derivs(e, z);
        // At a side collapsed along zeta the limit of S_zeta / eta is S_eta_zeta.
        let cross =
            if d.d2.norm() > 1e-9 * d.d1.norm() { d.d1.cross(&d.d2) } else { d.d1.cross(&d.d12) };
        (d.s, unit(cross))
    })
}

/// Midpoint of side k.
fn middle(patch: &Patch, k: usize) -> Vec3 {
    let at = [(0.5, 0.0), (1.0, 0.5), (0.5, 1.0), (0.0, 0.5)][k];
    patch.derivs(at.0, at.1).s
}

/// The patch rotated so that its collapsed side is at `eta = 0`.
fn with_collapsed_side_first(patch: &Patch, near: f64) -> Patch {
    let mut patch = patch.clone();
    for _ in 0..4 {
        let flat = (middle(&patch, 3) - ring(&patch)[0].0).norm() <= near
            && (ring(&patch)[3].0 - ring(&patch)[0].0).norm() <= near;
        let Patch::Bezier { degrees, points } = &patch else { break };
        if flat {
            break;
        }
        let (degrees, points) = turned(*degrees, points);
        patch = Patch::Bezier { degrees, points };
    }
    patch
}

fn discrepancy(bezier: &[Patch], nagata: &[Patch]) -> Discrepancy {
    let mut lost = Discrepancy::default();
    for (id, (b, n)) in bezier.iter().zip(nagata).enumerate() {
        for k in 0..(GRID_INTERVALS + 1) * (GRID_INTERVALS + 1) {
            let (e, z) = ((k / (GRID_INTERVALS + 1)) as f64, (k % (GRID_INTERVALS + 1)) as f64);
            let (e, z) = (e / GRID_INTERVALS as f64, z / GRID_INTERVALS as f64);
            let zeta = if n.sides() == 3 { e * z } else { z };
            let off = (b.derivs(e, z).s - n.derivs(e, zeta).s).norm();
            if off > lost.max_mm {
                lost = Discrepancy { max_mm: off, patch: id as u32 };
            }
        }
    }
    lost
}

/// Merges vertices, and the normals at each of them.
#[derive(Default)]
struct Weld {
    near: f64,
    vertices: Vec<Vec3>,
    cells: FxHashMap<[i64; 3], Vec<u32>>,
    normals: Vec<Vec3>,
    of_vertex: FxHashMap<u32, Vec<u32>>,
}

impl Weld {
    /// Vertex and normal ids of the corners of patch `id`.
    fn corners(
        &mut self,
        ring: &[(Vec3, Option<Vec3>)],
        id: usize,
    ) -> Result<(Vec<u32>, Vec<u32>), ToolError> {
        let (mut vertices, mut normals) = (Vec::new(), Vec::new());
        for (point, normal) in ring {
            let normal = normal.ok_or(ToolError::Collapsed { patch: id })?;
            let vertex = self.vertex(point);
            vertices.push(vertex);
            normals.push(self.normal(vertex, &normal));
        }
        Ok((vertices, normals))
    }

    fn vertex(&mut self, p: &Vec3) -> u32 {
        let cell = [0, 1, 2].map(|k| (p[k] / self.near).floor() as i64);
        for k in 0..27_i64 {
            let shift = [k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1];
            let at = [0, 1, 2].map(|i| cell[i].saturating_add(shift[i]));
            let same = |id: &&u32| (self.vertices[**id as usize] - p).norm() <= self.near;
            if let Some(id) = self.cells.get(&at).and_then(|list| list.iter().find(same)) {
                return *id;
            }
        }
        let id = self.vertices.len() as u32;
        self.vertices.push(*p);
        self.cells.entry(cell).or_default().push(id);
        id
    }

    fn normal(&mut self, vertex: u32, n: &Vec3) -> u32 {
        let list = self.of_vertex.entry(vertex).or_default();
        let same = |id: &&u32| {
            let other = &self.normals[**id as usize];
            other.cross(n).norm() <= NORMAL_TOLERANCE_RAD.sin() && other.dot(n) > 0.0
        };
        if let Some(id) = list.iter().find(same) {
            return *id;
        }
        let id = self.normals.len() as u32;
        self.normals.push(*n);
        list.push(id);
        id
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter of a torus fillet in `n` x `n` quadrilaterals, one of them split into triangles.
    fn fillet(n: u32) -> ToolModel {
        let (mut vertices, mut normals, mut corners) = (vec![], vec![], vec![]);
        for i in 0..=n {
            for j in 0..=n {
                let quarter = std::f64::consts::FRAC_PI_2 / f64::from(n);
                let (a, b) = (quarter * f64::from(i), quarter * f64::from(j));
                let normal = Vec3::new(a.cos() * b.cos(), a.sin() * b.cos(), b.sin());
                vertices.push(Vec3::new(a.cos(), a.sin(), 0.0) * 17.0 + normal * 7.0);
                normals.push(normal);
            }
        }
        let at = |i: u32, j: u32| i * (n + 1) + j;
        let mut push = |ids: &[u32]| {
            corners.push(PatchCorners { vertices: ids.to_vec(), normals: ids.to_vec(), face: 3 });
        };
        for i in 0..n {
            for j in 0..n {
                let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                if i + j == 0 {
                    push(&[a, b, c]);
                    push(&[a, c, d]);
                } else {
                    push(&[a, b, c, d]);
                }
            }
        }
        build("t".into(), ToolKind::Nagata, vertices, normals, corners, EdgeRule::Guarded)
            .unwrap()
            .0
    }

    #[test]
    fn there_and_back_is_the_same_model() {
        let tool = fillet(3);
        let bezier = to_bezier(&tool);
        assert!(bezier.patches.iter().all(|p| matches!(p, Patch::Bezier { degrees: [2, 2], .. })));
        let (back, lost) = to_nagata(&bezier).unwrap();
        assert!(lost.max_mm < 1e-13, "{lost:?}");
        assert_eq!((back.vertices.len(), back.normals.len()), (16, 16));
        assert_eq!(
            back.corners.iter().map(|c| c.vertices.len()).collect::<Vec<_>>(),
            tool.corners.iter().map(|c| c.vertices.len()).collect::<Vec<_>>()
        );
        for (a, b) in tool.patches.iter().zip(&back.patches) {
            assert!((a.derivs(0.6, 0.4).s - b.derivs(0.6, 0.4).s).norm() < 1e-13);
        }
    }

    #[test]
    fn the_lost_term_is_a_sixteenth_of_its_coefficient() {
        let mut bezier = to_bezier(&fillet(2));
        let Some(Patch::Bezier { points, .. }) = bezier.patches.last_mut() else { panic!() };
        points[4] += Vec3::new(0.0, 0.0, 0.2);
        // c22 contains 4 P11.
        let (_, lost) = to_nagata(&bezier).unwrap();
        assert!((lost.max_mm - 0.8 / 16.0).abs() < 1e-12, "{lost:?}");
        assert_eq!(lost.patch as usize, bezier.patches.len() - 1);
    }
}
