//! Plan of a factorisation: fronts in elimination order.

use super::choice::Ordering;

/// A run of consecutive rows of the contribution of a child that map to consecutive rows of its parent.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run {
    pub child: u32,
    pub parent: u32,
    pub len: u32,
}

/// One front: a dense block of `pivots` unknowns eliminated together and the `below` unknowns coupled to them.
///
/// Storage is column-major: the panel ((pivots + below) x pivots: pivot block over L21), then U12 (pivots x below).
/// The contribution block (below x below) is kept in the workspace.
#[derive(Debug, Clone, Default)]
pub(super) struct Front {
    /// First pivot in the new numbering; pivots are consecutive.
    pub first: usize,
    pub pivots: usize,
    pub below: usize,
    /// Unknowns below the pivots in the new numbering, ascending.
    pub rows: Vec<u32>,
    /// Fronts whose contributions are added to this one, ascending.
    pub children: Vec<u32>,
    /// Front that receives the contribution of this one; undefined for a root.
    pub parent: u32,
    /// Start of the pivots and unknowns below among those of all fronts.
    pub local: usize,
    /// Map of the contribution to the parent.
    pub runs: Vec<Run>,
    /// Start in the factor storage.
    pub storage: usize,
    /// Start of the contribution block in the workspace; those of the children follow it.
    pub contribution: usize,
    /// Range in the assembly map.
    pub entries: std::ops::Range<usize>,
    /// First front of the subtree.
    pub subtree: usize,
    /// Workspace of the subtree, including the contribution of this front.
    pub workspace: usize,
    /// Whether the children are processed in parallel, each with its own workspace.
    pub parallel: bool,
    /// Whether any front of the subtree is `parallel`.
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

    /// Rounded up so that the next block starts on a cache line.
    pub fn contribution_len(&self) -> usize {
        (self.below * self.below).next_multiple_of(8)
    }
}

/// Plan of a factorisation (result of the symbolic analysis).
#[derive(Debug, Clone, Default)]
pub struct Symbolic {
    /// Cancellation of a factorisation.
    pub(in crate::linear) cancel: kanagata_cancel::Cancel,
    /// Method that produced the elimination order.
    pub(crate) ordering: Ordering,
    /// Number of unknowns.
    pub(super) n: usize,
    /// Old number of each unknown by its new number.
    pub(super) old_of_new: Vec<u32>,
    /// Fronts in elimination order: children before parents, each subtree consecutive.
    pub(super) fronts: Vec<Front>,
    /// Fronts without a parent, ascending.
    pub(super) roots: Vec<u32>,
    /// Index of the matrix value of every entry of every front.
    pub(super) entry_value: Vec<u32>,
    /// Index of the entry in the storage of its front.
    pub(super) entry_place: Vec<u32>,
    /// Total number of pivots and unknowns below of all fronts.
    pub(super) locals: usize,
    /// Length of the factor storage.
    pub(super) storage: usize,
    /// Length of the workspace.
    pub(super) workspace: usize,
}
