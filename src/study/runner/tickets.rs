//! `runner.json`: tickets of submitted cases. Losing it costs repeated submissions, never results.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::StudyError;
use kanagata_files::{Input, WriteError, write_atomic};

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
    /// The cluster that has it, or those (`a,b`, `all`) of which one may have it; none for that of the configuration.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cluster: Option<String>,
}

impl Ticket {
    /// A ticket of one task.
    #[must_use]
    pub fn new(id: String) -> Self {
        Self { id, task: 0, cluster: None }
    }

    /// Whether both are of the same task; the cluster may be known to one of them only.
    #[must_use]
    pub fn is_same_task(&self, other: &Self) -> bool {
        (&self.id, self.task) == (&other.id, other.task)
    }
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
    /// Reads the tickets of a study; none if there is no file.
    ///
    /// # Errors
    /// [`StudyError::Io`] when the file cannot be read, [`StudyError::Value`] when it is damaged.
    pub fn read(study: &Path) -> Result<Self, StudyError> {
        let path = study.join(NAME);
        let text = match kanagata_files::read(&path, Input::Description) {
            Ok(text) => text,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Self::default()),
            Err(source) => return Err(StudyError::Io { path, source }),
        };
        serde_json::from_slice(&text).map_err(|e| StudyError::Value {
            path,
            place: format!("line {}, column {}", e.line(), e.column()),
            found: e.to_string(),
            allowed: "the tickets of a study as this program writes them; without the file, submitted cases may be submitted twice, and their locks let one run".into(),
        })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tickets_are_read_as_written_and_a_damaged_file_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let study = folder.path();
        assert_eq!(Tickets::read(study).unwrap(), Tickets::default());
        let ticket = Ticket { cluster: Some("b".into()), ..Ticket::new("kanagata-1".into()) };
        let mut tickets = Tickets { runner: "slurm".into(), ..Tickets::default() };
        let submission = Submission { ticket: Some(ticket), tries: 1, ..Submission::default() };
        tickets.cases.insert("a".into(), submission);
        tickets.write(study).unwrap();
        assert_eq!(Tickets::read(study).unwrap(), tickets);
        std::fs::write(study.join(NAME), "{\"runner\": ").unwrap();
        let error = Tickets::read(study).unwrap_err().to_string();
        assert!(error.contains(NAME) && error.contains("submitted twice"), "{error}");
    }
}
