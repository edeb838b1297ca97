//! `kanagata study DIR --status`: the state of all cases of a study, from its files.

use std::path::Path;

use serde::Serialize;

use super::exit::{Exit, Failure};
use super::terminal::{out, out_json};
use crate::report::record::QualityVerdict;
use crate::run::cost::duration;
use crate::study::status::{CaseState, CaseStatus, status};

/// What `--status --json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    cases: &'a [CaseStatus],
}

/// Prints the state of the study in `folder`.
///
/// # Errors
/// Exit code 4 when the folder holds no study, 2 when its files were not written by this program.
pub(super) fn run(folder: &Path, json: bool) -> Result<Exit, Failure> {
    let cases = status(folder)?;
    if json {
        let printed = Printed { cases: &cases };
        out_json!("{}", serde_json::to_string_pretty(&printed).map_err(Failure::input)?);
        return Ok(Exit::Done);
    }
    let fails = |case: &CaseStatus| {
        matches!(case.quality, Some(QualityVerdict::Exceeded | QualityVerdict::Cracks))
    };
    for case in cases.iter().filter(|case| case.state != CaseState::Done || fails(case)) {
        out!("{}: {}", case.name, line(case));
    }
    let states = [
        (CaseState::Waiting, "waiting"),
        (CaseState::Submitted, "submitted"),
        (CaseState::Running, "running"),
        (CaseState::Done, "done"),
        (CaseState::Failed, "failed"),
        (CaseState::Stale, "stale"),
    ];
    let counts =
        states.map(|(state, name)| (cases.iter().filter(|c| c.state == state).count(), name));
    let counts = counts.iter().filter(|(count, _)| *count > 0);
    let counts: Vec<String> = counts.map(|(count, name)| format!("{count} {name}")).collect();
    out!("{} cases: {}", cases.len(), counts.join(", "));
    Ok(Exit::Done)
}

/// State of a case in a line.
fn line(case: &CaseStatus) -> String {
    let mut text = match case.state {
        CaseState::Waiting => "waiting".to_owned(),
        CaseState::Submitted => "submitted".into(),
        CaseState::Running => "running".into(),
        CaseState::Done => "done".into(),
        CaseState::Failed => "failed".into(),
        CaseState::Stale => "stale".into(),
    };
    if let Some(host) = &case.host {
        text += &format!(" on {host}");
    }
    if let Some(increment) = case.increment {
        text += &format!(", increment {increment}");
    }
    if let Some(percent) = case.thinning_percent {
        text += &format!(", thins by {percent:.1} %");
    }
    if let Some(margin) = case.forming_limit_margin {
        text += &format!(", margin {margin:.2}");
    }
    text += match case.quality {
        Some(QualityVerdict::Exceeded) => ", a limit of quality is exceeded",
        Some(QualityVerdict::Cracks) => ", cracks",
        Some(QualityVerdict::Kept) | None => "",
    };
    if let Some(seconds) = case.left_s {
        text += &format!(", {} left", duration(seconds));
    }
    if case.tries > 1 {
        text += &format!(", submission {}", case.tries);
    }
    if let Some(reason) = &case.reason {
        text += &format!(": {reason}");
    }
    text
}
