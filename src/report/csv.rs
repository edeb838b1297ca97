//! Tables of comma-separated values (RFC 4180).
//!
//! Spreadsheet programs read text that begins with `=`, `+`, `-`, `@`, a tab or a carriage return as a formula. An
//! apostrophe is written before such a cell and removed on reading; numbers are unchanged.

/// Whether a spreadsheet could read a cell as a formula; leading apostrophes are ignored.
fn is_formula(cell: &str) -> bool {
    let begins = cell.trim_start_matches('\'').starts_with(['=', '+', '-', '@', '\t', '\r']);
    begins && cell.parse::<f64>().is_err()
}

/// A cell as written: quoted if it contains a separator of cells or rows, after an apostrophe if it could be read as a
/// formula.
#[must_use]
pub fn quoted(cell: &str) -> String {
    let marked = if is_formula(cell) { format!("'{cell}") } else { cell.to_owned() };
    let cell = marked.as_str();
    if cell.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.to_owned()
    }
}

/// The value of a written cell; the inverse of [`quoted`].
#[must_use]
pub fn unquoted(written: &str) -> String {
    let inner = written.strip_prefix('"').and_then(|rest| rest.strip_suffix('"'));
    let cell = inner.map_or_else(|| written.to_owned(), |cell| cell.replace("\"\"", "\""));
    match cell.strip_prefix('\'') {
        Some(marked) if is_formula(marked) => marked.to_owned(),
        _ => cell,
    }
}

/// Rows of a table. Line breaks within quotes do not end a row.
#[must_use]
pub fn rows(text: &str) -> Vec<&str> {
    first_rows(text, usize::MAX)
}

/// The first `count` rows of a table.
#[must_use]
pub fn first_rows(text: &str, count: usize) -> Vec<&str> {
    let rows = split(text, '\n', count).into_iter();
    rows.map(|row| row.strip_suffix('\r').unwrap_or(row)).collect()
}

/// Cells of a row.
#[must_use]
pub fn cells(row: &str) -> Vec<String> {
    first_cells(row, usize::MAX)
}

/// The first `count` cells of a row.
#[must_use]
pub fn first_cells(row: &str, count: usize) -> Vec<String> {
    let mut cells: Vec<String> = split(row, ',', count).into_iter().map(unquoted).collect();
    if row.ends_with(',') && cells.len() < count {
        cells.push(String::new());
    }
    cells
}

/// The first `count` parts between separators outside quotes; an empty part after the last separator is dropped.
fn split(text: &str, separator: char, count: usize) -> Vec<&str> {
    let (mut parts, mut start, mut within) = (Vec::new(), 0, false);
    for (at, c) in text.char_indices() {
        if parts.len() >= count {
            return parts;
        }
        within ^= c == '"';
        if c == separator && !within {
            parts.push(&text[start..at]);
            start = at + 1;
        }
    }
    if start < text.len() && parts.len() < count {
        parts.push(&text[start..]);
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formulas_are_marked_and_numbers_are_not() {
        for cell in ["=cmd|' /C calc'!A0", "+1+2", "-x", "@sum", "\tx", "'=x", "''-", "-"] {
            assert!(quoted(cell).trim_start_matches('"').starts_with('\''), "{cell:?}");
            assert_eq!(unquoted(&quoted(cell)), cell);
        }
        for cell in ["-1.5e-3", "+2", "'quoted'", "a=b", "-inf"] {
            assert_eq!(quoted(cell), cell);
            assert_eq!(unquoted(cell), cell);
        }
    }

    #[test]
    fn what_is_written_is_read_again() {
        let table = [["a", "1,5", ""], ["say \"no\"", "two\nlines", "\r\n"], ["\"", ",", "c"]];
        let row = |cells: &[&str; 3]| cells.map(quoted).join(",");
        let text: String = table.iter().map(|cells| row(cells) + "\n").collect();
        let found: Vec<Vec<String>> = rows(&text).into_iter().map(cells).collect();
        assert_eq!(found, table.map(|row| row.map(String::from).to_vec()));
        // CRLF line ends, and a last line without line end.
        assert_eq!(rows("a,b\r\n1,2"), ["a,b", "1,2"]);
        assert_eq!(cells("1,,\"x\""), ["1", "", "x"]);
        // A limited number of rows and cells.
        assert_eq!(first_rows("a\n\"b\nc\"\nd\n", 2), ["a", "\"b\nc\""]);
        assert_eq!((first_cells("1,2,", 2), first_cells(",,", 9).len()), (cells("1,2"), 3));
    }
}
