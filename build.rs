//! Sets `KANAGATA_BUILD`, the identity of the build in `run.json`: commit or sources, profile, features.
//!
//! The commit is that of `KANAGATA_COMMIT`, or of a git checkout without changes in release builds. Other builds are
//! identified by a digest of their sources, so that no two programs have one identity.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What the program is made of.
const SOURCES: [&str; 3] = ["src", "Cargo.toml", "Cargo.lock"];

fn main() {
    println!("cargo::rerun-if-env-changed=KANAGATA_COMMIT");
    for path in SOURCES.into_iter().chain(["build.rs"]) {
        if Path::new(path).exists() {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    let profile = env::var("PROFILE").unwrap_or_default();
    let named = env::var("KANAGATA_COMMIT").ok().filter(|commit| !commit.is_empty());
    // The checkout is not asked in builds for development: a commit would build everything again.
    let commit = named.or_else(|| if profile == "release" { checkout() } else { None });
    let source = commit.unwrap_or_else(|| format!("source-{:016x}", digest()));
    let features = ["cli", "pages"].into_iter().filter(|feature| {
        env::var_os(format!("CARGO_FEATURE_{}", feature.to_uppercase())).is_some()
    });
    let features: Vec<&str> = features.collect();
    let features = if features.is_empty() { "library".into() } else { features.join("+") };
    println!("cargo::rustc-env=KANAGATA_BUILD={source} {profile} {features}");
}

/// The commit of the checkout; `None` without git, outside a checkout, or with changed files.
fn checkout() -> Option<String> {
    let log = git(&["rev-parse", "--git-path", "logs/HEAD"])?;
    if Path::new(&log).exists() {
        println!("cargo::rerun-if-changed={log}");
    }
    let commit = git(&["rev-parse", "--short=12", "HEAD"])?;
    let changed =
        git(&["status", "--porcelain", "--", "src", "Cargo.toml", "Cargo.lock", "build.rs"])?;
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
    for path in SOURCES {
        collect(Path::new(path), &mut files);
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
