//! What a process has used: processor time and memory, as the system counts them.

/// Processor time of all threads since the process began [s]; 0 where the system does not say.
#[must_use]
pub fn cpu_seconds() -> f64 {
    // Fields 14 and 15 of /proc/self/stat, counted behind the command's closing bracket, in ticks of 1/100 s.
    let ticks = || -> Option<f64> {
        let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
        let mut fields = stat.rsplit_once(')')?.1.split_ascii_whitespace();
        let user: f64 = fields.nth(11)?.parse().ok()?;
        let system: f64 = fields.next()?.parse().ok()?;
        Some(user + system)
    };
    ticks().map_or(0.0, |t| t / 100.0)
}

/// Largest memory the process has held [MB]; 0 where the system does not say.
#[must_use]
pub fn peak_megabytes() -> f64 {
    let peak = || -> Option<f64> {
        let status = std::fs::read_to_string("/proc/self/status").ok()?;
        let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
        line.split_ascii_whitespace().nth(1)?.parse().ok()
    };
    peak().map_or(0.0, |kilobytes: f64| kilobytes / 1024.0)
}

#[cfg(test)]
mod tests {
    #[cfg(target_os = "linux")]
    #[test]
    fn the_system_says_what_was_used() {
        let spent: f64 = (0..20_000_000).map(|k| f64::from(k).sqrt()).sum();
        assert!(spent > 0.0 && super::cpu_seconds() > 0.0);
        assert!(super::peak_megabytes() > 1.0);
    }
}
