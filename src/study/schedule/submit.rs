//! Submits the cases that are ready.

use std::collections::HashMap;
use std::ops::Range;

use super::{Job, Phase, Question, Schedule, check_lock, increments, write};
use crate::StudyError;
use crate::case::Case;
use crate::groups::groups;
use crate::inputs::folder_of;
use crate::outcome;
use crate::runner::process::request_stop;
use crate::runner::tickets::{Submission, Ticket};
use crate::runner::{EngineError, Group};
use crate::states::{State, entry};
use kanagata_run::lock::{self, Place};

/// Mark of a case whose folder another process uses.
const WAITED_FOR: &str = "waited for";

impl Schedule<'_, '_> {
    /// Submits the cases that are ready. True if any were.
    pub(super) fn submit(&mut self) -> Result<bool, StudyError> {
        let mut any = false;
        for rank in self.ranks.clone() {
            any |= self.submit_rank(rank)?;
        }
        Ok(any)
    }

    /// Submits those of the jobs `rank` that are ready.
    fn submit_rank(&mut self, rank: Range<usize>) -> Result<bool, StudyError> {
        let ready = self.ready(rank);
        if ready.is_empty() {
            return Ok(false);
        }
        let groups = self.grouped(&ready);
        check_lock(self.how.lock, self.how.folder)?;
        for name in groups.iter().flat_map(|group| &group.cases) {
            outcome::forget(&folder_of(self.how.folder, name));
        }
        let submitted = self.hand_over(&groups, &ready);
        let count = self.answer(Question::Submit, submitted)?.map_or(0, |tickets| tickets.len());
        let verb = if self.how.runner.outlives() { "submitted" } else { "begins" };
        for name in groups.iter().take(count).flat_map(|group| &group.cases) {
            (self.say)(&format!("{name}: {verb}"));
        }
        Ok(count > 0)
    }

    /// The jobs of a rank that are ready, no more than the runner takes.
    fn ready(&mut self, rank: Range<usize>) -> Vec<usize> {
        let mut ready = Vec::new();
        for k in rank {
            if ready.len() >= self.how.runner.free() {
                break;
            }
            if self.is_ready(k) {
                ready.push(k);
            }
        }
        ready
    }

    /// Groups of the jobs `ready`, in the order in which the runner takes them.
    fn grouped(&self, ready: &[usize]) -> Vec<Group> {
        // What was submitted without success runs alone: it does not take others with it.
        let (again, first): (Vec<usize>, Vec<usize>) =
            ready.iter().copied().partition(|&k| self.jobs[k].submission.tries > 0);
        let of = |list: &[usize], task_s: f64| {
            let cases: Vec<&Case> = list.iter().map(|&k| self.jobs[k].case).collect();
            groups(&cases, self.how.folder, task_s)
        };
        let mut groups = [of(&first, self.how.task_s), of(&again, 0.0)].concat();
        groups.truncate(self.how.runner.free());
        self.how.runner.arrange(&mut groups);
        groups
    }

    /// Has the runner take groups of the jobs `ready`, and records their tickets.
    fn hand_over(&mut self, groups: &[Group], ready: &[usize]) -> Result<Vec<Ticket>, EngineError> {
        let leader = |&k: &usize| self.leader(&self.jobs[k])?.submission.ticket.clone();
        let after: Vec<Ticket> = ready.iter().filter_map(leader).collect();
        let before = Before::of(self, ready);
        let index: HashMap<&str, usize> =
            ready.iter().map(|&k| (self.jobs[k].case.id.as_str(), k)).collect();
        let of_group = |group: &Group| -> Vec<usize> {
            group.cases.iter().filter_map(|name| index.get(name.as_str()).copied()).collect()
        };
        let members: Vec<Vec<usize>> = groups.iter().map(of_group).collect();
        let (folder, lock) = (self.how.folder, self.how.lock);
        let (jobs, runner) = (&mut self.jobs, &mut *self.how.runner);
        let (name, keeps) = (runner.name(), runner.outlives());
        let mut record = |tickets: &[Ticket]| {
            for (group, members) in members.iter().enumerate() {
                for &k in members {
                    match tickets.get(group) {
                        Some(ticket) => before.note(&mut jobs[k], ticket),
                        None => before.restore(&mut jobs[k]),
                    }
                }
            }
            if keeps { write(jobs, keeps, lock, name, folder) } else { Ok(()) }
        };
        runner.submit(groups, &after, &mut record)
    }

