//! Construction of patches from vertices, normals and corner ids: Eq. 8 per edge, Eq. 10 and Eq. 12.

use rustc_hash::FxHashMap;

pub use super::error::ToolError;

use super::edge::{EdgeFault, EdgeRule, edge_curve};
use super::model::{GivenCurve, PatchCorners, ToolKind, ToolModel};
use super::patch::Patch;
use kanagata_geometry::Vec3;
use kanagata_geometry::numbers::{first_fault, point_fault};

/// An edge replaced by its chord by the edge guard.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct StraightEdge {
    /// Patches that share it.
    pub patches: Vec<u32>,
    /// Its vertices.
    pub vertices: [u32; 2],
    /// Reason.
    pub fault: EdgeFault,
}

/// Source of the edge coefficients.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EdgeChoice {
    /// Rule for all edges without given coefficients.
    pub rule: EdgeRule,
    /// Edges with given coefficients.
    pub given: Vec<GivenCurve>,
}

impl From<EdgeRule> for EdgeChoice {
    fn from(rule: EdgeRule) -> Self {
        Self { rule, given: Vec::new() }
    }
}

/// Builds a Nagata or facet model. Also returns the edges replaced by their chords.
///
/// # Errors
/// [`ToolError`] names the patch, vertex or normal.
pub fn build(
    name: String,
    kind: ToolKind,
    vertices: Vec<Vec3>,
    normals: Vec<Vec3>,
    corners: Vec<PatchCorners>,
    choice: impl Into<EdgeChoice>,
) -> Result<(ToolModel, Vec<StraightEdge>), ToolError> {
    check(&vertices, &normals, &corners)?;
    let EdgeChoice { rule, given: curves } = choice.into();
    let mut edges = match kind {
        ToolKind::Facets => FxHashMap::default(),
        _ => curve_edges(&vertices, &normals, &corners, rule),
    };
    set_given(&mut edges, &curves)?;
    let mut straight: Vec<StraightEdge> =
        edges.iter().filter_map(|(key, e)| e.straight(*key)).collect();
    straight.sort_by_key(|e| e.vertices);
    let c = |a: u32, b: u32| edges.get(&key(a, b)).map_or_else(Vec3::zeros, |e| e.c);
    let patches = corners.iter().map(|p| patch(&p.vertices, &vertices, c)).collect();
    let faces = corners.iter().map(|p| p.face).collect();
    let tool = ToolModel {
        name,
        kind,
        vertices,
        normals,
        corners,
        curves,
        patches,
        faces,
        border_gap_mm: 0.0,
    };
    Ok((tool, straight))
}

/// Replaces the coefficients of edges with given ones.
fn set_given(
    edges: &mut FxHashMap<[u32; 2], SharedEdge>,
    curves: &[GivenCurve],
) -> Result<(), ToolError> {
    for (index, curve) in curves.iter().enumerate() {
        if let Some(found) = point_fault(&Vec3::from(curve.c)) {
            return Err(ToolError::Number { what: "curve", index, found });
        }
        let [a, b] = curve.vertices;
        let edge = edges.get_mut(&key(a, b)).ok_or(ToolError::Curve { index, vertices: [a, b] })?;
        (edge.c, edge.fault) = (Vec3::from(curve.c), None);
    }
    Ok(())
}

/// Normal ids at both ends of every edge, lower vertex first, each distinct pair once.
#[must_use]
pub fn edge_ends(corners: &[PatchCorners]) -> std::collections::BTreeMap<[u32; 2], Vec<[u32; 2]>> {
    let mut ends: std::collections::BTreeMap<[u32; 2], Vec<[u32; 2]>> = Default::default();
    for p in corners {
        let n = p.vertices.len();
        for k in 0..n {
            let (a, b) = (p.vertices[k], p.vertices[(k + 1) % n]);
            let (na, nb) = (p.normals[k], p.normals[(k + 1) % n]);
            let pair = if a < b { [na, nb] } else { [nb, na] };
            let list = ends.entry(key(a, b)).or_default();
            if !list.contains(&pair) {
                list.push(pair);
            }
        }
    }
    ends
}

