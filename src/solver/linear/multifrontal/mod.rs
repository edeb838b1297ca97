//! A multifrontal LU, and LL^T where the matrix is symmetric and positive definite, of our own on dense kernels: nested dissection of blocks by their coordinates (minimum
//! degree where these say nothing), static memory reused by every refactorisation, pivoting inside fronts, subtrees in parallel, the same bits for any
//! number of threads.
//!
//! Rows are pivoted only within the pivot block of their front (an entire through-thickness column of the
//! sheet at least); whoever calls checks the residual and refines.

mod choice;
mod entries;
mod factors;
mod fronts;
mod inverse;
mod memory;
mod numeric;
mod order;
mod part;
mod pattern;
mod substitute;
mod supernodes;
mod symbolic;
mod symmetric;

pub use choice::Ordering;
pub use factors::{Factors, Singular};
pub use fronts::Symbolic;
pub use inverse::{Meeting, SparseRow};
pub use pattern::{PatternError, PatternRef};

#[cfg(test)]
mod tests;
