//! Prepares the cases of a study: the folder of each with its scene and `case.json`, and their order.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::StudyError;
use super::case::Case;
use super::case_file::{CaseFile, Expected, SCENE};
use super::follow::ranks;
use super::inputs::{Digests, folder_of, inputs, scene_text};
use kanagata_files::{Input, write_atomic};
use kanagata_run::cost::estimate;
use kanagata_scene::preview::SheetCounts;
use kanagata_scene::read::read_for_check;

/// Name of the file with the order of the cases.
const ORDER: &str = "order.json";

/// The order of the cases of a study, `order.json`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Order {
    /// Groups of cases: those of a group follow only cases of earlier groups.
    pub ranks: Vec<Vec<String>>,
}

impl Order {
    /// Reads the order of the study in `folder`.
    ///
    /// # Errors
    /// [`StudyError::Io`] when there is none, [`StudyError::Value`] when it is invalid.
    pub fn read(folder: &Path) -> Result<Self, StudyError> {
        let path = folder.join(ORDER);
        let text = kanagata_files::read(&path, Input::Description)
            .map_err(|source| StudyError::Io { path: path.clone(), source })?;
        serde_json::from_slice(&text).map_err(|e| StudyError::Value {
            path,
            place: format!("line {}, column {}", e.line(), e.column()),
            found: e.to_string(),
            allowed: "the order of a study as this program writes it".into(),
        })
    }
}

/// Writes scene and `case.json` of every case, and the order of `all` cases. What is there already and is of the same
/// inputs, build and threads is kept. `say` receives what could not be prepared.
///
/// # Errors
/// [`StudyError::Folder`], [`StudyError::Write`].
pub fn prepare(
    cases: &[Case],
    all: &[Case],
    study: &Path,
    threads: usize,
    say: &(dyn Fn(&str) + Sync),
) -> Result<(), StudyError> {
    let names = ranks(all).iter().map(|r| r.iter().map(|c| c.id.clone()).collect()).collect();
    let order = Order { ranks: names };
    write_atomic(&study.join(ORDER), |w| {
        serde_json::to_writer_pretty(&mut *w, &order)?;
        writeln!(w)
    })?;
    let digests = Digests::default();
    let mut expected: BTreeMap<&str, Option<Expected>> = BTreeMap::new();
    for case in ranks(cases).into_iter().flatten() {
        match inputs(case, study, &digests, false) {
            Ok(inputs) => {
                let leader = case.follows.as_deref().and_then(|l| expected.get(l).copied()?);
                let new = CaseFile::new(&case.id, case.follows.clone(), inputs, threads);
                expected.insert(&case.id, prepare_case(case, new, study, leader)?);
            }
            Err(reason) => {
                put_scene(case, study)?;
                say(&format!("{}: not prepared: {reason}", case.id));
            }
        }
    }
    Ok(())
}

/// Writes scene and `case.json` of a case whose leader is expected to need `leader`. Returns what it is expected to need.
fn prepare_case(
    case: &Case,
    mut new: CaseFile,
    study: &Path,
    leader: Option<Expected>,
) -> Result<Option<Expected>, StudyError> {
    let folder = folder_of(study, &case.id);
    let scene = put_scene(case, study)?;
    if let Ok(known) = CaseFile::read(&folder) {
        new.expected = known.expected;
        if known == new {
            return Ok(new.expected);
        }
    }
    // The history that a case follows may not be there yet: it takes about what its leader takes.
    new.expected = expected(&scene, new.threads).or(leader);
    new.write(&folder)?;
    Ok(new.expected)
}

/// Writes the scene of a case into its folder and returns its path.
fn put_scene(case: &Case, study: &Path) -> Result<PathBuf, StudyError> {
    let folder = folder_of(study, &case.id);
    fs::create_dir_all(&folder)
        .map_err(|source| StudyError::Folder { path: folder.clone(), source })?;
    let scene = folder.join(SCENE);
    let text = scene_text(case);
    if kanagata_files::read(&scene, Input::Description).ok().as_deref() != Some(text.as_slice()) {
        write_atomic(&scene, |w| w.write_all(&text))?;
    }
    Ok(scene)
}

/// Expected resources of the run of a scene; `None` if it cannot be set up.
fn expected(scene: &Path, threads: usize) -> Option<Expected> {
    let (plan, large) = read_for_check(scene, &[]).ok()?;
    let (setup, sheet) = match large {
        Some(large) => (plan.one_element(scene).ok()?, large.counts),
        None => {
            let check = plan.coarsened().map_or_else(|| plan.clone(), |(coarse, _)| coarse);
            let setup = check.simulation_setup(scene).ok()?;
            let counts = SheetCounts::of_blank(&plan.scene.blank);
            let sheet = counts.unwrap_or_else(|| SheetCounts::of_mesh(setup.body.mesh()));
            (setup, sheet)
        }
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().ok()?;
    let cost = pool.install(|| estimate(&setup, &sheet));
    Some(Expected {
        unknowns: cost.unknowns,
        memory_mb: cost.memory_mb.ceil(),
        // Whole seconds: an estimate has no more digits.
        seconds: cost.seconds.map(f64::ceil),
    })
}
