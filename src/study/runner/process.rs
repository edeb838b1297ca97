//! Child processes: the commands of cases on this machine, or commands of a template that run them elsewhere.

use std::io;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;

use super::template::{Template, Values, joined};
use super::tickets::Ticket;
use super::{ENGINE_INTERVAL, EngineError, Group, Record, Runner, TicketState};
use crate::StudyError;
use kanagata_files::temporary::own_group;
use kanagata_files::{Input, WriteError, create_log};
use kanagata_report::record::Process;
use kanagata_run::resources::{alive, identity};

/// Interval between checks of processes.
const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Submissions in a row that fail before the engine counts as refusing them: its exit code does not tell a server that is
/// restarted from a wrong option. At the interval of an engine it is about a minute.
const FAILURES_MAX: usize = 10;
/// File in the folder of a case that receives the output of its command.
const LOG: &str = "case.log";
/// Names in the template of a submission.
pub const NAMES: [&str; 7] = ["case", "dir", "host", "threads", "memory_mb", "minutes", "name"];

/// How commands are made and where they run.
#[derive(Debug, Clone)]
pub struct Setup {
    /// Folder of the study, absolute.
    pub study: PathBuf,
    /// The solver.
    pub program: PathBuf,
    /// Command that runs a case; `None`: the case's own command, here.
    pub submit: Option<Template>,
    /// Command that ends with 0 while the engine knows `{ticket}`. With it `submit` only hands over, and the last word of
    /// its output is the ticket.
    pub poll: Option<Template>,
    /// Command that ends `{ticket}`.
    pub cancel: Option<Template>,
    /// A place for one group at a time each: its host.
    pub places: Vec<String>,
    /// Runs end with this process.
    pub tied: bool,
    /// Run cases again that did not converge.
    pub again: bool,
}

impl Setup {
    /// Words of the command that runs a group.
    fn case_words(&self, group: &Group) -> Vec<String> {
        let program = self.program.display().to_string();
        let mut words = vec![program, "--threads".into(), group.threads.to_string(), "case".into()];
        words.extend(self.tied.then(|| "--tied".into()));
        words.extend(self.again.then(|| "--again".into()));
        words.extend(group.cases.iter().map(|case| format!("cases/{case}")));
        words
    }

    /// Words of the command for a group at a place.
    fn words(&self, group: &Group, host: &str) -> Vec<String> {
        let case = self.case_words(group);
        let Some(template) = &self.submit else { return case };
        let number = |value: Option<f64>| value.map_or_else(String::new, |v| format!("{v:.0}"));
        let values = Values::from([
            ("dir", self.study.display().to_string()),
            ("host", host.to_owned()),
            ("threads", group.threads.to_string()),
            ("memory_mb", number(group.memory_mb)),
            ("minutes", number(group.seconds.map(|s| (s / 60.0).ceil()))),
            ("name", group.cases.join("+")),
        ]);
        template.words(&case, &values)
    }
}

/// A process that runs a group.
struct Running {
    child: Child,
    ticket: Ticket,
    place: usize,
    log: PathBuf,
}

/// Runs groups as child processes.
pub struct Processes {
    setup: Setup,
    running: Vec<Running>,
    /// Tickets of earlier processes that were alive when last asked for.
    elsewhere: usize,
    /// Submissions that failed in a row.
    failures: usize,
}

impl Processes {
    /// A runner without processes.
    #[must_use]
    pub fn new(setup: Setup) -> Self {
        Self { setup, running: Vec::new(), elsewhere: 0, failures: 0 }
    }

    /// Index of a place without a process.
    fn free_place(&self) -> Option<usize> {
        (0..self.setup.places.len()).find(|place| self.running.iter().all(|r| r.place != *place))
    }

