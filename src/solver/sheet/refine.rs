//! Local refinement of a sheet in plan: every element of a base mesh is split into `4^level` columns of elements through
//! the thickness.
//!
//! The levels of two base elements with a common side differ by at most 1 ([`Refinement::balanced`]), so that a side of
//! a coarser element holds at most one hanging column for each of its parts. The ends of such a part are nodes of the
//! coarser element on the common side. They are corners of elements on both sides, hence no master hangs itself.
//!
//! A new column is the bilinear mean of the four corner columns of its base element, level by level. On the rim of a
//! disc it is moved to the circle, and the columns inside the base element follow by transfinite (Coons) interpolation.

use rustc_hash::FxHashMap;

use super::hanging::{Hanging, HangingColumn};
use super::hex_mesh::HexMesh;
use kanagata_geometry::{Vec2, Vec3};

/// Largest level: a base element is split into 256. With twice as many, elements are 256 times shorter than their base,
/// and thinner sheets than any would be resolved; the limit bounds the memory that a scene can ask for.
pub const LEVEL_MAX: u8 = 4;

/// Distance from the rim of a disc over its radius within which a column lies on it.
const ON_RIM_REL: f64 = 1e-9;

/// Elements of a sheet in plan by their corner columns, counter-clockwise seen from the top: those of its lowest layer,
/// in their order.
#[must_use]
pub fn plan_elements(mesh: &HexMesh) -> Vec<[u32; 4]> {
    let levels = mesh.nodes_per_column.max(1) as u32;
    let lowest = |e: &&[u32; 8]| levels > 1 && e[..4].iter().all(|n| n % levels == 0);
    let corners = |e: &[u32; 8]| [e[0], e[1], e[2], e[3]].map(|n| n / levels);
    mesh.elements.iter().filter(lowest).map(corners).collect()
}

/// Levels of the elements of a base mesh in plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Refinement {
    quads: Vec<[u32; 4]>,
    levels: Vec<u8>,
    sides: FxHashMap<[u32; 2], Side>,
    /// Elements whose level was raised to balance them.
    pub raised: usize,
}

/// A side of a base element.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Side {
    /// The first two elements on it.
    elements: [Option<u32>; 2],
    /// Larger level of them.
    level: u8,
    smaller: u8,
    /// First new column on it, and their number is `2^level - 1`; from the end column with the smaller number.
    first: u32,
}

fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl Refinement {
    /// Levels of the plan elements `quads`, raised where necessary so that they differ by at most 1 over common sides.
    /// Missing levels are 0; levels are at most [`LEVEL_MAX`].
    #[must_use]
    pub fn balanced(quads: Vec<[u32; 4]>, mut levels: Vec<u8>) -> Self {
        levels.resize(quads.len(), 0);
        levels.iter_mut().for_each(|level| *level = (*level).min(LEVEL_MAX));
        let mut sides: FxHashMap<[u32; 2], Side> = FxHashMap::default();
        let new = Side { elements: [None; 2], level: 0, smaller: 0, first: 0 };
        for (e, quad) in quads.iter().enumerate() {
            for k in 0..4 {
                let side = sides.entry(key(quad[k], quad[(k + 1) % 4])).or_insert(new);
                let free = side.elements.iter_mut().find(|element| element.is_none());
                free.into_iter().for_each(|free| *free = Some(e as u32));
            }
        }
        let given = levels.clone();
        for level in (1..=LEVEL_MAX).rev() {
            for e in 0..quads.len() {
                if levels[e] != level {
                    continue;
                }
                for k in 0..4 {
                    let side = &sides[&key(quads[e][k], quads[e][(k + 1) % 4])];
                    for other in side.elements.into_iter().flatten() {
                        levels[other as usize] = levels[other as usize].max(level - 1);
                    }
                }
            }
        }
        let raised = given.iter().zip(&levels).filter(|(given, level)| given != level).count();
        for side in sides.values_mut() {
            let of = side.elements.iter().flatten().map(|&e| levels[e as usize]);
            (side.smaller, side.level) =
                of.fold((LEVEL_MAX, 0), |(low, high), level| (low.min(level), high.max(level)));
        }
        Self { quads, levels, sides, raised }
    }

    /// Levels of the plan elements.
    #[must_use]
    pub fn levels(&self) -> &[u8] {
        &self.levels
    }

    /// Elements in plan after the refinement.
    #[must_use]
    pub fn element_count(&self) -> usize {
        self.levels.iter().map(|&level| 1usize << (2 * level)).sum()
    }

    /// The refined mesh of `base`, whose plan elements are those of the refinement. `rim`: radius of the circle about
    /// the origin that its curved outline lies on [mm], if any.
    ///
    /// Columns of the base keep their numbers. Elements follow in the order of the base elements.
    #[must_use]
    pub fn mesh(mut self, base: &HexMesh, rim: Option<f64>) -> HexMesh {
        let levels = base.nodes_per_column.max(1);
        let mut build = Build { levels, nodes: base.nodes.clone(), hanging: Vec::new(), rim };
        let mut elements = Vec::with_capacity(self.element_count() * (levels - 1));
        let mut made = rustc_hash::FxHashSet::default();
        for e in 0..self.quads.len() {
            let quad = self.quads[e];
            for k in 0..4 {
                let [a, b] = key(quad[k], quad[(k + 1) % 4]);
                if made.insert([a, b])
                    && let Some(side) = self.sides.get_mut(&[a, b])
                {
                    build.side([a, b], side);
                }
            }
            let grid = self.grid(e, &mut build);
            push_elements(&grid, 1 << self.levels[e], levels, &mut elements);
        }
        let mut mesh = HexMesh {
            nodes: build.nodes,
            elements,
            nodes_per_column: levels,
            hanging: Hanging::new(build.hanging),
        };
        mesh.set_reference_means();
        mesh
    }

    /// Columns of the grid over base element `e`, row by row: index `j * (m + 1) + i` for `m = 2^level`, with `i` from
    /// its corner 0 to 1 and `j` from 0 to 3. Makes the columns inside.
    fn grid(&self, e: usize, build: &mut Build) -> Vec<u32> {
        let (quad, level) = (self.quads[e], self.levels[e]);
        let m = 1usize << level;
        let mut ids = vec![0; (m + 1) * (m + 1)];
        let place = |side: usize, t: usize| match side {
            0 => t,
            1 => t * (m + 1) + m,
            2 => m * (m + 1) + m - t,
            _ => (m - t) * (m + 1),
        };
        for k in 0..4 {
            let [a, b] = [quad[k], quad[(k + 1) % 4]];
            let side = &self.sides[&key(a, b)];
            let (step, count) = (1usize << (side.level - level), 1usize << side.level);
            ids[place(k, 0)] = a;
            for t in 1..m {
                let from_a = t * step;
                let along = if a < b { from_a } else { count - from_a };
                ids[place(k, t)] = side.first + along as u32 - 1;
            }
        }
        let coons = Coons { quad, m, ids: &ids };
        let inside: Vec<Vec<Vec3>> = (1..m)
            .flat_map(|j| (1..m).map(move |i| [i, j]))
            .map(|at| coons.column(build, at))
            .collect();
        let mut next = build.column_count();
        for j in 1..m {
            for i in 1..m {
                ids[j * (m + 1) + i] = next;
                next += 1;
            }
        }
        build.nodes.extend(inside.into_iter().flatten());
        ids
    }
}

/// Hexahedra of `layers = levels - 1` over the grid of a base element.
fn push_elements(grid: &[u32], m: usize, levels: usize, out: &mut Vec<[u32; 8]>) {
    let at = |i: usize, j: usize| grid[j * (m + 1) + i] * levels as u32;
    for j in 0..m {
        for i in 0..m {
            let ring = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            for k in 0..levels as u32 - 1 {
                let ([a, b, c, d], [e, f, g, h]) = (ring.map(|n| n + k), ring.map(|n| n + k + 1));
                out.push([a, b, c, d, e, f, g, h]);
            }
        }
    }
}

