//! The command of a case: runs it, continues it, or does nothing if its run proves that it is done.

use std::path::{Path, PathBuf};

use super::StudyError;
use super::case_file::{CaseFile, SCENE};
use super::outcome;
use super::proof::{Inputs, Proof, proof};
use kanagata_report::record::RunRecord;
use kanagata_run::build::BUILD;
use kanagata_run::{Progress, RunError, RunOptions, inputs_of};
use kanagata_scene::read::read_with;
use kanagata_scene::{Plan, SceneError};

/// Why a case cannot be run to its end.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// `case.json` cannot be read.
    #[error(transparent)]
    File(#[from] StudyError),
    /// The scene cannot be read.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The run failed.
    #[error(transparent)]
    Run(#[from] RunError),
    /// Inputs or build are not those of `case.json`.
    #[error(
        "{}: {what}; allowed: the inputs and the build of its case.json", folder.display()
    )]
    Differs {
        /// Folder of the case.
        folder: PathBuf,
        /// What differs.
        what: String,
    },
    /// The case that it follows is not done.
    #[error("{}: waits for {leader}, whose increments it follows and which is not done; run that first", folder.display())]
    LeaderNotDone {
        /// Folder of the case.
        folder: PathBuf,
        /// The case that it follows.
        leader: String,
    },
    /// An earlier run of the same inputs did not converge.
    #[error(
        "{}: an earlier run of the same inputs did not converge: {message}", folder.display()
    )]
    NotConverged {
        /// Folder of the case.
        folder: PathBuf,
        /// Message of that run.
        message: String,
    },
}

/// What a case's command found or did.
#[derive(Debug)]
pub enum CaseEnd {
    /// An earlier run proves that it is done.
    AlreadyDone,
    /// It has been run to its end.
    Run(Box<RunRecord>),
}

/// Runs the case in `folder`; with `again` also a case whose earlier run did not converge. The options of the run that
/// concern earlier results are chosen here.
///
/// # Errors
/// [`CaseError`].
pub fn run_case(
    folder: &Path,
    again: bool,
    options: RunOptions<'_>,
    watch: &mut dyn FnMut(&Progress<'_>),
) -> Result<CaseEnd, CaseError> {
    let case = CaseFile::read(folder)?;
    if case.build != BUILD {
        let what = case.difference(BUILD, &case.inputs).unwrap_or_default();
        return Err(CaseError::Differs { folder: folder.into(), what });
    }
    if let Some(leader) = case.follows.as_ref().filter(|leader| !is_done(&sibling(folder, leader)))
    {
        return Err(CaseError::LeaderNotDone { folder: folder.into(), leader: leader.clone() });
    }
    let plan = read_with(&folder.join(SCENE), &[])?;
    let inputs = inputs_of(&plan);
    if let Some(what) = case.difference(BUILD, &without_history(&plan, &case, &inputs)) {
        return Err(CaseError::Differs { folder: folder.into(), what });
    }
    let restart = match proof(folder, &inputs) {
        Proof::Done => return Ok(CaseEnd::AlreadyDone),
        Proof::NotConverged(message) if !again => {
            let message = message.unwrap_or_default();
            return Err(CaseError::NotConverged { folder: folder.into(), message });
        }
        Proof::Unfinished => true,
        Proof::None | Proof::NotConverged(_) | Proof::Other(_) => false,
    };
    outcome::forget(folder);
    solve(&plan, folder, restart, options, watch)
}

/// Runs or continues a case; one that was stopped before its first checkpoint, or whose checkpoint is damaged, begins again.
fn solve(
    plan: &Plan,
    folder: &Path,
    restart: bool,
    options: RunOptions<'_>,
    watch: &mut dyn FnMut(&Progress<'_>),
) -> Result<CaseEnd, CaseError> {
    let (scene, output) = (folder.join(SCENE), folder.join("run"));
    let options = RunOptions { restart: false, overwrite: true, keep_complete: true, ..options };
    if restart {
        let resumed = RunOptions { restart: true, overwrite: false, ..options.clone() };
        match kanagata_run::run(plan, &scene, &output, &resumed, watch) {
            Err(RunError::Checkpoint(_)) => {}
            ended => return case_end(ended),
        }
    }
    case_end(kanagata_run::run(plan, &scene, &output, &options, watch))
}

/// A run that another process has completed since the proof was read is as good as an own one.
fn case_end(ended: Result<RunRecord, RunError>) -> Result<CaseEnd, CaseError> {
    match ended {
        Err(RunError::AlreadyComplete { .. }) => Ok(CaseEnd::AlreadyDone),
        ended => Ok(CaseEnd::Run(Box::new(ended?))),
    }
}

/// Folder of another case of the same study.
fn sibling(folder: &Path, name: &str) -> PathBuf {
    folder.join("..").join(name)
}

/// Whether the case in `folder` is proved done for the inputs of its `case.json`.
fn is_done(folder: &Path) -> bool {
    let Ok(case) = CaseFile::read(folder) else { return false };
    let Ok(plan) = read_with(&folder.join(SCENE), &[]) else { return false };
    let inputs = inputs_of(&plan);
    case.difference(BUILD, &without_history(&plan, &case, &inputs)).is_none()
        && proof(folder, &inputs) == Proof::Done
}

/// The inputs that `case.json` lists: all but the history of the case that it follows.
fn without_history(plan: &Plan, case: &CaseFile, inputs: &Inputs) -> Inputs {
    let history = plan.followed.as_ref().filter(|_| case.follows.is_some());
    let is_history = |name: &str| history.is_some_and(|followed| followed.file == name);
    inputs
        .iter()
        .filter(|(name, _)| !is_history(name))
        .map(|(n, d)| (n.clone(), d.clone()))
        .collect()
}
