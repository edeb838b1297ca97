//! Tolerances and limits of a run, and the method of contact enforcement.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Limits of the solver. Forces and lengths are scaled by the model, so no unit enters.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Maximum Newton iterations of an increment.
    pub iterations: usize,
    /// Target number of iterations: with fewer the next increment grows, with more it shrinks.
    pub wanted_iterations: usize,
    /// Tolerance of the residual force over the norm of contact forces and reactions.
    pub force_tolerance: f64,
    /// Tolerance of the penetration of a node over the thickness of the sheet.
    pub gap_tolerance: f64,
    /// Smallest increment, as a fraction of the first one (of the largest, if that is smaller).
    pub smallest_step: f64,
    /// Maximum number of increments of a run.
    pub increments: usize,
    /// Slip in an increment over which friction rises to the Coulomb force, over the longest element edge; 0: exact
    /// stick and slip. See [`kanagata_contact::friction::Coulomb`].
    pub friction_transition: f64,
    /// Relative error of the forces from the length of an increment, > 0, above which increments are shortened; `None`:
    /// their length follows the iterations alone.
    pub increment_error: Option<f64>,
    /// Method of contact enforcement.
    pub contact: ContactMethod,
}

/// How a node is kept out of a tool. Stiffnesses are shares of the undeformed mesh's own, so that no unit enters.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum ContactMethod {
    /// Exactly, the normal force being what equilibrium leaves over.
    #[default]
    Exact,
    /// By a spring: the node lies in the tool by its normal force over the stiffness.
    Penalty {
        /// Of the spring, over the mesh's, > 0.
        stiffness: f64,
    },
    /// By a spring about a known force, which is corrected from outside until the gap is closed.
    Augmented {
        /// Of the spring, over the mesh's, > 0.
        stiffness: f64,
    },
}

impl ContactMethod {
    /// Stiffness of the spring over that of the mesh, if there is one.
    #[must_use]
    pub fn stiffness(self) -> Option<f64> {
        match self {
            Self::Exact => None,
            Self::Penalty { stiffness } | Self::Augmented { stiffness } => Some(stiffness),
        }
    }
}

/// Iterations of an easy increment or step: three quarters of the target `wanted`. The next one may be longer.
pub(crate) fn easy_iterations(wanted: usize) -> usize {
    3 * wanted / 4
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            iterations: 25,
            wanted_iterations: 7,
            force_tolerance: 1e-6,
            gap_tolerance: 1e-8,
            smallest_step: 1e-4,
            increments: 100_000,
            friction_transition: 0.0,
            increment_error: None,
            contact: ContactMethod::Exact,
        }
    }
}