/// The refined mesh as it is built.
struct Build {
    /// Nodes in a column.
    levels: usize,
    nodes: Vec<Vec3>,
    hanging: Vec<HangingColumn>,
    rim: Option<f64>,
}

/// Linear interpolation that returns `a` for equal ends, whatever the parameter.
fn lerp(a: Vec3, b: Vec3, t: f64) -> Vec3 {
    a + (b - a) * t
}

impl Build {
    fn column_count(&self) -> u32 {
        (self.nodes.len() / self.levels) as u32
    }

    fn at(&self, column: u32, level: usize) -> Vec3 {
        self.nodes[column as usize * self.levels + level]
    }

    /// Makes the columns between the ends `a < b` of a side, and registers those that hang.
    fn side(&mut self, [a, b]: [u32; 2], side: &mut Side) {
        side.first = self.column_count();
        let count = 1u32 << side.level;
        let on_rim = self.is_on_rim([a, b], side);
        for t in 1..count {
            for level in 0..self.levels {
                let (from, to) = (self.at(a, level), self.at(b, level));
                let mut x = lerp(from, to, f64::from(t) / f64::from(count));
                if let Some(radius) = self.rim.filter(|_| on_rim) {
                    let plan = Vec2::new(x.x, x.y);
                    let moved = plan * (radius / plan.norm());
                    (x.x, x.y) = (moved.x, moved.y);
                }
                self.nodes.push(x);
            }
        }
        let column = |t: u32| match t {
            0 => a,
            t if t == count => b,
            t => side.first + t - 1,
        };
        if side.smaller < side.level {
            let odd = (1..count).step_by(2);
            self.hanging.extend(odd.map(|t| HangingColumn {
                column: column(t),
                masters: [column(t - 1), column(t + 1)],
            }));
        }
    }

    /// Whether a side of one element lies on the rim.
    fn is_on_rim(&self, ends: [u32; 2], side: &Side) -> bool {
        let Some(radius) = self.rim else { return false };
        let on = |column: u32| {
            let x = self.at(column, 0);
            (x.x.hypot(x.y) - radius).abs() <= ON_RIM_REL * radius
        };
        side.elements[1].is_none() && ends.into_iter().all(on)
    }
}

/// Transfinite interpolation inside a base element.
struct Coons<'a> {
    quad: [u32; 4],
    m: usize,
    ids: &'a [u32],
}

impl Coons<'_> {
    /// The column at `[i, j]` of the grid, level by level.
    fn column(&self, build: &Build, [i, j]: [usize; 2]) -> Vec<Vec3> {
        let m = self.m;
        let [s, t] = [i, j].map(|k| k as f64 / m as f64);
        let on_side = [i, (m + 1) * j + m, m * (m + 1) + i, j * (m + 1)];
        let weights = [1.0 - t, s, t, 1.0 - s];
        let ends = [[0, 1], [1, 2], [3, 2], [0, 3]];
        let at = |level: usize| {
            let corner = self.quad.map(|column| build.at(column, level));
            let [low, high] = [lerp(corner[0], corner[1], s), lerp(corner[3], corner[2], s)];
            let mut x = lerp(low, high, t);
            // Sides are straight but for those on the rim.
            for k in (0..4).filter(|_| build.rim.is_some()) {
                let [from, to] = ends[k].map(|k: usize| corner[k]);
                let straight = lerp(from, to, if k % 2 == 0 { s } else { t });
                x += (build.at(self.ids[on_side[k]], level) - straight) * weights[k];
            }
            x
        };
        (0..build.levels).map(at).collect()
    }
}

