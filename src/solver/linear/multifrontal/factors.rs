//! Factors of a matrix, front by front.

use super::memory::Memory;

/// Columns of a strip of a large product; operations below which a front is not cut into strips.
pub(super) const STRIP: usize = 96;

pub(super) const STRIP_FLOPS: f64 = 2e7;

/// A front whose pivot block is singular.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "the matrix is singular near unknown {unknown}: a part of the model is not held, or its stiffness has vanished"
)]
pub struct Singular {
    /// An unknown (numbered as in the pattern) of the pivot block that has no inverse.
    pub unknown: usize,
}

/// What is factored.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum Kind {
    /// Any matrix: P A = L U within every front.
    #[default]
    General,
    /// Symmetric and positive definite: A = L L^T; only the lower triangle is read.
    Symmetric,
}

/// Factors of one matrix, and the memory for the next ones of the same pattern.
#[derive(Debug, Default)]
pub struct Factors {
    pub(super) storage: Memory,
    pub(super) workspace: Memory,
    /// Row of the pivot block that stands in each place after pivoting, counted within its front.
    pub(super) pivot: Vec<u32>,
    pub(super) inverse: Vec<u32>,
    pub(super) kind: Kind,
    /// What was left of the right-hand sides in every front when its pivots were eliminated.
    pub(super) eliminated: Vec<f64>,
}

impl Factors {
    /// Whether they are those of a symmetric matrix.
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
