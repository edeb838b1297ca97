//! The forming solver.
fn main() {}
