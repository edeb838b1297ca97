//! The plan of a factorisation: fronts in the order of elimination.

use super::choice::Ordering;

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
    pub(in crate::solver) ordering: Ordering,
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
