//! Errors of a run.

use crate::linear::LinearError;
use crate::newton::outcome::NewtonError;

/// Reason why a run cannot start or continue.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum SimulationError {
    /// The model is inconsistent.
    #[error("{0}")]
    Setup(String),
    /// A tool that should be placed in contact never meets the sheet.
    #[error(
        "tool `{tool}` cannot be placed touching: moved along its direction it never meets the sheet; {remedy}"
    )]
    NoTouch {
        /// Name of the tool.
        tool: String,
        /// Its foremost faces face away from the sheet.
        looks_back: bool,
        /// Probable cause and remedy.
        remedy: String,
    },
    /// The matrix cannot be analysed, or a linear solve failed.
    #[error("{0}")]
    Linear(#[from] LinearError),
    /// An increment did not converge even with the smallest step.
    #[error(
        "stage `{stage}`, increment {increment}, stage fraction {share:.6}: not converged at a step of {step:.3e} of the stage: {cause}. Nearest tool there: `{tool}`, node {node} at ({x:.3}, {y:.3}, {z:.3}) mm. {remedy}"
    )]
    GaveUp {
        /// Stage name.
        stage: String,
        /// Increment that failed.
        increment: usize,
        /// Fraction of the stage reached.
        share: f64,
        /// Step that failed.
        step: f64,
        /// Node with the largest residual or failure.
        node: usize,
        /// Position of the node [mm].
        x: f64,
        /// Position of the node [mm].
        y: f64,
        /// Position of the node [mm].
        z: f64,
        /// Tool closest to the node.
        tool: Box<str>,
        /// Error of the Newton iteration.
        cause: Box<NewtonError>,
        /// Probable cause and remedy.
        remedy: Box<str>,
    },
    /// No tool holds the sheet, and its loads are not self-equilibrated.
    #[error(
        "stage `{stage}`: no tool holds the sheet, and {:.2} % of the scene's loads push it along as a whole, which nothing opposes. Remove them with the tools (`load_share` 0 at the end of the stage), hold the sheet (`holds`), or keep a tool at it", 100.0 * share
    )]
    NothingHolds {
        /// Stage name.
        stage: String,
        /// Fraction of the loads that is not balanced.
        share: f64,
    },
    /// The maximum number of increments is reached.
    #[error(
        "{limit} increments done and the process is not finished; raise `solver.increments` in the scene"
    )]
    TooManyIncrements {
        /// Maximum number of increments.
        limit: usize,
    },
    /// The run was stopped on request.
    #[error("stopped after increment {increment}")]
    Stopped {
        /// Last increment.
        increment: usize,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_that_failed_is_told_in_four_digits() {
        let cause = NewtonError::StillMoving { iterations: 40 };
        let error = SimulationError::GaveUp {
            stage: "draw".into(),
            increment: 12,
            share: 0.25,
            step: 7.802327320671765e-6,
            node: 3,
            x: 1.0,
            y: 2.0,
            z: 3.0,
            tool: "punch".into(),
            cause: Box::new(cause),
            remedy: "".into(),
        };
        let text = error.to_string();
        assert!(text.contains("not converged at a step of 7.802e-6 of the stage"), "{text}");
    }
}
