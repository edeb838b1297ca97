//! A sheet from foreign elements: the thickness direction found, nodes put into columns, quadrilaterals turned alike.
//!
//! What runs through the thickness is told by the mesh itself, not by its measures. Two elements with a common face
//! have their directions in common: the one across the face, and the two along it. Directions of elements linked so
//! fall into families; the thickness is a family with one direction of every element (in a structured rectangle there
//! are three such, along x, y and z; over irregular quadrilaterals only one). Of several, that with the shortest
//! columns is taken.

use std::collections::HashMap;

use super::blank::HexMesh;
use crate::geometry::Vec3;

/// Why elements make no sheet. Elements and nodes are counted from 0.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SheetError {
    /// A face or side with more than two elements.
    #[error(
        "found element {element} on a face or side with two others; allowed: at most two elements on each"
    )]
    Branches {
        /// The third element.
        element: usize,
    },
    /// Elements that do not hang together by faces or sides.
    #[error(
        "found {parts} parts, element {element} begins the second; allowed: one sheet, its elements joined by whole faces or sides"
    )]
    Parts {
        /// Number of parts.
        parts: usize,
        /// An element of the second.
        element: usize,
    },
    /// No direction runs through the thickness everywhere.
    #[error(
        "found no direction that runs through all elements in layers; allowed: hexahedra swept through the thickness of a sheet"
    )]
    NoDirection,
    /// Columns of different numbers of nodes.
    #[error(
        "found {found} nodes through the thickness at ({x}, {y}, {z}) mm and {others} elsewhere; allowed: the same number everywhere"
    )]
    Levels {
        /// Nodes in this column.
        found: usize,
        /// Nodes in the first one.
        others: usize,
        /// Its lowest node [mm].
        x: f64,
        /// Its lowest node [mm].
        y: f64,
        /// Its lowest node [mm].
        z: f64,
    },
    /// Elements that cannot be turned alike.
    #[error(
        "found element {element} turned both ways by its neighbours (a band with one side); allowed: a sheet with two sides"
    )]
    OneSided {
        /// The element.
        element: usize,
    },
    /// An element that uses a node twice.
    #[error(
        "found element {element} with one node at two corners; allowed: eight nodes, or four, all different"
    )]
    Degenerate {
        /// The element.
        element: usize,
    },
}

/// Faces of a hexahedron across each of its three directions, corresponding nodes side by side.
const ACROSS: [[[usize; 4]; 2]; 3] =
    [[[0, 3, 7, 4], [1, 2, 6, 5]], [[0, 1, 5, 4], [3, 2, 6, 7]], [[0, 1, 2, 3], [4, 5, 6, 7]]];

/// Families of (element, direction) or of anything else that is joined pair by pair.
struct Families(Vec<u32>);

impl Families {
    fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn root(&mut self, mut k: usize) -> usize {
        while self.0[k] as usize != k {
            self.0[k] = self.0[self.0[k] as usize];
            k = self.0[k] as usize;
        }
        k
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        let (low, high) = (a.min(b), a.max(b));
        self.0[high] = low as u32;
    }
}

/// Pairs of (element, direction, face) with the same nodes.
type Shared = Vec<[(usize, usize, usize); 2]>;

fn shared_faces(elements: &[[u32; 8]]) -> Result<Shared, SheetError> {
    let mut first: HashMap<[u32; 4], Option<(usize, usize, usize)>> = HashMap::new();
    let mut shared = Vec::new();
    for (e, nodes) in elements.iter().enumerate() {
        for (direction, faces) in ACROSS.iter().enumerate() {
            for (f, face) in faces.iter().enumerate() {
                let mut key = face.map(|k| nodes[k]);
                key.sort_unstable();
                match first.get_mut(&key) {
                    None => {
                        first.insert(key, Some((e, direction, f)));
                    }
                    Some(seen) => match seen.take() {
                        Some(other) => shared.push([other, (e, direction, f)]),
                        None => return Err(SheetError::Branches { element: e }),
                    },
                }
            }
        }
    }
    Ok(shared)
}

