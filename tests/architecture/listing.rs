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

#[derive(Default)]
struct Row {
    files: usize,
    lines: usize,
    uses: BTreeSet<String>,
}

/// One line a room, in the order of `rooms`: files, lines (rounded up to hundreds), and what it uses.
pub fn listing(found: &Imports, rooms: &[String]) -> String {
    let mut rows: BTreeMap<String, Row> = BTreeMap::new();
    for (module, file) in &found.files {
        let Some(own) = room(module) else { continue };
        let row = rows.entry(own.clone()).or_default();
        row.files += 1;
        row.lines += fs::read_to_string(file).unwrap().lines().count();
        row.uses.extend(found.uses[module].iter().filter_map(room).filter(|other| *other != own));
    }
    let mut out = String::from("| room | files | lines | uses |\n|---|---|---|---|\n");
    for name in rooms {
        let row = rows.remove(name).unwrap_or_else(|| panic!("no file in room {name}"));
        let uses: Vec<&str> =
            rooms.iter().map(String::as_str).filter(|r| row.uses.contains(*r)).collect();
        let lines = 100 * row.lines.div_ceil(100);
        writeln!(out, "| {name} | {} | {lines} | {} |", row.files, uses.join(", ")).unwrap();
    }
    let rest: Vec<&String> = rows.keys().collect();
    assert!(rest.is_empty(), "rooms without a place in the listing: {rest:?}");
    out
}
