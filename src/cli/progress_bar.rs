//! The progress bar of a run.

use indicatif::{ProgressBar, ProgressStyle};

use crate::run::Progress;

/// Positions of the bar.
const RESOLUTION: u64 = 10_000;

/// A bar, or a hidden one.
pub(super) fn progress_bar(quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(RESOLUTION);
    let style = ProgressStyle::with_template("{bar:24} {percent:>3} %  {msg}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

/// Shows the last increment on the bar.
pub(super) fn show(bar: &ProgressBar, progress: &Progress<'_>) {
    let r = progress.report;
    // The tool with the largest travel is shown.
    let watched = r.tools.iter().max_by(|a, b| a.travel.abs().total_cmp(&b.travel.abs()));
    let tool = watched.map_or_else(String::new, |t| {
        format!("{} {:.2} mm {:.1} kN", t.name, t.travel, t.force / 1e3)
    });
    let left = if progress.done > 0.01 {
        let seconds = progress.elapsed_s * (1.0 - progress.done) / progress.done;
        format!("{:.0}:{:02.0} left", (seconds / 60.0).floor(), seconds % 60.0)
    } else {
        String::new()
    };
    bar.set_position((progress.done * RESOLUTION as f64) as u64);
    bar.set_message(format!(
        "{} #{} {tool}, {} iterations, {} touch {} slip  {left}",
        r.stage_name, r.increment, r.iterations, r.contacts, r.slipping
    ));
}
