//! `manifest.json`: the state of the cases of a study.

use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::StudyError;
use crate::files::{WriteError, write_atomic};

/// State of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// Not started, or interrupted.
    Waiting,
    /// All stages done.
    Done,
    /// Ended early.
    Failed,
}

impl State {
    /// Name of the state.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Done => "done",
            Self::Failed => "failed",
        }
    }
}

/// Entry of a case in the manifest.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Entry {
    /// SHA-256 of the program version, the scene and the files it names; empty if one of them cannot be read.
    pub inputs: String,
    /// State.
    pub state: State,
    /// Why it ended early.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// The cases of a study by name.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Manifest {
    /// The cases.
    pub cases: BTreeMap<String, Entry>,
}

const FILE_NAME: &str = "manifest.json";
const DAMAGED_NAME: &str = "manifest.damaged.json";

impl Manifest {
    /// Reads the manifest of `folder`; empty if there is none.
    ///
    /// # Errors
    /// [`StudyError::Io`] when it cannot be read, [`StudyError::Value`] when it is invalid.
    pub fn read(folder: &Path) -> Result<Self, StudyError> {
        let path = folder.join(FILE_NAME);
        let text = match crate::files::read(&path, crate::files::Input::Description) {
            Ok(text) => text,
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Self::default()),
            Err(source) => return Err(StudyError::Io { path, source }),
        };
        serde_json::from_slice(&text).map_err(|e| StudyError::Value {
            path,
            place: format!("line {}, column {}", e.line(), e.column()),
            found: e.to_string(),
            allowed: "a manifest as this program writes it; a study that is run sets this one aside and takes what \
                      the cases' run.json prove"
                .into(),
        })
    }

    /// As [`Self::read`], but an invalid manifest is renamed to `manifest.damaged.json` and reported to `say`.
    ///
    /// # Errors
    /// [`StudyError::Io`] when it cannot be read or renamed.
    pub(super) fn read_or_set_aside(
        folder: &Path,
        say: &(dyn Fn(&str) + Sync),
    ) -> Result<Self, StudyError> {
        match Self::read(folder) {
            Err(StudyError::Value { path, place, found, .. }) => {
                fs::rename(&path, folder.join(DAMAGED_NAME))
                    .map_err(|source| StudyError::Io { path: path.clone(), source })?;
                say(&format!(
                    "warning: {}, {place}: found {found}; it is kept as {DAMAGED_NAME}, and what cases' run.json prove is \
                     taken in its place; the others are run",
                    path.display()
                ));
                Ok(Self::default())
            }
            read => read,
        }
    }

    /// Writes the manifest into `folder`.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub(super) fn write(&self, folder: &Path) -> Result<(), WriteError> {
        write_atomic(&folder.join(FILE_NAME), |w| {
            serde_json::to_writer_pretty(&mut *w, self)?;
            writeln!(w)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn a_damaged_manifest_is_reported_and_kept() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        assert_eq!(Manifest::read(folder).unwrap(), Manifest::default());
        let entry = Entry { inputs: "1".into(), state: State::Done, reason: None };
        let manifest = Manifest { cases: [("a".to_owned(), entry)].into() };
        manifest.write(folder).unwrap();
        assert_eq!(Manifest::read(folder).unwrap(), manifest);
        fs::write(folder.join(FILE_NAME), "{\"cases\": ").unwrap();
        let message = Manifest::read(folder).unwrap_err().to_string();
        assert!(message.contains("manifest.json, line 1") && message.contains("allowed"));
        let messages = Mutex::new(String::new());
        let say = |text: &str| messages.lock().unwrap().push_str(text);
        let read = Manifest::read_or_set_aside(folder, &say).unwrap();
        assert_eq!(read, Manifest::default());
        assert!(messages.lock().unwrap().contains("manifest.damaged.json"));
        assert!(folder.join(DAMAGED_NAME).exists() && !folder.join(FILE_NAME).exists());
    }
}
