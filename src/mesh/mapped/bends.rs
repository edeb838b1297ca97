//! Which way the sides of patches leave their ends on the border of a face: along the edges of the CAD, not along
//! chords. Two sides along one smooth border meet in a straight angle although their chords do not, and the corner of an
//! element between them turns over by whatever the CAD's tangents are off.

use rustc_hash::FxHashMap;

use super::patchwork::Node;
use super::sine::sine;
use crate::cad::model::Face;
use crate::geometry::Vec3;

/// Sine of a corner between sides along the border below which it is turned over: less than straight by more than
/// rounding. A straight corner is sound where the patch lies in its plane.
pub const TURNED: f64 = -1e-8;

/// For the sides of one face along bent edges, by the vertices they run from and to in the loop's direction: the
/// directions in which they leave these.
#[derive(Debug, Clone, Default)]
pub struct Bends(FxHashMap<[u32; 2], [Vec3; 2]>);

impl Bends {
    /// Adds the sides between the vertices of an edge in the loop's direction, with the edge's tangents there.
    pub fn add(&mut self, ids: &[u32], tangents: &[Vec3]) {
        for (ends, t) in ids.windows(2).zip(tangents.windows(2)) {
            self.0.insert([ends[0], ends[1]], [t[0], -t[1]]);
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Directions in which the side between two nodes that follow each other on a loop leaves the first and the second;
    /// `None` where it is not bent.
    pub fn of(&self, from: &Node, to: &Node) -> Option<&[Vec3; 2]> {
        self.0.get(&[from.id?, to.id?])
    }

    /// Signed sine of the corner at `ring[1]` between the sides from `ring[0]` and to `ring[2]`, of an element that
    /// turns as the loops do, against `normal`; `None` when neither side is bent.
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

    /// Whether no corner of an element is turned over along the border.
    pub fn suit(&self, face: &Face, ring: &[&Node]) -> bool {
        let count = ring.len();
        let sound = |k: usize| {
            let corner = [ring[(k + count - 1) % count], ring[k], ring[(k + 1) % count]];
            let Some(normal) = face.surface.normal(ring[k].uv) else { return true };
            self.corner(corner, &normal).is_none_or(|sine| sine > TURNED)
        };
        self.is_empty() || (0..count).all(sound)
    }
}
