//! Solver processes of a study. They are asked to stop with the study; a process left by an earlier study is stopped
//! first.

use std::io::{self, Read};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::Duration;

use crate::cancel::Cancel;
use crate::run::lock::{self, Place, host_name};

/// Interval between checks of a process.
const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Largest number of bytes of standard error that are kept.
const STDERR_BYTES_MAX: u64 = 1 << 16;

/// Runs `command` to its end and returns its standard error. When `stop` is requested, the process is asked to stop (the
/// solver saves a checkpoint) and waited for. Its standard input remains open as long as this process lives.
///
/// # Errors
/// Errors of the system when the program cannot be started or waited for.
pub(super) fn run(command: &mut Command, stop: &Cancel) -> io::Result<(ExitStatus, String)> {
    command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
    // Its own process group: terminal signals reach only the study, which asks its solvers to stop.
    own_group(command);
    let mut child = command.spawn()?;
    let _open = child.stdin.take();
    let mut pipe = child.stderr.take();
    let output = thread::spawn(move || {
        let mut output = Vec::new();
        // Output until the pipe breaks is kept.
        let _ = pipe.as_mut().map(|p| p.take(STDERR_BYTES_MAX).read_to_end(&mut output));
        let _ = pipe.map(|mut p| io::copy(&mut p, &mut io::sink()));
        output
    });
    let mut asked = false;
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        if stop.is_requested() && !asked {
            end(&mut child)?;
            asked = true;
        }
        thread::sleep(POLL_INTERVAL);
    };
    let output = output.join().unwrap_or_default();
    Ok((status, String::from_utf8_lossy(&output).trim().replace('\n', " ")))
}

/// Waits until no solver works in the folder `run`. A solver on this host is asked to stop, so that it saves a
/// checkpoint. Returns the reason if the folder remains in use: a solver on another host cannot be asked.
pub(super) fn wait_for(run: &Path, stop: &Cancel, say: &dyn Fn(&str)) -> Option<String> {
    let mut asked = None;
    let file = lock::file_in(run);
    loop {
        let holder = match lock::holder(&file) {
            Ok(Some(holder)) => holder,
            Ok(None) => return None,
            Err(error) => return Some(format!("cannot read {}: {error}", file.display())),
        };
        if stop.is_requested() {
            return Some(format!("{holder} still works in {}", run.display()));
        }
        match (&holder.process, holder.place) {
            (Some(process), Place::Elsewhere { .. }) if host_name(process).is_some() => {
                let (run, remedy) = (run.display(), holder.remedy());
                return Some(format!("{holder} works in {run}; {remedy}; then repeat the command"));
            }
            (Some(process), Place::Here | Place::Elsewhere { .. }) if asked != Some(process.id) => {
                say(&format!("{holder} still works in its folder: asked to end, waited for"));
                // A process that cannot be asked is waited for as well.
                let _ = request_stop(process.id);
                asked = Some(process.id);
            }
            _ => {}
        }
        thread::sleep(POLL_INTERVAL);
    }
}

#[cfg(unix)]
fn own_group(command: &mut Command) {
    use std::os::unix::process::CommandExt as _;
    command.process_group(0);
}

#[cfg(not(unix))]
fn own_group(_: &mut Command) {}

#[cfg(unix)]
fn end(child: &mut Child) -> io::Result<()> {
    request_stop(child.id())
}

/// Without signals, the run continues from its last checkpoint.
#[cfg(not(unix))]
fn end(child: &mut Child) -> io::Result<()> {
    child.kill()
}

#[cfg(unix)]
fn request_stop(process: u32) -> io::Result<()> {
    use rustix::process::{Pid, Signal, kill_process};
    let pid = i32::try_from(process).ok().and_then(Pid::from_raw);
    pid.map_or(Ok(()), |pid| kill_process(pid, Signal::TERM)).map_err(io::Error::from)
}

#[cfg(not(unix))]
fn request_stop(_: u32) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn output_and_status_are_returned() {
        let stop = Cancel::default();
        let mut command = Command::new("sh");
        command.args(["-c", "echo far >&2; echo away >&2; exit 3"]);
        let (status, output) = run(&mut command, &stop).unwrap();
        assert_eq!((status.code(), output.as_str()), (Some(3), "far away"));
    }

    #[test]
    fn a_process_is_asked_to_end_when_the_study_is() {
        let stop = Cancel::default();
        stop.request();
        let mut command = Command::new("sh");
        command.args(["-c", "trap 'kill $!; exit 5' TERM; sleep 60 2>/dev/null & wait"]);
        let (status, _) = run(&mut command, &stop).unwrap();
        // Undisturbed it ends with 0; asked before its trap is set, by the signal itself.
        assert!(status.code().is_none_or(|code| code == 5), "{status}");
    }
}
