//! Partition of the memory into disjoint parts of subtrees that run in parallel.

use super::factors::{Factors, Kind};
use super::fronts::{Front, Symbolic};

/// Output memory of one subtree; the fields `.._from` are offsets in the complete arrays.
pub(super) struct Part<'a> {
    pub(super) storage: &'a mut [f64],
    pub(super) storage_from: usize,
    pub(super) pivot: &'a mut [u32],
    pub(super) inverse: &'a mut [u32],
    pub(super) unknown_from: usize,
    /// Eliminated right-hand sides of its fronts.
    pub(super) eliminated: &'a mut [f64],
    pub(super) eliminated_from: usize,
    pub(super) workspace: &'a mut [f64],
    pub(super) workspace_from: usize,
    pub(super) rhs: &'a [&'a [f64]],
    pub(super) kind: Kind,
}

impl<'a> Part<'a> {
    /// The part of the complete tree.
    pub(super) fn whole(kind: Kind, factors: &'a mut Factors, rhs: &'a [&'a [f64]]) -> Self {
        Self {
            storage: factors.storage.get_mut(),
            storage_from: 0,
            pivot: &mut factors.pivot,
            inverse: &mut factors.inverse,
            unknown_from: 0,
            eliminated: &mut factors.eliminated,
            eliminated_from: 0,
            workspace: factors.workspace.get_mut(),
            workspace_from: 0,
            rhs,
            kind,
        }
    }
}

impl Symbolic {
    /// Splits the part of subtree `root` off the front of `part`; it keeps the whole workspace.
    pub(super) fn split<'a>(&self, part: Part<'a>, root: usize) -> (Part<'a>, Part<'a>) {
        let front = &self.fronts[root];
        let next = self.fronts.get(root + 1);
        let storage_end = next.map_or(self.storage, |f| f.storage) - part.storage_from;
        let unknown_end = front.first + front.pivots - part.unknown_from;
        let locals = part.rhs.len() * next.map_or(self.locals, |f| f.local);
        let eliminated_end = locals - part.eliminated_from;
        let (storage, storage_rest) = part.storage.split_at_mut(storage_end);
        let (pivot, pivot_rest) = part.pivot.split_at_mut(unknown_end);
        let (inverse, inverse_rest) = part.inverse.split_at_mut(unknown_end);
        let (eliminated, eliminated_rest) = part.eliminated.split_at_mut(eliminated_end);
        let rest = Part {
            storage: storage_rest,
            storage_from: part.storage_from + storage_end,
            pivot: pivot_rest,
            inverse: inverse_rest,
            unknown_from: part.unknown_from + unknown_end,
            eliminated: eliminated_rest,
            eliminated_from: locals,
            workspace: &mut [],
            workspace_from: part.workspace_from,
            rhs: part.rhs,
            kind: part.kind,
        };
        (Part { storage, pivot, inverse, eliminated, ..part }, rest)
    }

    /// Parts of the children of a front, each with its own workspace behind that of the front.
    pub(super) fn parts_of_children<'p>(
        &self,
        front: &Front,
        part: &'p mut Part<'_>,
    ) -> Vec<(usize, Part<'p>)> {
        let mut rest = Part {
            storage: part.storage,
            storage_from: part.storage_from,
            pivot: part.pivot,
            inverse: part.inverse,
            unknown_from: part.unknown_from,
            eliminated: part.eliminated,
            eliminated_from: part.eliminated_from,
            workspace: &mut [],
            workspace_from: 0,
            rhs: part.rhs,
            kind: part.kind,
        };
        let mut workspace_from = front.contribution + front.contribution_len();
        let mut workspace = &mut part.workspace[workspace_from - part.workspace_from..];
        let mut out = Vec::with_capacity(front.children.len());
        for &c in &front.children {
            let (mut own, after) = self.split(rest, c as usize);
            rest = after;
            let (room, beyond) = workspace.split_at_mut(self.fronts[c as usize].workspace);
            workspace = beyond;
            own.workspace = room;
            own.workspace_from = workspace_from;
            workspace_from += self.fronts[c as usize].workspace;
            out.push((c as usize, own));
        }
        out
    }
}
