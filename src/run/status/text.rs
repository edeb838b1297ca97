//! The status of a run in lines of a key and what it is.

use std::fmt::{self, Write as _};

use super::{State, Status};
use crate::run::progress_line::HEADER;

/// Lines under the name of a run.
struct Lines(String);

impl Lines {
    fn say(&mut self, key: &str, what: &str) {
        let _ = write!(self.0, "\n  {key:10} {what}");
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut lines = Lines(format!("{}: {}", self.name, self.state.words()));
        self.say_faults(&mut lines);
        self.say_progress(&mut lines);
        self.say_tools(&mut lines);
        self.say_times(&mut lines);
        if let Some(line) = &self.last_line {
            lines.say("last line", HEADER);
            lines.say("", line);
        }
        self.say_checkpoint(&mut lines);
        self.say_restart(&mut lines);
        f.write_str(&lines.0)
    }
}

impl Status {
    /// What ended the run, and its doubts.
    fn say_faults(&self, lines: &mut Lines) {
        if let Some(message) = &self.message {
            lines.say("because", message);
        }
        // What ended a run may quote them.
        let quoted = |text: &str| self.message.as_ref().is_some_and(|m| m.contains(text));
        for doubt in self.doubts.iter().filter(|doubt| !quoted(&doubt.text)) {
            lines.say("doubt", &doubt.to_string());
        }
    }

    /// Stage and increment.
    fn say_progress(&self, lines: &mut Lines) {
        if let Some(stage) = &self.stage {
            let done = 100.0 * self.time / self.stages.max(1) as f64;
            let stages = if self.stages == 1 {
                "1 stage".into()
            } else {
                format!("all {} stages", self.stages)
            };
            lines.say("stage", &format!("{stage}; {done:.1} % of {stages} done"));
        }
        lines.say(
            "increment",
            &format!(
                "{}, {} iterations and {} cuts so far, {} nodes touch, {} slip",
                self.increment, self.iterations, self.cuts, self.contacts[0], self.contacts[1]
            ),
        );
    }

    fn say_tools(&self, lines: &mut Lines) {
        for tool in &self.tools {
            let (name, travel, force) = (&tool.name, tool.travel_mm, tool.force_n / 1e3);
            lines.say("tool", &format!("{name}: travel {travel:.3} mm, force {force:.3} kN"));
        }
    }

    fn say_times(&self, lines: &mut Lines) {
        let left = self.left_s.map_or_else(String::new, |s| format!(", about {} left", clock(s)));
        let (wall, ago) = (clock(self.wall_s), clock(self.updated_s));
        lines.say("time", &format!("{wall} at the last increment, {ago} ago{left}"));
    }

    fn say_checkpoint(&self, lines: &mut Lines) {
        match &self.checkpoint {
            Some(c) => {
                let age = clock(c.age_s);
                let what = format!("{} of increment {}, {age} old", c.file, c.increment);
                lines.say("checkpoint", &what);
            }
            None if self.state == State::Finished => {}
            None => lines.say("checkpoint", "none"),
        }
    }

    fn say_restart(&self, lines: &mut Lines) {
        if self.state == State::NotConverged {
            lines.say(
                "continue with",
                "a changed scene, from the start; the last good state is steps/last.vtu",
            );
        }
    }
}

/// Hours, minutes and seconds.
fn clock(seconds: f64) -> String {
    let whole = seconds.max(0.0).round() as u64;
    let (h, m, s) = (whole / 3600, whole / 60 % 60, whole % 60);
    if h > 0 { format!("{h}:{m:02}:{s:02}") } else { format!("{m}:{s:02}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_told_by_the_clock() {
        assert_eq!([clock(0.4), clock(61.0), clock(3725.2)], ["0:00", "1:01", "1:02:05"]);
    }
}
