//! Proof of a case's outcome by the `run.json` of its run.

use std::collections::BTreeMap;
use std::path::Path;

use kanagata_files::Input;
use kanagata_report::record::{RunRecord, Verdict};
use kanagata_run::build::BUILD;

/// SHA-256 of the scene and of the files it names, by name as in the scene, as in `run.json`.
pub(super) type Inputs = BTreeMap<String, String>;

/// What the run in a case's folder proves.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Proof {
    /// There is no run.
    None,
    /// A run of the same inputs and build that has not ended, or was stopped.
    Unfinished,
    /// All stages are done.
    Done,
    /// The solver did not converge; its message.
    NotConverged(Option<String>),
    /// The run is of other inputs or of another build: what differs.
    Other(String),
}

/// Reads the proof in the case's folder `case` for a run of `inputs` by this build.
pub(super) fn proof(case: &Path, inputs: &Inputs) -> Proof {
    proof_and_record(case, inputs).0
}

/// The proof as [`proof`] has it, and the record that it is read from.
pub(super) fn proof_and_record(case: &Path, inputs: &Inputs) -> (Proof, Option<RunRecord>) {
    let Ok(text) = kanagata_files::read(&case.join("run/run.json"), Input::Description) else {
        return (Proof::None, None);
    };
    match RunRecord::parse(&text) {
        Ok(record) => (proof_of(&record, inputs), Some(record)),
        Err(found) => (Proof::Other(format!("its run.json cannot be read: {found}")), None),
    }
}

/// What a record proves for a run of `inputs` by this build.
fn proof_of(record: &RunRecord, inputs: &Inputs) -> Proof {
    if let Some(what) = difference([&record.build, BUILD], [&record.inputs, inputs]) {
        return Proof::Other(what);
    }
    match record.verdict {
        Verdict::Completed | Verdict::Doubtful => Proof::Done,
        Verdict::NotConverged => Proof::NotConverged(record.message.clone()),
        Verdict::Running | Verdict::Stopped => Proof::Unfinished,
    }
}

/// The first difference between two builds and their inputs, in words; the second of each is the present one.
pub(super) fn difference(builds: [&str; 2], inputs: [&Inputs; 2]) -> Option<String> {
    let [then, now] = inputs;
    for (name, digest) in now {
        match then.get(name) {
            None => return Some(format!("{name} was not among its inputs")),
            Some(before) if before != digest => return Some(format!("{name} has changed")),
            Some(_) => {}
        }
    }
    if let Some(name) = then.keys().find(|name| !now.contains_key(*name)) {
        return Some(format!("{name} is no longer among its inputs"));
    }
    let [then, now] = builds;
    (then != now).then(|| {
        let then = if then.is_empty() { "unknown" } else { then };
        format!("its build is {then}, this program is {now}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_names_the_input_or_the_build() {
        let of = |list: &[(&str, &str)]| -> Inputs {
            list.iter().map(|(name, sha)| ((*name).to_owned(), (*sha).to_owned())).collect()
        };
        let first = of(&[("scene", "1"), ("die.json", "2")]);
        let found = |now: &Inputs, build: &str| difference(["b", build], [&first, now]);
        assert_eq!(found(&first, "b"), None);
        let text = |now: &[(&str, &str)]| found(&of(now), "b").unwrap();
        assert_eq!(text(&[("scene", "1"), ("die.json", "3")]), "die.json has changed");
        assert_eq!(text(&[("scene", "1")]), "die.json is no longer among its inputs");
        let more = [("scene", "1"), ("die.json", "2"), ("mesh.inp", "4")];
        assert_eq!(text(&more), "mesh.inp was not among its inputs");
        assert_eq!(found(&first, "c").unwrap(), "its build is b, this program is c");
    }
}
