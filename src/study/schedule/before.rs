//! The schedule before anything is submitted: tickets of earlier executions, and the cases that are settled by what is
//! there.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

use super::{Execution, Job, Phase, Schedule, other_runner};
use crate::StudyError;
use crate::case::Case;
use crate::follow::ranks;
use crate::inputs::Digests;
use crate::runner::tickets::{Submission, Tickets};
use crate::states::{Entry, State};

impl<'a, 'b> Schedule<'a, 'b> {
    /// The schedule of cases with the tickets of earlier executions.
    pub(super) fn new(
        cases: &'a [Case],
        how: Execution<'b>,
        say: &'b (dyn Fn(&str) + Sync),
    ) -> Result<Self, StudyError> {
        let mut known = Tickets::read(how.folder).unwrap_or_else(|error| {
            say(&format!("tickets of submitted cases are lost: {error}"));
            Tickets::default()
        });
        let open = known.cases.values().any(|submission| submission.ticket.is_some());
        if open && known.runner != how.runner.name() {
            return Err(other_runner(how.folder, &known.runner, &*how.runner));
        }
        let (jobs, rows) = jobs_of(cases, &mut known);
        Ok(Self {
            jobs,
            ranks: rows,
            how,
            say,
            digests: Digests::default(),
            silence: BTreeMap::new(),
            at_work: HashMap::new(),
            gone_since: HashMap::new(),
            inherited: open,
            asked: HashMap::new(),
        })
    }

    /// The phases of all cases before anything is submitted.
    pub(super) fn settle_all_before(&mut self) {
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
}

/// The jobs of all cases, leaders before those that follow them, and the range of each rank.
fn jobs_of<'a>(cases: &'a [Case], known: &mut Tickets) -> (Vec<Job<'a>>, Vec<Range<usize>>) {
    let (mut jobs, mut rows): (Vec<Job<'a>>, Vec<Range<usize>>) = Default::default();
    let mut index: HashMap<&str, usize> = HashMap::new();
    for rank in ranks(cases) {
        rows.push(jobs.len()..jobs.len() + rank.len());
        for case in rank {
            index.insert(&case.id, jobs.len());
            let submission = known.cases.remove(&case.id).unwrap_or_default();
            jobs.push(Job {
                case,
                phase: Phase::Open,
                leader: case.follows.as_deref().and_then(|id| index.get(id).copied()),
                inherited: submission.ticket.is_some(),
                submission,
                told: String::new(),
            });
        }
    }
    (jobs, rows)
}
