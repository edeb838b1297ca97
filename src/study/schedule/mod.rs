//! Runs the cases of a study that are not done: submits them to a runner, and settles each by the proof in its folder.
//!
//! A case is done only if its `run.json` proves it. A ticket that has ended without proof is submitted again, at most
//! [`Execution::max_tries`] times without progress. An engine that does not answer changes nothing.

mod settle;
mod submit;

use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;
use std::time::{Duration, Instant};

use super::StudyError;
use super::case::Case;
use super::follow::ranks;
use super::groups::groups;
use super::inputs::{Digests, folder_of};
use super::runner::tickets::{Submission, Ticket, Tickets};
use super::runner::{EngineError, Runner, TicketState};
use super::states::{Entry, State, States};
use crate::cancel::Cancel;
use crate::report::record::RunRecord;
use crate::run::lock::{self, Attempt, Lock, Lost};

/// Submissions of a case without progress before it counts as failed, if nothing else is asked.
pub const MAX_TRIES: usize = 3;
/// Time after which a task that an engine lists as running, in whose folders no run is at work or has ended, counts as
/// gone: Slurm may list a task for ever whose processes were killed. It is the time after which a run on another host
/// counts as ended; preparing a run takes less.
pub const STALL: Duration = lock::HEARTBEAT_EXPIRY;

/// How cases are run.
pub struct Execution<'a> {
    /// Folder of the study.
    pub folder: &'a Path,
    /// Where they are run.
    pub runner: &'a mut dyn Runner,
    /// Submissions of a case without progress before it counts as failed.
    pub max_tries: usize,
    /// Smallest expected time of a task [s]; shorter cases share one.
    pub task_s: f64,
    /// Time after which a running task without a run at work counts as gone.
    pub stall: Duration,
    /// Run failed cases again.
    pub again: bool,
    /// Run cases again whose runs are of other inputs or of another build.
    pub renew: bool,
    /// Exclusive use of the folder.
    pub lock: &'a Lock,
    /// States of the cases before.
    pub before: &'a States,
    /// Submit and return.
    pub detach: bool,
    /// Stop request: running cases save a checkpoint and stop, and no other case starts.
    pub stop: &'a Cancel,
}

/// Runs all cases that are not done, leaders before the cases that follow them. `say` receives a message at the start
/// and the end of each.
///
/// # Errors
/// [`StudyError`] when the engine refuses a submission, or a file cannot be written.
pub fn execute<'a>(
    cases: &'a [Case],
    how: Execution<'a>,
    say: &'a (dyn Fn(&str) + Sync),
) -> Result<Left, StudyError> {
    let mut schedule = Schedule::new(cases, how, say)?;
    schedule.settle_all_before();
    schedule.run()?;
    Ok(schedule.left())
}

/// What an execution has left open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Left {
    /// Cases with a ticket.
    pub submitted: usize,
    /// Cases that wait: for those that they follow, or for a place.
    pub waiting: usize,
    /// Cases that are settled and not done.
    pub not_done: usize,
}

/// Exclusive use of a study's folder until the lock is dropped; with `break_lock` also from a study that is not known to be
/// alive on this host.
///
/// # Errors
/// [`StudyError::Busy`] when another study uses the folder, [`StudyError::Write`].
pub fn lock(folder: &Path, break_lock: bool) -> Result<Lock, StudyError> {
    match lock::take(&folder.join("study.lock"), break_lock)? {
        Attempt::Acquired(lock) => Ok(lock),
        Attempt::HeldByOther(holder) => Err(StudyError::Busy { folder: folder.into(), holder }),
    }
}

/// Checks that the study still holds its folder, before it submits or writes.
///
/// # Errors
/// [`StudyError::LockLost`] when another study has taken the folder.
pub fn check_lock(lock: &Lock, folder: &Path) -> Result<(), StudyError> {
    let lost = |lost: Lost| StudyError::LockLost { folder: folder.into(), found: lost.found };
    lock.check().map_err(lost)
}

/// Asks submitted cases to end.
///
/// # Errors
/// [`StudyError`] when they were submitted with another runner (`name`), or the engine does not answer.
pub fn cancel(
    folder: &Path,
    name: &str,
    tickets: &[Ticket],
    runner: &mut dyn Runner,
) -> Result<(), StudyError> {
    if name != runner.name() {
        return Err(other_runner(folder, name, runner));
    }
    // The engine's numbers of the jobs are learned first; it refuses to end what has ended.
    let done = runner.poll(tickets).and_then(|states| {
        let of_work = |s: &TicketState| matches!(s, TicketState::Waiting(_) | TicketState::Running);
        let open = tickets.iter().zip(states).filter(|(_, state)| of_work(state));
        let open: Vec<Ticket> = open.map(|(ticket, _)| ticket.clone()).collect();
        if open.is_empty() { Ok(()) } else { runner.cancel(&open) }
    });
    done.map_err(|error| match error {
        EngineError::Study(error) => error,
        EngineError::NoAnswer(reason) => StudyError::NoAnswer { runner: runner.name(), reason },
        EngineError::Refused(reason) => StudyError::Refused { runner: runner.name(), reason },
    })
}

