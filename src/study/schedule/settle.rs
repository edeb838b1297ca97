//! Settles cases: by the states of their tickets and by the proof in their folders.

use std::collections::HashMap;
use std::time::Duration;

use super::{Phase, Question, Schedule, increments};
use crate::StudyError;
use crate::inputs::folder_of;
use crate::outcome;
use crate::runner::tickets::{Submission, Ticket};
use crate::runner::{EngineError, TicketState};
use crate::states::{State, entry};

/// Time for which an engine of which an exit code is all that is known must not know a ticket before it counts as gone: a
/// server is restarted meanwhile.
const GONE_GRACE: Duration = Duration::from_secs(60);
/// Mark of a case whose task runs.
const RUNNING: &str = "running";

impl Schedule<'_, '_> {
    /// Asks the runner for the states of all tickets and settles the cases that have ended.
    pub(super) fn settle(&mut self) -> Result<(), StudyError> {
        let open: Vec<(usize, Ticket)> = self
            .jobs
            .iter()
            .enumerate()
            .filter(|(_, job)| job.phase == Phase::Open)
            .filter_map(|(k, job)| Some((k, job.submission.ticket.clone()?)))
            .collect();
        if open.is_empty() {
            return Ok(());
        }
        let mut tickets: Vec<Ticket> = open.iter().map(|(_, ticket)| ticket.clone()).collect();
        tickets.sort_unstable();
        tickets.dedup();
        let polled = self.how.runner.poll(&tickets);
        let Some(states) = self.answer(Question::Poll, polled)? else { return Ok(()) };
        let states: HashMap<Ticket, TicketState> = tickets.into_iter().zip(states).collect();
        self.gone_since.retain(|ticket, _| states.get(ticket) == Some(&TicketState::Gone));
        let (mut changed, mut running) = (false, Vec::new());
        for (k, ticket) in open {
            changed |= match &states[&ticket] {
                TicketState::Waiting(reason) => {
                    self.tell(k, reason.as_deref());
                    false
                }
                TicketState::Running => {
                    running.push(ticket.clone());
                    self.settle_proved(k, &ticket)
                }
                TicketState::Ended { reason, retry } => self.settle_ended(k, reason, *retry),
                TicketState::Gone if self.may_be_hidden(k, &ticket) => false,
                TicketState::Gone => self.settle_ended(k, "its ticket is gone", true),
            };
        }
        if self.how.runner.outlives() {
            changed |= self.settle_stalled(&running)?;
        }
        if changed { self.write() } else { Ok(()) }
    }

    /// The value of an answer to a question; `None`, with a message, if the engine does not answer.
    pub(super) fn answer<T>(
        &mut self,
        question: Question,
        answer: Result<T, EngineError>,
    ) -> Result<Option<T>, StudyError> {
        match answer {
            Ok(value) => {
                // An engine that takes a submission answers everything.
                let was_silent = match question {
                    Question::Submit => !std::mem::take(&mut self.silence).is_empty(),
                    _ => self.silence.remove(&question).is_some(),
                };
                if was_silent {
                    (self.say)(&format!("{} answers again", self.how.runner.name()));
                }
                Ok(Some(value))
            }
            Err(EngineError::Study(error)) => Err(error),
            Err(EngineError::Refused(reason)) => {
                Err(StudyError::Refused { runner: self.how.runner.name(), reason })
            }
            Err(EngineError::NoAnswer(reason)) => {
                if self.silence.get(&question) != Some(&reason) {
                    (self.say)(&format!(
                        "{} does not answer, asked again: {reason}",
                        self.how.runner.name()
                    ));
                }
                self.silence.insert(question, reason);
                Ok(None)
            }
        }
    }

    /// Tells a reason for waiting once.
    pub(super) fn tell(&mut self, k: usize, reason: Option<&str>) {
        let Some(reason) = reason.filter(|reason| self.jobs[k].told != *reason) else { return };
        (self.say)(&format!("{}: waits in the queue: {reason}", self.jobs[k].case.id));
        self.jobs[k].told = reason.to_owned();
    }

    /// Settles a case whose run is proved done while its task runs the next case. True if something has changed.
    fn settle_proved(&mut self, k: usize, ticket: &Ticket) -> bool {
        // The process of a local run ends right after its proof.
        if !self.how.runner.outlives() {
            return false;
        }
        if self.jobs[k].told != RUNNING {
            self.jobs[k].told = RUNNING.into();
            (self.say)(&format!("{}: runs", self.jobs[k].case.id));
        }
        let entry = entry(self.jobs[k].case, self.how.folder, &self.digests);
        if matches!(entry.state, State::Running | State::Done) {
            self.at_work.insert(ticket.clone(), (self.how.now)());
        }
        if entry.state == State::Done {
            self.end(k, State::Done, None);
        }
        entry.state == State::Done
    }

