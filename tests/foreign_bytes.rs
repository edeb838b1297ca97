//! Damaged files of every kind that the programs read: each gives a result or a typed error with words, never a panic.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use self::damage::{Text, damage};
use self::dice::Dice;
use self::readers::{KINDS, Reader};

#[path = "../fuzz/src/checkpoint.rs"]
mod checkpoint;
#[path = "../fuzz/src/damage.rs"]
#[allow(dead_code)]
mod damage;
#[path = "../fuzz/src/dice.rs"]
mod dice;
#[path = "../fuzz/src/readers.rs"]
mod readers;

/// Mutants of each seed.
const MUTANTS: usize = 150;
/// Mutants of each CAD file that is also converted and audited.
const CONVERTED: usize = 12;

fn fixtures(folder: &str) -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(folder);
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> = paths.filter(|path| path.is_file()).collect();
    files.sort();
    let named = |path: PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        (name, std::fs::read(path).unwrap())
    };
    files.into_iter().map(named).collect()
}

/// What reads files of a name.
fn reader(name: &str) -> Reader {
    match KINDS.iter().find(|(ending, _)| name.ends_with(ending)) {
        Some((_, read)) => *read,
        None if name.ends_with(".checkpoint") => checkpoint::restore,
        None => panic!("{name} ends as no kind of file that is read"),
    }
}

/// What is wrong with how some bytes are read; `None` when there is a result or a typed error.
fn fault(read: Reader, bytes: &[u8]) -> Option<&'static str> {
    match catch_unwind(AssertUnwindSafe(|| read(bytes))) {
        Err(_) => Some("panic"),
        Ok(Err(message)) if message.is_empty() => Some("an error without words"),
        Ok(_) => None,
    }
}

fn text(name: &str) -> Text {
    if name.ends_with("json") {
        Text::Json
    } else if name.ends_with("checkpoint") {
        Text::Checkpoint
    } else {
        Text::Cad
    }
}

/// Words, values and lines changed, and one time in three a byte too, or the end cut off.
fn mutant(name: &str, seed: &[u8], dice: &mut Dice) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    damage(text(name), "", &mut bytes, dice);
    match dice.below(6) {
        0 => bytes.truncate(dice.below(bytes.len())),
        1 if !bytes.is_empty() => {
            let at = dice.below(bytes.len());
            bytes[at] = dice.next() as u8;
        }
        _ => {}
    }
    bytes
}

/// Mutants of files, `count` of each, that are read wrongly. On threads of their own: what reads them has parallel loops inside,
/// and a thread of their pool that waits for one would begin another mutant.
fn assert_survived(seeds: &[(String, Vec<u8>)], count: usize, read: fn(&str) -> Reader) {
    let (next, faults) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let work = || {
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some((name, seed)) = seeds.get(at / count) else { break };
            let k = at % count;
            let bytes = mutant(name, seed, &mut Dice(k as u64));
            if let Some(what) = fault(read(name), &bytes) {
                faults.lock().unwrap().push(format!("{name} mutant {k}: {what}"));
            }
        }
    };
    let threads = thread::available_parallelism().map_or(1, |n| n.get());
    thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
    let faults = faults.into_inner().unwrap();
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
}

#[test]
fn seeds_are_read_without_a_fault() {
    let refused: Vec<String> = fixtures("seeds")
        .iter()
        .filter_map(|(name, bytes)| Some(format!("{name}: {}", reader(name)(bytes).err()?)))
        .collect();
    assert!(refused.is_empty(), "{}", refused.join("\n"));
    assert_eq!(checkpoint::restore(&checkpoint::body()), Ok(()));
}

#[test]
fn damaged_meshes_tools_scenes_studies_cards_and_histories_are_survived() {
    let mut seeds = fixtures("seeds");
    seeds.extend(fixtures("vtu"));
    seeds.extend(fixtures("u-draw").into_iter().filter(|(name, _)| name.ends_with("tool.json")));
    assert!(seeds.len() > 25, "{} seeds", seeds.len());
    assert_survived(&seeds, MUTANTS, reader);
}

#[test]
fn damaged_checkpoints_with_their_right_digest_are_survived() {
    let seed = ("small.checkpoint".to_owned(), checkpoint::body());
    assert_survived(&[seed], 10 * MUTANTS, reader);
}

#[test]
fn what_is_read_of_damaged_cad_is_meshed_converted_and_audited() {
    let mut seeds = fixtures("forming");
    seeds.retain(|(name, bytes)| !name.ends_with("json") && bytes.len() < 10_000);
    assert!(seeds.len() >= 20, "{} small files", seeds.len());
    assert_survived(&seeds, CONVERTED, |_| readers::convert);
}

/// What a fuzzer or somebody's file once broke, and what was made in that manner: `tools/fuzz` says how to add to it.
#[test]
fn inputs_that_broke_a_reader_once_are_read_again() {
    let files = fixtures("fuzz");
    assert!(files.len() > 5, "{} files in fixtures/fuzz", files.len());
    for (name, bytes) in files {
        assert_eq!(fault(reader(&name), &bytes), None, "{name}");
    }
}
