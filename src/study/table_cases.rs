//! The table of a study: one case in each row, with values of the scene.

use std::collections::BTreeSet;

use super::case::{CASES_MAX, NAME_MAX, allowed_words, is_word};
use kanagata_report::csv;
use kanagata_scene::error::Fault;
use kanagata_scene::set_value::SetValue;

/// Largest number of columns after the first. The check of a study makes the scene of a faulty row once per column; twice the
/// value would double its time.
const COLUMNS_MAX: usize = 64;
/// Largest number of rows that are read, with empty ones. Ten times the number of cases leaves room for empty rows and limits
/// the memory for a file of line breaks.
const ROWS_MAX: usize = 10 * CASES_MAX;
/// Largest length of a text from the table in a message.
const SHOWN_MAX: usize = 40;

/// The cases of a study from a table.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseTable {
    /// Heads of the columns after the first: paths of values of the scene.
    pub columns: Vec<String>,
    /// Cases in order.
    pub rows: Vec<TableRow>,
}

/// A row of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct TableRow {
    /// Number of the row in the file, from 1 for the head; a row with line breaks in quotes counts once.
    pub number: usize,
    /// Name of the case.
    pub case: String,
    /// Cells of the columns after the first.
    pub cells: Vec<String>,
    /// Value of the scene that each cell sets; `None` for an empty cell.
    pub values: Vec<Option<SetValue>>,
}

/// Parses a table of comma-separated values. A byte order mark and empty rows are ignored.
///
/// # Errors
/// The row or cell, what was found, and what is allowed.
pub fn parse(text: &str) -> Result<CaseTable, Fault> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut rows = csv::first_rows(text, ROWS_MAX + 1).into_iter().zip(1..);
    let columns = columns(rows.next().map_or("", |(head, _)| head))?;
    let mut table = CaseTable { columns, rows: Vec::new() };
    let mut names = BTreeSet::new();
    for (row, number) in rows.filter(|(row, _)| !row.trim().is_empty()) {
        if table.rows.len() == CASES_MAX || number > ROWS_MAX {
            let found = format!("more than {} cases or {ROWS_MAX} rows", table.rows.len());
            let allowed = format!("at most {CASES_MAX} cases");
            return Err((format!("row {number}"), found, allowed));
        }
        let row = row_of(row, number, &table.columns)?;
        if !names.insert(row.case.clone()) {
            let (place, found) = (case_place(number), format!("'{}' once more", row.case));
            return Err((place, found, "a name of its own".into()));
        }
        table.rows.push(row);
    }
    if table.rows.is_empty() {
        return Err(("row 2".into(), "no case".into(), "a row for each case".into()));
    }
    Ok(table)
}

/// Place of the name of a case in messages.
fn case_place(row: usize) -> String {
    format!("row {row}, column case")
}

/// The heads of the columns after the first.
fn columns(head: &str) -> Result<Vec<String>, Fault> {
    let mut columns = csv::first_cells(head, COLUMNS_MAX + 2).into_iter();
    let first = columns.next().unwrap_or_default();
    if first.trim() != "case" {
        let allowed = "case, and after commas the paths of values of the scene";
        return Err(("row 1, first column".into(), shown(&first), allowed.into()));
    }
    let columns: Vec<String> = columns.map(|column| column.trim().to_owned()).collect();
    if columns.len() > COLUMNS_MAX {
        let found = format!("more than {COLUMNS_MAX} columns after the first");
        return Err(("row 1".into(), found, format!("at most {COLUMNS_MAX}")));
    }
    for (k, column) in columns.iter().enumerate() {
        let place = || format!("row 1, column {}", k + 2);
        if let Err(why) = SetValue::new(column, "") {
            let allowed = "the path of a value of the scene, such as tools.die.friction";
            let found = if column.is_empty() { "no head".into() } else { why };
            return Err((place(), found, allowed.into()));
        }
        if columns[..k].contains(column) {
            let found = format!("{} once more", shown(column));
            return Err((place(), found, "each path once".into()));
        }
    }
    Ok(columns)
}

