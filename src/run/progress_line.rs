//! An increment as one line of text, and as one line of JSON.

use std::fmt::Write as _;

use serde::Serialize;

use kanagata_report::record::HistoryRow;

/// Header of the lines, without the tools.
pub const HEADER: &str = "  inc  time     it touch  slip  tools [mm, kN]";

/// The line of text of an increment.
#[must_use]
pub fn line(tools: &[String], row: &HistoryRow) -> String {
    let [touch, slip] = row.contacts;
    let mut out =
        format!("{:5}  {:7.4} {:3} {touch:5} {slip:5} ", row.increment, row.time, row.iterations);
    for (name, (travel, force)) in tools.iter().zip(row.travel_mm.iter().zip(&row.force_n)) {
        let _ = write!(out, " {name} {travel:.4} {:.4}", force / 1e3);
    }
    let _ = write!(out, "  {}", row.stage);
    out
}

#[derive(Serialize)]
struct Json<'a> {
    #[serde(flatten)]
    row: &'a HistoryRow,
    tools: &'a [String],
}

/// The line of JSON of an increment: all columns of `history.csv`, and `tools` with their names.
#[must_use]
pub fn json_line(tools: &[String], row: &HistoryRow) -> String {
    // Serialisation of numbers and strings does not fail.
    serde_json::to_string(&Json { row, tools }).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_stands_under_its_header_and_json_has_every_column() {
        let row = HistoryRow {
            increment: 12,
            stage: "draw".into(),
            time: 1.25,
            travel_mm: vec![0.0, 4.0],
            force_n: vec![-1500.0, 1500.0],
            pressure_mpa: Vec::new(),
            iterations: 5,
            contacts: [310, 22],
            energy: Default::default(),
        };
        let tools = ["die".to_owned(), "punch".to_owned()];
        let text = line(&tools, &row);
        assert_eq!(
            text,
            "   12   1.2500   5   310    22  die 0.0000 -1.5000 punch 4.0000 1.5000  draw"
        );
        assert_eq!(text.find(" die"), HEADER.find(" tools"));
        let value: serde_json::Value = serde_json::from_str(&json_line(&tools, &row)).unwrap();
        assert_eq!(
            (value["increment"].as_u64(), value["tools"][1].as_str()),
            (Some(12), Some("punch"))
        );
        assert_eq!(value["force_n"][1].as_f64(), Some(1500.0));
    }
}
