//! State of a study from the files in its folder alone, without the study file.

use std::path::Path;

use serde::Serialize;

use super::StudyError;
use super::case_file::CaseFile;
use super::inputs::folder_of;
use super::outcome;
use super::prepare::Order;
use super::proof::Proof;
use super::runner::tickets::{Submission, Tickets};
use kanagata_report::record::QualityVerdict;
use kanagata_run::lock;
use kanagata_run::status::status as run_status;

/// State of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CaseState {
    /// Not started, or interrupted.
    Waiting,
    /// Handed over to an engine.
    Submitted,
    /// A solver works in its folder.
    Running,
    /// All stages done.
    Done,
    /// Ended early.
    Failed,
    /// Its run is of other inputs or of another build than its `case.json`.
    Stale,
}

/// A case of a study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseStatus {
    /// Name.
    pub name: String,
    /// State.
    pub state: CaseState,
    /// Why it failed or is stale.
    pub reason: Option<String>,
    /// Increments of its run.
    pub increment: Option<usize>,
    /// Largest thinning of an element of its run [%].
    pub thinning_percent: Option<f64>,
    /// Smallest margin of its run to the forming limit; `None` without a limit.
    pub forming_limit_margin: Option<f64>,
    /// Verdict on the quality of its part.
    pub quality: Option<QualityVerdict>,
    /// Estimated wall time left [s]; of a running case only.
    pub left_s: Option<f64>,
    /// Host of a running case.
    pub host: Option<String>,
    /// Submissions since its run last advanced.
    pub tries: usize,
}

/// States of the cases of the study in `folder`, in the order in which they run.
///
/// # Errors
/// [`StudyError::Io`] when the folder holds no study, [`StudyError::Value`] when `order.json` or `runner.json` is invalid.
pub fn status(folder: &Path) -> Result<Vec<CaseStatus>, StudyError> {
    let order = Order::read(folder)?;
    let tickets = Tickets::read(folder)?;
    let of = |name: String| {
        let submission = tickets.cases.get(&name).cloned().unwrap_or_default();
        case_status(folder, name, &submission)
    };
    Ok(order.ranks.into_iter().flatten().map(of).collect())
}

fn case_status(study: &Path, name: String, submission: &Submission) -> CaseStatus {
    let (submitted, tries) = (submission.ticket.is_some(), submission.tries);
    let folder = folder_of(study, &name);
    let run = folder.join("run");
    let mut status = CaseStatus {
        name,
        state: if submitted { CaseState::Submitted } else { CaseState::Waiting },
        reason: None,
        increment: None,
        thinning_percent: None,
        forming_limit_margin: None,
        quality: None,
        left_s: None,
        host: None,
        tries,
    };
    let Ok(case) = CaseFile::read(&folder) else { return status };
    let seen = run_status(&run).ok();
    if let Some(run) = &seen {
        status.increment = Some(run.increment);
        status.thinning_percent = run.thinning.map(|found| found.percent);
        status.forming_limit_margin = run.margin.map(|found| found.margin);
        status.quality = run.quality;
    }
    if let Some(holder) = lock::holder(&lock::file_in(&run)).unwrap_or(None) {
        status.state = CaseState::Running;
        status.left_s = seen.and_then(|run| run.left_s);
        status.host = holder.process.as_ref().and_then(lock::host_name).map(str::to_owned);
        return status;
    }
    (status.state, status.reason) = ended_state(&case, &folder, submission);
    status
}

/// State of a case that no process works on, and the reason.
fn ended_state(
    case: &CaseFile,
    folder: &Path,
    submission: &Submission,
) -> (CaseState, Option<String>) {
    let submitted = submission.ticket.is_some();
    let outcome = outcome::read(folder);
    match case.proof(folder) {
        Proof::Done => (CaseState::Done, None),
        Proof::Other(what) => (CaseState::Stale, Some(what)),
        Proof::NotConverged(message) if !submitted => {
            (CaseState::Failed, outcome.map(|o| o.message).or(message))
        }
        _ if submitted => (CaseState::Submitted, None),
        _ if submission.last_failure.is_some() => {
            (CaseState::Failed, submission.last_failure.clone())
        }
        _ => match outcome {
            Some(outcome) if matches!(outcome.exit, 2 | 4) => {
                (CaseState::Failed, Some(outcome.message))
            }
            outcome => (CaseState::Waiting, outcome.map(|outcome| outcome.message)),
        },
    }
}