/// The direction of `other` that has the side `a`-`b`.
fn direction_of_side(nodes: &[u32; 8], a: u32, b: u32) -> Option<usize> {
    (0..3).find(|&d| {
        let [low, high] = ACROSS[d];
        (0..4).any(|k| {
            let side = [nodes[low[k]], nodes[high[k]]];
            side == [a, b] || side == [b, a]
        })
    })
}

fn one_part(count: usize, pairs: impl Iterator<Item = [usize; 2]>) -> Result<(), SheetError> {
    let mut parts = Families::new(count);
    pairs.for_each(|[a, b]| parts.join(a, b));
    let roots: Vec<usize> = (0..count).filter(|&e| parts.root(e) == e).collect();
    match roots[..] {
        [_, element, ..] => Err(SheetError::Parts { parts: roots.len(), element }),
        _ => Ok(()),
    }
}

fn all_different(nodes: &[u32]) -> bool {
    let mut sorted = nodes.to_vec();
    sorted.sort_unstable();
    sorted.windows(2).all(|w| w[0] != w[1])
}

/// A sheet of hexahedra whose corners come in the order of VTK, gmsh and Abaqus (a ring of four and the ring above it).
/// The upper face is the one towards +z or, of a sheet that stands upright, towards its larger of +x and +y.
/// `stacked`: the two rings are known to be the lower and the upper face of each element.
///
/// # Errors
/// [`SheetError`].
pub fn from_hexahedra(
    points: &[Vec3],
    elements: &[[u32; 8]],
    stacked: bool,
) -> Result<HexMesh, SheetError> {
    if let Some(element) = elements.iter().position(|e| !all_different(e)) {
        return Err(SheetError::Degenerate { element });
    }
    let shared = shared_faces(elements)?;
    one_part(elements.len(), shared.iter().map(|[a, b]| [a.0, b.0]))?;
    let candidates =
        if stacked { vec![vec![2; elements.len()]] } else { candidates(elements, &shared) };
    // The shortest columns; of like ones, those nearer to z.
    let mut best: Option<([f64; 2], Stacks)> = None;
    let mut fault = SheetError::NoDirection;
    for directions in &candidates {
        match Stacks::new(points, elements, directions) {
            Ok(stacks) => {
                let [length, along_z] = stacks.measures(points);
                let better = best.as_ref().is_none_or(|([least, z], _)| {
                    let alike = (length - least).abs() <= 1e-3 * least;
                    if alike { along_z > *z } else { length < *least }
                });
                if better {
                    best = Some(([length, along_z], stacks));
                }
            }
            Err(error) => fault = error,
        }
    }
    let (_, stacks) = best.ok_or(fault)?;
    stacks.mesh(points, elements)
}

/// For each family with one direction of every element, those directions.
fn candidates(elements: &[[u32; 8]], shared: &Shared) -> Vec<Vec<usize>> {
    let mut families = Families::new(3 * elements.len());
    for [(a, across_a, face), (b, across_b, _)] in shared {
        families.join(3 * a + across_a, 3 * b + across_b);
        let ring = ACROSS[*across_a][*face].map(|k| elements[*a][k]);
        for k in 0..2 {
            let (from, to) = (ring[k], ring[k + 1]);
            let of = |e: usize| direction_of_side(&elements[e], from, to);
            if let (Some(da), Some(db)) = (of(*a), of(*b)) {
                families.join(3 * a + da, 3 * b + db);
            }
        }
    }
    let mut out = Vec::new();
    for first in 0..3.min(3 * elements.len()) {
        let root = families.root(first);
        let of = |e: usize, families: &mut Families| {
            let mut own = (0..3).filter(|d| families.root(3 * e + d) == root);
            let direction = own.next();
            if own.next().is_some() { None } else { direction }
        };
        let directions: Option<Vec<usize>> =
            (0..elements.len()).map(|e| of(e, &mut families)).collect();
        out.extend(directions);
    }
    out
}

/// Nodes in columns, bottom first.
struct Stacks {
    directions: Vec<usize>,
    columns: Vec<Vec<u32>>,
}

