//! Triangles joined in pairs to quadrilaterals, best pairs first.

use std::collections::BTreeMap;

use super::bends::Bends;
use super::patchwork::Patchwork;
use crate::cad::model::Face;
use crate::geometry::Vec3;
use crate::mesh::Element;

/// Pairs whose worst corner (sine of its angle, signed) is below this stay triangles.
const WORST: f64 = 0.35;
/// Pairs bent more than this along their diagonal (cosine between the halves) stay triangles.
const BENT: f64 = 0.5;

/// Joins triangles of `work` to quads where the quad's corners are good. Elements that are quads already
/// stay as they are.
pub fn pair(face: &Face, work: &mut Patchwork, bends: &Bends) {
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
        // `left` runs a b c, `right` b a d: the quad is a d b c.
        let ring = [a, d, b, c];
        let quality = quality(work, ring, &normals);
        let nodes = ring.map(|n| &work.nodes[n as usize]);
        if quality >= WORST && bends.suit(face, &nodes) {
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

/// Smallest signed sine of the corners against the surface normal; -1 when two corners are one vertex or
/// the quad is bent too much.
fn quality(work: &Patchwork, ring: [u32; 4], normals: &[Option<Vec3>]) -> f64 {
    let at = |k: usize| work.nodes[ring[k % 4] as usize].point;
    let halves = [0, 2].map(|k| (at(k + 1) - at(k)).cross(&(at(k + 3) - at(k))));
    let same = (0..4).any(|k| {
        let node = |k: usize| work.nodes[ring[k % 4] as usize];
        node(k).same(&node(k + 1)) || node(k).same(&node(k + 2))
    });
    if same || halves[0].dot(&halves[1]) < BENT * halves[0].norm() * halves[1].norm() {
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
