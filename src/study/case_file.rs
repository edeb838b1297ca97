//! `case.json`: the inputs and the build that the run of a case must have, and the resources that it is expected to need.

use std::collections::BTreeMap;
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::StudyError;
use super::follow::history_of;
use super::proof::{Inputs, Proof, difference, proof};
use kanagata_files::{Input, WriteError, sha256_hex, write_atomic};
use kanagata_report::record::RunRecord;

/// Name of the file in the folder of a case.
const NAME: &str = "case.json";
/// Name of the scene in the folder of a case.
pub(super) const SCENE: &str = "case.scene.json";
/// Version of the file.
const VERSION: u32 = 1;

/// A case that is ready to run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CaseFile {
    /// `kanagata-case`.
    pub format: CaseTag,
    /// File version: 1.
    pub version: u32,
    /// Name of the case.
    pub name: String,
    /// The case whose increments it follows. It must be done first; its history is not among the inputs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub follows: Option<String>,
    /// SHA-256 of the scene and of the files it names, by name as in the scene.
    pub inputs: BTreeMap<String, String>,
    /// The build that must compute it, as in `run.json`.
    pub build: String,
    /// Threads of its run; results are the same for any number.
    pub threads: usize,
    /// Expected resources; absent if they cannot be estimated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected: Option<Expected>,
}

/// Expected resources of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Expected {
    /// Unknowns of the sheet.
    pub unknowns: usize,
    /// Peak memory [MB].
    pub memory_mb: f64,
    /// Wall time with these threads [s]: without difficulties, and with many.
    pub seconds: [f64; 2],
}

/// The format tag of a case file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum CaseTag {
    /// `kanagata-case`
    #[serde(rename = "kanagata-case")]
    Case,
}

impl CaseFile {
    /// A case without estimate.
    pub(super) fn new(name: &str, follows: Option<String>, inputs: Inputs, threads: usize) -> Self {
        Self {
            format: CaseTag::Case,
            version: VERSION,
            name: name.to_owned(),
            follows,
            inputs,
            build: kanagata_run::build::BUILD.into(),
            threads,
            expected: None,
        }
    }

    /// Reads the case in `folder`.
    ///
    /// # Errors
    /// [`StudyError::Io`] when there is none, [`StudyError::Value`] when it is invalid.
    pub fn read(folder: &Path) -> Result<Self, StudyError> {
        let path = folder.join(NAME);
        let text = kanagata_files::read(&path, Input::Description)
            .map_err(|source| StudyError::Io { path: path.clone(), source })?;
        let allowed = "a case as a study of this program prepares it";
        let fault = |place: String, found: String| StudyError::Value {
            path: path.clone(),
            place,
            found,
            allowed: allowed.into(),
        };
        let case: Self = serde_json::from_slice(&text).map_err(|e| {
            fault(format!("line {}, column {}", e.line(), e.column()), e.to_string())
        })?;
        if case.version != VERSION {
            return Err(fault("version".into(), case.version.to_string()));
        }
        Ok(case)
    }

    /// SHA-256 of the file in `folder`; `None` if there is none.
    pub(super) fn digest(folder: &Path) -> Option<String> {
        kanagata_files::read(&folder.join(NAME), Input::Description)
            .ok()
            .map(|text| sha256_hex(&text))
    }

    /// Writes the case into `folder`.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub(super) fn write(&self, folder: &Path) -> Result<(), WriteError> {
        write_atomic(&folder.join(NAME), |w| {
            serde_json::to_writer_pretty(&mut *w, self)?;
            writeln!(w)
        })
    }

    /// The proof in the case's folder `folder` for these inputs. The history that the case follows is taken as it was.
    pub(super) fn proof(&self, folder: &Path) -> Proof {
        let recorded = kanagata_files::read(&folder.join("run/run.json"), Input::Description)
            .ok()
            .and_then(|text| RunRecord::parse(&text).ok());
        let mut inputs = self.inputs.clone();
        if let (Some(record), Some(leader)) = (recorded, &self.follows) {
            let history = history_of(leader);
            inputs.extend(record.inputs.get(&history).map(|digest| (history, digest.clone())));
        }
        proof(folder, &inputs)
    }

    /// What differs between this case and a program with `build` that has found `inputs`; `None` if nothing does.
    pub(super) fn difference(&self, build: &str, inputs: &Inputs) -> Option<String> {
        difference([&self.build, build], [&self.inputs, inputs])
    }
}
