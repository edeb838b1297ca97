//! Multifrontal LU, and LL^T for symmetric positive definite matrices, on dense kernels.
//!
//! - Order: nested dissection of blocks by coordinates, or minimum degree for graphs unrelated to coordinates.
//! - Memory is static and reused by every refactorisation.
//! - Subtrees run in parallel; results do not depend on the number of threads.
//! - Rows are pivoted only within the pivot block of their front (at least one complete through-thickness column of
//!   the sheet). The caller checks the residual and refines.

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
pub use inverse::{InverseProduct, SparseRow};
pub use pattern::{PatternError, PatternRef};

#[cfg(test)]
mod tests;
