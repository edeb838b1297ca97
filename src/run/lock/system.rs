//! Locks of the operating system.

use std::fs::File;

/// Kind of a lock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Of a process that asks who holds the lock; several may ask at a time.
    Shared,
    /// Of the holder.
    Exclusive,
}

/// Result of an attempt to lock a file without waiting.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(unix), allow(dead_code, reason = "locks of other systems are not used"))]
pub(super) enum SystemLock {
    /// Locked until the file is closed.
    Acquired,
    /// Locked by another open file.
    Held,
    /// The file system has no locks.
    Unsupported,
}

/// The lock function of the operating system.
pub(super) type LockFile = fn(&File, Kind) -> SystemLock;

/// Locks a file without waiting. On a network file system the lock may be valid on this host only.
#[cfg(unix)]
pub(super) fn flock(file: &File, kind: Kind) -> SystemLock {
    use rustix::fs::{FlockOperation, flock};
    use rustix::io::Errno;
    let operation = match kind {
        Kind::Shared => FlockOperation::NonBlockingLockShared,
        Kind::Exclusive => FlockOperation::NonBlockingLockExclusive,
    };
    match flock(file, operation) {
        Ok(()) => SystemLock::Acquired,
        Err(Errno::WOULDBLOCK) => SystemLock::Held,
        Err(_) => SystemLock::Unsupported,
    }
}

#[cfg(not(unix))]
pub(super) fn flock(_: &File, _: Kind) -> SystemLock {
    SystemLock::Unsupported
}
