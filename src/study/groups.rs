//! Groups of cases that share a task.

use std::path::Path;

use super::case::Case;
use super::case_file::CaseFile;
use super::inputs::folder_of;
use super::runner::Group;

/// Groups prepared cases, in their order, to at least `task_s` of expected time (lower estimates). A case without
/// estimate is a group of its own.
pub(super) fn groups(cases: &[&Case], study: &Path, task_s: f64) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    // Lower estimate of the last group [s]; `None` if it is complete.
    let mut open: Option<f64> = None;
    for case in cases {
        let file = CaseFile::read(&folder_of(study, &case.id)).ok();
        let threads = file.as_ref().map_or(1, |file| file.threads);
        let expected = file.and_then(|file| file.expected);
        let Some(expected) = expected else {
            let cases = vec![case.id.clone()];
            groups.push(Group { cases, threads, memory_mb: None, seconds: None });
            open = None;
            continue;
        };
        let [low, high] = expected.seconds;
        let total = match (open, groups.last_mut()) {
            (Some(before), Some(group)) if group.threads == threads => {
                group.cases.push(case.id.clone());
                group.memory_mb = group.memory_mb.map(|mb| mb.max(expected.memory_mb));
                group.seconds = group.seconds.map(|s| s + high);
                before + low
            }
            _ => {
                groups.push(Group {
                    cases: vec![case.id.clone()],
                    threads,
                    memory_mb: Some(expected.memory_mb),
                    seconds: Some(high),
                });
                low
            }
        };
        open = (total < task_s).then_some(total);
    }
    groups
}
