//! What `squeue` lists.

use crate::runner::TicketState;

/// Columns of a task: job, index, state, name of the array, reason. With a line of heads the clusters are named as well.
pub(super) const FORMAT: &str = "%F|%K|%T|%j|%r";
/// State of a task of a federation that another cluster has started.
const REVOKED: &str = "REVOKED";
/// States of tasks that have ended; a task that a person has ended follows them.
const ENDED: [&str; 10] = [
    "COMPLETED",
    "FAILED",
    "TIMEOUT",
    "OUT_OF_MEMORY",
    "NODE_FAIL",
    "PREEMPTED",
    "BOOT_FAIL",
    "DEADLINE",
    "LAUNCH_FAILED",
    "RECONFIG_FAIL",
];

/// A task that `squeue` lists.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Listed {
    /// Name of its array.
    pub(super) name: String,
    /// Its index.
    pub(super) task: usize,
    /// Id of the job.
    pub(super) job: String,
    /// The cluster that has it; `None` for that of the configuration.
    pub(super) cluster: Option<String>,
    /// Its state.
    pub(super) state: TicketState,
}

/// Tasks that `squeue` lists in [`FORMAT`] when asked for `clusters`.
pub(super) fn listed(text: &str, clusters: Option<&str>) -> Vec<Listed> {
    let mut cluster = clusters.map(str::to_owned);
    let (mut tasks, mut revoked): (Vec<Listed>, Vec<Listed>) = Default::default();
    for line in text.lines().map(str::trim) {
        if let Some(name) = line.strip_prefix("CLUSTER:") {
            cluster = Some(name.trim().to_owned());
        }
        let cells: Vec<&str> = line.splitn(5, '|').collect();
        let [job, task, state, name, reason] = cells[..] else { continue };
        // The heads of the columns.
        let Ok(task) = task.parse() else { continue };
        let list = if state == REVOKED { &mut revoked } else { &mut tasks };
        list.push(Listed {
            name: name.to_owned(),
            task,
            job: job.to_owned(),
            cluster: cluster.clone(),
            state: state_of(state, reason),
        });
    }
    // A cluster that has passed a task on knows less of it than the one that has started it.
    let is_known = |other: &Listed| {
        tasks.iter().any(|known| (&known.name, known.task) == (&other.name, other.task))
    };
    revoked.retain(|other| !is_known(other));
    tasks.append(&mut revoked);
    tasks
}

/// State of a task. One in a state that is not known here has not ended: it is not submitted twice.
pub(super) fn state_of(state: &str, reason: &str) -> TicketState {
    match state {
        "PENDING" => {
            let usual = ["None", "Priority", "Resources", "Dependency", "BeginTime", "Cleaning"];
            TicketState::Waiting((!usual.contains(&reason)).then(|| reason.to_owned()))
        }
        "RUNNING" | "COMPLETING" | "RESIZING" | "SIGNALING" | "STAGE_OUT" | "STOPPED" => {
            TicketState::Running
        }
        // Ended by a person: it is not submitted again behind their back.
        _ if state.starts_with("CANCELLED") => ended(state, false),
        _ if ENDED.contains(&state) => ended(state, true),
        // CONFIGURING, REQUEUED, REQUEUE_HOLD, REQUEUE_FED, RESV_DEL_HOLD, SPECIAL_EXIT, SUSPENDED, REVOKED.
        _ => TicketState::Waiting(Some(state.to_lowercase())),
    }
}

fn ended(state: &str, retry: bool) -> TicketState {
    TicketState::Ended { reason: format!("Slurm says {state}"), retry }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_of_tasks_are_waiting_running_or_ended() {
        assert_eq!(state_of("PENDING", "Priority"), TicketState::Waiting(None));
        let never = TicketState::Waiting(Some("BadConstraints".into()));
        assert_eq!(state_of("PENDING", "BadConstraints"), never);
        assert_eq!(state_of("COMPLETING", "None"), TicketState::Running);
        let retry = |state| match state_of(state, "None") {
            TicketState::Ended { retry, .. } => Some(retry),
            _ => None,
        };
        for state in ["COMPLETED", "TIMEOUT", "OUT_OF_MEMORY", "NODE_FAIL", "PREEMPTED"] {
            assert_eq!(retry(state), Some(true), "{state}");
        }
        for state in ["CANCELLED", "CANCELLED by 0"] {
            assert_eq!(retry(state), Some(false), "{state}");
        }
        // A state of another version of Slurm.
        for state in ["REVOKED", "SUSPENDED", "EXPEDITING"] {
            assert_eq!(retry(state), None, "{state}");
        }
    }

    #[test]
    fn tasks_are_of_the_cluster_above_them() {
        let head = "ARRAY_JOB_ID|ARRAY_TASK_ID|STATE|NAME|REASON\n";
        let text = format!(
            "CLUSTER: a\n{head}101|0|REVOKED|k1|None\n101|1|REVOKED|k1|None\n\nCLUSTER: b\n{head}101|0|RUNNING|k1|None\n7|N/A|RUNNING|x|None\n"
        );
        let found = listed(&text, Some("a,b"));
        let of = |k: usize| (found[k].task, found[k].cluster.as_deref(), found[k].state.clone());
        assert_eq!(found.len(), 2, "{found:?}");
        assert_eq!(of(0), (0, Some("b"), TicketState::Running));
        assert_eq!(of(1), (1, Some("a"), TicketState::Waiting(Some("revoked".into()))));
        let one = listed(&format!("{head}5|3|PENDING|k2|a|b\n"), None);
        let state = TicketState::Waiting(Some("a|b".into()));
        let expected = Listed { name: "k2".into(), task: 3, job: "5".into(), cluster: None, state };
        assert_eq!(one, [expected]);
    }
}