impl Stacks {
    fn new(
        points: &[Vec3],
        elements: &[[u32; 8]],
        directions: &[usize],
    ) -> Result<Self, SheetError> {
        let mut above: Vec<Vec<u32>> = vec![Vec::new(); points.len()];
        let mut in_use = Vec::new();
        let mut seen = vec![false; points.len()];
        for (e, (nodes, &d)) in elements.iter().zip(directions).enumerate() {
            for (low, high) in ACROSS[d][0].iter().zip(&ACROSS[d][1]) {
                let (a, b) = (nodes[*low], nodes[*high]);
                for (from, to) in [(a, b), (b, a)] {
                    let next = &mut above[from as usize];
                    if !next.contains(&to) {
                        next.push(to);
                    }
                    if next.len() > 2 {
                        return Err(SheetError::Branches { element: e });
                    }
                }
            }
            for &n in nodes {
                if !std::mem::replace(&mut seen[n as usize], true) {
                    in_use.push(n);
                }
            }
        }
        let mut columns: Vec<Vec<u32>> = Vec::new();
        let mut taken = vec![false; points.len()];
        for &first in in_use.iter().filter(|n| above[**n as usize].len() == 1) {
            if taken[first as usize] {
                continue;
            }
            let mut column = vec![first];
            taken[first as usize] = true;
            let mut now = first;
            while let Some(&next) = above[now as usize].iter().find(|n| !taken[**n as usize]) {
                taken[next as usize] = true;
                column.push(next);
                now = next;
            }
            let others = columns.first().map_or(column.len(), Vec::len);
            if column.len() != others {
                let at = points[first as usize];
                let found = column.len();
                return Err(SheetError::Levels { found, others, x: at.x, y: at.y, z: at.z });
            }
            columns.push(column);
        }
        // A ring of elements closed through the thickness has no end.
        if in_use.iter().any(|n| !taken[*n as usize]) {
            return Err(SheetError::NoDirection);
        }
        Ok(Self { directions: directions.to_vec(), columns })
    }

    /// Mean length of the columns, and mean height of it along z [mm].
    fn measures(&self, points: &[Vec3]) -> [f64; 2] {
        let steps = self.columns.iter().flat_map(|c| c.windows(2));
        let sum = steps.fold([0.0; 2], |sum, w| {
            let step = points[w[1] as usize] - points[w[0] as usize];
            [sum[0] + step.norm(), sum[1] + step.z.abs()]
        });
        sum.map(|s| s / self.columns.len().max(1) as f64)
    }

    /// The mesh, all columns the same way up.
    fn mesh(mut self, points: &[Vec3], elements: &[[u32; 8]]) -> Result<HexMesh, SheetError> {
        let mut place = vec![(0u32, 0u32); points.len()];
        for (c, column) in self.columns.iter().enumerate() {
            column.iter().enumerate().for_each(|(l, &n)| place[n as usize] = (c as u32, l as u32));
        }
        // Lower rings of the elements, as columns; columns of one element stand the same way up.
        let ring = |e: usize| ACROSS[self.directions[e]][0].map(|k| elements[e][k]);
        let up = |e: usize, k: usize| {
            let d = self.directions[e];
            let [a, b] = [0, 1].map(|side| place[elements[e][ACROSS[d][side][k]] as usize].1);
            b > a
        };
        let of_column = |e: usize| ring(e).map(|n| place[n as usize].0);
        let turned = same_way_up(elements.len(), self.columns.len(), of_column, up)?;
        for (column, turn) in self.columns.iter_mut().zip(turned) {
            if turn {
                column.reverse();
            }
        }
        let sum: Vec3 = self
            .columns
            .iter()
            .map(|c| points[c[c.len() - 1] as usize] - points[c[0] as usize])
            .sum();
        if looks_down(&sum) {
            self.columns.iter_mut().for_each(|c| c.reverse());
        }
        let levels = self.columns.first().map_or(1, Vec::len);
        let mut number = vec![0u32; points.len()];
        let mut nodes = Vec::with_capacity(levels * self.columns.len());
        for n in self.columns.iter().flatten() {
            number[*n as usize] = nodes.len() as u32;
            nodes.push(points[*n as usize]);
        }
        let elements = elements.iter().zip(&self.directions);
        let elements = elements.map(|(e, &d)| upright(&nodes, &e.map(|n| number[n as usize]), d));
        Ok(HexMesh { elements: elements.collect(), nodes, nodes_per_column: levels })
    }
}

