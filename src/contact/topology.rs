//! Which sides and corners of the patches lie on the free border of the tool.
//!
//! Two patches are neighbours when they share the two vertices of a side; Bezier patches, which list no
//! vertices, when their corners coincide within 1e-7 of the model's size.

use rustc_hash::FxHashMap;

use crate::geometry::{Aabb, Vec3};
use crate::tool::{Patch, ToolModel};

/// Free sides and corners of every patch, one bit each.
#[derive(Debug, Clone)]
pub(super) struct Borders {
    sides: Vec<u8>,
    corners: Vec<u8>,
}

impl Borders {
    pub(super) fn of(model: &ToolModel) -> Self {
        let ids = corner_ids(model);
        let mut users: FxHashMap<(u32, u32), u32> = FxHashMap::default();
        for corners in &ids {
            for (a, b) in sides_of(corners) {
                *users.entry((a.min(b), a.max(b))).or_default() += 1;
            }
        }
        let mut free_vertex: FxHashMap<u32, bool> = FxHashMap::default();
        let mut out = Self { sides: vec![0; ids.len()], corners: vec![0; ids.len()] };
        for (patch, corners) in ids.iter().enumerate() {
            for (k, (a, b)) in sides_of(corners).enumerate() {
                if a != b && users[&(a.min(b), a.max(b))] == 1 {
                    out.sides[patch] |= 1 << k;
                    free_vertex.insert(a, true);
                    free_vertex.insert(b, true);
                }
            }
        }
        for (patch, corners) in ids.iter().enumerate() {
            for (k, id) in corners.iter().enumerate() {
                if free_vertex.contains_key(id) {
                    out.corners[patch] |= 1 << k;
                    // A side of no length is its corner.
                    if corners[(k + 1) % corners.len()] == *id {
                        out.sides[patch] |= 1 << k;
                    }
                }
            }
        }
        out
    }

    pub(super) fn side_is_free(&self, patch: u32, side: u8) -> bool {
        self.sides[patch as usize] & (1 << side) != 0
    }

    pub(super) fn corner_is_free(&self, patch: u32, corner: u8) -> bool {
        self.corners[patch as usize] & (1 << corner) != 0
    }
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
    points.iter().map(|c| c.iter().map(|p| seen.id(p)).collect()).collect()
}

fn corner_points(patch: &Patch) -> Vec<Vec3> {
    let all = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
    all[..patch.sides()].iter().map(|&(eta, zeta)| patch.derivs(eta, zeta).s).collect()
}

/// Gives equal ids to points within a cell of each other.
struct Welder {
    cell: f64,
    cells: FxHashMap<[i64; 3], Vec<(Vec3, u32)>>,
    count: u32,
}

impl Welder {
    fn id(&mut self, p: &Vec3) -> u32 {
        let key = [0, 1, 2].map(|k| (p[k] / self.cell).floor() as i64);
        for near in 0..27_i64 {
            let shift = [near % 3 - 1, near / 3 % 3 - 1, near / 9 - 1];
            let cell = [0, 1, 2].map(|k| key[k].saturating_add(shift[k]));
            let hit = self.cells.get(&cell).and_then(|points| {
                points.iter().find(|(q, _)| (q - p).norm() <= self.cell).map(|&(_, id)| id)
            });
            if let Some(id) = hit {
                return id;
            }
        }
        self.cells.entry(key).or_default().push((*p, self.count));
        self.count += 1;
        self.count - 1
    }
}