/// A row with the given columns after the first.
fn row_of(text: &str, number: usize, columns: &[String]) -> Result<TableRow, Fault> {
    let mut cells = csv::first_cells(text, columns.len() + 2);
    if cells.len() != columns.len() + 1 {
        let more = if cells.len() > columns.len() + 1 { " or more" } else { "" };
        let found = format!("{} cells{more}", cells.len());
        let allowed = format!("{}, one for each column", columns.len() + 1);
        return Err((format!("row {number}"), found, allowed));
    }
    let case = cells.remove(0).trim().to_owned();
    if !is_word(&case) {
        return Err((case_place(number), shown(&case), allowed_words()));
    }
    let value = |(column, cell): (&String, &String)| {
        let set = (!cell.trim().is_empty()).then(|| SetValue::new(column, cell)).transpose();
        let place = format!("row {number}, column {column}");
        set.map_err(|why| (place, why, "a path of the scene".to_owned()))
    };
    let values = columns.iter().zip(&cells).map(value).collect::<Result<_, _>>()?;
    Ok(TableRow { number, case, cells, values })
}

/// The start of a text in quotes.
fn shown(text: &str) -> String {
    let start: String = text.chars().take(SHOWN_MAX.max(NAME_MAX + 1)).collect();
    format!("'{start}'")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_cases_with_values_of_the_scene() {
        let text = "\u{feff}case, tools.die.friction,material,blank.size\r\n\
                    a,0.1,steel,\"[1, 2]\"\r\n\r\n b ,,\"say \"\"x\"\"\", \r\n";
        let table = parse(text).unwrap();
        assert_eq!(table.columns, ["tools.die.friction", "material", "blank.size"]);
        let [a, b] = table.rows.as_slice() else { panic!("{table:?}") };
        assert_eq!((a.case.as_str(), a.number, b.case.as_str(), b.number), ("a", 2, "b", 4));
        assert_eq!(a.cells, ["0.1", "steel", "[1, 2]"]);
        let values: Vec<_> = a.values.iter().map(|v| v.as_ref().unwrap().value().clone()).collect();
        assert_eq!(serde_json::json!(values), serde_json::json!([0.1, "steel", [1, 2]]));
        assert!(b.values[0].is_none() && b.values[2].is_none());
        assert_eq!(b.values[1].as_ref().unwrap().value(), "say \"x\"");
        assert_eq!(parse("case\na\nb").unwrap().rows.len(), 2);
    }

    #[test]
    fn a_wrong_table_is_refused_by_row_and_column() {
        let many_rows: String = (0..=CASES_MAX).map(|k| format!("c{k}\n")).collect();
        let many_columns: String = (0..=COLUMNS_MAX).map(|k| format!(",k{k}")).collect();
        for (text, place, found) in [
            ("", "row 1, first column", "''"),
            ("case;x\na;1\n", "row 1, first column", "'case;x'"),
            ("case,x\n", "row 2", "no case"),
            ("case,x,\na,1,2\n", "row 1, column 3", "no head"),
            ("case,x[\na,1\n", "row 1, column 2", "bracket"),
            ("case,x,x\na,1,2\n", "row 1, column 3", "'x' once more"),
            ("case,x\na,1\n\nb\n", "row 4", "1 cells"),
            ("case,x\na,1,2,3\n", "row 2", "3 cells or more"),
            ("case,x\na/b,1\n", "row 2, column case", "'a/b'"),
            ("case,x\n,1\n", "row 2, column case", "''"),
            ("case,x\na,1\na,2\n", "row 3, column case", "'a' once more"),
            (&format!("case\n{many_rows}"), "row 10002", "more than 10000 cases"),
            (&format!("case\n{}", "\n".repeat(2 * ROWS_MAX)), "row 2", "no case"),
            (&format!("case{many_columns}\n"), "row 1", "more than 64 columns"),
        ] {
            let fault = parse(text).unwrap_err();
            let start: String = text.chars().take(30).collect();
            assert!(fault.0 == place && fault.1.contains(found), "{start}: {fault:?}");
        }
    }
}