fn check(vertices: &[Vec3], normals: &[Vec3], corners: &[PatchCorners]) -> Result<(), ToolError> {
    for (what, list) in [("vertex", vertices), ("normal", normals)] {
        if let Some((index, found)) = first_fault(list) {
            return Err(ToolError::Number { what, index, found });
        }
    }
    if let Some(index) = normals.iter().position(|n| (n.norm() - 1.0).abs() > 1e-6) {
        return Err(ToolError::NormalLength { index, length: normals[index].norm() });
    }
    for (patch, p) in corners.iter().enumerate() {
        let (nv, nn) = (p.vertices.len(), p.normals.len());
        if !(3..=4).contains(&nv) || nn != nv {
            return Err(ToolError::Corners { patch, vertices: nv, normals: nn });
        }
        for (what, ids, len) in
            [("vertex", &p.vertices, vertices.len()), ("normal", &p.normals, normals.len())]
        {
            if let Some(&id) = ids.iter().find(|&&id| id as usize >= len) {
                return Err(ToolError::Id { patch, what, id, last: len as i64 - 1 });
            }
        }
        let mut different = p.vertices.clone();
        different.sort_unstable();
        different.dedup();
        if different.len() < 3 {
            return Err(ToolError::Collapsed { patch });
        }
    }
    let turned = |p: &PatchCorners| runs_clockwise(vertices, normals, p);
    let count = corners.iter().filter(|p| turned(p)).count();
    match corners.iter().position(turned) {
        Some(patch) if 2 * count > corners.len() => {
            Err(ToolError::Turned { patch, count, of: corners.len() })
        }
        _ => Ok(()),
    }
}

/// True when the corners are clockwise as seen against each of their normals.
fn runs_clockwise(vertices: &[Vec3], normals: &[Vec3], p: &PatchCorners) -> bool {
    let x = |k: usize| vertices[p.vertices[k % p.vertices.len()] as usize];
    let sides = (0..p.vertices.len()).map(|k| (x(k) - x(0)).cross(&(x(k + 1) - x(0))));
    let area: Vec3 = sides.sum();
    p.normals.iter().all(|&n| normals[n as usize].dot(&area) < 0.0)
}

fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

#[derive(Default)]
struct SharedEdge {
    patches: Vec<u32>,
    /// Normal ids at the lower and the higher vertex, each distinct pair once.
    ends: Vec<[u32; 2]>,
    c: Vec3,
    fault: Option<EdgeFault>,
}

impl SharedEdge {
    fn straight(&self, vertices: [u32; 2]) -> Option<StraightEdge> {
        Some(StraightEdge { patches: self.patches.clone(), vertices, fault: self.fault? })
    }
}

/// Coefficients of every edge, evaluated once from its lower vertex to its higher one, so that adjacent patches have
/// identical values.
fn curve_edges(
    vertices: &[Vec3],
    normals: &[Vec3],
    corners: &[PatchCorners],
    rule: EdgeRule,
) -> FxHashMap<[u32; 2], SharedEdge> {
    let mut edges: FxHashMap<[u32; 2], SharedEdge> = FxHashMap::default();
    for (id, p) in corners.iter().enumerate() {
        let n = p.vertices.len();
        for k in 0..n {
            let (a, b) = (p.vertices[k], p.vertices[(k + 1) % n]);
            let (na, nb) = (p.normals[k], p.normals[(k + 1) % n]);
            let edge = edges.entry(key(a, b)).or_default();
            edge.patches.push(id as u32);
            let ends = if a < b { [na, nb] } else { [nb, na] };
            if !edge.ends.contains(&ends) {
                edge.ends.push(ends);
            }
        }
    }
    for (&[a, b], edge) in &mut edges {
        let d = vertices[b as usize] - vertices[a as usize];
        let ends: Vec<[Vec3; 2]> =
            edge.ends.iter().map(|e| e.map(|n| normals[n as usize])).collect();
        let curve = edge_curve(&d, &ends, rule);
        (edge.c, edge.fault) = (curve.c, if a == b { None } else { curve.fault });
    }
    edges
}

