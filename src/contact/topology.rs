//! Classification of the sides and corners of patches: free border of the tool, or one of its [`joints`].
//!
//! Two patches are neighbours when they have the two vertices of a side in common. Bezier patches, which have no vertex
//! ids, are neighbours when their corners coincide within 1e-7 of the model's size.

use rustc_hash::{FxHashMap, FxHashSet};

use super::joints;
use super::projection::Location;
use kanagata_geometry::{Aabb, Vec3};
use kanagata_tool::side::sides_used_once;
use kanagata_tool::{Patch, ToolModel};

/// Sides and corners of every patch, one bit each; empty without any.
#[derive(Debug, Clone, Default)]
struct Bits {
    sides: Vec<u8>,
    corners: Vec<u8>,
}

impl Bits {
    /// The given sides and the corners at their ends, for all patches that share them.
    fn of_sides(ids: &[Vec<u32>], sides: Vec<u8>) -> Self {
        let mut ends: FxHashSet<u32> = FxHashSet::default();
        for (corners, bits) in ids.iter().zip(&sides) {
            for (k, (a, b)) in sides_of(corners).enumerate() {
                if bits & (1 << k) != 0 {
                    ends.extend([a, b]);
                }
            }
        }
        let mut out = Self { sides, corners: vec![0; ids.len()] };
        for (patch, corners) in ids.iter().enumerate() {
            for (k, id) in corners.iter().enumerate() {
                if ends.contains(id) {
                    out.corners[patch] |= 1 << k;
                    // A collapsed side is equivalent to its corner.
                    if corners[(k + 1) % corners.len()] == *id {
                        out.sides[patch] |= 1 << k;
                    }
                }
            }
        }
        out
    }

    fn holds(&self, patch: u32, location: Location) -> bool {
        let set = |bits: &[u8], k: u8| bits.get(patch as usize).is_some_and(|b| b & (1 << k) != 0);
        match location {
            Location::Inside => false,
            Location::Edge(k) => set(&self.sides, k),
            Location::Vertex(k) => set(&self.corners, k),
        }
    }
}

/// The free border of a tool, and its joints.
#[derive(Debug, Clone)]
pub(super) struct Borders {
    free: Bits,
    joints: Bits,
}

impl Borders {
    pub(super) fn of(model: &ToolModel) -> Self {
        let ids = corner_ids(model);
        let once = used_once(&ids);
        if model.border_gap_mm == 0.0 {
            return Self { free: Bits::of_sides(&ids, once), joints: Bits::default() };
        }
        let joint = joints::sides(model, &once);
        let outer: Vec<u8> = once.iter().zip(&joint).map(|(all, joint)| all & !joint).collect();
        let ends = joints::ends(model, &outer);
        let mut free = Bits::of_sides(&ids, outer);
        let joints = Bits::of_sides(&ids, joint);
        // Where a joint ends at the border of the tool its corners are on the border, although none of their sides is
        // free.
        for (patch, bits) in joints.corners.iter().enumerate() {
            for k in (0..4).filter(|k| bits & (1 << k) != 0) {
                free.corners[patch] |= u8::from(ends.near(model, patch, k)) << k;
            }
        }
        Self { free, joints }
    }

    /// True when a foot point at `location` is on the free border.
    pub(super) fn is_free(&self, patch: u32, location: Location) -> bool {
        self.free.holds(patch, location)
    }

    /// True when there are joints.
    #[inline(always)]
    pub(super) fn has_joints(&self) -> bool {
        !self.joints.sides.is_empty()
    }

    /// True when a foot point at `location` is on a joint.
    pub(super) fn is_joint(&self, patch: u32, location: Location) -> bool {
        self.joints.holds(patch, location)
    }
}

/// Non-degenerate sides used by one patch.
fn used_once(ids: &[Vec<u32>]) -> Vec<u8> {
    let rings: Vec<&[u32]> = ids.iter().map(|ring| &ring[..]).collect();
    let bits = |sides: Vec<usize>| sides.iter().fold(0, |bits, k| bits | 1 << k);
    sides_used_once(&rings).into_iter().map(bits).collect()
}

fn sides_of(corners: &[u32]) -> impl Iterator<Item = (u32, u32)> + '_ {
    (0..corners.len()).map(|k| (corners[k], corners[(k + 1) % corners.len()]))
}

/// Vertex ids of every patch, in the order of its corners.
pub(super) fn corner_ids(model: &ToolModel) -> Vec<Vec<u32>> {
    if model.corners.len() == model.patches.len() {
        return model.corners.iter().map(|c| c.vertices.clone()).collect();
    }
    let points: Vec<Vec<Vec3>> = model.patches.iter().map(corner_points).collect();
    let size = Aabb::of_points(points.iter().flatten()).diagonal();
    let mut seen =
        Welder { cell: (1e-7 * size).max(1e-300), cells: FxHashMap::default(), count: 0 };
    // Independently divided faces have nothing in common.
    let part = |face: u32| if model.border_gap_mm > 0.0 { face } else { 0 };
    let rings = points.iter().zip(&model.faces);
    rings.map(|(c, &face)| c.iter().map(|p| seen.id(p, part(face))).collect()).collect()
}

fn corner_points(patch: &Patch) -> Vec<Vec3> {
    let all = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
    all[..patch.sides()].iter().map(|&(eta, zeta)| patch.derivs(eta, zeta).s).collect()
}

/// A cell of one part.
type Cell = ([i64; 3], u32);

/// Assigns equal ids to points of one part within a cell of each other.
struct Welder {
    cell: f64,
    cells: FxHashMap<Cell, Vec<(Vec3, u32)>>,
    count: u32,
}

impl Welder {
    fn id(&mut self, p: &Vec3, part: u32) -> u32 {
        let key = [0, 1, 2].map(|k| (p[k] / self.cell).floor() as i64);
        for near in 0..27_i64 {
            let shift = [near % 3 - 1, near / 3 % 3 - 1, near / 9 - 1];
            let cell = [0, 1, 2].map(|k| key[k].saturating_add(shift[k]));
            let hit = self.cells.get(&(cell, part)).and_then(|points| {
                points.iter().find(|(q, _)| (q - p).norm() <= self.cell).map(|&(_, id)| id)
            });
            if let Some(id) = hit {
                return id;
            }
        }
        self.cells.entry((key, part)).or_default().push((*p, self.count));
        self.count += 1;
        self.count - 1
    }
}
