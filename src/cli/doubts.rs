//! Doubts on the terminal with remedies on the command line, and their reference page.

use std::fmt::Write as _;

use super::terminal::err;
use crate::report::doubt::{Doubt, DoubtCode};
use crate::run::advice::{Conversion, Finding};

/// Prints doubts with their remedies to stderr, after all other output.
pub(super) fn print_doubts(doubts: &[Doubt], accepted: bool) {
    print_with(doubts, accepted, remedy);
}

/// As [`print_doubts`], for a tool that is just converted.
pub(super) fn print_conversion_doubts(doubts: &[Doubt], accepted: bool) {
    let remedy = |doubt: &Doubt| match doubt.code {
        DoubtCode::ToleranceExceeded | DoubtCode::BordersExceeded => {
            Some("a larger --tol, or more --time if it was limited".into())
        }
        DoubtCode::NormalsExceeded => {
            Some("a larger --normal-tol, or more --time if it was limited".into())
        }
        _ => remedy(doubt),
    };
    print_with(doubts, accepted, remedy);
}

fn print_with(doubts: &[Doubt], accepted: bool, remedy: impl Fn(&Doubt) -> Option<String>) {
    for doubt in doubts {
        err!("doubt {doubt}");
        if let Some(remedy) = remedy(doubt) {
            err!("  try: {remedy}");
        }
    }
    if let (false, [_, ..]) = (accepted, doubts) {
        err!("{}; --accept-doubts ends with exit code 0 all the same", counted(doubts.len()));
    }
}

/// The number of doubts in words.
fn counted(doubts: usize) -> String {
    let plural = if doubts == 1 { "" } else { "s" };
    format!("{doubts} doubt{plural}: the result must not be trusted as it is")
}

/// The remedy on the command line for a doubt about a tool.
fn remedy(doubt: &Doubt) -> Option<String> {
    let limit = doubt.limit;
    match doubt.code {
        DoubtCode::ToleranceExceeded | DoubtCode::BordersExceeded => {
            limit.map(|mm| format!("`kanagata convert` with --tol {mm}mm"))
        }
        DoubtCode::NormalsExceeded => {
            limit.map(|deg| format!("`kanagata convert` with --normal-tol {deg}deg"))
        }
        DoubtCode::GapsExceeded => Some("`kanagata convert` with --borders conforming".into()),
        DoubtCode::FoldedPatches => {
            Some("`kanagata convert` without --allow-folds, or with more --arc-divisions".into())
        }
        _ => None,
    }
}

/// Options of the programs that apply the remedy of a finding, in brackets.
pub(super) fn options(finding: &Finding) -> String {
    let auto = finding.auto.then(|| "--auto excludes them".to_owned());
    let convert = finding.conversion.map(|conversion| match conversion {
        Conversion::Reachable => "`kanagata convert --reach SCENE`".into(),
        Conversion::Within(mm) => format!("`kanagata convert --tol {mm:.4}mm`"),
    });
    let all: Vec<String> = auto.into_iter().chain(convert).collect();
    if all.is_empty() { String::new() } else { format!(" ({})", all.join("; ")) }
}

/// The reference page of all codes (Markdown).
#[must_use]
pub fn reference() -> String {
    let mut out = String::from(
        "# Doubts\n\n\
         A doubt is a reason why a result must not be trusted as it is. It stands in `run.json` (`doubts`: code, where, value,\n\
         limit, text), last on the terminal (on stderr with `-q` and `--json`), first in `report.html`, in the table of a study and\n\
         in `kanagata-solve status`. A run that ends with a doubt has the verdict `doubtful` and exit code 1; with\n\
         `--accept-doubts` the exit code is 0, and the list stays. `kanagata-solve check` finds those of the scene before a run.\n\n\
         Those of an audit stand in its JSON, last on the terminal and first in its page; `kanagata audit` ends with exit code 1.\n\
         Those of a conversion are last on the terminal; `kanagata convert` writes the tool and ends with exit code 1.\n\n\
         Codes are stable: scripts may rely on them. This page is written from `src/report/doubt.rs`.\n\n\
         | code | found in | limit | meaning |\n|---|---|---|---|\n",
    );
    for code in DoubtCode::ALL {
        let _ = writeln!(
            out,
            "| `{code}` | {} | {} | {} |",
            code.found_by(),
            code.limit(),
            code.meaning()
        );
    }
    out
}
