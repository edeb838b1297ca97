//! Boundary loops in a surface's native parameters: taken from the file's parameter curves where these are
//! good, projected from the curves in space where not; closed across seams and poles.

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
pub(super) use side::{LoopFault, Path, Side, are_inside_out, signed_area};
