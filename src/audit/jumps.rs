//! Gaps and normal discontinuities between adjacent patches.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::gaps::{self, OpenSide};
use super::reference::ReferenceSurface;
use super::report::Jumps;
use super::sample::angle_deg;
use super::side::{Side, on_side};
use kanagata_geometry::{Aabb, Vec3};
use kanagata_tool::side::corners;
use kanagata_tool::{Patch, ToolModel};

/// Compares the patches at each common edge at `n + 1` points. Also returns the sides at free borders of the tool: used
/// by one patch, and the CAD does not continue beyond them.
pub(super) fn find(
    tool: &ToolModel,
    reference: &impl ReferenceSurface,
    n: usize,
) -> (Jumps, Vec<Side>) {
    let edges: Vec<([u32; 2], Vec<Side>)> = edges(tool).into_iter().collect();
    let found: Vec<Jumps> = edges.par_iter().map(|(_, s)| of_edge(tool, reference, s, n)).collect();
    let mut free = free(&edges);
    let open = gaps::across(tool, reference, &free, n);
    let inner: BTreeSet<[usize; 2]> = open.iter().map(|o| [o.patch, o.side]).collect();
    free.retain(|s| !inner.contains(&[s.patch, s.side]));
    let mut all = Jumps { open_sides: open.len(), ..Jumps::default() };
    if let Some(o) = open.iter().max_by(|a, b| a.gap_mm.total_cmp(&b.gap_mm)) {
        all.border_gap_mm = o.gap_mm;
        all.border_gap_patch = Some(o.patch as u32);
        all.border_gap_at = Some(o.at.into());
    }
    for j in found {
        all.shared_edges += j.shared_edges;
        all.free_edges += j.free_edges;
        all.creases += j.creases;
        all.position_mm = all.position_mm.max(j.position_mm);
        all.crease_deg = all.crease_deg.max(j.crease_deg);
        if j.normal_deg > all.normal_deg {
            (all.normal_deg, all.normal_patches) = (j.normal_deg, j.normal_patches);
        }
    }
    (all, free)
}

/// Sides used by one patch beyond which the CAD continues, with their gaps: those of independently divided faces.
pub(super) fn open_sides(
    tool: &ToolModel,
    reference: &impl ReferenceSurface,
    n: usize,
) -> Vec<OpenSide> {
    let edges: Vec<([u32; 2], Vec<Side>)> = edges(tool).into_iter().collect();
    gaps::across(tool, reference, &free(&edges), n)
}

/// Sides used by one patch.
fn free(edges: &[([u32; 2], Vec<Side>)]) -> Vec<Side> {
    edges.iter().filter(|e| e.1.len() == 1).map(|e| e.1[0]).collect()
}

fn of_edge(tool: &ToolModel, reference: &impl ReferenceSurface, sides: &[Side], n: usize) -> Jumps {
    let mut found = Jumps::default();
    let [first, others @ ..] = sides else { return found };
    if others.is_empty() {
        found.free_edges = 1;
        return found;
    }
    found.shared_edges = 1;
    for other in others {
        let crease = is_crease(tool, reference, *first, *other);
        found.creases |= usize::from(crease);
        for k in 0..=n {
            let t = k as f64 / n as f64;
            let (p, a) = on_side(&tool.patches[first.patch], *first, t);
            let (q, b) = on_side(&tool.patches[other.patch], *other, t);
            found.position_mm = found.position_mm.max((p - q).norm());
            let angle = a.zip(b).map_or(0.0, |(a, b)| angle_deg(&a, &b));
            if crease {
                found.crease_deg = found.crease_deg.max(angle);
            } else if angle > found.normal_deg {
                found.normal_deg = angle;
                found.normal_patches = Some([first.patch as u32, other.patch as u32]);
            }
        }
    }
    found
}

/// True for a crease. Nagata patches and facets: they do not have common normals at both ends. Bezier patches: the
/// normals of their CAD faces at the middle of the edge differ by more than one degree.
fn is_crease(
    tool: &ToolModel,
    reference: &impl ReferenceSurface,
    first: Side,
    other: Side,
) -> bool {
    let ends = |s: Side| {
        let normals = &tool.corners.get(s.patch)?.normals;
        let pair = [*normals.get(s.side)?, *normals.get((s.side + 1) % normals.len())?];
        Some(if s.reversed { [pair[1], pair[0]] } else { pair })
    };
    if let (Some(a), Some(b)) = (ends(first), ends(other)) {
        return a != b;
    }
    let middle = on_side(&tool.patches[first.patch], first, 0.5).0;
    let normal = |s: Side| {
        let foot = reference.closest(&middle, tool.faces[s.patch])?;
        Some(foot.own_normal.unwrap_or(foot.normal))
    };
    tool.faces[first.patch] != tool.faces[other.patch]
        && normal(first).zip(normal(other)).is_some_and(|(a, b)| angle_deg(&a, &b) > 1.0)
}

/// Sides by their corners, lower id first; the patches of each edge in order.
fn edges(tool: &ToolModel) -> BTreeMap<[u32; 2], Vec<Side>> {
    let ids: Vec<Vec<u32>> = if tool.corners.len() == tool.patches.len() {
        tool.corners.iter().map(|c| c.vertices.clone()).collect()
    } else {
        welded(&tool.patches)
    };
    let mut edges: BTreeMap<[u32; 2], Vec<Side>> = BTreeMap::new();
    for (patch, ring) in ids.iter().enumerate() {
        for side in 0..ring.len() {
            let (a, b) = (ring[side], ring[(side + 1) % ring.len()]);
            if a != b {
                let at = Side { patch, side, reversed: a > b };
                edges.entry([a.min(b), a.max(b)]).or_default().push(at);
            }
        }
    }
    edges
}

/// Corner ids of patches without ids: corners within 1e-6 of the model's size are merged.
fn welded(patches: &[Patch]) -> Vec<Vec<u32>> {
    let ring = |p: &Patch| -> Vec<Vec3> {
        corners(p.sides()).iter().map(|&(e, z)| p.derivs(e, z).s).collect()
    };
    let rings: Vec<Vec<Vec3>> = patches.iter().map(ring).collect();
    let all: Vec<Vec3> = rings.iter().flatten().copied().collect();
    let size = Aabb::of_points(&all).diagonal();
    let near = (1e-6 * size).max(f64::MIN_POSITIVE);
    let cell = |p: &Vec3| [0, 1, 2].map(|k| (p[k] / near).floor() as i64);
    let mut known: FxHashMap<[i64; 3], Vec<(u32, Vec3)>> = FxHashMap::default();
    let mut count = 0;
    let mut id = |p: &Vec3| {
        let [x, y, z] = cell(p);
        for k in 0..27 {
            let at = [x + k / 9 - 1, y + k / 3 % 3 - 1, z + k % 3 - 1];
            let same = known.get(&at).and_then(|l| l.iter().find(|q| (q.1 - p).norm() <= near));
            if let Some(found) = same {
                return found.0;
            }
        }
        count += 1;
        known.entry([x, y, z]).or_default().push((count - 1, *p));
        count - 1
    };
    rings.iter().map(|ring| ring.iter().map(&mut id).collect()).collect()
}
