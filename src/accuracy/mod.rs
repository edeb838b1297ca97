//! Accuracy on demand: a sequence of runs of one scene, from coarse to fine, until estimated errors are small enough.
//!
//! 1. The first run has two elements over 90 degrees of the smallest radius within reach (`start`), one layer and six
//!    points. It shows where the sheet bends and where tools penetrate it: all further meshes are refined there (`pattern`).
//! 2. Meshes are refined (`sequence`). The distance between the last two runs and the observed order of convergence give
//!    the error of the mesh (`estimate`).
//! 3. On the last of them points through the thickness are raised and layers doubled (`choose`, `options`). The change that
//!    each brings gives its part of the error. What is too inaccurate is changed for all further runs, whose meshes are as
//!    fine as the estimates predict to be necessary. All runs keep the error of their increments small, and estimate it.
//! 4. The sequence ends when the sum of the parts is below the error that was asked for.
//!
//! A quantity of two runs is compared by a distance (`distance`) that vanishes only where both agree in a whole curve or
//! field: values that agree by chance do not look converged.

mod choose;
mod distance;
mod error;
mod estimate;
mod field;
mod into_folder;
mod model;
mod options;
mod pattern;
mod publish;
mod quantities;
mod records;
mod runner;
mod sequence;
mod start;
mod status;

pub use error::AccuracyError;
pub use into_folder::run_into;
pub use model::Model;
pub use publish::RUNS;
pub use runner::{Limits, Observer, Sequence};
pub use sequence::run_to_accuracy;
pub use status::{SequenceRun, SequenceStatus, sequence_status};
