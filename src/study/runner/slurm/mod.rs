//! Slurm: every submission is a job array with a name of its own, by which it is found again. Job ids alone do not do: a
//! controller that is killed after a submission may forget it and give its id to the next one.

mod environment;

use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, SystemTime};

use super::template::{joined, split};
use super::tickets::Ticket;
use super::{EngineError, Group, Record, Runner, TicketState};
use crate::files::{sha256_hex, write_atomic};
use crate::study::StudyError;

/// Interval between questions [s]: a controller serves many users, and a task lasts at least minutes.
const POLL_INTERVAL: Duration = Duration::from_secs(2);
/// Largest number of tasks of an array, one less than the default of Slurm's `MaxArraySize`.
const TASKS_MAX: usize = 1000;
/// Largest over smallest expected memory of the tasks of an array, which all get what the largest needs: at most half of it
/// is kept from others in vain.
const MEMORY_RATIO_MAX: f64 = 2.0;
/// Requested over expected memory: a run above its request is killed, and what is requested is kept from others.
const MEMORY_FACTOR: f64 = 1.3;
/// Requested time over the upper estimate: machines differ by a factor of two.
const TIME_FACTOR: f64 = 2.0;
/// Smallest requested time [min]: starting, reading and saving a checkpoint take part of a minute on a busy file server.
const MINUTES_MIN: f64 = 5.0;
/// Time before the limit at which a run is asked to save a checkpoint and end [s].
const SIGNAL_S: u32 = 60;
/// Folder of scripts and outputs in that of the study.
const FOLDER: &str = "slurm";

/// How jobs are submitted.
#[derive(Debug, Clone, Default)]
pub struct Setup {
    /// Folder of the study, absolute.
    pub study: PathBuf,
    /// The solver.
    pub program: PathBuf,
    /// Options of `sbatch`, with their dashes.
    pub options: Vec<String>,
    /// Run cases again that did not converge.
    pub again: bool,
}

/// Submits groups as job arrays.
pub struct Slurm {
    setup: Setup,
    /// Job ids of arrays by name, as far as known.
    jobs: HashMap<String, String>,
}

impl Slurm {
    /// A runner that knows no job.
    #[must_use]
    pub fn new(setup: Setup) -> Self {
        Self { setup, jobs: HashMap::new() }
    }

    /// A name that no other submission has.
    fn new_name(&self, k: usize) -> String {
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let seed = format!("{} {} {now:?} {k}", self.setup.study.display(), std::process::id());
        format!("kanagata-{}", &sha256_hex(seed.as_bytes())[..10])
    }

    /// Script of an array.
    fn script(&self, name: &str, groups: &[Group]) -> String {
        let most = |of: fn(&Group) -> Option<f64>| {
            // A group without estimate gets what the cluster gives by default.
            let all: Option<Vec<f64>> = groups.iter().map(of).collect();
            all.and_then(|all| all.into_iter().reduce(f64::max))
        };
        let threads = groups.iter().map(|g| g.threads).max().unwrap_or(1);
        let mut directives = vec![
            ("job-name", name.to_owned()),
            ("array", format!("0-{}", groups.len().saturating_sub(1))),
            ("cpus-per-task", threads.to_string()),
            ("signal", format!("B:TERM@{SIGNAL_S}")),
            ("output", format!("{FOLDER}/{name}-%a.log")),
            ("open-mode", "append".to_owned()),
        ];
        if let Some(megabytes) = most(|g| g.memory_mb) {
            directives.push(("mem", format!("{:.0}M", (MEMORY_FACTOR * megabytes).ceil())));
        }
        if let Some(seconds) = most(|g| g.seconds) {
            let minutes = (TIME_FACTOR * seconds / 60.0).ceil().max(MINUTES_MIN);
            directives.push(("time", format!("{minutes:.0}")));
        }
        let mut text = "#!/bin/sh\n".to_owned();
        // Writing to a string cannot fail.
        for (name, value) in directives {
            let _ = writeln!(text, "#SBATCH --{name}={value}");
        }
        for option in &self.setup.options {
            let _ = writeln!(text, "#SBATCH {option}");
        }
        let mut words = vec![
            self.setup.program.display().to_string(),
            "--threads".into(),
            threads.to_string(),
            "case".into(),
        ];
        words.extend(self.setup.again.then(|| "--again".into()));
        let folder = joined(&[self.setup.study.display().to_string()]);
        let tasks: String = groups.iter().map(task_line).collect();
        let _ = write!(
            text,
            "cd {folder} || exit 4\n\
             # The folders of the task's cases.\n\
             set -- $(sed -n \"$((SLURM_ARRAY_TASK_ID + 1))p\" <<'TASKS'\n{tasks}TASKS\n)\n\
             # The solver takes the place of this shell, so that signals reach it.\n\
             exec {} \"$@\"\n",
            joined(&words)
        );
        text
    }

