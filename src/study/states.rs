//! The state of every case of a study, from the files in its folder.

use std::collections::BTreeMap;
use std::path::Path;

use super::StudyError;
use super::case::Case;
use super::inputs::{Digests, folder_of, inputs};
use super::outcome;
use super::proof::{Proof, proof_and_record};
use super::runner::tickets::Tickets;
use kanagata_report::record::RunRecord;
use kanagata_run::lock;

/// State of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Not started, or interrupted.
    Waiting,
    /// A solver works in its folder.
    Running,
    /// All stages done.
    Done,
    /// Ended early.
    Failed,
    /// Its run is of other inputs or of another build.
    Stale,
}

impl State {
    /// Name of the state.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Running => "running",
            Self::Done => "done",
            Self::Failed => "failed",
            Self::Stale => "stale",
        }
    }
}

/// State of a case, with the reason if it is not done.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// State.
    pub state: State,
    /// Why it waits, failed, or is stale.
    pub reason: Option<String>,
    /// Whether a file of its scene cannot be read.
    pub lacks_files: bool,
    /// Record of its run, if the state was found by it.
    pub record: Option<RunRecord>,
}

impl Entry {
    /// A state with its reason.
    pub(super) fn new(state: State, reason: Option<String>) -> Self {
        Self { state, reason, lacks_files: false, record: None }
    }
}

/// The cases of a study by name.
pub type States = BTreeMap<String, Entry>;

/// States of `cases` in the study folder `folder`.
#[must_use]
pub fn states(cases: &[Case], folder: &Path) -> States {
    let digests = Digests::default();
    let own: States = cases.iter().map(|c| (c.id.clone(), entry(c, folder, &digests))).collect();
    let mut all = own.clone();
    // A damaged file is reported by who submits or cancels.
    let tickets = Tickets::read(folder).unwrap_or_default();
    for (id, entry) in all.iter_mut().filter(|(_, entry)| entry.state == State::Waiting) {
        let reason = tickets.cases.get(id).and_then(|submission| submission.last_failure.clone());
        if reason.is_some() {
            (entry.state, entry.reason) = (State::Failed, reason);
        }
    }
    for case in cases {
        let Some((leader, reason)) = stale_leader(case, cases, &own) else { continue };
        if let Some(entry) = all.get_mut(&case.id).filter(|e| e.state == State::Done) {
            let reason = Some(format!("follows {leader}: {reason}"));
            (entry.state, entry.reason) = (State::Stale, reason);
        }
    }
    all
}

/// The stale case that `case` follows, directly or through others, and why it is stale.
fn stale_leader(case: &Case, cases: &[Case], states: &States) -> Option<(String, String)> {
    let mut at = case;
    // Following is acyclic in valid studies; the count terminates otherwise.
    for _ in cases {
        let leader = at.follows.as_ref()?;
        let entry = states.get(leader)?;
        if entry.state == State::Stale {
            return Some((leader.clone(), entry.reason.clone().unwrap_or_default()));
        }
        at = cases.iter().find(|c| c.id == *leader)?;
    }
    None
}

/// State of a case by its own files.
pub(super) fn entry(case: &Case, study: &Path, digests: &Digests) -> Entry {
    let folder = folder_of(study, &case.id);
    let has_run = folder.join("run/run.json").exists();
    let inputs = match inputs(case, study, digests, true) {
        Ok(inputs) => inputs,
        Err(reason) if has_run => {
            let reason = format!("what it was run with cannot be compared: {reason}");
            return Entry { lacks_files: true, ..Entry::new(State::Stale, Some(reason)) };
        }
        // A case that follows another has no history before that is done.
        Err(_) if case.follows.is_some() && self::inputs(case, study, digests, false).is_ok() => {
            let reason =
                case.follows.as_ref().map(|leader| format!("follows {leader}, which is not done"));
            return Entry::new(State::Waiting, reason);
        }
        Err(reason) => {
            // A case that was never to be run has no folder.
            let state = if folder.exists() { State::Failed } else { State::Waiting };
            return Entry { lacks_files: true, ..Entry::new(state, Some(reason)) };
        }
    };
    // A lock that cannot be read is an error of the run, which names it.
    if lock::holder(&lock::file_in(&folder.join("run"))).unwrap_or(None).is_some() {
        return Entry::new(State::Running, None);
    }
    let outcome = outcome::read(&folder);
    let (proof, record) = proof_and_record(&folder, &inputs);
    let entry = match proof {
        Proof::Done => Entry::new(State::Done, None),
        Proof::Other(what) => Entry::new(State::Stale, Some(what)),
        Proof::NotConverged(message) => {
            Entry::new(State::Failed, outcome.map(|o| o.message).or(message))
        }
        Proof::None | Proof::Unfinished => match outcome.filter(|o| o.exit == 2) {
            Some(refused) => Entry::new(State::Failed, Some(refused.message)),
            None => Entry::new(State::Waiting, None),
        },
    };
    Entry { record, ..entry }
}

/// Refuses to continue where runs are of other inputs or of another build.
///
/// # Errors
/// [`StudyError::OtherRuns`] with the differences.
pub fn refuse_other_runs(states: &States, folder: &Path) -> Result<(), StudyError> {
    let other = states.iter().filter(|(_, e)| e.state == State::Stale && !e.lacks_files);
    let cases: Vec<(String, String)> =
        other.map(|(id, entry)| (id.clone(), entry.reason.clone().unwrap_or_default())).collect();
    if cases.is_empty() {
        return Ok(());
    }
    Err(StudyError::OtherRuns { folder: folder.into(), cases })
}
