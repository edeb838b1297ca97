//! Results of the best run in the folder of a sequence.

use std::fs;
use std::path::Path;

use super::error::AccuracyError;
use super::runner::Sequence;
use kanagata_files::{Input, WriteError, remove_where, write_atomic};
use kanagata_report::doubt::DoubtCode;
use kanagata_report::record::{
    FacePenetrationRecord, IncrementErrorRecord, RunRecord, SequenceEnd, Verdict,
};
use kanagata_run::checkpoint;

/// Folder of the runs of a sequence, in the folder of its results.
pub const RUNS: &str = "accuracy";

impl Sequence {
    /// Copies the files of the best run into `output`, with the estimated errors in its `run.json`, and returns that
    /// record.
    ///
    /// # Errors
    /// [`AccuracyError::Results`] for a file of the run that cannot be read, [`AccuracyError::Write`].
    pub fn publish(&self, output: &Path) -> Result<RunRecord, AccuracyError> {
        let fault =
            |path: &Path, found: String| AccuracyError::Results { path: path.into(), found };
        let path = self.best.join("run.json");
        let text = kanagata_files::read(&path, Input::Description);
        let text = text.map_err(|e| fault(&path, e.to_string()))?;
        let mut record = RunRecord::parse(&text).map_err(|found| fault(&path, found))?;
        // A record must not stand beside files of another run.
        remove_where(output, |name| name == "run.json" || name == "report.html");
        checkpoint::remove(output);
        for inner in ["steps", "tools"] {
            let folder = output.join(inner);
            fs::create_dir_all(&folder)
                .map_err(|source| WriteError { path: folder.clone(), source })?;
            remove_where(&folder, |name| name.ends_with(".vtu"));
            let files = fs::read_dir(self.best.join(inner)).into_iter().flatten().flatten();
            for file in files.filter(|file| file.path().extension().is_some_and(|e| e == "vtu")) {
                copy(&file.path(), &folder.join(file.file_name()))?;
            }
        }
        for name in ["history.csv", "iterations.csv", "run.pvd"] {
            let from = self.best.join(name);
            if from.exists() {
                copy(&from, &output.join(name))?;
            }
        }
        record.accuracy = Some(self.record.clone());
        self.drop_judged_doubts(&mut record);
        record.doubts.extend(self.record.doubt());
        if record.verdict.is_complete() {
            let sound = record.doubts.is_empty();
            record.verdict = if sound { Verdict::Completed } else { Verdict::Doubtful };
        }
        record.write(&output.join("run.json"))?;
        Ok(record)
    }
}

impl Sequence {
    /// Drops doubts about what the estimated errors contain.
    fn drop_judged_doubts(&self, record: &mut RunRecord) {
        // What tools in faces of elements change: the less, the finer the mesh.
        let depth = record.face_penetration.as_ref().map_or(0.0, |found| found.depth_rel);
        if self.judges_contact() && depth <= FacePenetrationRecord::ALLOWED_IN_SEQUENCE_REL {
            record.doubts.retain(|doubt| doubt.code != DoubtCode::PenetrationOnFaces);
        }
        if self.judges_increments(record) {
            record.doubts.retain(|doubt| doubt.code != DoubtCode::IncrementsTooLong);
        }
    }

    /// Whether the errors are as small as asked with what the increments leave, which is a part of them: the value that the
    /// sequence gives its runs is an aim, not a limit of the scene.
    fn judges_increments(&self, record: &RunRecord) -> bool {
        let of_work = record.increment_error.map_or(0.0, |error| error.of_work);
        self.record.end == SequenceEnd::Reached && of_work <= IncrementErrorRecord::ALLOWED_REL
    }

    /// Whether a force and the thickness were asked for, and are as accurate: what tools in faces of elements change.
    fn judges_contact(&self) -> bool {
        let asked = |name: &str| {
            self.record.quantities.iter().any(|q| q.name.starts_with(name) && q.allowed.is_some())
        };
        self.record.end == SequenceEnd::Reached && asked("force.") && asked("thickness")
    }
}

/// Copies a file, complete or not at all.
fn copy(from: &Path, to: &Path) -> Result<(), AccuracyError> {
    let fault =
        |e: std::io::Error| AccuracyError::Results { path: from.into(), found: e.to_string() };
    let (mut file, _) = kanagata_files::open(from, Input::Mesh).map_err(fault)?;
    write_atomic(to, |w| std::io::copy(&mut file, w).map(drop))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_report::record::{AccuracyRecord, QuantityRecord};

    #[test]
    fn contact_is_judged_where_force_and_thickness_were_asked_for() {
        let judged = |asked: &[&str], end: SequenceEnd| {
            let quantity = |name: &str| QuantityRecord {
                name: name.into(),
                unit: "mm".into(),
                value: 1.0,
                error: Some(0.01),
                allowed: asked.contains(&name).then_some(0.02),
                parts: Default::default(),
                order: None,
            };
            let record = AccuracyRecord {
                end,
                quantities: ["force.punch", "thickness", "draw_in"].map(quantity).into(),
                runs: Vec::new(),
                unmeasured: Vec::new(),
                cpu_s: 0.0,
                last_cpu_s: 0.0,
            };
            Sequence { record, best: Default::default() }.judges_contact()
        };
        assert!(judged(&["force.punch", "thickness"], SequenceEnd::Reached));
        assert!(!judged(&["force.punch", "thickness"], SequenceEnd::Time));
        assert!(!judged(&["thickness", "draw_in"], SequenceEnd::Reached));
        assert!(!judged(&["force.punch"], SequenceEnd::Reached));
    }

    #[test]
    fn increments_are_judged_by_the_errors_that_they_are_part_of() {
        let sequence = |end| {
            let record = AccuracyRecord { end, ..AccuracyRecord::default() };
            Sequence { record, best: Default::default() }
        };
        let run = |of_work| {
            let error = IncrementErrorRecord { of_work, ..IncrementErrorRecord::default() };
            RunRecord { increment_error: Some(error), ..RunRecord::default() }
        };
        assert!(sequence(SequenceEnd::Reached).judges_increments(&run(0.01)));
        assert!(!sequence(SequenceEnd::Reached).judges_increments(&run(0.06)));
        assert!(!sequence(SequenceEnd::Options).judges_increments(&run(0.01)));
    }
}
