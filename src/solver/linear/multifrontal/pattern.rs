//! Pattern of a matrix, grouping of its unknowns in blocks, and the graph of coupled blocks.

use super::order::BlockGraph;

/// Square matrix pattern in compressed rows. Fill is computed for the union of the structure and its transpose.
#[derive(Debug, Clone, Copy)]
pub struct PatternRef<'a> {
    /// Start of each row; length rows + 1.
    pub row_start: &'a [usize],
    /// Columns of each row.
    pub columns: &'a [u32],
}

/// Reason why a pattern cannot be analysed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the matrix pattern is not usable: {0}")]
pub struct PatternError(pub &'static str);

/// Unknowns of each block, ascending.
#[derive(Debug, Clone)]
pub(super) struct Members {
    start: Vec<usize>,
    unknowns: Vec<u32>,
}

impl Members {
    pub fn of(&self, block: usize) -> &[u32] {
        &self.unknowns[self.start[block]..self.start[block + 1]]
    }
}

pub(super) fn members_of(block: &[u32], blocks: usize) -> Members {
    let mut start = vec![0usize; blocks + 1];
    for &b in block {
        start[b as usize + 1] += 1;
    }
    for b in 0..blocks {
        start[b + 1] += start[b];
    }
    let mut next = start.clone();
    let mut unknowns = vec![0u32; block.len()];
    for (i, &b) in block.iter().enumerate() {
        unknowns[next[b as usize]] = i as u32;
        next[b as usize] += 1;
    }
    Members { start, unknowns }
}

/// Graph of blocks coupled by a value in either direction (quotient graph).
pub(super) fn quotient(pattern: PatternRef<'_>, block: &[u32], members: &Members) -> BlockGraph {
    let blocks = members.start.len() - 1;
    let mut mark = vec![u32::MAX; blocks];
    let mut ties: Vec<[u32; 2]> = Vec::new();
    for b in 0..blocks as u32 {
        mark[b as usize] = b;
        for &i in members.of(b as usize) {
            let row = pattern.row_start[i as usize]..pattern.row_start[i as usize + 1];
            for &c in &pattern.columns[row] {
                let other = block[c as usize];
                if mark[other as usize] != b {
                    mark[other as usize] = b;
                    ties.extend([[b, other], [other, b]]);
                }
            }
        }
    }
    ties.sort_unstable();
    ties.dedup();
    let mut start = vec![0usize; blocks + 1];
    for tie in &ties {
        start[tie[0] as usize + 1] += 1;
    }
    for b in 0..blocks {
        start[b + 1] += start[b];
    }
    BlockGraph { start, neighbours: ties.iter().map(|tie| tie[1]).collect() }
}
