//! The plan of a factorisation: fronts, their tree, and where everything lies in memory. Made once for a
//! pattern, used for every refactorisation.

use super::choice::{Ordering, elimination, front_operations};
use super::order::BlockGraph;
use crate::geometry::Vec3;

/// A run of consecutive rows of a child's contribution that lands on consecutive rows of its parent's front.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run {
    pub child: u32,
    pub parent: u32,
    pub len: u32,
}

/// One front: a dense block of `pivots` unknowns eliminated together and the `below` unknowns they touch.
///
/// Storage, column by column: the panel ((pivots + below) x pivots: pivot block over L21), then U12
/// (pivots x below). The contribution block (below x below) lives in the workspace.
#[derive(Debug, Clone, Default)]
pub(super) struct Front {
    /// First pivot in the new numbering; pivots are consecutive.
    pub first: usize,
    pub pivots: usize,
    pub below: usize,
    /// Unknowns below, new numbering, rising.
    pub rows: Vec<u32>,
    /// Fronts whose contributions are added here, rising.
    pub children: Vec<u32>,
    /// The front that this one's contribution is added to; of a root any.
    pub parent: u32,
    /// Start of its pivots and the unknowns below among those of all fronts.
    pub local: usize,
    /// How this front's contribution lands in its parent.
    pub runs: Vec<Run>,
    /// Start in the factor storage.
    pub storage: usize,
    /// Start of this front's contribution block in the workspace: its children's lie above it.
    pub contribution: usize,
    /// Range in the assembly map.
    pub entries: std::ops::Range<usize>,
    /// First front of the subtree.
    pub subtree: usize,
    /// Workspace its subtree needs, own contribution included.
    pub workspace: usize,
    /// The children are worked on side by side, each in its own workspace.
    pub parallel: bool,
    /// Some front of the subtree is `parallel`.
    pub forks: bool,
    /// Operations of the subtree.
    pub flops: f64,
}

impl Front {
    pub fn panel_len(&self) -> usize {
        (self.pivots + self.below) * self.pivots
    }

    pub fn storage_len(&self) -> usize {
        self.panel_len() + self.pivots * self.below
    }

    /// Rounded up so that the next one begins on a cache line.
    pub fn contribution_len(&self) -> usize {
        (self.below * self.below).next_multiple_of(8)
    }
}

/// The plan of a factorisation.
#[derive(Debug, Clone, Default)]
pub struct Symbolic {
    /// Request to give up a factorisation.
    pub(in crate::solver::linear) cancel: crate::cancel::Cancel,
    /// How the order of elimination was found.
    ordering: Ordering,
    /// Number of unknowns.
    pub(super) n: usize,
    /// New number of each unknown to its old one.
    pub(super) old_of_new: Vec<u32>,
    /// Fronts in the order of elimination, children before parents, each subtree consecutive.
    pub(super) fronts: Vec<Front>,
    /// Fronts without a parent, rising.
    pub(super) roots: Vec<u32>,
    /// Index of a matrix value, for every entry of every front.
    pub(super) entry_value: Vec<u32>,
    /// Where it goes in its front's storage.
    pub(super) entry_place: Vec<u32>,
    /// Pivots and unknowns below of all fronts.
    pub(super) locals: usize,
    /// Length of the factor storage.
    pub(super) storage: usize,
    /// Length of the workspace.
    pub(super) workspace: usize,
}

/// A square matrix pattern in compressed rows. Fill is planned for the union of the structure and its mirror.
#[derive(Debug, Clone, Copy)]
pub struct PatternRef<'a> {
    /// Start of each row, one more than rows.
    pub row_start: &'a [usize],
    /// Columns of each row.
    pub columns: &'a [u32],
}