    /// Starts the command of a group at a place.
    fn start(&self, group: &Group, place: usize) -> Result<Running, EngineError> {
        let words = self.setup.words(group, &self.setup.places[place]);
        let folder = self.setup.study.join("cases").join(&group.cases[0]);
        let log = folder.join(LOG);
        let unwritten = |source| StudyError::from(WriteError { path: log.clone(), source });
        let file = create_log(&log).map_err(StudyError::from)?;
        let other = file.try_clone().map_err(unwritten)?;
        let mut command = Command::new(&words[0]);
        command.args(&words[1..]).current_dir(&self.setup.study).stdout(file).stderr(other);
        // The input stays open as long as this process lives; a tied run stops when it ends.
        command.stdin(if self.setup.tied { Stdio::piped() } else { Stdio::null() });
        // Signals of the terminal reach only the study, which asks its runs to stop.
        own_group(&mut command);
        let child = command
            .spawn()
            .map_err(|source| StudyError::Start { path: words[0].clone().into(), source })?;
        let id = identity(child.id()).and_then(|process| serde_json::to_string(&process).ok());
        let id = id.unwrap_or_else(|| child.id().to_string());
        Ok(Running { child, ticket: Ticket::new(id), place, log })
    }

    /// Hands a group over to an engine and returns its ticket.
    fn hand_over(&mut self, group: &Group) -> Result<Ticket, EngineError> {
        let words = self.setup.words(group, "");
        let output = output(&words, &self.setup.study)?;
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let last = text.split_whitespace().last().filter(|_| output.status.success());
        if let Some(id) = last {
            self.failures = 0;
            return Ok(Ticket::new(id.to_owned()));
        }
        if output.status.success() {
            let reason = format!("`{}` printed no ticket", joined(&words));
            return Err(EngineError::Refused(reason));
        }
        self.failures += 1;
        let why = failure(&words, &output);
        Err(if self.failures < FAILURES_MAX {
            EngineError::NoAnswer(why)
        } else {
            EngineError::Refused(why)
        })
    }

    /// State of a ticket that an engine or an earlier process has.
    fn state_elsewhere(&self, ticket: &Ticket) -> Result<TicketState, EngineError> {
        if let Some(poll) = &self.setup.poll {
            let words = poll.words(&[], &Values::from([("ticket", ticket.id.clone())]));
            let known = output(&words, &self.setup.study)?.status.success();
            // In the queue or at work: its exit code does not tell.
            return Ok(if known { TicketState::Waiting(None) } else { TicketState::Gone });
        }
        let process: Option<Process> = serde_json::from_str(&ticket.id).ok();
        Ok(match process.and_then(|process| alive(&process)) {
            // A process of another machine cannot be looked up: its run's lock tells.
            Some(false) | None => TicketState::Gone,
            Some(true) => TicketState::Running,
        })
    }
}

