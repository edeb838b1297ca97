//! Stop requests: SIGTERM and SIGINT.
//!
//! Work with a state to save handles the request itself ([`crate::cancel::Section`]). Otherwise, and on a second
//! request, child processes are ended, temporary files removed, and the process ends immediately with exit code 5.

use std::sync::OnceLock;

use super::exit::Exit;
use super::terminal::err;
use crate::cancel::Cancel;
use crate::files::temporary::end_all;

/// Signals within this time are one request [ms]: `timeout` and terminals signal the process and its group.
#[cfg(unix)]
const ONE_REQUEST_MS: u128 = 500;
/// Time for work that has accepted the request to report and end [ms].
#[cfg(unix)]
const GRACE_MS: u64 = 1000;

/// The stop request of this process.
pub(super) fn request() -> &'static Cancel {
    static REQUEST: OnceLock<Cancel> = OnceLock::new();
    REQUEST.get_or_init(Cancel::default)
}

/// Ends the process and its child processes.
fn end() -> ! {
    end_all();
    if request().is_complete() {
        err!("error: stopped by a signal while the report was written; the results are complete");
    } else {
        err!("error: stopped by a signal; nothing was saved");
    }
    std::process::exit(Exit::Stopped as i32);
}

/// Requests a stop as a signal does.
pub(super) fn stop() {
    request().request();
    if !request().is_heeded() {
        end();
    }
}

/// Installs the signal handlers. A file beyond `ulimit -f` is an error of its writer, not a signal.
#[cfg(unix)]
pub(super) fn listen() {
    use signal_hook::consts::{SIGINT, SIGTERM, SIGXFSZ};
    use std::io::Read as _;
    use std::os::unix::net::UnixStream;

    let flag = std::sync::Arc::default();
    let _ = signal_hook::flag::register(SIGXFSZ, flag);
    let Ok((mut reader, writer)) = UnixStream::pair() else { return };
    for signal in [SIGTERM, SIGINT] {
        // If this fails, a signal ends the program immediately; the last checkpoint remains.
        let _ = writer.try_clone().map(|w| signal_hook::low_level::pipe::register(signal, w));
    }
    std::thread::spawn(move || {
        // Keeps the writer open as long as there is a reader.
        let _writer = writer;
        let mut byte = [0];
        if reader.read_exact(&mut byte).is_err() {
            return;
        }
        let first = std::time::Instant::now();
        request().request();
        if !request().is_heeded() {
            end();
        }
        std::thread::spawn(|| {
            while request().is_heeded() {
                std::thread::sleep(std::time::Duration::from_millis(10));
            }
            std::thread::sleep(std::time::Duration::from_millis(GRACE_MS));
            end();
        });
        while reader.read_exact(&mut byte).is_ok() {
            if first.elapsed().as_millis() > ONE_REQUEST_MS {
                end();
            }
        }
    });
}

#[cfg(not(unix))]
pub(super) fn listen() {}
