//! `runner.json`: tickets of submitted cases. Losing it costs repeated submissions, never results.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::files::{Input, WriteError, write_atomic};

/// Name of the file in the folder of a study.
const NAME: &str = "runner.json";

/// A group that was submitted to an engine.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Ticket {
    /// Name at the engine.
    pub id: String,
    /// Index of its task.
    #[serde(default)]
    pub task: usize,
}

/// The submissions of a case.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Submission {
    /// The present ticket.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ticket: Option<Ticket>,
    /// Submissions since the run last advanced.
    pub tries: usize,
    /// Increments of the run at the last submission.
    #[serde(default)]
    pub increment: usize,
    /// How the last submission ended of a case that is not submitted again.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last_failure: Option<String>,
}

/// The submissions of a study.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tickets {
    /// The runner that they were submitted to.
    pub runner: String,
    /// Submissions by case.
    pub cases: BTreeMap<String, Submission>,
}

impl Tickets {
    /// Reads the tickets of a study; none if there is no file or it is damaged.
    #[must_use]
    pub fn read(study: &Path) -> Self {
        let text = crate::files::read(&study.join(NAME), Input::Description).unwrap_or_default();
        serde_json::from_slice(&text).unwrap_or_default()
    }

    /// Writes the tickets.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub fn write(&self, study: &Path) -> Result<(), WriteError> {
        write_atomic(&study.join(NAME), |w| {
            serde_json::to_writer_pretty(&mut *w, self)?;
            writeln!(w)
        })
    }
}
