//! The record of a run at its start.

use std::fs;
use std::path::Path;

use super::build::{BUILD, cpu_class};
use super::inputs::inputs;
use super::resources::this_process;
use kanagata_report::record::{IncrementErrorRecord, RunRecord, VERSION, Verdict};
use kanagata_scene::Plan;

/// Value of `format` in `run.json`.
pub(super) const FORMAT: &str = "kanagata-run";

/// Name and version of the program.
pub const PROGRAM: &str = concat!("kanagata-solve ", env!("CARGO_PKG_VERSION"));

/// The record of a new run.
pub(super) fn first_record(plan: &Plan, scene: &Path, unknowns: usize) -> RunRecord {
    RunRecord {
        format: FORMAT.into(),
        version: VERSION,
        program: PROGRAM.into(),
        build: BUILD.into(),
        cpu: cpu_class().into(),
        name: plan.scene.name.clone(),
        verdict: Verdict::Running,
        threads: rayon::current_num_threads(),
        unknowns,
        inputs: inputs(plan),
        scene: fs::canonicalize(scene).ok().map(|p| p.to_string_lossy().into_owned()),
        set: plan.set.clone(),
        stages: plan.scene.stages.len(),
        quality: plan.scene.quality,
        increment_error: plan.scene.solver.increment_error.map(|allowed| IncrementErrorRecord {
            allowed: Some(allowed),
            ..IncrementErrorRecord::default()
        }),
        process: this_process(),
        ..RunRecord::default()
    }
}