    /// Writes the script of an array.
    fn write(&self, name: &str, text: &str) -> Result<(), StudyError> {
        let folder = self.setup.study.join(FOLDER);
        std::fs::create_dir_all(&folder)
            .map_err(|source| StudyError::Folder { path: folder.clone(), source })?;
        write_atomic(&folder.join(format!("{name}.sh")), |w| w.write_all(text.as_bytes()))?;
        Ok(())
    }

    /// Submits an array with a written script of this text; it starts after `after`.
    fn submit_array(
        &mut self,
        name: &str,
        tasks: usize,
        text: &str,
        after: &[Ticket],
    ) -> Result<(), EngineError> {
        // sbatch takes an option from its command line, else from the environment, else from the script.
        let mut arguments = self.options();
        arguments.extend([
            "--parsable".to_owned(),
            format!("--job-name={name}"),
            format!("--array=0-{}", tasks.saturating_sub(1)),
        ]);
        let mut jobs: Vec<&str> =
            after.iter().filter_map(|t| self.jobs.get(&t.id)).map(String::as_str).collect();
        jobs.sort_unstable();
        jobs.dedup();
        if !jobs.is_empty() {
            arguments.push(format!("--dependency=afterany:{}", jobs.join(":")));
        }
        arguments.push(format!("{FOLDER}/{name}.sh"));
        let output = self.command("sbatch", &arguments, &environment::of_script(text))?;
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let job = text.trim().split(';').next().unwrap_or_default().to_owned();
        if output.status.success() && !job.is_empty() {
            self.jobs.insert(name.to_owned(), job);
            return Ok(());
        }
        let why = failure("sbatch", &output);
        Err(if self.answers() { EngineError::Refused(why) } else { EngineError::NoAnswer(why) })
    }

    /// Words of the options of `sbatch`.
    fn options(&self) -> Vec<String> {
        self.setup.options.iter().flat_map(|option| words_of(option)).collect()
    }

    /// Whether the controller answers.
    fn answers(&self) -> bool {
        self.command("scontrol", &["ping".to_owned()], &[]).is_ok_and(|done| done.status.success())
    }

    /// Output of a program of Slurm that does not inherit the variables `without`.
    fn command(
        &self,
        program: &str,
        arguments: &[String],
        without: &[&str],
    ) -> Result<Output, EngineError> {
        let mut command = Command::new(program);
        environment::hiding().iter().for_each(|variable| _ = command.env_remove(variable));
        without.iter().for_each(|variable| _ = command.env_remove(variable));
        command.env_remove(environment::SBATCH_CLUSTERS);
        let variable = |name: &str| std::env::var(name).ok();
        if let Some(clusters) = environment::clusters(&self.options(), variable) {
            command.env(environment::CLUSTERS, clusters);
        }
        let done =
            command.args(arguments).current_dir(&self.setup.study).stdin(Stdio::null()).output();
        done.map_err(|source| StudyError::Start { path: program.into(), source }.into())
    }

    /// Names of the arrays of tickets.
    fn names(tickets: &[Ticket]) -> Vec<String> {
        let mut names: Vec<String> = tickets.iter().map(|t| t.id.clone()).collect();
        names.sort_unstable();
        names.dedup();
        names
    }
}

