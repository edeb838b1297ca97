//! Runs the cases of a study that are not done: submits them to a runner, and settles each by the proof in its folder.
//!
//! A case is done only if its `run.json` proves it. A ticket that has ended without proof is submitted again, at most
//! [`Execution::max_tries`] times without progress. An engine that does not answer changes nothing.

mod before;
mod settle;
mod submit;

use std::collections::{BTreeMap, HashMap};
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
use super::states::{State, States};
use kanagata_cancel::Cancel;
use kanagata_report::record::RunRecord;
use kanagata_run::lock::{self, Attempt, Lock, Lost};

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
    /// The clock for times that an engine is given.
    pub now: &'a dyn Fn() -> Instant,
    /// Waits between questions to the runner.
    pub pause: &'a dyn Fn(Duration),
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

/// Asks submitted cases to end. Returns the number of those that were asked; the others have ended, or the engine has
/// removed them from its lists.
///
/// An engine reports an error if one of several tasks has ended meanwhile, and asks the others all the same. It is asked
/// once more for their states: where some have ended by themselves, they explain the error.
///
/// # Errors
/// [`StudyError::OtherRunner`] when they were submitted with another runner (`name`), [`StudyError::NotCancelled`] when the
/// engine does not answer, or reports an error although no task has ended.
pub fn cancel(
    folder: &Path,
    name: &str,
    tickets: &[Ticket],
    runner: &mut dyn Runner,
) -> Result<usize, StudyError> {
    if name != runner.name() {
        return Err(other_runner(folder, name, runner));
    }
    end_all(tickets, runner).map_err(|error| {
        let (reason, refused) = match error {
            EngineError::Study(error) => return error,
            EngineError::NoAnswer(reason) => (reason, false),
            EngineError::Refused(reason) => (reason, true),
        };
        StudyError::NotCancelled { runner: runner.name(), reason, refused }
    })
}

/// Has the engine end tickets. Returns the number of those that were asked.
fn end_all(tickets: &[Ticket], runner: &mut dyn Runner) -> Result<usize, EngineError> {
    let is_at_work = |s: &TicketState| matches!(s, TicketState::Waiting(_) | TicketState::Running);
    // The engine's numbers of the jobs are learned first; it refuses to end what has ended.
    let states = runner.poll(tickets)?;
    let open = tickets.iter().zip(states).filter(|(_, state)| is_at_work(state));
    let open: Vec<Ticket> = open.map(|(ticket, _)| ticket.clone()).collect();
    if open.is_empty() {
        return Ok(0);
    }
    let Err(error) = runner.cancel(&open) else { return Ok(open.len()) };
    let states = runner.poll(&open)?;
    let by_itself = |state: &&TicketState| {
        matches!(state, TicketState::Gone | TicketState::Ended { retry: true, .. })
    };
    let ended = states.iter().filter(by_itself).count();
    if ended == 0 && states.iter().any(is_at_work) {
        return Err(error);
    }
    Ok(open.len() - ended)
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

/// What an engine is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Question {
    Submit,
    Poll,
    Cancel,
}

struct Schedule<'a, 'b> {
    jobs: Vec<Job<'a>>,
    /// Jobs that depend only on those of earlier ranges.
    ranks: Vec<Range<usize>>,
    how: Execution<'b>,
    say: &'b (dyn Fn(&str) + Sync),
    digests: Digests,
    /// The last message of an engine without answer, by what it was asked: its queue may be closed while it lists tasks.
    silence: BTreeMap<Question, String>,
    /// When a run of a running ticket was last seen at work or ended.
    at_work: HashMap<Ticket, Instant>,
    /// Since when a ticket that may only be hidden has not been known.
    gone_since: HashMap<Ticket, Instant>,
    /// Whether `runner.json` had tickets.
    inherited: bool,
    /// Processes asked to end, by their folder's case.
    asked: HashMap<String, u32>,
}

impl<'a> Schedule<'a, '_> {
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
            (self.how.pause)(self.how.runner.interval());
        }
    }

    /// An error if the engine has not answered: a detached study must not look submitted.
    fn answered(&self) -> Result<(), StudyError> {
        match self.silence.values().next() {
            None => Ok(()),
            Some(reason) => {
                let (runner, reason) = (self.how.runner.name(), reason.clone());
                Err(StudyError::NoAnswer { runner, reason })
            }
        }
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
        self.answer(Question::Cancel, cancelled).map(|_| ())
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
    let text = kanagata_files::read(&path, kanagata_files::Input::Description).unwrap_or_default();
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
    // A damaged file was reported at the start, and is replaced.
    let mut tickets = Tickets::read(folder).unwrap_or_default();
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
