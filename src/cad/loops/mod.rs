//! Boundary loops in native surface parameters: from the file's parameter curves where they are accurate, otherwise
//! projected from the space curves; closed across seams and poles.

mod closed;
mod paths;
mod periods;
mod project;
mod seam;
mod side;
mod slits;
#[cfg(test)]
mod slits_tests;
#[cfg(test)]
mod tests;

pub(super) use closed::closed_loops;
pub(super) use paths::paths_of;
pub(super) use side::{LoopFault, Path, Side, outer_loop_is_reversed, signed_area};
