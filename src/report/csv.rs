//! Tables of comma-separated values (RFC 4180).
//!
//! Programs for tables take text that begins with `=`, `+`, `-`, `@`, a tab or a carriage return for a formula. Such a cell is
//! written behind an apostrophe, which is taken away again on reading; numbers stay as they are.

/// Whether a cell could be taken for a formula, apostrophes before it passed over.
fn is_formula(cell: &str) -> bool {
    let begins = cell.trim_start_matches('\'').starts_with(['=', '+', '-', '@', '\t', '\r']);
    begins && cell.parse::<f64>().is_err()
}

/// A cell as it is written: in quotes where it has what separates cells or rows, behind an apostrophe where it could be taken
/// for a formula.
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

/// The cell of what is written.
#[must_use]
pub fn unquoted(written: &str) -> String {
    let inner = written.strip_prefix('"').and_then(|rest| rest.strip_suffix('"'));
    let cell = inner.map_or_else(|| written.to_owned(), |cell| cell.replace("\"\"", "\""));
    match cell.strip_prefix('\'') {
        Some(marked) if is_formula(marked) => marked.to_owned(),
        _ => cell,
    }
}

/// Rows of a table: its lines, but for breaks within quotes.
#[must_use]
pub fn rows(text: &str) -> Vec<&str> {
    split(text, '\n').into_iter().map(|row| row.strip_suffix('\r').unwrap_or(row)).collect()
}

/// Cells of a row.
#[must_use]
pub fn cells(row: &str) -> Vec<String> {
    let mut cells: Vec<String> = split(row, ',').into_iter().map(unquoted).collect();
    if row.ends_with(',') {
        cells.push(String::new());
    }
    cells
}

/// Parts between separators that are not within quotes; none behind the last one.
fn split(text: &str, separator: char) -> Vec<&str> {
    let (mut parts, mut start, mut within) = (Vec::new(), 0, false);
    for (at, c) in text.char_indices() {
        within ^= c == '"';
        if c == separator && !within {
            parts.push(&text[start..at]);
            start = at + 1;
        }
    }
    if start < text.len() {
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
        // Lines that end as elsewhere, and a last one that does not end.
        assert_eq!(rows("a,b\r\n1,2"), ["a,b", "1,2"]);
        assert_eq!(cells("1,,\"x\""), ["1", "", "x"]);
    }
}
