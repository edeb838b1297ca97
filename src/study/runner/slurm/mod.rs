//! Slurm: every submission is a job array with a name of its own, by which it is found again. Job ids alone do not do: a
//! controller that is killed after a submission may forget it and give its id to the next one. With several clusters an id
//! is that of one of them: tickets keep the cluster, and every program is asked for it by name.
//!
//! - `options`: what a user adds; `environment`: variables that programs of Slurm must not inherit
//! - `script`: the script of an array; `queue`: what `squeue` lists

mod environment;
mod options;
mod queue;
mod script;

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, SystemTime};

pub use self::options::Options;
pub use self::script::Setup;
use self::script::{FOLDER, Script};
use super::tickets::Ticket;
use super::{EngineError, Group, Record, Runner, TicketState};
use crate::StudyError;
use kanagata_files::{sha256_hex, write_atomic};

/// Interval between questions [s]: a controller serves many users, and a task lasts at least minutes.
const POLL_INTERVAL: Duration = Duration::from_secs(2);
/// Largest number of tasks of an array, one less than the default of Slurm's `MaxArraySize`.
const TASKS_MAX: usize = 1000;
/// Largest over smallest expected memory of the tasks of an array, which all get what the largest needs: at most half of
/// the memory that a task holds is unused.
const MEMORY_RATIO_MAX: f64 = 2.0;
/// The name that stands for all clusters.
const ALL: &str = "all";

/// A job that Slurm has accepted.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Job {
    /// Its id.
    id: String,
    /// The cluster that has it; `None` for that of the configuration.
    cluster: Option<String>,
}

/// Submits groups as job arrays.
pub struct Slurm {
    setup: Setup,
    /// Jobs of arrays by name, as far as known.
    jobs: HashMap<String, Job>,
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

    /// Clusters that are asked for: those of the options, else those of the environment.
    fn asked_clusters(&self) -> Option<String> {
        environment::clusters(&self.setup.options, |name| std::env::var(name).ok())
    }

    /// Clusters to submit an array to that starts after `after`. Slurm orders tasks of one cluster only: it is that of
    /// `after`; else, of the clusters that are asked for, that of all known jobs, for which later cases may have to wait.
    fn clusters(&self, after: &[Ticket]) -> Result<Option<String>, EngineError> {
        let mut leaders = BTreeSet::new();
        for ticket in after {
            leaders.insert(&self.job(ticket)?.cluster);
        }
        if leaders.len() > 1 {
            let names =
                leaders.into_iter().map(|name| name.as_deref().unwrap_or("the default one"));
            let names = names.collect::<Vec<_>>().join(", ");
            return Err(EngineError::Refused(format!(
                "cases follow others on several clusters ({names}), and Slurm orders tasks of one only; they can be submitted when those have ended"
            )));
        }
        if let Some(leader) = leaders.into_iter().next() {
            return Ok(leader.clone());
        }
        let asked = self.asked_clusters();
        let known: BTreeSet<&String> =
            self.jobs.values().filter_map(|job| job.cluster.as_ref()).collect();
        let includes = |name: &&String| {
            asked.iter().flat_map(|a| a.split(',')).any(|a| a == *name || a == ALL)
        };
        let mut known = known.into_iter().filter(includes);
        Ok(match (known.next(), known.next()) {
            (Some(one), None) => Some(one.clone()),
            _ => asked,
        })
    }

    /// The job of a ticket.
    fn job(&self, ticket: &Ticket) -> Result<&Job, EngineError> {
        let unknown =
            || EngineError::NoAnswer(format!("the job of {} is not known yet", ticket.id));
        self.jobs.get(&ticket.id).ok_or_else(unknown)
    }

    /// Writes the script of an array.
    fn write(&self, name: &str, text: &str) -> Result<(), StudyError> {
        let folder = self.setup.study.join(FOLDER);
        std::fs::create_dir_all(&folder)
            .map_err(|source| StudyError::Folder { path: folder.clone(), source })?;
        write_atomic(&folder.join(format!("{name}.sh")), |w| w.write_all(text.as_bytes()))?;
        Ok(())
    }