/// What would be submitted for the cases that are not done, rank by rank.
#[must_use]
pub fn emit(
    cases: &[Case],
    states: &States,
    folder: &Path,
    runner: &dyn Runner,
    task_s: f64,
) -> Vec<String> {
    let open = |case: &&Case| states.get(&case.id).is_none_or(|e| e.state != State::Done);
    let texts = ranks(cases).into_iter().map(|rank| {
        let open: Vec<&Case> = rank.into_iter().filter(open).collect();
        runner.emit(&groups(&open, folder, task_s))
    });
    texts.filter(|text| !text.is_empty()).collect()
}

fn other_runner(folder: &Path, name: &str, runner: &dyn Runner) -> StudyError {
    StudyError::OtherRunner { folder: folder.into(), runner: name.into(), asked: runner.name() }
}

/// What is left to do for a case.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Phase {
    /// To be run.
    Open,
    /// Nothing in this execution.
    Settled(State),
}

/// A case in the schedule.
struct Job<'a> {
    case: &'a Case,
    phase: Phase,
    /// Index of the case that it follows, if that is in the schedule; smaller than its own.
    leader: Option<usize>,
    submission: Submission,
    /// Whether its ticket is of an earlier execution.
    inherited: bool,
    /// Messages about its ticket that were given.
    told: String,
}

struct Schedule<'a, 'b> {
    jobs: Vec<Job<'a>>,
    /// Jobs that depend only on those of earlier ranges.
    ranks: Vec<Range<usize>>,
    how: Execution<'b>,
    say: &'b (dyn Fn(&str) + Sync),
    digests: Digests,
    /// The last message of an engine without answer.
    silence: String,
    /// When a run of a running ticket was last seen at work or ended.
    at_work: HashMap<Ticket, Instant>,
    /// Since when a ticket that may only be hidden has not been known.
    gone_since: HashMap<Ticket, Instant>,
    /// Whether `runner.json` had tickets.
    inherited: bool,
    /// Processes asked to end, by their folder's case.
    asked: HashMap<String, u32>,
}

impl<'a, 'b> Schedule<'a, 'b> {
    /// The schedule of cases with the tickets of earlier executions.
    fn new(
        cases: &'a [Case],
        how: Execution<'b>,
        say: &'b (dyn Fn(&str) + Sync),
    ) -> Result<Self, StudyError> {
        let mut known = Tickets::read(how.folder);
        let open = known.cases.values().any(|submission| submission.ticket.is_some());
        if open && known.runner != how.runner.name() {
            return Err(other_runner(how.folder, &known.runner, &*how.runner));
        }
        let (mut jobs, mut rows): (Vec<Job<'a>>, Vec<Range<usize>>) = Default::default();
        let mut index: HashMap<&str, usize> = HashMap::new();
        for rank in ranks(cases) {
            rows.push(jobs.len()..jobs.len() + rank.len());
            for case in rank {
                index.insert(&case.id, jobs.len());
                jobs.push(Job {
                    case,
                    phase: Phase::Open,
                    leader: case.follows.as_deref().and_then(|id| index.get(id).copied()),
                    submission: known.cases.remove(&case.id).unwrap_or_default(),
                    inherited: false,
                    told: String::new(),
                });
                if let Some(job) = jobs.last_mut() {
                    job.inherited = job.submission.ticket.is_some();
                }
            }
        }
        Ok(Self {
            jobs,
            ranks: rows,
            how,
            say,
            digests: Digests::default(),
            silence: String::new(),
            at_work: HashMap::new(),
            gone_since: HashMap::new(),
            inherited: open,
            asked: HashMap::new(),
        })
    }

    /// The phases of all cases before anything is submitted.
    fn settle_all_before(&mut self) {
        let before = self.how.before;
        for k in 0..self.jobs.len() {
            // A ticket whose end nobody has seen yet comes first.
            if self.jobs[k].submission.ticket.is_none()
                && let Some(entry) = before.get(&self.jobs[k].case.id)
            {
                self.settle_before(k, entry);
            }
        }
    }

    /// The phase of a case before anything is submitted.
    fn settle_before(&mut self, k: usize, entry: &Entry) {
        let job = &mut self.jobs[k];
        let failed = |job: &mut Job<'_>, reason: &str| {
            job.phase = Phase::Settled(State::Failed);
            (self.say)(&format!("{}: failed: {reason}", job.case.id));
        };
        let reason = entry.reason.clone().unwrap_or_default();
        match entry.state {
            State::Done => job.phase = Phase::Settled(State::Done),
            _ if entry.lacks_files => failed(job, &reason),
            State::Failed if !self.how.again => failed(job, &reason),
            State::Stale if self.how.renew => job.submission = Submission::default(),
            _ if self.how.again => job.submission = Submission::default(),
            _ if job.submission.tries >= self.how.max_tries => {
                let tries = job.submission.tries;
                let reason = job.submission.last_failure.clone();
                let reason =
                    reason.unwrap_or_else(|| format!("submitted {tries} times without progress"));
                failed(job, &reason);
            }
            _ => {}
        }
    }