    /// Whether a case can be submitted now. A solver that an earlier study has left in its folder is asked to end.
    fn is_ready(&mut self, k: usize) -> bool {
        let job = &self.jobs[k];
        if job.phase != Phase::Open || job.submission.ticket.is_some() || self.is_blocked(job) {
            return false;
        }
        let ordered = self.how.runner.orders_dependents();
        let is_unsent = |l: &Job<'_>| l.phase == Phase::Open && l.submission.ticket.is_none();
        if self.leader(job).is_some_and(is_unsent) {
            return false;
        }
        if !ordered && !self.leader_is_done(k) {
            return false;
        }
        let run = folder_of(self.how.folder, &job.case.id).join("run");
        // A lock that cannot be read is an error of the run, which names it.
        let Some(holder) = lock::holder(&lock::file_in(&run)).unwrap_or(None) else {
            return self.is_still_open(k);
        };
        let id = job.case.id.clone();
        let process = holder.process.as_ref().map(|process| process.id);
        if let Some(process) = process.filter(|_| !ordered && holder.place == Place::Here) {
            if self.asked.insert(id.clone(), process) != Some(process) {
                let text = "still works in its folder: asked to end, waited for";
                (self.say)(&format!("{id}: {holder} {text}"));
                // A process that cannot be asked is waited for as well.
                let _ = request_stop(process);
            }
        } else if self.jobs[k].told != WAITED_FOR {
            let remedy = holder.remedy();
            (self.say)(&format!("{id}: {holder} works in its folder, waited for; {remedy}"));
            self.jobs[k].told = WAITED_FOR.into();
        }
        false
    }

    /// Settles a case that was done meanwhile, or that cannot be run now that the case it follows is done.
    fn is_still_open(&mut self, k: usize) -> bool {
        let follows = self.jobs[k].case.follows.is_some();
        // Those without leader were examined at the start.
        if !follows && self.asked.is_empty() && self.jobs[k].told.is_empty() {
            return true;
        }
        let entry = entry(self.jobs[k].case, self.how.folder, &self.digests);
        match entry.state {
            State::Done => self.end(k, State::Done, None),
            State::Stale if !self.how.renew => {
                let reason = entry.reason.map(|what| format!("its run is of other inputs: {what}"));
                self.end(k, State::Failed, reason);
            }
            _ => return true,
        }
        false
    }
}

/// Increments and submissions of cases before they are submitted.
struct Before {
    increments: HashMap<String, usize>,
    submissions: HashMap<String, Submission>,
}

impl Before {
    /// The submissions of the jobs `ready` so far.
    fn of(schedule: &Schedule<'_, '_>, ready: &[usize]) -> Self {
        let jobs = || ready.iter().map(|&k| &schedule.jobs[k]);
        let increments = |job: &Job<'_>| increments(schedule.how.folder, job.case);
        Self {
            increments: jobs().map(|job| (job.case.id.clone(), increments(job))).collect(),
            submissions: jobs().map(|job| (job.case.id.clone(), job.submission.clone())).collect(),
        }
    }

    /// Takes back the ticket of a job that was not submitted.
    fn restore(&self, job: &mut Job<'_>) {
        if let Some(submission) = self.submissions.get(&job.case.id) {
            job.submission = submission.clone();
        }
    }

    /// Notes the ticket of a job.
    fn note(&self, job: &mut Job<'_>, ticket: &Ticket) {
        if let Some(own) = &mut job.submission.ticket
            && own.is_same_task(ticket)
        {
            // Its cluster may be known by now.
            own.clone_from(ticket);
            return;
        }
        let increment = self.increments.get(&job.case.id).copied().unwrap_or(0);
        let tries = job.submission.tries + 1;
        job.inherited = false;
        job.submission =
            Submission { ticket: Some(ticket.clone()), tries, increment, last_failure: None };
    }
}
