//! One file a subcommand, for both programs; [`exit`] holds the exit codes and prints errors.

pub mod audit;
pub mod cad;
pub mod check;
pub mod convert;
pub mod doubts;
pub mod ended;
mod exit;
mod fit;
mod gmsh;
pub mod inspect;
pub mod material;
pub mod mesh;
mod own;
pub mod quantity;
mod read;
mod remedy;
pub mod run;
mod say;
mod skip;
pub mod solve;
pub mod status;
mod stop;
pub mod study;
mod threads;
