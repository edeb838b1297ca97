//! Heartbeat of a lock: its file is written again at regular intervals, so that other hosts see that its holder is alive.

use std::fs::File;
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

/// Time between two heartbeats. Halved, a file server has twice as many writes (one file per run and interval).
pub(super) const HEARTBEAT_INTERVAL: Duration = Duration::from_secs(30);

/// Request to end, and its notification.
type End = (Mutex<bool>, Condvar);

/// A thread that refreshes a lock file until it is dropped.
#[derive(Debug)]
pub(super) struct Heartbeat {
    end: Arc<End>,
    thread: Option<JoinHandle<()>>,
}

impl Heartbeat {
    /// Refreshes `file`, which contains `text`, after every `interval`. It ends early if the file has other content.
    ///
    /// # Errors
    /// The error of the operating system when no thread can be started.
    pub(super) fn start(file: Arc<File>, text: Vec<u8>, interval: Duration) -> io::Result<Self> {
        let end = Arc::new((Mutex::new(false), Condvar::new()));
        let ended = Arc::clone(&end);
        let beat = move || {
            // An error of the file system may pass before the heartbeat expires.
            while !waited(&ended, interval) && refresh(&file, &text).unwrap_or(true) {}
        };
        let thread = Builder::new().name("heartbeat".into()).spawn(beat)?;
        Ok(Self { end, thread: Some(thread) })
    }
}

impl Drop for Heartbeat {
    fn drop(&mut self) {
        *self.end.0.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.end.1.notify_all();
        if let Some(thread) = self.thread.take() {
            // The thread does not panic.
            let _ = thread.join();
        }
    }
}

/// Waits for the interval, or until the end is requested (true).
fn waited(end: &End, interval: Duration) -> bool {
    let requested = end.0.lock().unwrap_or_else(PoisonError::into_inner);
    let waited = end.1.wait_timeout_while(requested, interval, |requested| !*requested);
    *waited.unwrap_or_else(PoisonError::into_inner).0
}

/// Writes the content of the file again, so that the file server sets its modification time. False if its content is
/// not `text`: another process holds the lock.
///
/// # Errors
/// The error of the operating system.
fn refresh(mut file: &File, text: &[u8]) -> io::Result<bool> {
    let mut found = Vec::new();
    file.seek(SeekFrom::Start(0))?;
    file.take(text.len() as u64 + 1).read_to_end(&mut found)?;
    if found != text {
        return Ok(false);
    }
    file.seek(SeekFrom::Start(0))?;
    file.write_all(text)?;
    file.sync_all()?;
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Instant, SystemTime};

    fn until(what: impl Fn() -> bool) {
        let start = Instant::now();
        while !what() {
            assert!(start.elapsed() < Duration::from_secs(60));
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    #[test]
    fn the_file_is_refreshed_until_the_heartbeat_is_dropped_or_the_content_is_of_another() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.lock");
        let file = Arc::new(kanagata_files::create_new(&path, b"own").unwrap());
        let old = SystemTime::now() - Duration::from_secs(1000);
        let is_old = || std::fs::metadata(&path).unwrap().modified().unwrap() == old;
        let interval = Duration::from_millis(1);
        let beat = Heartbeat::start(Arc::clone(&file), b"own".to_vec(), interval).unwrap();
        for _ in 0..3 {
            file.set_modified(old).unwrap();
            until(|| !is_old());
        }
        drop(beat);
        assert_eq!(std::fs::read(&path).unwrap(), b"own");
        let beat = Heartbeat::start(Arc::clone(&file), b"former".to_vec(), interval).unwrap();
        until(|| beat.thread.as_ref().unwrap().is_finished());
        assert_eq!(std::fs::read(&path).unwrap(), b"own");
    }

    #[test]
    fn a_heartbeat_ends_promptly() {
        let file = Arc::new(tempfile::tempfile().unwrap());
        let start = Instant::now();
        drop(Heartbeat::start(file, b"own".to_vec(), HEARTBEAT_INTERVAL).unwrap());
        assert!(start.elapsed() < Duration::from_secs(5));
    }
}