impl Runner for Processes {
    fn name(&self) -> &'static str {
        if self.setup.submit.is_some() { "command" } else { "local" }
    }

    fn free(&self) -> usize {
        if self.setup.poll.is_some() {
            usize::MAX
        } else {
            self.setup.places.len().saturating_sub(self.running.len() + self.elsewhere)
        }
    }

    fn orders_dependents(&self) -> bool {
        false
    }

    fn outlives(&self) -> bool {
        !self.setup.tied || self.setup.poll.is_some()
    }

    fn may_be_silent(&self) -> bool {
        self.setup.poll.is_some()
    }

    fn interval(&self) -> Duration {
        if self.setup.poll.is_some() { ENGINE_INTERVAL } else { POLL_INTERVAL }
    }

    fn submit(
        &mut self,
        groups: &[Group],
        _: &[Ticket],
        record: Record<'_>,
    ) -> Result<Vec<Ticket>, EngineError> {
        let mut tickets = Vec::new();
        for group in groups {
            if self.setup.poll.is_some() {
                tickets.push(self.hand_over(group)?);
            } else {
                let Some(place) = self.free_place() else { break };
                let running = self.start(group, place)?;
                tickets.push(running.ticket.clone());
                self.running.push(running);
            }
            record(&tickets)?;
        }
        Ok(tickets)
    }

    fn poll(&mut self, tickets: &[Ticket]) -> Result<Vec<TicketState>, EngineError> {
        let mut states = Vec::new();
        self.elsewhere = 0;
        for ticket in tickets {
            let Some(k) = self.running.iter().position(|r| r.ticket == *ticket) else {
                let state = self.state_elsewhere(ticket)?;
                self.elsewhere += usize::from(state == TicketState::Running);
                states.push(state);
                continue;
            };
            let status = self.running[k].child.try_wait();
            states.push(match status {
                Ok(None) => TicketState::Running,
                Ok(Some(status)) => ended(status, &self.running.swap_remove(k).log),
                Err(error) => TicketState::Ended { reason: error.to_string(), retry: true },
            });
        }
        Ok(states)
    }

    fn cancel(&mut self, tickets: &[Ticket]) -> Result<(), EngineError> {
        if self.setup.poll.is_some() && self.setup.cancel.is_none() {
            return Err(EngineError::Refused("no command is given that ends a ticket".into()));
        }
        let mut first = None;
        for ticket in tickets {
            if let Some(cancel) = &self.setup.cancel {
                let words = cancel.words(&[], &Values::from([("ticket", ticket.id.clone())]));
                let output = output(&words, &self.setup.study)?;
                if !output.status.success() {
                    first.get_or_insert_with(|| failure(&words, &output));
                }
            } else if let Some(process) = serde_json::from_str::<Process>(&ticket.id).ok()
                && alive(&process) == Some(true)
            {
                // A process that has just ended cannot be asked.
                let _ = request_stop(process.id);
                // Programs that do not pass on the signal pass on the end of their input.
                if let Some(running) = self.running.iter_mut().find(|r| r.ticket == *ticket) {
                    drop(running.child.stdin.take());
                }
            }
        }
        first.map_or(Ok(()), |why| Err(EngineError::NoAnswer(why)))
    }

    fn emit(&self, groups: &[Group]) -> String {
        let places = self.setup.places.iter().cycle();
        let line =
            |(group, place): (&Group, &String)| joined(&self.setup.words(group, place)) + "\n";
        groups.iter().zip(places).map(line).collect()
    }
}

/// How a process ended.
fn ended(status: ExitStatus, log: &Path) -> TicketState {
    let text = kanagata_files::read_text(log, Input::Description).unwrap_or_default();
    let last = text.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or_default();
    let reason = match status.code() {
        Some(code) => format!("ended with exit code {code} {last}"),
        None => format!("killed ({status}) {last}"),
    };
    // Exit code 5: it was asked to stop.
    TicketState::Ended { reason: reason.trim_end().to_owned(), retry: status.code() != Some(5) }
}

/// Output of a command of a template.
fn output(words: &[String], folder: &Path) -> Result<std::process::Output, EngineError> {
    let done =
        Command::new(&words[0]).args(&words[1..]).current_dir(folder).stdin(Stdio::null()).output();
    done.map_err(|source| StudyError::Start { path: words[0].clone().into(), source }.into())
}

/// Why a command failed, in words.
fn failure(words: &[String], output: &std::process::Output) -> String {
    let errors = String::from_utf8_lossy(&output.stderr);
    format!("`{}`: {}, {}", joined(words), output.status, errors.trim().replace('\n', " "))
}

/// Asks a process and its group to end.
#[cfg(unix)]
pub(crate) fn request_stop(process: u32) -> io::Result<()> {
    use rustix::process::{Pid, Signal, kill_process, kill_process_group};
    let Some(pid) = i32::try_from(process).ok().and_then(Pid::from_raw) else { return Ok(()) };
    // A process that leads no group is asked alone.
    kill_process_group(pid, Signal::TERM)
        .or_else(|_| kill_process(pid, Signal::TERM))
        .map_err(io::Error::from)
}

#[cfg(not(unix))]
pub(crate) fn request_stop(_: u32) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}
