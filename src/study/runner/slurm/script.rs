//! The script of a job array.

use std::path::PathBuf;

use super::environment::is_given;
use super::options::Options;
use crate::runner::Group;
use crate::runner::template::joined;

/// Requested over expected memory: a run above its request is killed, and what is requested is kept from others.
const MEMORY_FACTOR: f64 = 1.3;
/// Requested time over the upper estimate: machines differ by a factor of two.
const TIME_FACTOR: f64 = 2.0;
/// Smallest requested time [min]: starting, reading and saving a checkpoint take part of a minute on a busy file server.
const MINUTES_MIN: f64 = 5.0;
/// Time before the limit at which a run is asked to save a checkpoint and end [s].
const SIGNAL_S: u32 = 60;
/// Folder of scripts and outputs in that of the study.
pub(super) const FOLDER: &str = "slurm";

/// How jobs are submitted.
#[derive(Debug, Clone, Default)]
pub struct Setup {
    /// Folder of the study, absolute.
    pub study: PathBuf,
    /// The solver.
    pub program: PathBuf,
    /// Options of `sbatch`.
    pub options: Options,
    /// Run cases again that did not converge.
    pub again: bool,
}

/// The script of an array.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Script {
    /// Its lines.
    pub(super) text: String,
    /// Names of the options that it has, without dashes.
    pub(super) asks: Vec<String>,
}

impl Script {
    /// The script of the array `name` on `clusters` (`None`: that of the configuration) with a task for every group.
    pub(super) fn new(setup: &Setup, name: &str, clusters: Option<&str>, groups: &[Group]) -> Self {
        let own = directives(setup, name, clusters, groups);
        let asks = own.iter().map(|(name, _)| *name).chain(setup.options.names());
        let asks = asks.map(str::to_owned).collect();
        let own = own.iter().map(|(name, value)| format!("--{name}={value}"));
        let lines: String =
            own.chain(setup.options.lines()).map(|option| format!("#SBATCH {option}\n")).collect();
        Self { text: format!("#!/bin/sh\n{lines}{}", body(setup, groups)), asks }
    }
}

/// What an array asks for, as names and values of options. What a user's options ask for is left out: `sbatch` refuses
/// several options for memory.
fn directives(
    setup: &Setup,
    name: &str,
    clusters: Option<&str>,
    groups: &[Group],
) -> Vec<(&'static str, String)> {
    let most = |of: fn(&Group) -> Option<f64>| {
        // A group without estimate gets what the cluster gives by default.
        let all: Option<Vec<f64>> = groups.iter().map(of).collect();
        all.and_then(|all| all.into_iter().reduce(f64::max))
    };
    let memory = most(|g| g.memory_mb).map(|mb| format!("{:.0}M", (MEMORY_FACTOR * mb).ceil()));
    let time = most(|g| g.seconds).map(|seconds| {
        let minutes = (TIME_FACTOR * seconds / 60.0).ceil().max(MINUTES_MIN);
        format!("{minutes:.0}")
    });
    let own = [
        ("job-name", Some(name.to_owned())),
        ("array", Some(format!("0-{}", groups.len().saturating_sub(1)))),
        ("clusters", clusters.map(str::to_owned)),
        ("cpus-per-task", Some(threads(groups).to_string())),
        ("signal", Some(format!("B:TERM@{SIGNAL_S}"))),
        ("output", Some(format!("{FOLDER}/{name}-%a.log"))),
        ("open-mode", Some("append".to_owned())),
        ("mem", memory),
        ("time", time),
    ];
    let asked = own.into_iter().filter_map(|(name, value)| Some((name, value?)));
    // The clusters are those of the options, or fewer of them.
    asked.filter(|(name, _)| *name == "clusters" || !is_given(name, &setup.options)).collect()
}

/// Threads of each run of an array.
fn threads(groups: &[Group]) -> usize {
    groups.iter().map(|g| g.threads).max().unwrap_or(1)
}

/// The commands of an array.
fn body(setup: &Setup, groups: &[Group]) -> String {
    let mut words = vec![
        setup.program.display().to_string(),
        "--threads".into(),
        threads(groups).to_string(),
        "case".into(),
    ];
    words.extend(setup.again.then(|| "--again".into()));
    let folder = joined(&[setup.study.display().to_string()]);
    let tasks: String = groups.iter().map(task_line).collect();
    format!(
        "cd {folder} || exit 4\n\
         # The folders of the task's cases.\n\
         set -- $(sed -n \"$((SLURM_ARRAY_TASK_ID + 1))p\" <<'TASKS'\n{tasks}TASKS\n)\n\
         # The solver takes the place of this shell, so that signals reach it.\n\
         exec {} \"$@\"\n",
        joined(&words)
    )
}

/// Folders of a group's cases in a line.
fn task_line(group: &Group) -> String {
    let folders: Vec<String> = group.cases.iter().map(|case| format!("cases/{case}")).collect();
    folders.join(" ") + "\n"
}
