//! What a run's record says before anything is done.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use super::inputs::inputs;
use super::resources::this_process;
use crate::report::record::{RunRecord, VERSION, Verdict};
use crate::scene::Plan;

/// Mark of `run.json`.
pub(super) const FORMAT: &str = "kanagata-run";

/// Name and version of the program.
pub const PROGRAM: &str = concat!("kanagata-solve ", env!("CARGO_PKG_VERSION"));

/// The record of a run that begins.
pub(super) fn first_record(plan: &Plan, scene: &Path, unknowns: usize) -> RunRecord {
    RunRecord {
        format: FORMAT.into(),
        version: VERSION,
        program: PROGRAM.into(),
        name: plan.scene.name.clone(),
        verdict: Verdict::Running,
        message: None,
        increments: 0,
        iterations: 0,
        cuts: 0,
        snaps: 0,
        stabilised_increments: 0,
        unstable: 0,
        first_unstable: None,
        buckles: 0,
        first_buckle: None,
        released_elastic_nmm: 0.0,
        factorisations: 0,
        updates: 0,
        cycling: 0,
        wall_s: 0.0,
        cpu_s: 0.0,
        peak_mb: 0.0,
        timings_s: BTreeMap::new(),
        threads: rayon::current_num_threads(),
        unknowns,
        force_error: 0.0,
        energy_error: 0.0,
        unaccounted_nmm: 0.0,
        opened: None,
        stored_energy_error: 0.0,
        released_force_work_nmm: 0.0,
        artificial_energy_nmm: 0.0,
        work_nmm: 0.0,
        volume_error: None,
        penetration_mm: 0.0,
        thickness: None,
        doubts: Vec::new(),
        self_penetration: None,
        hourglass: None,
        through_thickness_shear: None,
        overhang: None,
        face_penetration: None,
        necking: None,
        inside_tool: None,
        holder_lift: None,
        tools_never_touched: Vec::new(),
        strain: None,
        springback: None,
        convergence_order: None,
        inputs: inputs(plan),
        scene: fs::canonicalize(scene).ok().map(|p| p.to_string_lossy().into_owned()),
        stages: plan.scene.stages.len(),
        left_out: Vec::new(),
        process: this_process(),
    }
}
