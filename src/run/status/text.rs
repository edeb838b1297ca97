//! Status of a run as lines of key and value.

use std::fmt::{self, Write as _};

use super::{State, Status};
use crate::lock::HEARTBEAT_EXPIRY;
use crate::progress_line::HEADER;
use kanagata_report::record::QualityVerdict;

/// Lines below the name of a run.
struct Lines(String);

impl Lines {
    fn push(&mut self, key: &str, what: &str) {
        let _ = write!(self.0, "\n  {key:10} {what}");
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut lines = Lines(format!("{}: {}", self.name, self.state_text()));
        self.push_faults(&mut lines);
        self.push_progress(&mut lines);
        self.push_tools(&mut lines);
        self.push_formability(&mut lines);
        self.push_times(&mut lines);
        if let Some(line) = &self.last_line {
            lines.push("last line", HEADER);
            lines.push("", line);
        }
        self.push_checkpoint(&mut lines);
        self.push_restart(&mut lines);
        f.write_str(&lines.0)
    }
}

impl Status {
    /// The state, and the host of the process if it is another one.
    fn state_text(&self) -> String {
        let process = self.host.as_ref().map_or_else(String::new, |host| format!(" on {host}"));
        match (self.state, &self.host) {
            (State::Running, Some(host)) => match self.heartbeat_s {
                Some(age) => format!("running on {host} (last heartbeat {} ago)", clock(age)),
                None => format!("running on {host}"),
            },
            (State::Running, None) => "running".into(),
            (State::Finished, _) => "finished".into(),
            (State::NotConverged, _) => "not converged".into(),
            (State::Stopped, _) => "stopped".into(),
            (State::Killed, None) => "killed: its process is gone".into(),
            (State::Killed, Some(host)) => format!(
                "killed: its process on {host} has ended, or has had no heartbeat for {} minutes",
                HEARTBEAT_EXPIRY.as_secs() / 60
            ),
            (State::Elsewhere, _) => format!(
                "running at its last update; its process{process} cannot be checked from here"
            ),
        }
    }

    /// The message of a run that ended early, and the doubts.
    fn push_faults(&self, lines: &mut Lines) {
        if let Some(message) = &self.message {
            lines.push("because", message);
        }
        // The message may contain doubts.
        let quoted = |text: &str| self.message.as_ref().is_some_and(|m| m.contains(text));
        for doubt in self.doubts.iter().filter(|doubt| !quoted(&doubt.text)) {
            lines.push("doubt", &doubt.to_string());
        }
    }

    /// Stage and increment.
    fn push_progress(&self, lines: &mut Lines) {
        if let Some(stage) = &self.stage {
            let done = 100.0 * self.time / self.stages.max(1) as f64;
            let stages = if self.stages == 1 {
                "1 stage".into()
            } else {
                format!("all {} stages", self.stages)
            };
            lines.push("stage", &format!("{stage}; {done:.1} % of {stages} done"));
        }
        lines.push(
            "increment",
            &format!(
                "{}, {} iterations and {} cuts so far, {} nodes touch, {} slip",
                self.increment, self.iterations, self.cuts, self.contacts[0], self.contacts[1]
            ),
        );
    }

    fn push_tools(&self, lines: &mut Lines) {
        for tool in &self.tools {
            let (name, travel, force) = (&tool.name, tool.travel_mm, tool.force_n / 1e3);
            lines.push("tool", &format!("{name}: travel {travel:.3} mm, force {force:.3} kN"));
        }
    }

    /// Largest thinning, smallest margin, and the verdict on quality.
    fn push_formability(&self, lines: &mut Lines) {
        if let Some(thinning) = &self.thinning {
            lines.push("thinning", &thinning.to_string());
        }
        if let Some(margin) = &self.margin {
            lines.push("margin", &margin.to_string());
        }
        let verdict = match self.quality {
            Some(QualityVerdict::Kept) => "all limits of quality are kept",
            Some(QualityVerdict::Exceeded) => "a limit of quality is exceeded",
            Some(QualityVerdict::Cracks) => "the sheet cracks: it is beyond the forming limit",
            None => return,
        };
        lines.push("quality", verdict);
    }

    fn push_times(&self, lines: &mut Lines) {
        let left = self.left_s.map_or_else(String::new, |s| format!(", about {} left", clock(s)));
        let (wall, ago) = (clock(self.wall_s), clock(self.updated_s));
        lines.push("time", &format!("{wall} at the last increment, {ago} ago{left}"));
    }

    fn push_checkpoint(&self, lines: &mut Lines) {
        match &self.checkpoint {
            Some(c) => {
                let age = clock(c.age_s);
                let what = format!("{} of increment {}, {age} old", c.file, c.increment);
                lines.push("checkpoint", &what);
            }
            None if self.state == State::Finished => {}
            None => lines.push("checkpoint", "none"),
        }
    }

    fn push_restart(&self, lines: &mut Lines) {
        if self.state == State::NotConverged {
            lines.push(
                "continue with",
                "a changed scene, from the start; the last good state is steps/last.vtu",
            );
        }
    }
}

/// A duration as hours, minutes and seconds.
fn clock(seconds: f64) -> String {
    let whole = seconds.max(0.0).round() as u64;
    let (h, m, s) = (whole / 3600, whole / 60 % 60, whole % 60);
    if h > 0 { format!("{h}:{m:02}:{s:02}") } else { format!("{m}:{s:02}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_hours_minutes_and_seconds() {
        assert_eq!([clock(0.4), clock(61.0), clock(3725.2)], ["0:00", "1:01", "1:02:05"]);
    }
}
