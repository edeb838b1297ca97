//! Checks the values in the table of a study, and names the cell that makes a scene invalid.

use std::path::Path;

use serde_json::Value;

use super::case::Case;
use super::cases::{Roots, base_scene, case_of_row};
use super::file::Study;
use super::table_cases::{CaseTable, TableRow};
use kanagata_scene::error::Fault;

/// Name of the table in messages, and its content; `None` without a table.
fn table_of(study: &Study) -> Option<(&str, &CaseTable)> {
    Some((study.table.as_deref()?, study.rows.as_ref()?))
}

/// Place of a cell in messages.
fn place(file: &str, table: &CaseTable, row: &TableRow, column: usize) -> String {
    format!("{file}, row {}, column {}", row.number, table.columns[column])
}

/// All values of the table with their places.
pub(super) fn places(study: &Study) -> impl Iterator<Item = (String, &Value)> {
    table_of(study).into_iter().flat_map(|(file, table)| {
        table.rows.iter().flat_map(move |row| {
            let set = row.values.iter().enumerate();
            set.filter_map(move |(k, set)| {
                Some((place(file, table, row, k), set.as_ref()?.value()))
            })
        })
    })
}

/// Checks that the path of every value of the table leads to a place in the scene, without and with `--quick`.
pub(super) fn values(study: &Study) -> Result<(), Fault> {
    let Some((file, table)) = table_of(study) else { return Ok(()) };
    for quick in [false, true] {
        let base = base_scene(study, quick);
        for row in &table.rows {
            let mut scene = base.clone();
            for (k, set) in row.values.iter().enumerate() {
                let Some(set) = set else { continue };
                set.apply(&mut scene).map_err(|(at, found, allowed)| {
                    let at = if at.is_empty() { "scene".into() } else { at };
                    (format!("{}: {at}", place(file, table, row, k)), found, allowed)
                })?;
            }
        }
    }
    Ok(())
}

/// Origin of the fault in the scene of row `k`: the first column without which the scene is valid, or the row. `None`
/// without a table, and if no column decides where the scenes of all rows are invalid (`all_bad`).
pub(super) fn fault_origin(
    study: &Study,
    quick: bool,
    (k, all_bad): (usize, bool),
    is_valid: &dyn Fn(&Case) -> bool,
) -> Option<String> {
    let (file, table) = table_of(study)?;
    let row = table.rows.get(k)?;
    let (base, none) = (base_scene(study, quick), Path::new(""));
    let roots = Roots { tools: none, own: none };
    let decides = |&column: &usize| {
        let is_set = row.values[column].is_some();
        is_set && is_valid(&case_of_row(study, &base, &roots, row, Some(column)))
    };
    let place = match (0..table.columns.len()).find(decides) {
        Some(column) => place(file, table, row, column),
        None if all_bad => return None,
        None => format!("{file}, row {}", row.number),
    };
    Some(format!("{place} (case {})", row.case))
}

#[cfg(test)]
mod tests {
    use super::super::table_cases::parse;
    use super::super::validate::check;
    use super::*;
    use serde_json::json;

    /// The message for a study with this table; empty if it is valid.
    fn fault(table: &str, change: impl Fn(&mut Value)) -> String {
        let mut value = json!({
            "format": "kanagata-study", "version": 1, "name": "s", "watch": "die", "table": "t.csv",
            "scene": {
                "format": "kanagata-scene", "version": 1, "name": "",
                "blank": {
                    "shape": {"rectangle": {"size_mm": [10.0, 10.0], "elements": [2, 2]}},
                    "thickness_mm": 1.0
                },
                "material": "mild-steel-neto2012",
                "tools": [{"name": "die", "file": "{case}/die.json", "direction": [0, 0, 1]}],
                "stages": [{"name": "draw", "drive": {"die": {"travel_mm": 1.0}}}],
            },
        });
        change(&mut value);
        let mut study: Study = serde_json::from_value(value).unwrap();
        study.rows = Some(parse(table).unwrap());
        check(&study, Path::new("s.json")).map_or_else(|e| e.to_string(), |()| String::new())
    }

    fn holds(message: &str, words: &[&str]) {
        assert!(words.iter().all(|w| message.contains(w)), "{message}: {words:?}");
    }

    const TABLE: &str = "case,tools.die.friction,blank.layers\na,0.1,\nb,,2\n";

    #[test]
    fn rows_are_checked_and_faults_named_by_row_and_column() {
        assert_eq!(fault(TABLE, |_| ()), "");
        let friction = TABLE.replace("0.1", "-0.1");
        holds(
            &fault(&friction, |_| ()),
            &["s.json, t.csv, row 2, column tools.die.friction (case a)", "friction", "-0.1"],
        );
        let text = TABLE.replace(",2", ",two");
        holds(&fault(&text, |_| ()), &["row 3, column blank.layers (case b)", "two"]);
        let path = TABLE.replace("die", "dye");
        holds(
            &fault(&path, |_| ()),
            &["row 2, column tools.dye.friction: tools: found no element \"dye\"; allowed: die"],
        );
        let key = TABLE.replace("layers", "layerz");
        holds(&fault(&key, |_| ()), &["row 3, column blank.layerz (case b)", "layerz"]);
        let quick = fault(TABLE, |s| s["quick"] = json!({"tools": []}));
        holds(&quick, &["row 2, column tools.die.friction: tools", "the list is empty"]);
        holds(&fault(TABLE, |s| s["watch"] = "punch".into()), &["every case (first a)", "watch"]);
    }

    #[test]
    fn a_table_stands_in_place_of_choices() {
        let both = json!([{"name": "x", "options": [{"name": "1"}]}]);
        let both = fault(TABLE, |s| s["choices"] = both.clone());
        holds(&both, &["choices: found choices and a `table`"]);
        holds(&fault(TABLE, |s| s["reference"] = "c".into()), &["'c'", "a case of t.csv"]);
        assert_eq!(fault(TABLE, |s| s["reference"] = "b".into()), "");
        let follow = json!([{"of": "a", "cases": ["b"]}]);
        assert_eq!(fault(TABLE, |s| s["follow"] = follow.clone()), "");
        let mark = fault(TABLE, |s| s["scene"]["tools"][0]["file"] = "{model}".into());
        holds(&mark, &["scene.tools[0].file", "'{model}'", "{case}: the case's name in braces"]);
        let mark = fault("case,tools.die.file\na,{case}.json\nb,{tool}.json\n", |_| ());
        holds(&mark, &["t.csv, row 3, column tools.die.file", "'{tool}'"]);
    }
}