/// The element with its lower ring first, counter-clockwise seen from the upper one.
fn upright(nodes: &[Vec3], e: &[u32; 8], direction: usize) -> [u32; 8] {
    let [mut low, mut high] = ACROSS[direction].map(|face| face.map(|k| e[k]));
    if low[0] > high[0] {
        std::mem::swap(&mut low, &mut high);
    }
    let x = |n: u32| nodes[n as usize];
    let normal = (x(low[2]) - x(low[0])).cross(&(x(low[3]) - x(low[1])));
    let up: Vec3 = (0..4).map(|k| x(high[k]) - x(low[k])).sum();
    if normal.dot(&up) < 0.0 {
        low.reverse();
        high.reverse();
    }
    [low[0], low[1], low[2], low[3], high[0], high[1], high[2], high[3]]
}

fn looks_down(up: &Vec3) -> bool {
    let upright = up.z.abs() <= 0.01 * up.norm();
    let decisive = if !upright {
        up.z
    } else if up.x.abs() > up.y.abs() {
        up.x
    } else {
        up.y
    };
    decisive < 0.0
}

/// Which columns have to be turned so that those of every element stand the same way up. `up(e, k)`: whether column k
/// of element e runs from its first ring to its second.
fn same_way_up(
    elements: usize,
    columns: usize,
    of_column: impl Fn(usize) -> [u32; 4],
    up: impl Fn(usize, usize) -> bool,
) -> Result<Vec<bool>, SheetError> {
    let mut links: Vec<Vec<(u32, bool)>> = vec![Vec::new(); columns];
    for e in 0..elements {
        let ids = of_column(e);
        for k in 0..4 {
            let next = (k + 1) % 4;
            let differ = up(e, k) != up(e, next);
            links[ids[k] as usize].push((ids[next], differ));
            links[ids[next] as usize].push((ids[k], differ));
        }
    }
    let turned = walk(&links);
    for e in 0..elements {
        let ids = of_column(e);
        let way = |k: usize| up(e, k) ^ turned[ids[k] as usize];
        if (1..4).any(|k| way(k) != way(0)) {
            return Err(SheetError::OneSided { element: e });
        }
    }
    Ok(turned)
}

/// Marks so that linked items differ where the link says so, as far as that can be.
fn walk(links: &[Vec<(u32, bool)>]) -> Vec<bool> {
    let mut mark: Vec<Option<bool>> = vec![None; links.len()];
    for start in 0..links.len() {
        if mark[start].is_some() {
            continue;
        }
        mark[start] = Some(false);
        let mut todo = vec![start];
        while let Some(now) = todo.pop() {
            let own = mark[now].unwrap_or(false);
            for &(next, differ) in &links[now] {
                let next = next as usize;
                if mark[next].is_none() {
                    mark[next] = Some(own ^ differ);
                    todo.push(next);
                }
            }
        }
    }
    mark.into_iter().map(|m| m.unwrap_or(false)).collect()
}

/// Quadrilaterals all turned one way: counter-clockwise seen from +z or, of a sheet that stands upright, from its
/// larger of +x and +y.
///
/// # Errors
/// [`SheetError`].
pub fn oriented(points: &[Vec3], quads: &[[u32; 4]]) -> Result<Vec<[u32; 4]>, SheetError> {
    if let Some(element) = quads.iter().position(|q| !all_different(q)) {
        return Err(SheetError::Degenerate { element });
    }
    let mut links: Vec<Vec<(u32, bool)>> = vec![Vec::new(); quads.len()];
    let mut first: HashMap<[u32; 2], Option<(usize, bool)>> = HashMap::new();
    let mut pairs = Vec::new();
    for (e, q) in quads.iter().enumerate() {
        for k in 0..4 {
            let (a, b) = (q[k], q[(k + 1) % 4]);
            let forward = a < b;
            match first.get_mut(&[a.min(b), a.max(b)]) {
                None => {
                    first.insert([a.min(b), a.max(b)], Some((e, forward)));
                }
                Some(seen) => {
                    let Some((other, way)) = seen.take() else {
                        return Err(SheetError::Branches { element: e });
                    };
                    links[e].push((other as u32, way == forward));
                    links[other].push((e as u32, way == forward));
                    pairs.push([e, other]);
                }
            }
        }
    }
    one_part(quads.len(), pairs.into_iter())?;
    let turned = walk(&links);
    let torn = |e: usize| links[e].iter().any(|(o, d)| turned[e] ^ turned[*o as usize] != *d);
    if let Some(element) = (0..quads.len()).find(|&e| torn(e)) {
        return Err(SheetError::OneSided { element });
    }
    let turn = |(q, &turn): (&[u32; 4], &bool)| if turn { reversed(q) } else { *q };
    let quads: Vec<[u32; 4]> = quads.iter().zip(&turned).map(turn).collect();
    let area = |q: &[u32; 4]| {
        let [a, b, c, d] = q.map(|n| points[n as usize]);
        (c - a).cross(&(d - b))
    };
    let sum: Vec3 = quads.iter().map(area).sum();
    Ok(if looks_down(&sum) { quads.iter().map(reversed).collect() } else { quads })
}