    /// Submits an array with a written script to `clusters`; it starts after `after`. Returns the cluster that has it.
    fn submit_array(
        &mut self,
        name: &str,
        script: &Script,
        tasks: usize,
        clusters: Option<&str>,
        after: &[Ticket],
    ) -> Result<Option<String>, EngineError> {
        // sbatch takes an option from its command line, else from the environment, else from the script.
        let mut arguments = self.setup.options.arguments();
        arguments.extend([
            "--parsable".to_owned(),
            format!("--job-name={name}"),
            format!("--array=0-{}", tasks.saturating_sub(1)),
        ]);
        arguments.extend(clusters.map(|clusters| format!("--clusters={clusters}")));
        let leaders: BTreeSet<&str> =
            after.iter().filter_map(|t| self.jobs.get(&t.id)).map(|job| job.id.as_str()).collect();
        if !leaders.is_empty() {
            let leaders = leaders.into_iter().collect::<Vec<_>>().join(":");
            arguments.push(format!("--dependency=afterany:{leaders}"));
        }
        arguments.push(format!("{FOLDER}/{name}.sh"));
        let output = self.command("sbatch", &arguments, &environment::replacing(&script.asks))?;
        if let Some(mut job) = submitted(&output) {
            job.cluster = job.cluster.or_else(|| clusters.map(str::to_owned));
            let cluster = job.cluster.clone();
            self.jobs.insert(name.to_owned(), job);
            return Ok(cluster);
        }
        let why = failure("sbatch", &output);
        Err(if self.answers(clusters) {
            EngineError::Refused(why)
        } else {
            EngineError::NoAnswer(why)
        })
    }

    /// Whether the controllers of all `clusters` answer.
    fn answers(&self, clusters: Option<&str>) -> bool {
        let names: Vec<Option<&str>> = match clusters {
            None | Some(ALL) => vec![None],
            Some(list) => list.split(',').map(Some).collect(),
        };
        let answers = |name: &Option<&str>| {
            let arguments = [of_cluster(*name), vec!["ping".to_owned()]].concat();
            self.command("scontrol", &arguments, &[]).is_ok_and(|done| done.status.success())
        };
        names.iter().all(answers)
    }

    /// Output of a program of Slurm that does not inherit the variables `without`. Clusters are named by arguments.
    fn command(
        &self,
        program: &str,
        arguments: &[String],
        without: &[&str],
    ) -> Result<Output, EngineError> {
        let mut command = Command::new(program);
        environment::hiding().iter().for_each(|variable| _ = command.env_remove(variable));
        let without = without.iter().chain(&environment::CLUSTERS);
        without.for_each(|variable| _ = command.env_remove(variable));
        let done =
            command.args(arguments).current_dir(&self.setup.study).stdin(Stdio::null()).output();
        done.map_err(|source| StudyError::Start { path: program.into(), source }.into())
    }

    /// Names of the arrays of tickets, by the clusters of which one has them.
    fn names(&self, tickets: &[Ticket]) -> BTreeMap<Option<String>, BTreeSet<String>> {
        let mut names: BTreeMap<_, BTreeSet<String>> = BTreeMap::new();
        for ticket in tickets {
            let known = self.jobs.get(&ticket.id).map(|job| &job.cluster);
            let clusters = known.unwrap_or(&ticket.cluster).clone();
            names.entry(clusters).or_default().insert(ticket.id.clone());
        }
        names
    }
}

