//! The progress bar of a run, and the time left.

use indicatif::{ProgressBar, ProgressStyle};

use super::terminal;
use crate::run::Progress;

/// Positions of the bar.
pub(super) const RESOLUTION: u64 = 10_000;
/// Fraction of the work after which the time left is estimated. Doubled: bars of hours show it a minute later.
const ESTIMATE_FROM: f64 = 0.01;

/// A bar on standard error, or a hidden one. Output of the program goes above it; [`terminal::end_bar`] ends it.
pub(super) fn progress_bar(quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(RESOLUTION);
    let style = ProgressStyle::with_template("{bar:24} {percent:>3} %  {msg}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    terminal::begin_bar(&bar);
    bar
}

/// The time left as text, if `fraction` of the work took `elapsed_s`; `None` too early to estimate it.
pub(super) fn left_text(fraction: f64, elapsed_s: f64) -> Option<String> {
    let left = || format!("{} left", minutes(elapsed_s * (1.0 - fraction) / fraction));
    (fraction > ESTIMATE_FROM).then(left)
}

/// Minutes and seconds of a time [s].
pub(super) fn minutes(seconds: f64) -> String {
    let seconds = seconds.round() as u64;
    format!("{}:{:02}", seconds / 60, seconds % 60)
}

/// Shows the last increment on the bar.
pub(super) fn show(bar: &ProgressBar, progress: &Progress<'_>) {
    let r = progress.report;
    // The tool with the largest travel is shown.
    let watched = r.tools.iter().max_by(|a, b| a.travel.abs().total_cmp(&b.travel.abs()));
    let tool = watched.map_or_else(String::new, |t| {
        format!("{} {:.2} mm {:.1} kN", t.name, t.travel, t.force / 1e3)
    });
    let left = left_text(progress.done, progress.elapsed_s).unwrap_or_default();
    bar.set_position((progress.done * RESOLUTION as f64) as u64);
    bar.set_message(format!(
        "{} #{} {tool}, {} iterations, {} touch {} slip  {left}",
        r.stage_name, r.increment, r.iterations, r.contacts, r.slipping
    ));
}