fn reversed(quad: &[u32; 4]) -> [u32; 4] {
    let [a, b, c, d] = *quad;
    [a, d, c, b]
}

#[cfg(test)]
mod tests {
    use super::super::blank::{quarter_disc, rectangle, thickened};
    use super::*;

    /// The mesh as a stranger would write it: nodes in another order, elements turned every way.
    fn foreign(mesh: &HexMesh) -> (Vec<Vec3>, Vec<[u32; 8]>) {
        // All 24 turns come from these two: about the third direction, and the first to the third.
        let spin = |e: [u32; 8]| [e[1], e[2], e[3], e[0], e[5], e[6], e[7], e[4]];
        let tip = |e: [u32; 8]| [e[4], e[5], e[1], e[0], e[7], e[6], e[2], e[3]];
        let count = mesh.nodes.len() as u32;
        let other = |n: u32| (n * 7 + 3) % count;
        assert_ne!(count % 7, 0);
        let mut points = vec![Vec3::zeros(); mesh.nodes.len()];
        mesh.nodes.iter().enumerate().for_each(|(n, x)| points[other(n as u32) as usize] = *x);
        let turned = |(k, e): (usize, &[u32; 8])| {
            let mut e = e.map(other);
            (0..k % 4).for_each(|_| e = spin(e));
            (0..k / 4 % 4).for_each(|_| e = tip(e));
            (0..k / 16 % 4).for_each(|_| e = spin(e));
            e
        };
        (points, mesh.elements.iter().enumerate().map(turned).collect())
    }

    /// Elements as sets of places, and whether each is upright.
    fn same_sheet(a: &HexMesh, b: &HexMesh) {
        assert_eq!((a.nodes.len(), a.nodes_per_column), (b.nodes.len(), b.nodes_per_column));
        let column = |m: &HexMesh, c: usize| {
            m.nodes[c * m.nodes_per_column..(c + 1) * m.nodes_per_column].to_vec()
        };
        for c in 0..a.column_count() {
            let own = column(a, c);
            assert!((0..b.column_count()).any(|k| column(b, k) == own), "column {c}");
        }
        let bottom = |m: &HexMesh, e: &[u32; 8]| {
            // From the smallest corner on: the ring is the same whichever corner began.
            let ring = [0, 1, 2, 3].map(|k| m.nodes[e[k] as usize]);
            let key = |x: &Vec3| (x.x, x.y, x.z);
            let first = (0..4).min_by(|&i, &j| key(&ring[i]).partial_cmp(&key(&ring[j])).unwrap());
            let above = [0, 1, 2, 3].map(|k| m.nodes[e[k + 4] as usize]);
            let turn = |r: [Vec3; 4]| [0, 1, 2, 3].map(|k| r[(k + first.unwrap()) % 4]);
            (turn(ring), turn(above))
        };
        for (e, f) in a.elements.iter().zip(&b.elements) {
            assert_eq!(bottom(a, e), bottom(b, f));
        }
    }

