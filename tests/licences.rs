//! `tools/licences`: every crate that cargo links into the programs is named, with a text.

#[path = "skipping/mod.rs"]
mod skipping;

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Names and versions of the crates in the programs, by cargo itself.
fn linked() -> BTreeSet<String> {
    let tree = Command::new(env!("CARGO"))
        .args([
            "tree",
            "--package",
            "kanagata",
            "--locked",
            "--offline",
            "--prefix",
            "none",
            "--format",
            "{p}",
        ])
        .args(["--edges", "normal", "--target", "x86_64-unknown-linux-gnu"])
        .current_dir(root())
        .output()
        .unwrap();
    assert!(tree.status.success(), "{}", String::from_utf8_lossy(&tree.stderr));
    let text = String::from_utf8(tree.stdout).unwrap();
    let package = |line: &str| {
        let mut words = line.split(' ');
        Some(format!("{} {}", words.next()?, words.next()?.strip_prefix('v')?))
    };
    text.lines().filter_map(package).filter(|name| !name.starts_with("kanagata")).collect()
}

#[test]
fn all_crates_of_the_programs_are_named_with_a_licence_and_a_text() {
    if Command::new("python3").arg("--version").output().is_err() {
        return skipping::skip(["python3", "install Python 3"]);
    }
    // The metadata have the package of `python/` too, which the tests do not build.
    let metadata = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--locked", "--offline"])
        .args(["--filter-platform", "x86_64-unknown-linux-gnu"])
        .current_dir(root())
        .output()
        .unwrap();
    if String::from_utf8_lossy(&metadata.stderr).contains("--offline was specified") {
        return skipping::skip(["all crates of Cargo.lock", "run cargo fetch"]);
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("licences");
    let done = Command::new("python3")
        .arg(root().join("tools/licences"))
        .args(["--offline", "--target", "x86_64-unknown-linux-gnu", "-o"])
        .arg(&file)
        .env("CARGO", env!("CARGO"))
        .output()
        .unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let text = std::fs::read_to_string(&file).unwrap();
    let (list, texts) = text.split_once("=====").unwrap();
    let expected = linked();
    assert!(expected.len() > 100, "{}", expected.len());
    assert!(expected.iter().all(|package| !package.starts_with("criterion ")), "of tests only");
    let listed: BTreeSet<String> = list
        .lines()
        .filter_map(|line| line.strip_prefix("  "))
        .map(|line| line.split_whitespace().take(2).collect::<Vec<_>>().join(" "))
        .collect();
    assert_eq!(listed, expected);
    for package in &expected {
        assert!(texts.contains(&format!("\n{package} (")), "{package} has no text");
    }
    assert!(texts.contains("Permission is hereby granted") && texts.contains("Apache License"));
}
