//! The process named in a lock file.

use crate::resources::this_process;
use kanagata_files::random;
use kanagata_report::record::Process;

/// This process. Without `/proc` its host is empty, and a random number stands for its start time.
pub(super) fn own() -> Process {
    this_process().unwrap_or_else(|| Process {
        id: std::process::id(),
        started: random(),
        host: String::new(),
    })
}

/// The process named in the content of a lock file; `None` for an empty or foreign file.
pub(super) fn parse(text: &[u8]) -> Option<Process> {
    serde_json::from_slice(text).ok()
}

/// Whether the holder refreshes its lock file: version 0.2.0 does not, and names no namespace of process ids.
pub(super) fn has_heartbeat(process: &Process) -> bool {
    process.host.split(' ').count() != 2
}

/// Name of the host of a process; `None` if it was not identified.
#[must_use]
pub fn host_name(process: &Process) -> Option<&str> {
    process.host.split(' ').next().filter(|name| !name.is_empty())
}

/// A process in words.
#[must_use]
pub fn process_text(process: Option<&Process>) -> String {
    match process {
        Some(p) => match host_name(p) {
            Some(host) => format!("process {} on {host}", p.id),
            None => format!("process {}", p.id),
        },
        None => "another process".into(),
    }
}