    /// Whether a ticket may only seem gone: its engine may be silent, and nothing shows that the case has ended.
    fn may_be_hidden(&mut self, k: usize, ticket: &Ticket) -> bool {
        if !self.how.runner.may_be_silent() {
            return false;
        }
        let folder = folder_of(self.how.folder, &self.jobs[k].case.id);
        let entry = entry(self.jobs[k].case, self.how.folder, &self.digests);
        let ended = matches!(entry.state, State::Done | State::Failed);
        if ended || outcome::read(&folder).is_some() {
            return false;
        }
        let now = (self.how.now)();
        let since = *self.gone_since.entry(ticket.clone()).or_insert(now);
        now.duration_since(since) < GONE_GRACE
    }

    /// Opens the cases of running tickets again in whose folders nothing has been at work for too long. True if there are
    /// any.
    fn settle_stalled(&mut self, running: &[Ticket]) -> Result<bool, StudyError> {
        self.at_work.retain(|ticket, _| running.contains(ticket));
        let now = (self.how.now)();
        let mut stalled = Vec::new();
        for ticket in running {
            let seen = *self.at_work.entry(ticket.clone()).or_insert(now);
            if now.duration_since(seen) >= self.how.stall && !stalled.contains(ticket) {
                stalled.push(ticket.clone());
            }
        }
        if stalled.is_empty() {
            return Ok(false);
        }
        let cancelled = self.how.runner.cancel(&stalled);
        if self.answer(Question::Cancel, cancelled)?.is_none() {
            return Ok(false);
        }
        for k in 0..self.jobs.len() {
            let ticket = self.jobs[k].submission.ticket.as_ref();
            if ticket.is_some_and(|ticket| stalled.contains(ticket)) {
                let reason = "listed as running, but no run is at work in its folder";
                self.settle_ended(k, reason, true);
            }
        }
        Ok(true)
    }

    /// Settles a case whose ticket has ended or is gone, or opens it again. True if something has changed.
    pub(super) fn settle_ended(&mut self, k: usize, reason: &str, retry: bool) -> bool {
        let entry = entry(self.jobs[k].case, self.how.folder, &self.digests);
        let outcome = outcome::read(&folder_of(self.how.folder, &self.jobs[k].case.id));
        let exit = outcome.as_ref().map(|outcome| outcome.exit);
        match (entry.state, exit) {
            (State::Done, _) => self.end(k, State::Done, None),
            // Another process works in its folder.
            (State::Running, _) => return false,
            (State::Failed, _) => self.end(k, State::Failed, entry.reason),
            (State::Stale, _) if !self.how.renew => {
                let reason = entry.reason.map(|what| format!("its run is of other inputs: {what}"));
                self.end(k, State::Failed, reason);
            }
            // Ended by a person before this command, which asks for the case again.
            _ if !retry && self.jobs[k].inherited && !self.is_stopping() => {
                self.jobs[k].submission.ticket = None;
            }
            (_, Some(2 | 4)) => self.end(k, State::Failed, outcome.map(|outcome| outcome.message)),
            _ if !self.leader_is_done(k) => self.jobs[k].submission = Submission::default(),
            // A client that a stop has ended (ssh) does not report the exit code 5 of its solver.
            _ if !retry || self.is_stopping() => {
                let message = outcome.map_or_else(|| reason.to_owned(), |outcome| outcome.message);
                self.end(k, State::Waiting, Some(message));
            }
            _ => self.try_again(k, reason),
        }
        true
    }

    /// Whether a stop has been requested that ends the submitted cases.
    fn is_stopping(&self) -> bool {
        self.how.stop.is_requested() && !self.how.runner.outlives()
    }

    pub(super) fn leader_is_done(&self, k: usize) -> bool {
        let leader = self.leader(&self.jobs[k]);
        leader.is_none_or(|leader| leader.phase == Phase::Settled(State::Done))
    }

    /// Opens a case again, unless it was submitted too often without progress.
    pub(super) fn try_again(&mut self, k: usize, reason: &str) {
        let increments = increments(self.how.folder, self.jobs[k].case);
        let submission = &mut self.jobs[k].submission;
        submission.ticket = None;
        if increments > submission.increment {
            submission.tries = 0;
        }
        let tries = submission.tries;
        if tries < self.how.max_tries {
            (self.say)(&format!("{}: {reason}; submitted again", self.jobs[k].case.id));
        } else {
            let reason = format!("{reason}; submitted {tries} times without progress");
            self.jobs[k].submission.last_failure = Some(reason.clone());
            self.end(k, State::Failed, Some(reason));
        }
    }

    /// Settles a case.
    pub(super) fn end(&mut self, k: usize, state: State, reason: Option<String>) {
        let job = &mut self.jobs[k];
        job.phase = Phase::Settled(state);
        job.submission.ticket = None;
        if state == State::Done {
            job.submission = Submission::default();
        }
        (self.say)(&format!("{}: {}", job.case.id, reason.as_deref().unwrap_or("done")));
    }
}
