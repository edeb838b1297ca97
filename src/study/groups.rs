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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case_file::Expected;
    use crate::proof::Inputs;

    #[test]
    fn short_cases_share_a_task_until_it_is_long_enough() {
        let folder = tempfile::tempdir().unwrap();
        let study = folder.path();
        let case = |id: &str| Case {
            id: id.into(),
            options: Vec::new(),
            follows: None,
            scene: serde_json::Value::Null,
        };
        let cases: Vec<Case> = ["a", "b", "c", "d", "e"].map(case).into();
        let put = |id: &str, seconds: Option<[f64; 2]>, memory_mb: f64| {
            let own = folder_of(study, id);
            std::fs::create_dir_all(&own).unwrap();
            let mut file = CaseFile::new(id, None, Inputs::new(), 2);
            file.expected = seconds.map(|seconds| Expected { unknowns: 1, memory_mb, seconds });
            file.write(&own).unwrap();
        };
        put("a", Some([200.0, 400.0]), 50.0);
        put("b", Some([150.0, 300.0]), 90.0);
        put("c", Some([10.0, 20.0]), 10.0);
        put("d", None, 0.0);
        put("e", Some([500.0, 900.0]), 20.0);
        let all: Vec<&Case> = cases.iter().collect();
        let found = groups(&all, study, 300.0);
        let names: Vec<String> = found.iter().map(|group| group.cases.join("+")).collect();
        assert_eq!(names, ["a+b", "c", "d", "e"]);
        assert_eq!((found[0].memory_mb, found[0].seconds), (Some(90.0), Some(700.0)));
        assert_eq!((found[2].memory_mb, found[2].seconds), (None, None));
        assert_eq!(groups(&all, study, 0.0).len(), 5);
    }
}
