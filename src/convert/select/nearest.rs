//! Names that come nearest to one that is not there.

use std::collections::BTreeSet;

/// Number of names compared, and characters of each.
const COMPARED_MAX: usize = 5_000;
const LENGTH_MAX: usize = 64;
/// Names listed.
const LISTED_MAX: usize = 8;

/// The names nearest to `item`, as text; what there is when there are few.
pub(super) fn nearest(item: &str, names: impl Iterator<Item = String>) -> String {
    let names: BTreeSet<String> = names.take(COMPARED_MAX).collect();
    let count = names.len();
    if count == 0 {
        return "the file names none".into();
    }
    let wanted: Vec<char> = item.to_lowercase().chars().take(LENGTH_MAX).collect();
    let mut by_distance: Vec<(usize, String)> =
        names.into_iter().map(|name| (distance(&wanted, &name), name)).collect();
    by_distance.sort();
    let listed = by_distance.iter().take(LISTED_MAX).map(|(_, name)| format!("'{name}'"));
    let listed = listed.collect::<Vec<_>>().join(", ");
    if count <= LISTED_MAX {
        format!("there: {listed}")
    } else {
        format!("nearest of {count}: {listed}")
    }
}

/// Smallest number of characters to insert, delete or replace (Levenshtein distance), whatever their case.
fn distance(wanted: &[char], name: &str) -> usize {
    let name: Vec<char> = name.to_lowercase().chars().take(LENGTH_MAX).collect();
    let mut row: Vec<usize> = (0..=name.len()).collect();
    for (i, a) in wanted.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, b) in name.iter().enumerate() {
            let replaced = diagonal + usize::from(a != b);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[name.len()]
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn the_name_with_the_fewest_changes_comes_first() {
        let names = ["binder", "die", "punch"];
        let found = nearest("DIA", names.iter().map(ToString::to_string));
        assert!(found.starts_with("there: 'die', "), "{found}");
        let many = (0..100).map(|k| format!("face{k}"));
        let found = nearest("face71x", many);
        assert!(found.starts_with("nearest of 100: 'face71', "), "{found}");
        assert_eq!(nearest("x", std::iter::empty()), "the file names none");
    }
}