impl Runner for Slurm {
    fn name(&self) -> &'static str {
        "slurm"
    }

    fn free(&self) -> usize {
        usize::MAX
    }

    fn orders_dependents(&self) -> bool {
        true
    }

    fn outlives(&self) -> bool {
        true
    }

    fn interval(&self) -> Duration {
        POLL_INTERVAL
    }

    fn arrange(&self, groups: &mut [Group]) {
        let memory = |group: &Group| group.memory_mb.unwrap_or(0.0);
        groups.sort_by(|a, b| memory(a).total_cmp(&memory(b)));
    }

    fn submit(
        &mut self,
        groups: &[Group],
        after: &[Ticket],
        record: Record<'_>,
    ) -> Result<Vec<Ticket>, EngineError> {
        if let Some(ticket) = after.iter().find(|ticket| !self.jobs.contains_key(&ticket.id)) {
            return Err(EngineError::NoAnswer(format!(
                "the job of {} is not known yet",
                ticket.id
            )));
        }
        let mut tickets = Vec::new();
        for (k, array) in arrays(groups).into_iter().enumerate() {
            let before = tickets.len();
            let name = self.new_name(k);
            let text = self.script(&name, array);
            self.write(&name, &text)?;
            tickets.extend((0..array.len()).map(|task| Ticket { id: name.clone(), task }));
            record(&tickets)?;
            if let Err(error) = self.submit_array(&name, array.len(), &text, after) {
                if matches!(error, EngineError::Refused(_)) {
                    // Its tickets do not exist.
                    tickets.truncate(before);
                    record(&tickets)?;
                }
                return Err(error);
            }
        }
        Ok(tickets)
    }

    fn poll(&mut self, tickets: &[Ticket]) -> Result<Vec<TicketState>, EngineError> {
        if tickets.is_empty() {
            return Ok(Vec::new());
        }
        let names = Self::names(tickets).join(",");
        let arguments = ["-a", "-h", "-r", "-t", "all", "-o", "%F|%K|%T|%j|%r", "-n", &names];
        let output = self.command("squeue", &arguments.map(str::to_owned), &[])?;
        if !output.status.success() {
            return Err(EngineError::NoAnswer(failure("squeue", &output)));
        }
        let mut found: HashMap<(String, usize), TicketState> = HashMap::new();
        for line in String::from_utf8_lossy(&output.stdout).lines() {
            let cells: Vec<&str> = line.trim().split('|').collect();
            let [job, task, state, name, reason] = cells[..] else { continue };
            let Ok(task) = task.parse() else { continue };
            self.jobs.insert(name.to_owned(), job.to_owned());
            found.insert((name.to_owned(), task), state_of(state, reason));
        }
        let state = |t: &Ticket| found.get(&(t.id.clone(), t.task)).cloned();
        Ok(tickets.iter().map(|t| state(t).unwrap_or(TicketState::Gone)).collect())
    }

    fn cancel(&mut self, tickets: &[Ticket]) -> Result<(), EngineError> {
        // Tasks whose job is known are ended one by one, so that others of their array go on.
        let job = |t: &Ticket| self.jobs.get(&t.id).map(|job| format!("{job}_{}", t.task));
        let known: Option<Vec<String>> = tickets.iter().map(job).collect();
        let arguments = match known {
            Some(tasks) if !tasks.is_empty() => tasks,
            _ => Self::names(tickets).into_iter().map(|name| format!("--name={name}")).collect(),
        };
        let mut first = None;
        for arguments in arguments.chunks(TASKS_MAX) {
            // A name is an option of its own call.
            let calls: Vec<&[String]> = if arguments[0].starts_with("--") {
                arguments.chunks(1).collect()
            } else {
                vec![arguments]
            };
            for call in calls {
                let output = self.command("scancel", call, &[])?;
                if !output.status.success() {
                    first.get_or_insert_with(|| failure("scancel", &output));
                }
            }
        }
        first.map_or(Ok(()), |why| Err(EngineError::NoAnswer(why)))
    }

    fn emit(&self, groups: &[Group]) -> String {
        let mut groups = groups.to_vec();
        self.arrange(&mut groups);
        let script = |(k, array): (usize, &[Group])| self.script(&self.new_name(k), array);
        arrays(&groups).into_iter().enumerate().map(script).collect()
    }
}

/// Arranged groups by the array that they are tasks of: those of similar memory, and at most [`TASKS_MAX`].
fn arrays(groups: &[Group]) -> Vec<&[Group]> {
    let mut arrays = Vec::new();
    let mut start = 0;
    for k in 1..=groups.len() {
        let fits = groups.get(k).is_some_and(|group| is_similar(&groups[start], group));
        if !fits || k - start == TASKS_MAX {
            arrays.push(&groups[start..k]);
            start = k;
        }
    }
    arrays
}

/// Whether a group may be in an array whose smallest is `smallest`.
fn is_similar(smallest: &Group, group: &Group) -> bool {
    match (smallest.memory_mb, group.memory_mb) {
        (Some(least), Some(own)) => own <= MEMORY_RATIO_MAX * least,
        // A group without estimate gets what the cluster gives by default.
        (least, own) => least == own,
    }
}

/// Words of an option, as in a script; an option that cannot be split is one word.
fn words_of(option: &str) -> Vec<String> {
    split(option).unwrap_or_else(|| vec![option.to_owned()])
}

/// Folders of a group's cases in a line.
fn task_line(group: &Group) -> String {
    let folders: Vec<String> = group.cases.iter().map(|case| format!("cases/{case}")).collect();
    folders.join(" ") + "\n"
}

/// State of a task that `squeue` lists.
fn state_of(state: &str, reason: &str) -> TicketState {
    match state {
        "PENDING" => {
            let usual = ["None", "Priority", "Resources", "Dependency", "BeginTime", "Cleaning"];
            TicketState::Waiting((!usual.contains(&reason)).then(|| reason.to_owned()))
        }
        "CONFIGURING" | "REQUEUED" | "REQUEUE_HOLD" | "REQUEUE_FED" | "RESV_DEL_HOLD"
        | "SPECIAL_EXIT" | "SUSPENDED" => TicketState::Waiting(Some(state.to_lowercase())),
        "RUNNING" | "COMPLETING" | "RESIZING" | "SIGNALING" | "STAGE_OUT" | "STOPPED" => {
            TicketState::Running
        }
        _ => TicketState::Ended {
            reason: format!("Slurm says {state}"),
            // Ended by a person: it is not submitted again behind their back.
            retry: !state.starts_with("CANCELLED"),
        },
    }
}

/// Why a program of Slurm failed, in words.
fn failure(program: &str, output: &Output) -> String {
    let errors = String::from_utf8_lossy(&output.stderr);
    format!("{program}: {}", errors.trim().replace('\n', " "))
}

#[cfg(test)]
mod tests;