/// Eq. 10 (triangle) and Eq. 12 (quadrilateral) from corner positions and edge coefficients.
fn patch(ids: &[u32], vertices: &[Vec3], c: impl Fn(u32, u32) -> Vec3) -> Patch {
    let x = |k: usize| vertices[ids[k] as usize];
    if ids.len() == 3 {
        let (x00, x10, x11) = (x(0), x(1), x(2));
        let (c1, c2, c3) = (c(ids[0], ids[1]), c(ids[1], ids[2]), c(ids[0], ids[2]));
        let c10 = x10 - x00 - c1;
        Patch::Triangle([x00, c10, x11 - x10 + c1 - c3, c3 - c1 - c2, c1, c2])
    } else {
        let (x00, x10, x11, x01) = (x(0), x(1), x(2), x(3));
        let (c1, c2) = (c(ids[0], ids[1]), c(ids[1], ids[2]));
        let (c3, c4) = (c(ids[3], ids[2]), c(ids[0], ids[3]));
        let c11 = x11 - x10 - x01 + x00 + c1 - c2 - c3 + c4;
        Patch::Quad([x00, x10 - x00 - c1, x01 - x00 - c4, c11, c1, c4, c3 - c1, c2 - c4])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two quadrilaterals with a common edge over a quarter cylinder of radius 7.
    fn cylinder() -> (Vec<Vec3>, Vec<Vec3>, Vec<PatchCorners>) {
        let (mut vertices, mut normals) = (vec![], vec![]);
        for k in 0..3 {
            let a = std::f64::consts::FRAC_PI_4 * f64::from(k);
            let n = Vec3::new(a.cos(), 0.0, a.sin());
            vertices.extend([n * 7.0, n * 7.0 + Vec3::y() * 5.0]);
            normals.extend([n, n]);
        }
        let quad = |k: u32| PatchCorners {
            vertices: vec![k, k + 1, k + 3, k + 2],
            normals: vec![k, k + 1, k + 3, k + 2],
            face: 0,
        };
        (vertices, normals, vec![quad(0), quad(2)])
    }

    #[test]
    fn normals_that_point_behind_their_corners_are_refused() {
        let (vertices, normals, corners) = cylinder();
        let turned = normals.iter().map(|n| -n).collect();
        let found =
            build("t".into(), ToolKind::Nagata, vertices, turned, corners, EdgeRule::Guarded);
        assert_eq!(found.unwrap_err(), ToolError::Turned { patch: 0, count: 2, of: 2 });
    }

    #[test]
    fn corners_edges_and_normals_are_interpolated() {
        let (vertices, normals, corners) = cylinder();
        let (model, straight) =
            build("t".into(), ToolKind::Nagata, vertices, normals, corners, EdgeRule::Guarded)
                .unwrap();
        assert!(straight.is_empty());
        let at = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        for (patch, corners) in model.patches.iter().zip(&model.corners) {
            for (k, (e, z)) in at.into_iter().enumerate() {
                let vertex = model.vertices[corners.vertices[k] as usize];
                let normal = model.normals[corners.normals[k] as usize];
                assert!((patch.derivs(e, z).s - vertex).norm() < 1e-14);
                assert!((patch.normal(e, z).unwrap() - normal).norm() < 1e-12);
            }
        }
        // The common edge has the same points from both sides.
        for t in [0.25, 0.5, 0.75] {
            let (a, b) = (model.patches[0].derivs(t, 1.0).s, model.patches[1].derivs(t, 0.0).s);
            assert!((a - b).norm() < 1e-15);
        }
    }

    #[test]
    fn facets_are_flat() {
        let (vertices, normals, corners) = cylinder();
        let (model, _) =
            build("t".into(), ToolKind::Facets, vertices, normals, corners, EdgeRule::Guarded)
                .unwrap();
        let d = model.patches[0].derivs(0.3, 0.6);
        assert!(d.d11.norm() == 0.0 && d.d22.norm() == 0.0);
    }

    #[test]
    fn wrong_ids_and_lengths_are_named() {
        let fails = |change: fn(&mut Vec<Vec3>, &mut Vec<Vec3>, &mut Vec<PatchCorners>)| {
            let (mut v, mut n, mut c) = cylinder();
            change(&mut v, &mut n, &mut c);
            build("t".into(), ToolKind::Nagata, v, n, c, EdgeRule::Guarded).unwrap_err()
        };
        assert_eq!(
            fails(|_, _, c| c[1].vertices[0] = 99),
            ToolError::Id { patch: 1, what: "vertex", id: 99, last: 5 }
        );
        assert!(matches!(fails(|_, n, _| n[2] *= 1.1), ToolError::NormalLength { index: 2, .. }));
        assert!(matches!(
            fails(|v, _, _| v[0].x = f64::NAN),
            ToolError::Number { what: "vertex", index: 0, .. }
        ));
        let far = fails(|v, _, _| v[1].y = 9_223_372_036_854_775_807.0);
        assert!(far.to_string().contains("allowed: up to 1e7 mm"), "{far}");
        assert!(matches!(fails(|_, _, c| c[0].normals.truncate(2)), ToolError::Corners { .. }));
        let twice = fails(|_, _, c| c[0].vertices = vec![0, 0, 1, 1]);
        assert_eq!(twice, ToolError::Collapsed { patch: 0 });
    }
}
