//! Consistent orientation of columns and quadrilaterals.

use rustc_hash::FxHashMap;

use super::error::SheetError;
use super::families::{all_different, check_connected};
use kanagata_geometry::Vec3;

pub(super) fn points_down(up: &Vec3) -> bool {
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

/// Columns to be reversed so that the four columns of every element have the same orientation. `up(e, k)`: whether
/// column k of element e runs from its first ring to its second.
pub(super) fn columns_to_reverse(
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
    let reverse = propagate_orientation(columns, |column| links[column].iter().copied());
    for e in 0..elements {
        let ids = of_column(e);
        let orientation = |k: usize| up(e, k) ^ reverse[ids[k] as usize];
        if (1..4).any(|k| orientation(k) != orientation(0)) {
            return Err(SheetError::OneSided { element: e });
        }
    }
    Ok(reverse)
}

/// Marks items so that linked items differ where the link requires it, as far as possible.
fn propagate_orientation<I: Iterator<Item = (u32, bool)>>(
    count: usize,
    links: impl Fn(usize) -> I,
) -> Vec<bool> {
    let mut mark = vec![false; count];
    let mut seen = vec![false; count];
    let mut todo = Vec::new();
    for start in 0..count {
        if std::mem::replace(&mut seen[start], true) {
            continue;
        }
        todo.push(start);
        while let Some(now) = todo.pop() {
            for (next, differ) in links(now) {
                let next = next as usize;
                if !std::mem::replace(&mut seen[next], true) {
                    mark[next] = mark[now] ^ differ;
                    todo.push(next);
                }
            }
        }
    }
    mark
}

/// Neighbours across the four sides of each quadrilateral, and whether they have the opposite orientation.
struct Neighbours(Vec<[u32; 4]>);

impl Neighbours {
    /// A side without neighbour.
    const NO_NEIGHBOUR: u32 = u32::MAX;

    fn of(quads: &[[u32; 4]]) -> Result<Self, SheetError> {
        // For each side its first quadrilateral and local side, until the second one is found.
        let mut unmatched: FxHashMap<[u32; 2], u32> = FxHashMap::default();
        unmatched.reserve(2 * quads.len());
        let mut across = vec![[Self::NO_NEIGHBOUR; 4]; quads.len()];
        for (e, q) in quads.iter().enumerate() {
            for k in 0..4 {
                let [a, b] = side(q, k);
                let Some(first) = unmatched.get_mut(&[a.min(b), a.max(b)]) else {
                    unmatched.insert([a.min(b), a.max(b)], (4 * e + k) as u32);
                    continue;
                };
                let first_side = std::mem::replace(first, Self::NO_NEIGHBOUR);
                if first_side == Self::NO_NEIGHBOUR {
                    return Err(SheetError::Branches { element: e });
                }
                let (other, l) = (first_side as usize / 4, first_side as usize % 4);
                let differ = u32::from(side(&quads[other], l) == [a, b]);
                across[e][k] = 2 * other as u32 + differ;
                across[other][l] = 2 * e as u32 + differ;
            }
        }
        Ok(Self(across))
    }

    fn of_element(&self, e: usize) -> impl Iterator<Item = (u32, bool)> {
        let there = self.0[e].into_iter().filter(|code| *code != Self::NO_NEIGHBOUR);
        there.map(|code| (code / 2, code % 2 == 1))
    }
}

fn side(quad: &[u32; 4], k: usize) -> [u32; 2] {
    [quad[k], quad[(k + 1) % 4]]
}

/// Orients quadrilaterals consistently: counter-clockwise seen from +z or, for a vertical sheet, from the larger of
/// +x and +y.
///
/// # Errors
/// [`SheetError`].
pub fn oriented(points: &[Vec3], quads: &[[u32; 4]]) -> Result<Vec<[u32; 4]>, SheetError> {
    if let Some(element) = quads.iter().position(|q| !all_different(q)) {
        return Err(SheetError::Degenerate { element });
    }
    let neighbours = Neighbours::of(quads)?;
    let pairs = |e: usize| neighbours.of_element(e).map(move |(other, _)| [e, other as usize]);
    check_connected(quads.len(), (0..quads.len()).flat_map(pairs))?;
    let reverse = propagate_orientation(quads.len(), |e| neighbours.of_element(e));
    let inconsistent = |e: usize| {
        neighbours.of_element(e).any(|(o, differ)| reverse[e] ^ reverse[o as usize] != differ)
    };
    if let Some(element) = (0..quads.len()).find(|&e| inconsistent(e)) {
        return Err(SheetError::OneSided { element });
    }
    let orient = |(q, &reverse): (&[u32; 4], &bool)| if reverse { reversed(q) } else { *q };
    let quads: Vec<[u32; 4]> = quads.iter().zip(&reverse).map(orient).collect();
    let area = |q: &[u32; 4]| {
        let [a, b, c, d] = q.map(|n| points[n as usize]);
        (c - a).cross(&(d - b))
    };
    let sum: Vec3 = quads.iter().map(area).sum();
    Ok(if points_down(&sum) { quads.iter().map(reversed).collect() } else { quads })
}

pub(super) fn reversed(quad: &[u32; 4]) -> [u32; 4] {
    let [a, b, c, d] = *quad;
    [a, d, c, b]
}
