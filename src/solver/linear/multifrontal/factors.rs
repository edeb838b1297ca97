//! Factors of a matrix, front by front.

use super::memory::Memory;

/// Columns of a strip of a large product, and operations below which a front is not divided into strips.
pub(super) const STRIP_COLUMNS: usize = 96;

pub(super) const STRIP_FLOPS_MIN: f64 = 2e7;

/// A front with a singular pivot block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "the matrix is singular near unknown {unknown}: a part of the model is not held, or its stiffness has vanished"
)]
pub struct Singular {
    /// Unknown (in the numbering of the pattern) of the singular pivot block.
    pub unknown: usize,
}

/// Type of the factorisation.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum Kind {
    /// General matrix: P A = L U within every front.
    #[default]
    General,
    /// Symmetric positive definite matrix: A = L L^T; only the lower triangle is read.
    Symmetric,
}

/// Factors of one matrix, with memory reused for later matrices of the same pattern.
#[derive(Debug, Default)]
pub struct Factors {
    pub(super) storage: Memory,
    pub(super) workspace: Memory,
    /// Original row at each position of the pivot block after pivoting, local to its front.
    pub(super) pivot: Vec<u32>,
    pub(super) inverse: Vec<u32>,
    pub(super) kind: Kind,
    /// Right-hand sides of every front after elimination of its pivots.
    pub(super) eliminated: Vec<f64>,
}

impl Factors {
    /// Whether these are the LL^T factors of a symmetric matrix.
    #[must_use]
    pub fn is_symmetric(&self) -> bool {
        self.kind == Kind::Symmetric
    }

    /// Panels and U12 blocks of all fronts.
    pub(super) fn storage(&self) -> &[f64] {
        self.storage.get()
    }
}

#[inline]
pub(super) fn add(to: &mut [f64], from: &[f64], len: u32) {
    let len = len as usize;
    for (t, f) in to[..len].iter_mut().zip(&from[..len]) {
        *t += f;
    }
}
