//! Sets `KANAGATA_BUILD`, the identity of the build in `run.json`: commit or sources, profile, features.
//!
//! The commit is that of `KANAGATA_COMMIT`, or of a git checkout without changes in release builds. Other builds are
//! identified by a digest of the sources that a run is made of, so that no two programs have one identity whose runs may
//! differ. Commands, sequences, studies and conversion are not among them: who changes these need not compile the crate of
//! runs again.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What a run is made of, from the root of the workspace: this crate, and those that it depends on (`tests/architecture.rs`
/// compares). A package of this crate alone has its own files only.
const SOURCES: [&str; 15] = [
    "Cargo.toml",
    "Cargo.lock",
    "src/audit",
    "src/cad",
    "src/cancel",
    "src/contact",
    "src/files",
    "src/geometry",
    "src/mesh",
    "src/progress",
    "src/report",
    "src/run",
    "src/scene",
    "src/solver",
    "src/tool",
];
/// From the folder of this crate.
const WORKSPACE: &str = "../..";

fn main() {
    println!("cargo::rerun-if-env-changed=KANAGATA_COMMIT");
    for path in sources() {
        println!("cargo::rerun-if-changed={}", path.display());
    }
    let profile = env::var("PROFILE").unwrap_or_default();
    let named = env::var("KANAGATA_COMMIT").ok().filter(|commit| !commit.is_empty());
    // The checkout is not asked in builds for development: a commit would build everything again.
    let commit = named.or_else(|| if profile == "release" { checkout() } else { None });
    let source = commit.unwrap_or_else(|| format!("source-{:016x}", digest()));
    let features = if env::var_os("CARGO_FEATURE_PAGES").is_some() { "pages" } else { "library" };
    println!("cargo::rustc-env=KANAGATA_BUILD={source} {profile} {features}");
}

/// The sources that are there.
fn sources() -> Vec<PathBuf> {
    let whole = Path::new(WORKSPACE).join("src/run/identity.rs").exists();
    let base = Path::new(if whole { WORKSPACE } else { "." });
    let paths = SOURCES.into_iter().map(|path| base.join(path));
    let found: Vec<PathBuf> = paths.filter(|path| path.exists()).collect();
    if whole { found } else { vec![PathBuf::from(".")] }
}

/// The commit of the checkout; `None` without git, outside a checkout, or with changed files.
fn checkout() -> Option<String> {
    let log = git(&["rev-parse", "--git-path", "logs/HEAD"])?;
    if Path::new(&log).exists() {
        println!("cargo::rerun-if-changed={log}");
    }
    let commit = git(&["rev-parse", "--short=12", "HEAD"])?;
    let paths = SOURCES.map(|path| format!("{WORKSPACE}/{path}"));
    let mut arguments = vec!["status", "--porcelain", "--"];
    arguments.extend(paths.iter().map(String::as_str));
    let changed = git(&arguments)?;
    changed.is_empty().then_some(commit)
}

/// Standard output of git, trimmed; `None` if it fails.
fn git(arguments: &[&str]) -> Option<String> {
    let done = Command::new("git").args(arguments).output().ok().filter(|d| d.status.success())?;
    String::from_utf8(done.stdout).ok().map(|text| text.trim().to_owned())
}

/// Digest of the sources, their names and the compiler (FNV-1a, 64 bits): it tells builds apart and protects from nobody.
fn digest() -> u64 {
    let mut files = Vec::new();
    for path in sources() {
        collect(&path, &mut files);
    }
    files.sort();
    let compiler = env::var("RUSTC").ok().and_then(|rustc| {
        Command::new(rustc).arg("--version").output().ok().map(|done| done.stdout)
    });
    let mut digest = 0xcbf2_9ce4_8422_2325;
    let mut add = |bytes: &[u8]| {
        for byte in bytes {
            digest = (digest ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    add(&compiler.unwrap_or_default());
    for file in files {
        add(file.to_string_lossy().as_bytes());
        add(&fs::read(&file).unwrap_or_default());
    }
    digest
}

/// Adds the files at `path`.
fn collect(path: &Path, files: &mut Vec<PathBuf>) {
    match fs::read_dir(path) {
        Ok(entries) => entries.flatten().for_each(|entry| collect(&entry.path(), files)),
        Err(_) if path.is_file() => files.push(path.to_path_buf()),
        Err(_) => {}
    }
}