/// Why a pattern cannot be planned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the matrix pattern is not usable: {0}")]
pub struct PatternError(pub &'static str);

impl Symbolic {
    /// Plans the factorisation of a pattern whose unknown `i` belongs to block `block[i]` (unknowns that are
    /// eliminated together: the three of a node, or all of a through-thickness column), block `b` standing at
    /// `centers[b]` (none: nothing is known of where they stand).
    ///
    /// # Errors
    /// [`PatternError`] when lengths disagree or a front would be too large for 32-bit places.
    pub fn new(
        pattern: PatternRef<'_>,
        block: &[u32],
        centers: &[Vec3],
    ) -> Result<Self, PatternError> {
        let n = pattern.row_start.len().saturating_sub(1);
        let most = if centers.is_empty() { n } else { centers.len() };
        if block.len() != n || block.iter().any(|&b| b as usize >= most) {
            return Err(PatternError("every unknown needs a block and every block a centre"));
        }
        if pattern.row_start.last() != Some(&pattern.columns.len())
            || pattern.columns.iter().any(|&c| c as usize >= n)
        {
            return Err(PatternError("columns do not fit the row starts"));
        }
        let last = block.iter().max().map_or(0, |&b| b as usize + 1);
        let members = members_of(block, last.max(centers.len()));
        let graph = quotient(pattern, block, &members);
        let found = elimination(&graph, centers, &members)?;
        let mut plan = Self::lay_out(n, &found.nodes, &found.order, &members)?;
        plan.ordering = found.ordering;
        super::entries::map_entries(&mut plan, pattern)?;
        Ok(plan)
    }

    /// How the order of elimination was found.
    #[must_use]
    pub fn ordering(&self) -> Ordering {
        self.ordering
    }

    /// Multiplications and additions of a factorisation.
    #[must_use]
    pub fn flops(&self) -> f64 {
        self.roots.iter().map(|&r| self.fronts[r as usize].flops).sum()
    }

    /// Bytes of factors and workspace.
    #[must_use]
    pub fn bytes(&self) -> usize {
        8 * (self.storage + self.workspace)
    }

    fn lay_out(
        n: usize,
        nodes: &super::supernodes::Supernodes,
        order: &[u32],
        members: &Members,
    ) -> Result<Self, PatternError> {
        let mut plan = Self { n, ..Self::default() };
        // New numbers: unknowns of the blocks of each front, in elimination order.
        let mut first_of_position = vec![0u32; order.len()];
        for node in &nodes.list {
            for &position in &node.blocks {
                first_of_position[position as usize] = plan.old_of_new.len() as u32;
                plan.old_of_new.extend(members.of(order[position as usize] as usize));
            }
        }
        let expand = |positions: &[u32]| -> Vec<u32> {
            let mut rows: Vec<u32> = positions
                .iter()
                .flat_map(|&p| {
                    let first = first_of_position[p as usize];
                    first..first + members.of(order[p as usize] as usize).len() as u32
                })
                .collect();
            rows.sort_unstable();
            rows
        };
        let mut next = 0;
        for node in &nodes.list {
            let pivots: usize =
                node.blocks.iter().map(|&p| members.of(order[p as usize] as usize).len()).sum();
            let rows = expand(&node.below);
            let mut front =
                Front { first: next, pivots, below: rows.len(), rows, ..Front::default() };
            next += pivots;
            if front.storage_len() > u32::MAX as usize {
                return Err(PatternError("a front holds more than 2^32 numbers"));
            }
            front.children.clone_from(&node.children);
            front.local = plan.locals;
            plan.locals += front.pivots + front.below;
            front.storage = plan.storage;
            // Fronts begin on cache lines: faster, and the kernels see the same alignment every time.
            plan.storage += front.storage_len().next_multiple_of(8);
            plan.fronts.push(front);
        }
        plan.roots.clone_from(&nodes.roots);
        plan.link();
        plan.place_contributions();
        Ok(plan)
    }

    /// Subtrees, operation counts and where each contribution lands in its parent.
    fn link(&mut self) {
        for i in 0..self.fronts.len() {
            let own = front_operations(self.fronts[i].pivots, self.fronts[i].below);
            let children = std::mem::take(&mut self.fronts[i].children);
            self.fronts[i].flops =
                own + children.iter().map(|&c| self.fronts[c as usize].flops).sum::<f64>();
            self.fronts[i].subtree =
                children.first().map_or(i, |&c| self.fronts[c as usize].subtree);
            for &c in &children {
                let runs = runs_into(&self.fronts[c as usize], &self.fronts[i]);
                self.fronts[c as usize].runs = runs;
                self.fronts[c as usize].parent = i as u32;
            }
            self.fronts[i].children = children;
        }
    }

    /// Static workspace: a contribution at the base of its subtree's part, the children's parts above it.
    /// Children that are worked on one after the other share the room above the contributions already made.
    fn place_contributions(&mut self) {
        const PARALLEL_SHARE: f64 = 0.02;
        let threshold = PARALLEL_SHARE * self.flops();
        for i in 0..self.fronts.len() {
            let children = std::mem::take(&mut self.fronts[i].children);
            let big =
                children.iter().filter(|&&c| self.fronts[c as usize].flops > threshold).count();
            let parallel = big > 1;
            let own = self.fronts[i].contribution_len();
            let (mut top, mut peak) = (own, own);
            for &c in &children {
                let child = &self.fronts[c as usize];
                peak = peak.max(top + child.workspace);
                top += if parallel { child.workspace } else { child.contribution_len() };
            }
            self.fronts[i].workspace = peak;
            self.fronts[i].parallel = parallel;
            self.fronts[i].forks =
                parallel || children.iter().any(|&c| self.fronts[c as usize].forks);
            self.fronts[i].children = children;
        }
        self.workspace =
            self.roots.iter().map(|&r| self.fronts[r as usize].workspace).max().unwrap_or(0);
        self.place_absolute();
    }

    fn place_absolute(&mut self) {
        for i in (0..self.fronts.len()).rev() {
            let base = self.fronts[i].contribution;
            let mut top = base + self.fronts[i].contribution_len();
            let parallel = self.fronts[i].parallel;
            for k in 0..self.fronts[i].children.len() {
                let c = self.fronts[i].children[k] as usize;
                self.fronts[c].contribution = top;
                top += if parallel {
                    self.fronts[c].workspace
                } else {
                    self.fronts[c].contribution_len()
                };
            }
        }
    }
}

fn runs_into(child: &Front, parent: &Front) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    let mut at = 0;
    for (k, &row) in child.rows.iter().enumerate() {
        let row_ = row as usize;
        let place = if row_ < parent.first + parent.pivots {
            row_ - parent.first
        } else {
            while parent.rows[at] != row {
                at += 1;
            }
            parent.pivots + at
        };
        match runs.last_mut() {
            // A run does not straddle the border between the parent's pivots and the rest.
            Some(run) if (run.parent + run.len) as usize == place && place != parent.pivots => {
                run.len += 1;
            }
            _ => runs.push(Run { child: k as u32, parent: place as u32, len: 1 }),
        }
    }
    runs
}

/// Unknowns of each block, rising.
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

/// Blocks tied by a value in either direction.
fn quotient(pattern: PatternRef<'_>, block: &[u32], members: &Members) -> BlockGraph {
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
