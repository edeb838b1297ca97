//! Symbolic analysis: fronts, their tree and the memory layout. Computed once for a pattern and used by every
//! refactorisation.

use super::choice::{Ordering, elimination, front_operations};
use super::fronts::{Front, Run, Symbolic};
use super::pattern::{Members, PatternError, PatternRef, members_of, quotient};
use super::supernodes::Supernodes;
use kanagata_geometry::Vec3;

impl Symbolic {
    /// Analyses a pattern whose unknown `i` belongs to block `block[i]`. Unknowns of a block are eliminated together:
    /// those of a node, or of a through-thickness column. `centers[b]` is the position of block `b`; empty if
    /// unknown.
    ///
    /// # Errors
    /// [`PatternError`] if lengths are inconsistent or a front exceeds 32-bit indices.
    pub fn new(
        pattern: PatternRef<'_>,
        block: &[u32],
        centers: &[Vec3],
    ) -> Result<Self, PatternError> {
        let n = pattern.row_start.len().saturating_sub(1);
        let block_count = if centers.is_empty() { n } else { centers.len() };
        if block.len() != n || block.iter().any(|&b| b as usize >= block_count) {
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

    /// Method that produced the elimination order.
    #[must_use]
    pub fn ordering(&self) -> Ordering {
        self.ordering
    }

    /// Number of multiply-add operations of a factorisation.
    #[must_use]
    pub fn flops(&self) -> f64 {
        self.roots.iter().map(|&r| self.fronts[r as usize].flops).sum()
    }

    /// Memory of factors and workspace [bytes].
    #[must_use]
    pub fn bytes(&self) -> usize {
        8 * (self.storage + self.workspace)
    }

    fn lay_out(
        n: usize,
        nodes: &Supernodes,
        order: &[u32],
        members: &Members,
    ) -> Result<Self, PatternError> {
        let mut plan = Self { n, ..Self::default() };
        let first_of_position = plan.number_unknowns(nodes, order, members);
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
            let (rows, children) = (expand(&node.below), node.children.clone());
            let below = rows.len();
            plan.push(Front { first: next, pivots, below, rows, children, ..Front::default() })?;
            next += pivots;
        }
        plan.roots.clone_from(&nodes.roots);
        plan.link();
        plan.place_contributions();
        Ok(plan)
    }

    /// Numbers the unknowns of the blocks of each front in elimination order; returns the first new number of each
    /// position.
    fn number_unknowns(
        &mut self,
        nodes: &Supernodes,
        order: &[u32],
        members: &Members,
    ) -> Vec<u32> {
        let mut first_of_position = vec![0u32; order.len()];
        for node in &nodes.list {
            for &position in &node.blocks {
                first_of_position[position as usize] = self.old_of_new.len() as u32;
                self.old_of_new.extend(members.of(order[position as usize] as usize));
            }
        }
        first_of_position
    }

    /// Appends a front to the memory layout.
    fn push(&mut self, mut front: Front) -> Result<(), PatternError> {
        if front.storage_len() > u32::MAX as usize {
            return Err(PatternError("a front holds more than 2^32 numbers"));
        }
        front.local = self.locals;
        self.locals += front.pivots + front.below;
        front.storage = self.storage;
        // Fronts start on cache lines: this is faster, and the kernels always see the same alignment.
        self.storage += front.storage_len().next_multiple_of(8);
        self.fronts.push(front);
        Ok(())
    }

    /// Computes subtrees, operation counts and the map of each contribution to its parent.
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

    /// Static workspace layout: a contribution at the base of the part of its subtree, the parts of the children
    /// behind it. Children processed in sequence share the space behind the contributions already computed.
    fn place_contributions(&mut self) {
        const PARALLEL_WORK_FRACTION: f64 = 0.02;
        let threshold = PARALLEL_WORK_FRACTION * self.flops();
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
            // A run does not cross the boundary between the pivots of the parent and the rows below.
            Some(run) if (run.parent + run.len) as usize == place && place != parent.pivots => {
                run.len += 1;
            }
            _ => runs.push(Run { child: k as u32, parent: place as u32, len: 1 }),
        }
    }
    runs
}
