//! Tangents of patch sides along curved CAD edges.
//!
//! A patch side on the boundary of a face leaves its ends along the CAD edge, not along the chord. Two sides on one
//! smooth boundary meet in a straight angle although their chords do not. The corner of an element between them is then
//! inverted by the inaccuracy of the CAD tangents.

use rustc_hash::FxHashMap;

use super::patchwork::Node;
use super::sine::sine;
use kanagata_cad::model::Face;
use kanagata_geometry::Vec3;

/// Signed sine of a corner between boundary sides below which the corner is inverted: less than straight by more than
/// rounding. A straight corner is valid where the patch lies in its plane.
pub const INVERTED_CORNER_SINE: f64 = -1e-8;

/// Tangents of the sides of one face along curved edges, by the vertices of each side in the direction of the loop.
#[derive(Debug, Clone, Default)]
pub struct EdgeTangents(FxHashMap<[u32; 2], [Vec3; 2]>);

impl EdgeTangents {
    /// Adds the sides between consecutive vertices of an edge, in the direction of the loop, with the tangents of the
    /// edge there.
    pub fn add(&mut self, ids: &[u32], tangents: &[Vec3]) {
        for (ends, t) in ids.windows(2).zip(tangents.windows(2)) {
            self.0.insert([ends[0], ends[1]], [t[0], -t[1]]);
        }
    }

    /// True when no side is curved.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Tangents at both ends of the side between two consecutive nodes of a loop; `None` for a straight side.
    pub fn of(&self, from: &Node, to: &Node) -> Option<&[Vec3; 2]> {
        self.0.get(&[from.id?, to.id?])
    }

    /// Signed sine of the corner at `ring[1]` between the sides from `ring[0]` and to `ring[2]`, relative to `normal`,
    /// for an element with the orientation of the loops. `None` when neither side is curved.
    pub fn corner(&self, ring: [&Node; 3], normal: &Vec3) -> Option<f64> {
        let [before, at, after] = ring;
        let (back, out) = (self.of(before, at), self.of(at, after));
        if back.is_none() && out.is_none() {
            return None;
        }
        let back = back.map_or(before.point - at.point, |b| b[1]);
        let out = out.map_or(after.point - at.point, |o| o[0]);
        Some(sine(&out, &back, normal))
    }

    /// True when no corner of an element is inverted along the boundary.
    pub fn has_valid_corners(&self, face: &Face, ring: &[&Node]) -> bool {
        let count = ring.len();
        let sound = |k: usize| {
            let corner = [ring[(k + count - 1) % count], ring[k], ring[(k + 1) % count]];
            let Some(normal) = face.surface.normal(ring[k].uv) else { return true };
            self.corner(corner, &normal).is_none_or(|sine| sine > INVERTED_CORNER_SINE)
        };
        self.is_empty() || (0..count).all(sound)
    }
}
