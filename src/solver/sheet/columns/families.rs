//! Families of element directions connected by common faces.

use std::collections::HashMap;

use super::error::SheetError;

/// Faces of a hexahedron normal to each of its three directions, corresponding nodes at the same position.
pub(super) const FACES_BY_DIRECTION: [[[usize; 4]; 2]; 3] =
    [[[0, 3, 7, 4], [1, 2, 6, 5]], [[0, 1, 5, 4], [3, 2, 6, 7]], [[0, 1, 2, 3], [4, 5, 6, 7]]];

/// Disjoint sets of (element, direction) or of other items joined in pairs (union-find).
pub(super) struct DisjointSets(Vec<u32>);

impl DisjointSets {
    pub(super) fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    pub(super) fn root(&mut self, mut k: usize) -> usize {
        while self.0[k] as usize != k {
            self.0[k] = self.0[self.0[k] as usize];
            k = self.0[k] as usize;
        }
        k
    }

    pub(super) fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        let (low, high) = (a.min(b), a.max(b));
        self.0[high] = low as u32;
    }
}

/// Pairs of (element, direction, face) with the same nodes.
pub(super) type CommonFaces = Vec<[(usize, usize, usize); 2]>;

pub(super) fn common_faces(elements: &[[u32; 8]]) -> Result<CommonFaces, SheetError> {
    let mut first: HashMap<[u32; 4], Option<(usize, usize, usize)>> = HashMap::new();
    let mut shared = Vec::new();
    for (e, nodes) in elements.iter().enumerate() {
        for (direction, faces) in FACES_BY_DIRECTION.iter().enumerate() {
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

/// Direction of an element that contains the edge `a`-`b`.
pub(super) fn direction_of_side(nodes: &[u32; 8], a: u32, b: u32) -> Option<usize> {
    (0..3).find(|&d| {
        let [low, high] = FACES_BY_DIRECTION[d];
        (0..4).any(|k| {
            let side = [nodes[low[k]], nodes[high[k]]];
            side == [a, b] || side == [b, a]
        })
    })
}

pub(super) fn check_connected(
    count: usize,
    pairs: impl Iterator<Item = [usize; 2]>,
) -> Result<(), SheetError> {
    let mut parts = DisjointSets::new(count);
    pairs.for_each(|[a, b]| parts.join(a, b));
    let roots: Vec<usize> = (0..count).filter(|&e| parts.root(e) == e).collect();
    match roots[..] {
        [_, element, ..] => Err(SheetError::Parts { parts: roots.len(), element }),
        _ => Ok(()),
    }
}

pub(super) fn all_different(nodes: &[u32]) -> bool {
    let mut sorted = nodes.to_vec();
    sorted.sort_unstable();
    sorted.windows(2).all(|w| w[0] != w[1])
}

/// Directions of all families that contain exactly one direction of every element.
pub(super) fn candidates(elements: &[[u32; 8]], shared: &CommonFaces) -> Vec<Vec<usize>> {
    let mut families = DisjointSets::new(3 * elements.len());
    for [(a, across_a, face), (b, across_b, _)] in shared {
        families.join(3 * a + across_a, 3 * b + across_b);
        let ring = FACES_BY_DIRECTION[*across_a][*face].map(|k| elements[*a][k]);
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
        let of = |e: usize, families: &mut DisjointSets| {
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
