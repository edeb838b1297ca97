//! Processes of a study: each is asked to end where the study is, and one that an earlier study left behind gives way.

use std::io::{self, Read};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::Duration;

use crate::cancel::Cancel;
use crate::run::lock;
use crate::run::resources::alive;

/// Between two looks at the process.
const PAUSE: Duration = Duration::from_millis(50);
/// Bytes of what a process says that are kept.
const SAID_BYTES: u64 = 1 << 16;

/// Runs `command` to its end; what it says on standard error comes back. When `stop` is set it is asked to end (the solver
/// then leaves a checkpoint) and waited for. Its standard input stays open as long as this process lives.
///
/// # Errors
/// What the system says when the program cannot be started or waited for.
pub(super) fn run(command: &mut Command, stop: &Cancel) -> io::Result<(ExitStatus, String)> {
    command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
    // What a terminal sends to the study is not for its solvers: those are asked to end.
    own_group(command);
    let mut child = command.spawn()?;
    let _open = child.stdin.take();
    let mut pipe = child.stderr.take();
    let said = thread::spawn(move || {
        let mut said = Vec::new();
        // What was said until the pipe broke is what there is to tell.
        let _ = pipe.as_mut().map(|p| p.take(SAID_BYTES).read_to_end(&mut said));
        let _ = pipe.map(|mut p| io::copy(&mut p, &mut io::sink()));
        said
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
        thread::sleep(PAUSE);
    };
    let said = said.join().unwrap_or_default();
    Ok((status, String::from_utf8_lossy(&said).trim().replace('\n', " ")))
}

/// Waits until no solver works in the folder `run`; one of this machine is asked to end, so that it leaves a checkpoint.
/// Gives the reason where the folder cannot be had.
pub(super) fn wait_for(run: &Path, stop: &Cancel, say: &dyn Fn(&str)) -> Option<String> {
    let mut asked = None;
    while let Some(holder) = lock::holder(&lock::file_in(run)) {
        let who = lock::process_text(holder.as_ref());
        if stop.is_requested() {
            return Some(format!("{who} still works in {}", run.display()));
        }
        if let Some(process) = holder {
            match alive(&process) {
                None if !process.host.is_empty() => {
                    return Some(format!(
                        "{who} works in {}; wait for it, or end it there, and give the command again",
                        run.display()
                    ));
                }
                // The name of one that is gone, until the one that works there has written its own.
                Some(false) => {}
                _ if asked == Some(process.id) => {}
                _ => {
                    say(&format!("{who} still works in its folder: asked to end, waited for"));
                    // Where it cannot be asked it is waited for all the same.
                    let _ = ask_to_end(process.id);
                    asked = Some(process.id);
                }
            }
        }
        thread::sleep(PAUSE);
    }
    None
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
    ask_to_end(child.id())
}

/// Where there is no signal to ask with, the last checkpoint is what the run goes on from.
#[cfg(not(unix))]
fn end(child: &mut Child) -> io::Result<()> {
    child.kill()
}

#[cfg(unix)]
fn ask_to_end(process: u32) -> io::Result<()> {
    use rustix::process::{Pid, Signal, kill_process};
    let pid = i32::try_from(process).ok().and_then(Pid::from_raw);
    pid.map_or(Ok(()), |pid| kill_process(pid, Signal::TERM)).map_err(io::Error::from)
}

#[cfg(not(unix))]
fn ask_to_end(_: u32) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_and_how_it_ended_come_back() {
        let stop = Cancel::default();
        let mut command = Command::new("sh");
        command.args(["-c", "echo far >&2; echo away >&2; exit 3"]);
        let (status, said) = run(&mut command, &stop).unwrap();
        assert_eq!((status.code(), said.as_str()), (Some(3), "far away"));
    }

    #[test]
    fn a_process_is_asked_to_end_when_the_study_is() {
        let stop = Cancel::default();
        stop.request();
        let mut command = Command::new("sh");
        command.args(["-c", "trap 'kill $!; exit 5' TERM; sleep 60 2>/dev/null & wait"]);
        let (status, _) = run(&mut command, &stop).unwrap();
        // Left alone it ends with 0; asked before its trap was set, by the signal itself.
        assert!(status.code().is_none_or(|code| code == 5), "{status}");
    }
}
