//! `run --accuracy`: a sequence of runs to an accuracy, with its progress and its results on the terminal.

use std::path::Path;

use indicatif::ProgressBar;

use super::exit::{Exit, Failure};
use super::progress_bar::{progress_bar, show};
use super::terminal::{end_bar, err, out, put};
use crate::accuracy::{AccuracyError, Limits, Model, Observer, run_into};
use crate::report::record::{AccuracyRecord, RunRecord};
use crate::run::folder::row;
use crate::run::progress_line::{HEADER, json_line, line};
use crate::run::report::write_from_files;
use crate::run::{Progress, RunError};
use crate::scene::Plan;
use crate::scene::accuracy::Accuracy;
use crate::scene::set_value::SetValue;

/// Parses `1%`, `0.01`, or `force=1%,thickness=1%,draw-in=0.1mm,springback=0.05mm`.
pub(super) fn accuracy(text: &str) -> Result<Accuracy, String> {
    if !text.contains('=') {
        return Ok(Accuracy::of_all(fraction(text)?));
    }
    let mut out = Accuracy::default();
    for part in text.split(',') {
        let (name, value) =
            part.split_once('=').ok_or_else(|| format!("found {part:?}; allowed: NAME=ERROR"))?;
        let length = || super::quantity::length_mm(value).map(Some);
        match (name.trim(), value.trim().ends_with("mm")) {
            ("force", false) => out.force = Some(fraction(value)?),
            ("thickness", false) => out.thickness = Some(fraction(value)?),
            ("draw-in", false) => out.draw_in = Some(fraction(value)?),
            ("draw-in", true) => out.draw_in_mm = length()?,
            ("springback", false) => out.springback = Some(fraction(value)?),
            ("springback", true) => out.springback_mm = length()?,
            _ => {
                return Err(format!(
                    "found {part:?}; allowed: force, thickness, draw-in and springback as fractions (1%), draw-in and springback also as lengths (0.1mm)"
                ));
            }
        }
    }
    Ok(out)
}

/// A fraction, or a percentage, within the range that can be asked for.
fn fraction(text: &str) -> Result<f64, String> {
    use crate::scene::accuracy::{FRACTION_MAX, FRACTION_MIN};
    let text = text.trim();
    let (number, size) = text.strip_suffix('%').map_or((text, 1.0), |number| (number, 0.01));
    let value = number.trim().parse::<f64>().ok().map(|x| x * size);
    value.filter(|x| (FRACTION_MIN..=FRACTION_MAX).contains(x)).ok_or_else(|| {
        format!("found {text:?}; allowed: {FRACTION_MIN} to {FRACTION_MAX}, or as a percentage: 1%")
    })
}

/// A sequence of runs, and what is shown of it.
pub(super) struct Request<'a> {
    /// The scene file, and values of it that are set.
    pub(super) scene: &'a Path,
    pub(super) set: &'a [SetValue],
    /// Folder for the results.
    pub(super) output: &'a Path,
    /// In place of that of the scene.
    pub(super) accuracy: Option<Accuracy>,
    pub(super) limits: Limits,
    /// A line, or a line of JSON, for every increment.
    pub(super) lines: bool,
    pub(super) json: bool,
    /// Nothing but doubts on the terminal.
    pub(super) quiet: bool,
    /// Whether `report.html` is written.
    pub(super) page: bool,
}

/// Shows the runs of a sequence.
struct Terminal<'a> {
    request: &'a Request<'a>,
    bar: ProgressBar,
    tools: Vec<String>,
}

impl Observer for Terminal<'_> {
    fn begins(&mut self, number: usize, purpose: &str, model: &Model, known: bool) {
        self.bar.set_position(0);
        if !self.request.quiet {
            let known = if known { " (done before)" } else { "" };
            out!("run {number}, {purpose}: {model}{known}");
            if self.request.lines {
                out!("{HEADER}");
            }
        }
    }

    fn progress(&mut self, progress: &Progress<'_>) {
        match (self.request.lines, self.request.json) {
            (false, false) => show(&self.bar, progress),
            _ if progress.report.increment == 0 => {}
            (true, _) => put(&line(&self.tools, &row(progress.report))),
            (_, true) => put(&json_line(&self.tools, &row(progress.report))),
        }
    }

    fn failed(&mut self, why: &str) {
        err!("note: it did not converge: {why}");
    }
}

impl From<AccuracyError> for Failure {
    fn from(error: AccuracyError) -> Self {
        match error {
            AccuracyError::Run(error) => error.into(),
            AccuracyError::Scene(error) => RunError::Scene(error).into(),
            AccuracyError::Write(error) => error.into(),
            AccuracyError::Results { .. } => Self::new(Exit::Io, error),
            AccuracyError::NotConverged { .. } => Self::new(Exit::NoConvergence, error),
            _ => Self::input(error),
        }
    }
}

/// Runs the sequence and returns the record of its best run, with the estimated errors.
pub(super) fn run(request: &Request<'_>, plan: &Plan) -> Result<RunRecord, Failure> {
    let output = request.output;
    let mut terminal = Terminal {
        request,
        bar: progress_bar(request.quiet || request.lines),
        tools: plan.scene.tools.iter().map(|tool| tool.name.clone()).collect(),
    };
    let Request { scene, set, accuracy, ref limits, .. } = *request;
    let ended = run_into(scene, set, accuracy, output, limits, &mut terminal);
    end_bar(&terminal.bar);
    let record = ended?;
    if request.page {
        write_from_files(output)?;
    }
    Ok(record)
}

/// Prints the estimated errors.
pub(super) fn print(record: &AccuracyRecord) {
    out!(
        "estimated errors from {} runs, {:.1} s processor ({:.2} times the last run): {}",
        record.runs.len(),
        record.cpu_s,
        record.cpu_s / record.last_cpu_s.max(f64::MIN_POSITIVE),
        record.end.in_words().0
    );
    for q in &record.quantities {
        let error = q.error.map_or_else(
            || "error not known".into(),
            |e| format!("+- {e:.4} ({:.2} %)", 100.0 * e / q.value.abs().max(f64::MIN_POSITIVE)),
        );
        let allowed = q.allowed.map_or_else(String::new, |a| format!(", {a:.4} allowed"));
        let parts: Vec<String> =
            q.parts.iter().map(|(name, part)| format!("{name} {part:.4}")).collect();
        out!("  {:16} {:12.4} {} {error}{allowed}; {}", q.name, q.value, q.unit, parts.join(", "));
    }
    for name in &record.unmeasured {
        err!(
            "note: the error of {name} is not known: the run with finer {name} did not converge, or would have exceeded time or memory"
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_accuracy_is_one_fraction_or_one_for_every_quantity() {
        assert_eq!(accuracy("1%"), Ok(Accuracy::of_all(0.01)));
        assert_eq!(accuracy("0.02"), Ok(Accuracy::of_all(0.02)));
        let some = accuracy("force=2%,draw-in=0.1mm,springback=5%").unwrap();
        let expected = Accuracy {
            force: Some(0.02),
            draw_in_mm: Some(0.1),
            springback: Some(0.05),
            ..Accuracy::default()
        };
        assert_eq!(some, expected);
        for bad in ["", "0", "60%", "x", "force", "force=1mm", "thickness=0", "width=1%", "-1%"] {
            assert!(accuracy(bad).is_err(), "{bad}");
        }
    }
}
