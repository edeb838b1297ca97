//! Tolerances and limits of a run, and how contact is enforced.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Limits of the solver. Forces and lengths are scaled by the problem itself: no unit enters.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Newton iterations an increment may take.
    pub iterations: usize,
    /// Iterations an increment should take: fewer and the next one grows, more and it shrinks.
    pub wanted_iterations: usize,
    /// Residual force over the norm of contact forces and reactions.
    pub force_tolerance: f64,
    /// Largest penetration of a node [mm] over the sheet's thickness.
    pub gap_tolerance: f64,
    /// Smallest increment, a share of the first one (of the largest, where that is smaller).
    pub smallest_step: f64,
    /// Increments of the whole run.
    pub increments: usize,
    /// Slip in an increment over which friction rises to Coulomb's force, over the longest element edge;
    /// 0: exact stick and slip. See [`crate::contact::friction::Coulomb`].
    pub friction_transition: f64,
    /// How a node is kept out of a tool.
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
    /// Stiffness of the spring over the mesh's, where there is one.
    #[must_use]
    pub fn stiffness(self) -> Option<f64> {
        match self {
            Self::Exact => None,
            Self::Penalty { stiffness } | Self::Augmented { stiffness } => Some(stiffness),
        }
    }
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
            contact: ContactMethod::Exact,
        }
    }
}