    #[test]
    fn a_sheet_comes_back_from_any_numbering_and_turning() {
        let (points, quads) = quarter_disc(10.0, 3, 4);
        let disc = thickened(&points, &quads, 0.5, 2);
        // Elements smaller in plan than through the thickness do not mislead.
        let fine = thickened(&points, &quads, 3.0, 1);
        for mesh in
            [rectangle(8.0, 5.0, 0.8, 5, 3, 2), disc, fine, rectangle(4.0, 2.0, 1.5, 4, 8, 1)]
        {
            let (points, elements) = foreign(&mesh);
            same_sheet(&mesh, &from_hexahedra(&points, &elements, false).unwrap());
            let upside: Vec<[u32; 8]> = mesh
                .elements
                .iter()
                .map(|e| [e[4], e[7], e[6], e[5], e[0], e[3], e[2], e[1]])
                .collect();
            same_sheet(&mesh, &from_hexahedra(&mesh.nodes, &upside, true).unwrap());
            // Inside out, as a mirrored file has them.
            let mirrored: Vec<[u32; 8]> =
                mesh.elements.iter().map(|e| [4, 5, 6, 7, 0, 1, 2, 3].map(|k| e[k])).collect();
            same_sheet(&mesh, &from_hexahedra(&mesh.nodes, &mirrored, true).unwrap());
        }
    }

    #[test]
    fn a_sheet_that_is_no_plane_keeps_its_thickness() {
        let mut mesh = rectangle(30.0, 5.0, 1.0, 12, 2, 1);
        let bend = |x: &Vec3| {
            let (s, c) = (x.x / 12.0).sin_cos();
            Vec3::new((12.0 + x.z) * s, x.y, (12.0 + x.z) * c)
        };
        mesh.nodes = mesh.nodes.iter().map(bend).collect();
        let (points, elements) = foreign(&mesh);
        same_sheet(&mesh, &from_hexahedra(&points, &elements, false).unwrap());
    }

    #[test]
    fn what_is_no_sheet_says_why() {
        let mesh = rectangle(4.0, 4.0, 1.0, 2, 2, 1);
        let mut twice = mesh.elements.clone();
        twice.push(twice[0]);
        let found = |e: &[[u32; 8]]| from_hexahedra(&mesh.nodes, e, false).unwrap_err();
        assert!(matches!(found(&twice), SheetError::Branches { .. } | SheetError::NoDirection));
        let apart = [mesh.elements[0], mesh.elements[3]];
        assert_eq!(found(&apart), SheetError::Parts { parts: 2, element: 1 });
        let mut flat = mesh.elements.clone();
        flat[2][1] = flat[2][0];
        assert_eq!(found(&flat), SheetError::Degenerate { element: 2 });
        // A step: two layers here, one there.
        let stairs = rectangle(4.0, 4.0, 2.0, 2, 2, 2);
        let kept: Vec<[u32; 8]> = stairs.elements[..7].to_vec();
        let error = from_hexahedra(&stairs.nodes, &kept, true).unwrap_err();
        assert!(matches!(error, SheetError::Levels { .. }), "{error}");
    }

    #[test]
    fn quads_are_turned_towards_z_and_a_moebius_band_is_refused() {
        let (points, quads) = quarter_disc(10.0, 2, 2);
        let mixed = |(k, q): (usize, &[u32; 4])| if k % 3 == 0 { reversed(q) } else { *q };
        let mixed: Vec<[u32; 4]> = quads.iter().enumerate().map(mixed).collect();
        let up = oriented(&points, &mixed).unwrap();
        for (a, b) in up.iter().zip(&quads) {
            let turned = (0..4).any(|k| [0, 1, 2, 3].map(|i| a[(i + k) % 4]) == *b);
            assert!(turned, "{a:?} {b:?}");
        }
        let ring = |k: u32| [2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1];
        let mut band: Vec<[u32; 4]> = (0..4).map(ring).collect();
        band.push([8, 1, 0, 9]);
        let points: Vec<Vec3> =
            (0..10).map(|k| Vec3::new(f64::from(k / 2), f64::from(k % 2), 0.0)).collect();
        assert!(matches!(oriented(&points, &band), Err(SheetError::OneSided { .. })));
        let apart = oriented(&points, &[ring(0), ring(2)]).unwrap_err();
        assert_eq!(apart, SheetError::Parts { parts: 2, element: 1 });
    }
}
