//! Recombination of pairs of triangles to quadrilaterals, best pairs first.

use std::collections::BTreeMap;

use super::edge_tangents::EdgeTangents;
use super::patchwork::Patchwork;
use crate::Element;
use kanagata_cad::model::Face;
use kanagata_geometry::Vec3;

/// Signed sine of the worst corner below which a pair remains two triangles.
const CORNER_SINE_MIN: f64 = 0.35;
/// Cosine between the normals of both halves below which a pair remains two triangles.
const FOLD_COSINE_MIN: f64 = 0.5;

/// Recombines triangles of `work` to quadrilaterals with good corners. Existing quadrilaterals are unchanged.
pub fn pair(face: &Face, work: &mut Patchwork, edge_tangents: &EdgeTangents) {
    let mut owner: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for (k, e) in work.elements.iter().enumerate().filter(|(_, e)| e.nodes().len() == 3) {
        e.sides().for_each(|side| {
            owner.insert(side, k);
        });
    }
    let normals: Vec<Option<Vec3>> = work.nodes.iter().map(|n| face.surface.normal(n.uv)).collect();
    let mut pairs = Vec::new();
    for (&[a, b], &left) in &owner {
        let Some(&right) = owner.get(&[b, a]).filter(|_| a < b) else { continue };
        let apex = |k: usize| work.elements[k].nodes().iter().copied().find(|&n| n != a && n != b);
        let (Some(c), Some(d)) = (apex(left), apex(right)) else { continue };
        // `left` is a b c, `right` is b a d: the quadrilateral is a d b c.
        let ring = [a, d, b, c];
        let quality = quality(work, ring, &normals);
        let nodes = ring.map(|n| &work.nodes[n as usize]);
        if quality >= CORNER_SINE_MIN && edge_tangents.has_valid_corners(face, &nodes) {
            pairs.push((quality, left, right, ring));
        }
    }
    pairs.sort_by(|x, y| y.0.total_cmp(&x.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    let mut used = vec![false; work.elements.len()];
    let mut quads = Vec::new();
    for (_, left, right, ring) in pairs {
        if !used[left] && !used[right] {
            used[left] = true;
            used[right] = true;
            quads.push(Element::quad(ring, 0));
        }
    }
    let rest = work.elements.iter().zip(&used).filter(|(_, used)| !**used).map(|(e, _)| *e);
    quads.extend(rest);
    work.elements = quads;
}

/// Smallest signed sine of the corners relative to the surface normal; -1 when two corners are one vertex or the
/// quadrilateral is too strongly bent.
fn quality(work: &Patchwork, ring: [u32; 4], normals: &[Option<Vec3>]) -> f64 {
    let at = |k: usize| work.nodes[ring[k % 4] as usize].point;
    let halves = [0, 2].map(|k| (at(k + 1) - at(k)).cross(&(at(k + 3) - at(k))));
    let same = (0..4).any(|k| {
        let node = |k: usize| work.nodes[ring[k % 4] as usize];
        node(k).same(&node(k + 1)) || node(k).same(&node(k + 2))
    });
    if same || halves[0].dot(&halves[1]) < FOLD_COSINE_MIN * halves[0].norm() * halves[1].norm() {
        return -1.0;
    }
    let mut worst = 1.0f64;
    for k in 0..4 {
        let (out, back) = (at(k + 1) - at(k), at(k + 3) - at(k));
        let cross = out.cross(&back);
        let normal = normals[ring[k] as usize].unwrap_or(cross);
        let scale = out.norm() * back.norm() * normal.norm();
        worst = worst.min(if scale > 0.0 { cross.dot(&normal) / scale } else { -1.0 });
    }
    worst
}
