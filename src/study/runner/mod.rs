//! Runners: where the commands of cases are executed.
//!
//! - [`process`]: child processes here, or those of a command template (ssh, containers, other queues)
//! - [`slurm`]: job arrays of Slurm
//! - [`tickets`]: `runner.json`, what has been submitted

pub mod process;
pub mod slurm;
pub mod template;
pub mod tickets;

use std::time::Duration;

use self::tickets::Ticket;
use super::StudyError;

/// Interval between questions to an engine [s]: one that answers for many users is not asked more often.
const ENGINE_INTERVAL: Duration = Duration::from_secs(5);

/// Cases that one task runs one after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Names of the cases.
    pub cases: Vec<String>,
    /// Threads of each run.
    pub threads: usize,
    /// Largest expected memory [MB]; `None` if unknown.
    pub memory_mb: Option<f64>,
    /// Upper estimate of the time of all [s]; `None` if unknown.
    pub seconds: Option<f64>,
}

/// State of a submitted group.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TicketState {
    /// In the queue; why, if that needs attention.
    Waiting(Option<String>),
    /// At work.
    Running,
    /// Ended: how, and whether it may be submitted again.
    Ended {
        /// How it ended.
        reason: String,
        /// False if it was stopped on purpose.
        retry: bool,
    },
    /// The engine does not know it.
    Gone,
}

/// Why an engine did not do what was asked.
#[derive(Debug)]
pub enum EngineError {
    /// It does not answer: nothing is known, and nothing changes.
    NoAnswer(String),
    /// It refuses what is asked; asking again does not help.
    Refused(String),
    /// A file of the study cannot be written, or a program not be started.
    Study(StudyError),
}

impl From<StudyError> for EngineError {
    fn from(error: StudyError) -> Self {
        Self::Study(error)
    }
}

/// Records tickets.
pub type Record<'a> = &'a mut dyn FnMut(&[Ticket]) -> Result<(), StudyError>;

/// Executes the commands of cases.
pub trait Runner {
    /// Name, as `--runner` has it.
    fn name(&self) -> &'static str;

    /// Number of groups that it takes now; any number without a limit of its own.
    fn free(&self) -> usize {
        usize::MAX
    }

    /// Whether it takes groups that must wait for others, and orders them itself.
    fn orders_dependents(&self) -> bool {
        false
    }

    /// Whether its tickets outlive this process, as those of an engine do.
    fn outlives(&self) -> bool {
        true
    }

    /// Whether a ticket may seem gone while the engine is only silent.
    fn may_be_silent(&self) -> bool {
        false
    }

    /// Interval between calls of [`Runner::poll`].
    fn interval(&self) -> Duration {
        ENGINE_INTERVAL
    }

    /// Puts groups that may run in any order into the order in which [`Runner::submit`] takes them.
    fn arrange(&self, _groups: &mut [Group]) {}

    /// Submits groups, one ticket each; they start when those of `after` have ended. The tickets are recorded before the
    /// engine may lose them.
    ///
    /// # Errors
    /// [`EngineError`]. Recorded tickets of a submission without answer may or may not exist.
    fn submit(
        &mut self,
        groups: &[Group],
        after: &[Ticket],
        record: Record<'_>,
    ) -> Result<Vec<Ticket>, EngineError>;

    /// States of tickets, in their order.
    ///
    /// # Errors
    /// [`EngineError`].
    fn poll(&mut self, tickets: &[Ticket]) -> Result<Vec<TicketState>, EngineError>;

    /// Asks groups that the last [`Runner::poll`] has found waiting or running to end; their runs save checkpoints.
    /// All are asked, also after one that could not be. An engine that ends nothing refuses it.
    ///
    /// # Errors
    /// [`EngineError`], the first.
    fn cancel(&mut self, _tickets: &[Ticket]) -> Result<(), EngineError> {
        Err(EngineError::Refused("it has no command that ends a ticket".into()))
    }

    /// What [`Runner::submit`] would hand over, as text; the names of the cases of a group in a line if it is no text.
    fn emit(&self, groups: &[Group]) -> String {
        groups.iter().map(|group| group.cases.join(" ") + "\n").collect()
    }
}
