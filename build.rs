//! Sets `KANAGATA_BUILD`, the identity of the build in `run.json`: commit, profile, features.
//!
//! The commit is that of `KANAGATA_COMMIT`, or of the git checkout in release builds; `+` marks changed files. Builds for
//! development have none, so that a commit does not build everything again.

use std::env;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-env-changed=KANAGATA_COMMIT");
    println!("cargo::rerun-if-changed=build.rs");
    let profile = env::var("PROFILE").unwrap_or_default();
    let named = env::var("KANAGATA_COMMIT").ok().filter(|commit| !commit.is_empty());
    let commit = named.or_else(|| if profile == "release" { checkout() } else { None });
    let features = ["cli", "pages"].into_iter().filter(|feature| {
        env::var_os(format!("CARGO_FEATURE_{}", feature.to_uppercase())).is_some()
    });
    let features: Vec<&str> = features.collect();
    println!(
        "cargo::rustc-env=KANAGATA_BUILD={} {profile} {}",
        commit.as_deref().unwrap_or("no-commit"),
        if features.is_empty() { "library".into() } else { features.join("+") }
    );
}

/// The commit of the checkout; `None` without git or outside a checkout.
fn checkout() -> Option<String> {
    for path in [git(&["rev-parse", "--git-path", "logs/HEAD"])?, "src".into()] {
        println!("cargo::rerun-if-changed={path}");
    }
    let commit = git(&["rev-parse", "--short=12", "HEAD"])?;
    let changed = git(&["status", "--porcelain", "--untracked-files=no"])?;
    Some(if changed.is_empty() { commit } else { commit + "+" })
}

/// Standard output of git, trimmed; `None` if it fails.
fn git(arguments: &[&str]) -> Option<String> {
    let done = Command::new("git").args(arguments).output().ok().filter(|d| d.status.success())?;
    String::from_utf8(done.stdout).ok().map(|text| text.trim().to_owned())
}
