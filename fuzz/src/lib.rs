//! The readers, compiled for the fuzzer without the solver and what that needs (minutes of building), and what both
//! targets share: what reading one input may cost, and changes that know words and columns. `tools/fuzz` runs them.
//!
//! libFuzzer's own limits see the whole process and nothing that was asked for but never touched; [`within_limits`]
//! counts what one input asks for.

// The rest of the package uses what is unused here.
#![allow(dead_code)]

#[path = "../../src/cad/mod.rs"]
pub mod cad;
pub mod dice;
#[path = "../../src/geometry/mod.rs"]
pub mod geometry;
pub mod limits;
pub mod mutate;

pub use limits::within_limits;
