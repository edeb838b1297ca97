//! Runs of a study that do not compare: they were computed in different ways, or their results cannot be read.

use std::collections::BTreeMap;

use super::row::Row;
use crate::LISTED_MAX;

/// Cases by the build or the class of processors of their runs.
type Classes<'a> = BTreeMap<&'a str, Vec<&'a str>>;

/// A note if the runs are of several builds, one if those that are done were computed on several classes of processors, and
/// one if their files cannot be read, each with the cases.
pub(super) fn notes(rows: &[Row<'_>]) -> Vec<String> {
    let mut builds = Classes::new();
    let mut processors = Classes::new();
    for row in rows {
        builds.entry(&row.build).or_default().push(&row.case.id);
        if let Some(record) = row.record.as_ref().filter(|_| row.done()) {
            processors.entry(&record.cpu).or_default().push(&row.case.id);
        }
    }
    let of_builds = several(builds).map(|list| {
        format!(
            "Runs were computed by several builds: {list}. Those that are not of this build are stale and take no part in the comparison."
        )
    });
    let of_processors = several(processors).map(|list| {
        format!(
            "Runs were computed on several classes of processors: {list}. Their results differ in rounding; compare runs of one class."
        )
    });
    of_builds.into_iter().chain(of_processors).chain(unread(rows)).collect()
}

/// Files that cannot be read of cases that are done, in words.
fn unread(rows: &[Row<'_>]) -> Option<String> {
    let mut files = Classes::new();
    for row in rows {
        row.unread.iter().for_each(|file| files.entry(file).or_default().push(&row.case.id));
    }
    (!files.is_empty()).then(|| {
        let list = files.iter().map(listed).collect::<Vec<_>>().join("; ");
        format!(
            "Files of runs cannot be read, and their results are left out: {list}. Remove the folder `run` of these cases and run them again."
        )
    })
}

/// The classes with their cases, in words; `None` unless there are several. What is unknown is no class.
fn several(mut classes: Classes<'_>) -> Option<String> {
    classes.remove("");
    (classes.len() > 1).then(|| classes.iter().map(listed).collect::<Vec<_>>().join("; "))
}

/// A class with its cases, in words.
fn listed((class, cases): (&&str, &Vec<&str>)) -> String {
    let named = cases.iter().take(LISTED_MAX).copied().collect::<Vec<_>>().join(", ");
    let more = match cases.len().saturating_sub(LISTED_MAX) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    format!("{class} ({named}{more})")
}