    /// Submits and settles until nothing is left, a stop is requested, or after one submission if detached.
    fn run(&mut self) -> Result<(), StudyError> {
        let mut cancelled = false;
        loop {
            self.settle()?;
            if self.how.stop.is_requested() {
                if !cancelled && !self.how.runner.outlives() {
                    self.cancel()?;
                    cancelled = true;
                }
                if self.how.runner.outlives() || !self.has_tickets() {
                    return Ok(());
                }
            } else {
                let submitted = self.submit()?;
                if self.how.detach && (!submitted || self.how.runner.orders_dependents()) {
                    return self.answered();
                }
                if self.jobs.iter().all(|job| self.is_over(job)) {
                    return Ok(());
                }
            }
            std::thread::sleep(self.how.runner.interval());
        }
    }

    /// An error if the engine has not answered: a detached study must not look submitted.
    fn answered(&self) -> Result<(), StudyError> {
        if self.silence.is_empty() {
            return Ok(());
        }
        Err(StudyError::NoAnswer { runner: self.how.runner.name(), reason: self.silence.clone() })
    }

    fn left(&self) -> Left {
        let count = |of: &dyn Fn(&Job<'_>) -> bool| self.jobs.iter().filter(|job| of(job)).count();
        let is_open = |job: &Job<'_>| job.phase == Phase::Open;
        let submitted = count(&|job| is_open(job) && job.submission.ticket.is_some());
        Left {
            submitted,
            waiting: count(&is_open) - submitted,
            not_done: count(&|job| !is_open(job) && job.phase != Phase::Settled(State::Done)),
        }
    }

    fn has_tickets(&self) -> bool {
        self.jobs.iter().any(|job| job.phase == Phase::Open && job.submission.ticket.is_some())
    }

    /// Whether nothing more happens to a case in this execution.
    fn is_over(&self, job: &Job<'_>) -> bool {
        job.phase != Phase::Open || (job.submission.ticket.is_none() && self.is_blocked(job))
    }

    /// Whether the case that `job` follows, directly or through others, is settled and not done.
    fn is_blocked(&self, job: &Job<'_>) -> bool {
        let Some(leader) = self.leader(job) else { return false };
        match leader.phase {
            Phase::Settled(state) => state != State::Done,
            Phase::Open => self.is_blocked(leader),
        }
    }

    /// The case that `job` follows, if it is in the schedule; leaders come before it.
    fn leader(&self, job: &Job<'_>) -> Option<&Job<'a>> {
        job.leader.map(|k| &self.jobs[k])
    }

    /// Asks all tickets to end.
    fn cancel(&mut self) -> Result<(), StudyError> {
        let tickets: Vec<Ticket> =
            self.jobs.iter().filter_map(|job| job.submission.ticket.clone()).collect();
        let cancelled = self.how.runner.cancel(&tickets);
        self.answer(cancelled).map(|_| ())
    }

    fn write(&self) -> Result<(), StudyError> {
        let keeps = self.how.runner.outlives();
        if keeps || self.inherited {
            let (lock, name) = (self.how.lock, self.how.runner.name());
            return write(&self.jobs, keeps, lock, name, self.how.folder);
        }
        Ok(())
    }
}

/// Increments of the run of a case.
fn increments(study: &Path, case: &Case) -> usize {
    let path = folder_of(study, &case.id).join("run/run.json");
    let text = crate::files::read(&path, crate::files::Input::Description).unwrap_or_default();
    RunRecord::parse(&text).map_or(0, |record| record.increments)
}

/// Writes the tickets of all jobs; those of cases outside the schedule are kept.
///
/// # Errors
/// [`StudyError::LockLost`] when another study has taken the folder, [`StudyError::Write`].
fn write(
    jobs: &[Job<'_>],
    keeps: bool,
    lock: &Lock,
    runner: &str,
    folder: &Path,
) -> Result<(), StudyError> {
    check_lock(lock, folder)?;
    let mut tickets = Tickets::read(folder);
    tickets.runner = runner.to_owned();
    for job in jobs {
        let mut own = job.submission.clone();
        // A ticket that ends with this process is not kept.
        own.ticket = own.ticket.filter(|_| keeps || job.inherited);
        if own == Submission::default() {
            tickets.cases.remove(&job.case.id);
        } else {
            tickets.cases.insert(job.case.id.clone(), own);
        }
    }
    Ok(tickets.write(folder)?)
}

#[cfg(test)]
mod tests;
