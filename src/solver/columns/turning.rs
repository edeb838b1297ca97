//! Columns and quadrilaterals turned the same way.

use rustc_hash::FxHashMap;

use super::SheetError;
use super::families::{all_different, one_part};
use crate::geometry::Vec3;

pub(super) fn looks_down(up: &Vec3) -> bool {
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
pub(super) fn same_way_up(
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
    let mut first: FxHashMap<[u32; 2], Option<(usize, bool)>> = FxHashMap::default();
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

pub(super) fn reversed(quad: &[u32; 4]) -> [u32; 4] {
    let [a, b, c, d] = *quad;
    [a, d, c, b]
}
