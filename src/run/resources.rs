//! Resources used by a process, and whether it is alive, from `/proc`.

use std::time::Instant;

use kanagata_files::read_system;
use kanagata_report::record::Process;

/// Wall and processor time since the start of a run.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    start: Instant,
    cpu_s: f64,
}

impl Clock {
    /// Starts now.
    #[must_use]
    pub fn start() -> Self {
        Self { start: Instant::now(), cpu_s: cpu_seconds() }
    }

    /// Wall time [s].
    #[must_use]
    pub fn wall_s(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// Processor time of all threads of this process [s].
    #[must_use]
    pub fn cpu_s(&self) -> f64 {
        cpu_seconds() - self.cpu_s
    }
}

/// Processor time of all threads of this process [s]; 0 if the system does not report it.
#[must_use]
pub fn cpu_seconds() -> f64 {
    // Fields 14 and 15 of /proc/self/stat, counted after the closing bracket of the command, in ticks of 1/100 s.
    let ticks = || -> Option<f64> {
        let stat = read_system("/proc/self/stat").ok()?;
        let mut fields = stat.rsplit_once(')')?.1.split_ascii_whitespace();
        let user: f64 = fields.nth(11)?.parse().ok()?;
        let system: f64 = fields.next()?.parse().ok()?;
        Some(user + system)
    };
    ticks().map_or(0.0, |t| t / 100.0)
}

/// This process; `None` if the system does not identify it in `/proc`.
#[must_use]
pub fn this_process() -> Option<Process> {
    identity(std::process::id())
}

/// The process `id` of this machine; `None` if there is none or the system does not identify it in `/proc`.
#[must_use]
pub fn identity(id: u32) -> Option<Process> {
    Some(Process { id, started: started(id)?, host: host()? })
}

/// Whether a process is alive; `None` for another host, or if the system does not report it.
#[must_use]
pub fn alive(process: &Process) -> Option<bool> {
    is_here(&host()?, &process.host).then(|| started(process.id) == Some(process.started))
}

/// Whether `recorded` is the host `here`. Records of version 0.2.0 do not name the process-id namespace.
fn is_here(here: &str, recorded: &str) -> bool {
    let without_namespace = here.rsplit_once(' ').map(|(machine, _)| machine);
    recorded == here || Some(recorded) == without_namespace
}

/// Start time of a process in clock ticks since boot: field 22 of its stat. A zombie counts as ended.
fn started(id: u32) -> Option<u64> {
    let stat = read_system(&format!("/proc/{id}/stat")).ok()?;
    let mut fields = stat.rsplit_once(')')?.1.split_ascii_whitespace();
    let state = fields.next()?;
    if matches!(state, "Z" | "X") {
        return None;
    }
    fields.nth(18)?.parse().ok()
}

/// Host name and boot id of the machine, and the namespace of the process ids: containers may share the first two.
///
/// `None` if `/proc` belongs to another namespace, where the same ids are those of other processes.
fn host() -> Option<String> {
    let read = |file: &str| read_system(&format!("/proc/sys/kernel/{file}")).ok();
    let itself = std::fs::read_link("/proc/self").ok()?;
    if itself.to_str()? != std::process::id().to_string() {
        return None;
    }
    let (name, boot) = (read("hostname")?, read("random/boot_id")?);
    let namespace = std::fs::read_link("/proc/self/ns/pid");
    let namespace = namespace.map_or_else(|_| "pid:".into(), |link| link.display().to_string());
    Some(format!("{} {} {namespace}", name.trim(), boot.trim()))
}

/// Peak memory of this process [MB]; 0 if the system does not report it.
#[must_use]
pub fn peak_megabytes() -> f64 {
    let peak = || -> Option<f64> {
        let status = read_system("/proc/self/status").ok()?;
        let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
        line.split_ascii_whitespace().nth(1)?.parse().ok()
    };
    peak().map_or(0.0, |kilobytes: f64| kilobytes / 1024.0)
}

/// Memory available to this process [MB]: that of the machine, or the limit of its address space if smaller. `None` if
/// the system does not report it.
#[must_use]
pub fn memory_limit_megabytes() -> Option<f64> {
    let all = || -> Option<f64> {
        let text = kanagata_files::read_system("/proc/meminfo").ok()?;
        let line = text.lines().find(|l| l.starts_with("MemTotal:"))?;
        line.split_ascii_whitespace().nth(1)?.parse().ok()
    };
    let machine = all().map(|kilobytes: f64| kilobytes / 1024.0);
    #[cfg(unix)]
    let space = rustix::process::getrlimit(rustix::process::Resource::As)
        .current
        .map(|bytes| bytes as f64 / 1048576.0);
    #[cfg(not(unix))]
    let space: Option<f64> = None;
    machine.into_iter().chain(space).reduce(f64::min)
}

#[cfg(test)]
mod tests {
    #[cfg(target_os = "linux")]
    #[test]
    fn the_system_reports_resources() {
        let spent: f64 = (0..20_000_000).map(|k| f64::from(k).sqrt()).sum();
        assert!(spent > 0.0 && super::cpu_seconds() > 0.0);
        assert!(super::peak_megabytes() > 1.0);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_process_lives_until_it_has_ended() {
        let mut child = std::process::Command::new("sleep").arg("60").spawn().unwrap();
        let host = super::host().unwrap();
        let process =
            super::Process { id: child.id(), started: super::started(child.id()).unwrap(), host };
        assert_eq!(super::alive(&process), Some(true));
        child.kill().unwrap();
        child.wait().unwrap();
        assert_eq!(super::alive(&process), Some(false));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_host_is_a_machine_since_its_start_and_a_namespace() {
        let own = super::this_process().unwrap();
        let words: Vec<&str> = own.host.split(' ').collect();
        assert!(words.len() == 3 && words[2].starts_with("pid:"), "{words:?}");
        let of = |host: &str| super::Process { host: host.into(), ..own.clone() };
        assert_eq!(super::alive(&of(&words[..2].join(" "))), Some(true), "version 0.2.0");
        assert_eq!(super::alive(&of(&format!("{} {} pid:[1]", words[0], words[1]))), None);
        assert_eq!(super::alive(&of(&format!("other {} {}", words[1], words[2]))), None);
        assert_eq!(super::alive(&of("")), None);
    }
}