impl HexMesh {
    /// Puts every hanging node exactly into the middle of its masters.
    fn set_reference_means(&mut self) {
        let means: Vec<(usize, Vec3)> = self
            .hanging_nodes()
            .map(|(node, [a, b])| (node, 0.5 * (self.nodes[a] + self.nodes[b])))
            .collect();
        means.into_iter().for_each(|(node, x)| self.nodes[node] = x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sheet::hex_mesh::{disc, rectangle, thickened};

    /// Levels that change from element to element without order.
    fn disorder(count: usize, seed: u64) -> Vec<u8> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) as u32
        };
        (0..count).map(|_| if next() % 4 == 0 { (next() % 5) as u8 } else { 0 }).collect()
    }

    fn volume(mesh: &HexMesh) -> f64 {
        let of = |e: &[u32; 8]| {
            let x = e.map(|n| mesh.nodes[n as usize]);
            (x[2] - x[0]).cross(&(x[3] - x[1])).z * 0.5 * (x[4] - x[0]).z
        };
        let volumes = mesh.elements.iter().map(of);
        volumes.inspect(|volume| assert!(*volume > 0.0)).sum()
    }

    /// Every side inside the sheet belongs to two polygons, and those left over form the border of the base mesh.
    fn border(mesh: &HexMesh) -> f64 {
        let mut sides = FxHashMap::default();
        for polygon in mesh.upper_polygons() {
            for k in 0..polygon.len() {
                let (a, b) = (polygon[k], polygon[(k + 1) % polygon.len()]);
                if sides.remove(&(b, a)).is_none() {
                    assert_eq!(sides.insert((a, b), ()), None);
                }
            }
        }
        let at = |column: usize| mesh.nodes[column * mesh.nodes_per_column];
        sides.keys().map(|&(a, b)| (at(a) - at(b)).norm()).sum()
    }

    #[test]
    fn disordered_levels_make_a_tight_mesh_in_which_no_master_hangs() {
        let base = rectangle(12.0, 10.0, 0.8, 6, 5, 2);
        for seed in 0..20 {
            let levels = disorder(30, seed);
            let refinement = Refinement::balanced(plan_elements(&base), levels.clone());
            assert!(refinement.levels().iter().zip(&levels).all(|(level, given)| level >= given));
            let count = refinement.element_count();
            let mesh = refinement.mesh(&base, None);
            assert_eq!(mesh.elements.len(), 2 * count);
            assert!((volume(&mesh) - 96.0).abs() < 1e-9 && (border(&mesh) - 44.0).abs() < 1e-9);
            for (node, [a, b]) in mesh.hanging_nodes() {
                assert!(mesh.masters(a).is_none() && mesh.masters(b).is_none());
                assert_eq!(mesh.nodes[node], 0.5 * (mesh.nodes[a] + mesh.nodes[b]));
            }
            for e in 0..mesh.elements.len() {
                let mut nodes = mesh.effective_nodes(e).to_vec();
                assert!(nodes.iter().all(|&n| mesh.masters(n as usize).is_none()));
                nodes.sort_unstable();
                nodes.dedup();
                assert_eq!(nodes.len(), 8);
            }
            assert_eq!(mesh.hanging_found(1e-9), mesh.hanging);
        }
    }

    #[test]
    fn levels_of_zero_make_the_base_mesh_and_of_one_a_finer_one() {
        let base = rectangle(12.0, 10.0, 0.8, 3, 4, 2);
        let of = |level| Refinement::balanced(plan_elements(&base), vec![level; 12]);
        assert_eq!(of(0).mesh(&base, None), base);
        let (finer, whole) = (of(1).mesh(&base, None), rectangle(12.0, 10.0, 0.8, 6, 8, 2));
        assert!(finer.hanging.is_empty() && finer.nodes.len() == whole.nodes.len());
        for x in &whole.nodes {
            assert!(finer.nodes.iter().any(|y| (x - y).norm() < 1e-12), "{x}");
        }
    }

    #[test]
    fn a_refined_disc_tends_to_its_circle() {
        let (points, quads) = disc(10.0, 1, 2);
        let base = thickened(&points, &quads, 0.5, 1);
        let count = plan_elements(&base).len();
        let off = |level: u8| {
            let levels = vec![level; count];
            let mesh = Refinement::balanced(plan_elements(&base), levels).mesh(&base, Some(10.0));
            1.0 - volume(&mesh) / (0.5 * std::f64::consts::PI * 100.0)
        };
        let (coarse, fine) = (off(0), off(3));
        assert!(coarse > 0.09 && fine < coarse / 60.0 && fine > 0.0, "{coarse} {fine}");
    }
}
