//! The listing of rooms in docs/architecture.md.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::fs;

use super::imports::{Imports, Module};

/// A room: a module of the library, or of the solver.
fn room(module: &Module) -> Option<String> {
    match module.first()?.as_str() {
        "solver" => Some(format!("solver/{}", module.get(1)?)),
        first => Some(first.to_owned()),
    }
}

/// A line of the listing.
#[derive(Default)]
pub struct Row {
    files: usize,
    lines: usize,
    uses: BTreeSet<String>,
}

/// The lines of the listing, in the order of `rooms`.
pub fn rows(found: &Imports, rooms: &[String]) -> Vec<(String, Row)> {
    let mut rows: BTreeMap<String, Row> = BTreeMap::new();
    for (module, file) in &found.files {
        let Some(own) = room(module) else { continue };
        let row = rows.entry(own.clone()).or_default();
        row.files += 1;
        row.lines += fs::read_to_string(file).unwrap().lines().count();
        row.uses.extend(found.uses[module].iter().filter_map(room).filter(|other| *other != own));
    }
    let take = |name: &String| {
        let row = rows.remove(name).unwrap_or_else(|| panic!("no file in room {name}"));
        (name.clone(), row)
    };
    let listed = rooms.iter().map(take).collect();
    let rest: Vec<&String> = rows.keys().collect();
    assert!(rest.is_empty(), "rooms without a place in the listing: {rest:?}");
    listed
}

/// The text: files, lines (rounded up to hundreds), and what a room uses.
pub fn written(rows: &[(String, Row)]) -> String {
    let mut out = String::from("| room | files | lines | uses |\n|---|---|---|---|\n");
    for (name, row) in rows {
        let lines = 100 * row.lines.div_ceil(100);
        let uses: Vec<&str> =
            rows.iter().map(|(n, _)| n.as_str()).filter(|n| row.uses.contains(*n)).collect();
        writeln!(out, "| {name} | {} | {lines} | {} |", row.files, uses.join(", ")).unwrap();
    }
    out
}

/// Faults of a listing: rooms and uses must be these; numbers may be off by a tenth, and by two files or 200 lines, so that
/// not every change of a file is one of the listing.
pub fn faults(listing: &str, rows: &[(String, Row)]) -> Vec<String> {
    let near = |listed: &str, counted: usize, slack: usize| {
        let listed = listed.parse::<usize>();
        listed.is_ok_and(|listed| listed.abs_diff(counted) <= slack.max(counted / 10))
    };
    let expected = written(rows);
    let mut faults = Vec::new();
    if listing.lines().count() != expected.lines().count() {
        faults.push(format!("the listing has {} lines", listing.lines().count()));
    }
    for ((listed, expected), (_, row)) in listing.lines().zip(expected.lines()).skip(2).zip(rows) {
        let cells = |line: &str| line.split('|').map(|c| c.trim().to_owned()).collect::<Vec<_>>();
        let (own, good) = (cells(listed), cells(expected));
        let same = own.len() == good.len() && own[1] == good[1] && own[4] == good[4];
        if !same || !near(&own[2], row.files, 2) || !near(&own[3], row.lines, 200) {
            faults.push(format!("{listed}\n  is {expected}"));
        }
    }
    faults
}
