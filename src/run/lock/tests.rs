use std::sync::Barrier;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;

const UNSUPPORTED: LockFile = |_, _| SystemLock::Unsupported;
const LOCKS: [LockFile; 2] = [flock, UNSUPPORTED];

fn acquired(attempt: Attempt) -> Lock {
    match attempt {
        Attempt::Acquired(lock) => lock,
        Attempt::HeldByOther(holder) => panic!("held by {holder}"),
    }
}

fn held(attempt: Attempt) -> Holder {
    match attempt {
        Attempt::Acquired(lock) => panic!("acquired {lock:?}"),
        Attempt::HeldByOther(holder) => holder,
    }
}

fn other() -> Process {
    Process { id: 7, started: 1, host: "there 0-0 pid:[1]".into() }
}

fn write_other(path: &Path) {
    std::fs::write(path, serde_json::to_vec(&other()).unwrap()).unwrap();
}

fn set_age(path: &Path, age_s: u64) {
    let file = File::options().write(true).open(path).unwrap();
    file.set_modified(std::time::SystemTime::now() - Duration::from_secs(age_s)).unwrap();
}

#[test]
fn a_lock_has_one_holder_and_is_free_when_dropped() {
    for lock_file in LOCKS {
        let folder = tempfile::tempdir().unwrap();
        let path = file_in(folder.path());
        assert_eq!(holder::judge(&path, lock_file).unwrap(), None);
        let lock = acquired(take_with(&path, false, lock_file).unwrap());
        let who = held(take_with(&path, false, lock_file).unwrap());
        assert_eq!(who.process.as_ref().unwrap().id, std::process::id());
        assert_eq!(who.place, Place::Here);
        assert!(who.to_string().contains(&format!("process {}", std::process::id())));
        assert_eq!(holder::judge(&path, lock_file).unwrap(), Some(who));
        // A holder of this host keeps its lock.
        held(take_with(&path, true, lock_file).unwrap());
        lock.check().unwrap();
        drop(lock);
        assert_eq!(holder::judge(&path, lock_file).unwrap(), None);
        drop(acquired(take_with(&path, false, lock_file).unwrap()));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "the lock file alone");
    }
}

#[test]
fn an_identity_of_an_ended_process_or_none_does_not_lock() {
    let folder = tempfile::tempdir().unwrap();
    let path = file_in(folder.path());
    let own = identity::own();
    let gone = Process { started: own.started + 1, ..own };
    for lock_file in LOCKS {
        for text in [serde_json::to_vec(&gone).unwrap(), b"no process".to_vec()] {
            std::fs::write(&path, text).unwrap();
            drop(acquired(take_with(&path, false, lock_file).unwrap()));
        }
    }
    let unknown = folder.path().join("no/such/run.lock");
    assert!(take(&unknown, false).unwrap_err().to_string().contains("run.lock"));
}

#[test]
fn a_holder_on_another_host_keeps_its_lock_until_it_expires_or_is_broken() {
    let folder = tempfile::tempdir().unwrap();
    let path = file_in(folder.path());
    for lock_file in LOCKS {
        for (age_s, break_lock, free) in
            [(105, false, false), (400, false, true), (105, true, true)]
        {
            write_other(&path);
            set_age(&path, age_s);
            match take_with(&path, break_lock, lock_file).unwrap() {
                Attempt::Acquired(lock) => assert!(free && lock.check().is_ok()),
                Attempt::HeldByOther(holder) => {
                    assert!(!free && holder.process == Some(other()));
                    let text = format!("{holder}; {}", holder.remedy());
                    assert!(text.starts_with("process 7 on there (last heartbeat 10"), "{text}");
                    assert!(text.contains(
                        "on there (`kill 7`; checkpoints remain); it counts as ended 5 minutes"
                    ));
                }
            }
        }
    }
}

#[test]
fn a_lost_lock_is_noticed_and_the_file_of_the_new_holder_stays() {
    let folder = tempfile::tempdir().unwrap();
    let path = file_in(folder.path());
    let take = || acquired(take_with(&path, true, UNSUPPORTED).unwrap());
    let lock = take();
    write_other(&path);
    let lost = lock.check().unwrap_err().to_string();
    assert!(lost.ends_with("run.lock: process 7 on there holds the lock now"), "{lost}");
    drop(lock);
    assert_eq!(holder(&path).unwrap().unwrap().process, Some(other()));
    // The file is replaced, not written: the former holder has its own.
    let lock = take();
    let new = folder.path().join("new");
    write_other(&new);
    rename(&new, &path).unwrap();
    assert!(lock.check().is_err());
    drop(lock);
    assert_eq!(holder(&path).unwrap().unwrap().process, Some(other()));
    let lock = take();
    std::fs::remove_file(&path).unwrap();
    assert!(lock.check().unwrap_err().found.contains("deleted"));
    drop(lock);
    assert!(!path.exists());
}

#[test]
fn an_abandoned_claim_delays_and_a_foreign_one_refuses() {
    let folder = tempfile::tempdir().unwrap();
    let path = file_in(folder.path());
    let claim = folder.path().join(".run.lock.claim");
    write_other(&claim);
    set_age(&claim, 100);
    drop(acquired(take(&path, false).unwrap()));
    write_other(&claim);
    let who = held(take(&path, false).unwrap());
    assert_eq!(who.process, Some(other()));
    assert!(who.to_string().contains("last heartbeat unknown"), "{who}");
}

/// Threads compete for a free lock, and for one with an expired holder and an abandoned claim.
#[test]
fn one_of_several_processes_acquires_a_lock_without_locks_of_the_system() {
    const THREADS: usize = 4;
    let folder = tempfile::tempdir().unwrap();
    for round in 0..200 {
        let path = folder.path().join(format!("{round}.lock"));
        if round % 2 == 1 {
            let claim = folder.path().join(format!(".{round}.lock.claim"));
            write_other(&path);
            set_age(&path, 400);
            write_other(&claim);
            set_age(&claim, 400);
        }
        let (start, winners) = (Barrier::new(THREADS), AtomicUsize::new(0));
        let end = Barrier::new(THREADS);
        std::thread::scope(|scope| {
            for _ in 0..THREADS {
                scope.spawn(|| {
                    start.wait();
                    let attempt = take_with(&path, false, UNSUPPORTED).unwrap();
                    if let Attempt::Acquired(lock) = &attempt {
                        winners.fetch_add(1, Ordering::Relaxed);
                        lock.check().unwrap();
                    }
                    end.wait();
                });
            }
        });
        assert_eq!(winners.into_inner(), 1, "round {round}");
    }
}
