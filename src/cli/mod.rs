//! One file a subcommand, for both programs; [`exit`] holds the exit codes and prints errors.

pub mod check;
pub mod exit;
pub mod run;
pub mod solve;
