//! Stages of a conversion, an audit or a mesh on the terminal, with the time left.
//!
//! The library counts ([`crate::progress`]); a thread draws the last report ten times a second, so that no worker waits for
//! the terminal. Nothing is drawn with `--quiet`, where standard error is no terminal, and in the first 0.4 s.

use std::io::IsTerminal as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::progress_bar::{RESOLUTION, left_text, minutes, progress_bar};
use super::terminal;
use crate::progress::{Progress, Report};

/// Time between two drawings.
const TICK: Duration = Duration::from_millis(100);
/// Time after which a command is long enough for a bar. Doubled: conversions of a second have none.
const QUIET_START: Duration = Duration::from_millis(400);

/// Argument of commands that show their progress.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub struct QuietArgs {
    /// No progress and no summary: only warnings and doubts (stderr)
    #[arg(short, long)]
    quiet: bool,
}

/// What is drawn.
#[derive(Default)]
struct Shared {
    /// The last report, and the begin of its stage.
    last: Mutex<Option<(Report, Instant)>>,
    /// Stands before the stage.
    label: Mutex<String>,
    has_ended: AtomicBool,
}

/// What the command of this process draws.
static CURRENT: OnceLock<Arc<Shared>> = OnceLock::new();

/// The stages of a command on the terminal, until dropped.
pub(super) struct Shown(Option<(Arc<Shared>, JoinHandle<()>)>);

/// Shows the stages that [`progress`] reports until the guard is dropped. With `--quiet` the summary is dropped too.
pub(super) fn show(args: QuietArgs) -> Shown {
    if args.quiet {
        terminal::silence();
    }
    show_unless(args.quiet)
}

/// Shows the stages that [`progress`] reports until the guard is dropped, unless they are `hidden`.
pub(super) fn show_unless(hidden: bool) -> Shown {
    if hidden || !std::io::stderr().is_terminal() {
        return Shown(None);
    }
    let shared = Arc::clone(CURRENT.get_or_init(Arc::default));
    let drawn = Arc::clone(&shared);
    Shown(Some((shared, std::thread::spawn(move || draw(&drawn)))))
}

impl Drop for Shown {
    fn drop(&mut self) {
        if let Some((shared, thread)) = self.0.take() {
            shared.has_ended.store(true, Ordering::Relaxed);
            thread.thread().unpark();
            let _ = thread.join();
        }
    }
}

/// Where the work of the command reports its progress.
pub(super) fn progress() -> Progress {
    let Some(shared) = CURRENT.get() else { return Progress::default() };
    let shared = Arc::clone(shared);
    Progress::new(move |report| {
        let mut last = shared.last.lock().unwrap_or_else(PoisonError::into_inner);
        let begin = last.filter(|l| l.0.stage == report.stage && l.0.done <= report.done);
        *last = Some((*report, begin.map_or_else(Instant::now, |l| l.1)));
    })
}

/// Names the part of the work whose stages follow, as `body 2 of 5`.
pub(super) fn name_part(label: String) {
    if let Some(shared) = CURRENT.get() {
        *shared.label.lock().unwrap_or_else(PoisonError::into_inner) = label;
    }
}

/// Draws until the command has ended.
fn draw(shared: &Shared) {
    let start = Instant::now();
    let bar = progress_bar(false);
    while !shared.has_ended.load(Ordering::Relaxed) {
        if start.elapsed() >= QUIET_START {
            let last = *shared.last.lock().unwrap_or_else(PoisonError::into_inner);
            let label = shared.label.lock().unwrap_or_else(PoisonError::into_inner).clone();
            if let Some((report, begin)) = last {
                let done = report.fraction().unwrap_or(0.0);
                bar.set_position((done * RESOLUTION as f64) as u64);
                bar.set_message(label + &text(&report, begin.elapsed().as_secs_f64()));
            }
        }
        std::thread::park_timeout(TICK);
    }
    terminal::end_bar(&bar);
}

/// A stage after `elapsed_s` as text.
fn text(report: &Report, elapsed_s: f64) -> String {
    let Report { stage, unit, done, total, is_limit } = *report;
    let left = report.fraction().and_then(|fraction| left_text(fraction, elapsed_s));
    match (total, left) {
        (0, _) => format!("{stage}, for {}", minutes(elapsed_s)),
        (_, Some(left)) if is_limit => format!("{stage}, at most {left}"),
        (_, None) if is_limit => stage.to_owned(),
        (_, Some(left)) => format!("{stage}, {done} of {total} {unit}, {left}"),
        (_, None) => format!("{stage}, {done} of {total} {unit}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_says_what_is_counted_and_the_time_left() {
        let mut report =
            Report { stage: "mesh", unit: "faces", done: 90, total: 360, is_limit: false };
        assert_eq!(text(&report, 30.0), "mesh, 90 of 360 faces, 1:30 left");
        report.done = 0;
        assert_eq!(text(&report, 30.0), "mesh, 0 of 360 faces");
        report = Report { stage: "search", done: 36, is_limit: true, ..report };
        assert_eq!(text(&report, 10.0), "search, at most 1:30 left");
        report.total = 0;
        assert_eq!(text(&report, 61.0), "search, for 1:01");
    }
}
