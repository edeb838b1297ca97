//! Common output of studies: CSV tables and charts on a page.

use std::path::Path;

use super::StudyError;
use kanagata_files::write_atomic;
use kanagata_report::csv;
use kanagata_report::drawing::{Chart, Line};
use kanagata_report::page::Page;
use kanagata_report::plot::{Axis, Plot, Series, Style};

/// Writes a CSV table; cells with commas, quotes or line breaks are quoted.
pub(super) fn write_csv(
    path: &Path,
    head: &[&str],
    table: &[Vec<String>],
) -> Result<(), StudyError> {
    write_atomic(path, |w| {
        writeln!(w, "{}", head.iter().map(|c| csv::quoted(c)).collect::<Vec<_>>().join(","))?;
        for row in table {
            writeln!(w, "{}", row.iter().map(|c| csv::quoted(c)).collect::<Vec<_>>().join(","))?;
        }
        Ok(())
    })?;
    Ok(())
}

/// Adds a chart with its title to a page; lines with `marks_only` become rings.
pub(super) fn plot(page: &mut Page, chart: &Chart) {
    let series = |line: &Line| {
        let (x, y) = line.points.iter().copied().unzip();
        let style = if line.marks_only { Style::Rings } else { Style::Line };
        (Series { name: line.name.clone(), x, y }, style)
    };
    let axis = |(title, log): &(String, bool)| Axis { title: title.clone(), log: *log };
    let series = chart.lines.iter().map(series).collect();
    let plot = Plot { x: axis(&chart.x), y: axis(&chart.y), series, equal: false };
    page.heading(&chart.title);
    page.plot(&plot, 480);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_quoted_where_they_must_be() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        let row = ["1", "a,b", "say \"no\""].map(String::from).to_vec();
        write_csv(&path, &["x", "y", "z"], &[row]).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text, "x,y,z\n1,\"a,b\",\"say \"\"no\"\"\"\n");
    }
}
