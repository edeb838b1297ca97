//! The command lines of both programs, one file per subcommand. [`exit`] has the exit codes and prints errors.

pub mod audit;
pub mod cad;
pub mod check;
pub mod convert;
pub mod doubts;
mod exit;
mod fit;
mod gmsh;
pub mod inspect;
pub mod material;
pub mod mesh;
mod output_clash;
pub mod quantity;
mod read;
mod remedy;
pub mod report;
pub mod run;
pub mod run_summary;
mod skip;
pub mod solve;
pub mod status;
mod stop;
pub mod study;
mod terminal;
mod threads;
