//! Linear solvers.
pub mod multifrontal;