impl Runner for Slurm {
    fn name(&self) -> &'static str {
        "slurm"
    }

    fn orders_dependents(&self) -> bool {
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
        let mut tickets = Vec::new();
        for (k, array) in arrays(groups).into_iter().enumerate() {
            let (before, name) = (tickets.len(), self.new_name(k));
            let clusters = self.clusters(after)?;
            let script = Script::new(&self.setup, &name, clusters.as_deref(), array);
            self.write(&name, &script.text)?;
            let ticket = |task| Ticket { id: name.clone(), task, cluster: clusters.clone() };
            tickets.extend((0..array.len()).map(ticket));
            record(&tickets)?;
            match self.submit_array(&name, &script, array.len(), clusters.as_deref(), after) {
                Ok(cluster) if cluster != clusters => {
                    tickets[before..].iter_mut().for_each(|t| t.cluster.clone_from(&cluster));
                    record(&tickets)?;
                }
                Ok(_) => {}
                Err(error) => {
                    if matches!(error, EngineError::Refused(_)) {
                        // Its tickets do not exist.
                        tickets.truncate(before);
                        record(&tickets)?;
                    }
                    return Err(error);
                }
            }
        }
        Ok(tickets)
    }

    fn poll(&mut self, tickets: &[Ticket]) -> Result<Vec<TicketState>, EngineError> {
        let mut found: HashMap<(String, usize), TicketState> = HashMap::new();
        for (clusters, names) in self.names(tickets) {
            let names = names.into_iter().collect::<Vec<_>>().join(",");
            let fixed = ["-a", "-r", "-t", "all", "-o", queue::FORMAT, "-n", &names];
            let arguments =
                [of_cluster(clusters.as_deref()), fixed.map(str::to_owned).into()].concat();
            let output = self.command("squeue", &arguments, &[])?;
            if !output.status.success() {
                return Err(EngineError::NoAnswer(failure("squeue", &output)));
            }
            let text = String::from_utf8_lossy(&output.stdout);
            for listed in queue::listed(&text, clusters.as_deref()) {
                let job = Job { id: listed.job, cluster: listed.cluster };
                self.jobs.insert(listed.name.clone(), job);
                found.insert((listed.name, listed.task), listed.state);
            }
        }
        let state = |t: &Ticket| found.get(&(t.id.clone(), t.task)).cloned();
        Ok(tickets.iter().map(|t| state(t).unwrap_or(TicketState::Gone)).collect())
    }

    fn cancel(&mut self, tickets: &[Ticket]) -> Result<(), EngineError> {
        let mut tasks: BTreeMap<Option<String>, Vec<String>> = BTreeMap::new();
        let mut first = None;
        for ticket in tickets {
            // Tasks are ended one by one: others of their array are not affected.
            match self.job(ticket) {
                Ok(job) => {
                    let task = format!("{}_{}", job.id, ticket.task);
                    tasks.entry(job.cluster.clone()).or_default().push(task);
                }
                Err(error) => _ = first.get_or_insert(error),
            }
        }
        for (cluster, tasks) in &tasks {
            for tasks in tasks.chunks(TASKS_MAX) {
                let arguments = [&of_cluster(cluster.as_deref())[..], tasks].concat();
                let output = self.command("scancel", &arguments, &[])?;
                if !output.status.success() {
                    let why = failure("scancel", &output);
                    first.get_or_insert(EngineError::NoAnswer(why));
                }
            }
        }
        first.map_or(Ok(()), Err)
    }

    fn emit(&self, groups: &[Group]) -> String {
        let mut groups = groups.to_vec();
        self.arrange(&mut groups);
        let clusters = self.asked_clusters();
        let script = |(k, array): (usize, &[Group])| {
            Script::new(&self.setup, &self.new_name(k), clusters.as_deref(), array).text
        };
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

/// Arguments that have a program of Slurm work with clusters.
fn of_cluster(clusters: Option<&str>) -> Vec<String> {
    clusters.map_or_else(Vec::new, |clusters| vec!["-M".into(), clusters.into()])
}

/// The job that `sbatch --parsable` has submitted: `ID`, or `ID;CLUSTER` where clusters are named.
fn submitted(output: &Output) -> Option<Job> {
    let text = String::from_utf8_lossy(&output.stdout);
    let line = text.lines().rev().find(|line| !line.trim().is_empty())?.trim();
    let (id, cluster) = line.split_once(';').unwrap_or((line, ""));
    let cluster = Some(cluster.to_owned()).filter(|name| !name.is_empty());
    let is_number = !id.is_empty() && id.bytes().all(|b| b.is_ascii_digit());
    (is_number && output.status.success()).then(|| Job { id: id.to_owned(), cluster })
}

/// Why a program of Slurm failed, in words.
fn failure(program: &str, output: &Output) -> String {
    let errors = String::from_utf8_lossy(&output.stderr);
    let text =
        if errors.trim().is_empty() { String::from_utf8_lossy(&output.stdout) } else { errors };
    format!("{program}: {}", text.trim().replace('\n', " "))
}

#[cfg(test)]
mod tests;
