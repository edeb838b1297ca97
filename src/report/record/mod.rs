//! The records of a run folder: `history.csv`, `iterations.csv` and `run.json`.

mod accuracy;
mod doubts;
mod files;
mod formability;
mod history;
mod increment_error;
mod origin;
mod quality;
mod section;
mod sheet;

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::doubt::Doubt;
use kanagata_files::{WriteError, write_atomic};

pub use accuracy::{AccuracyRecord, QuantityRecord, SequenceEnd, SequenceRunRecord};
pub use files::{FilesRecord, StepFilesRecord};
pub use formability::{
    FormabilityRecord, LimitMarginRecord, ThinningRecord, TurnedPathsRecord, ZoneShares,
};
pub use history::{Energies, History, HistoryRow, IterationRow, write_iterations};
pub use increment_error::IncrementErrorRecord;
pub use origin::{ExcludedPatchesRecord, Process};
pub use quality::{Quality, QualityVerdict};
pub use section::{SectionRecord, WallRecord};
pub use sheet::{
    FacePenetrationRecord, HolderLiftRecord, HolderLostRecord, HolderPressureRecord,
    HourglassRecord, InsideToolRecord, MaximumForceRecord, NeckingKind, NeckingRecord,
    NormalDisplacementRecord, OverhangRecord, PlasticStrainRecord, PressurePeakRecord,
    SelfPenetrationRecord, SpringbackRecord, StrainRecord, ThicknessRecord,
    ThroughThicknessShearRecord, UnaccountedEnergyRecord, WaveRecord, WavesRecord,
};

/// How a run ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The run is in progress, or its process was killed.
    #[default]
    Running,
    /// All stages done, no doubts.
    Completed,
    /// All stages done; `doubts` lists why the result must not be trusted as it is.
    Doubtful,
    /// The solver did not converge; the last converged state is on disk.
    NotConverged,
    /// Stopped on request; it can continue from its checkpoint.
    Stopped,
}

/// `run.json`: inputs, cost and outcome of a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RunRecord {
    /// `kanagata-run`.
    pub format: String,
    /// File version: [`VERSION`].
    pub version: u32,
    /// Version of the program that wrote it.
    pub program: String,
    /// Scene name.
    pub name: String,
    /// Outcome of the run.
    pub verdict: Verdict,
    /// The solver's message if the run ended early.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
    /// Increments completed.
    pub increments: usize,
    /// Newton iterations, including those of increments that were cut.
    pub iterations: usize,
    /// Step cuts: increments that were repeated with a shorter step.
    pub step_cuts: usize,
    /// Snap-throughs: the sheet moved to an equilibrium that is not near the previous one.
    #[serde(default)]
    pub snap_throughs: usize,
    /// Elastic energy released in snap-throughs [N mm].
    #[serde(default)]
    pub released_elastic_nmm: f64,
    /// Increments that needed viscous stabilisation (active-set cycling); it was removed before they were accepted.
    #[serde(default)]
    pub stabilised_increments: usize,
    /// Increments that ended in an unstable equilibrium (buckling or wrinkling); step cuts found no stable one.
    #[serde(default)]
    pub unstable_increments: usize,
    /// First increment that ended in an unstable equilibrium.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_unstable: Option<usize>,
    /// Bucklings: the sheet left an unstable equilibrium along its softest mode and reached a stable one.
    #[serde(default)]
    pub buckles: usize,
    /// Increment of the first buckling.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_buckle: Option<usize>,
    /// Factorisations of the tangent matrix.
    #[serde(default)]
    pub factorisations: usize,
    /// Updates of the factors for a changed active set, in place of a factorisation.
    #[serde(default)]
    pub updates: usize,
    /// Iterations with active-set cycling, in which only some of the violated contact states were changed.
    #[serde(default)]
    pub active_set_cycling: usize,
    /// Wall time [s].
    pub wall_s: f64,
    /// Processor time of all threads [s].
    pub cpu_s: f64,
    /// Peak memory of the process [MB].
    pub peak_mb: f64,
    /// Wall time by phase [s]. `search`: search of the tools and projection on their patches. `contact`: contact
    /// conditions. `elements`: element loop and assembly. `factor`, `update`, `solve`: factorisation, updates of the
    /// factors, substitution. `stability`: factorisations for the stability of every equilibrium. `penetration`:
    /// penetration of element faces.
    pub timings_s: BTreeMap<String, f64>,
    /// Threads used.
    pub threads: usize,
    /// Unknowns of the model.
    pub unknowns: usize,
    /// Largest difference of tool forces and nodal contact forces, over the force.
    pub force_error: f64,
    /// Unaccounted energy over `work_nmm`, or over the rounding error of the work if that is larger.
    pub energy_error: f64,
    /// Unaccounted energy so far [N mm]: external work less the energy found in the sheet and in friction.
    #[serde(default)]
    pub unaccounted_nmm: f64,
    /// The increment with the largest change of the unaccounted energy.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_unaccounted: Option<UnaccountedEnergyRecord>,
    /// Work of the internal forces (trapezoidal rule) that is neither elastic energy nor plastic work, relative to the
    /// same work as `energy_error`. It decreases with the length of the increments.
    #[serde(default)]
    pub stored_energy_error: f64,
    /// Estimated error of the forces from the length of the increments; absent in files of older programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub increment_error: Option<IncrementErrorRecord>,
    /// Work that forces of released tools did on the sheet [N mm]; negative where it springs back against them.
    #[serde(default)]
    pub released_force_work_nmm: f64,
    /// Artificial (hourglass) energy [N mm]: work of the stabilisation of elements under pressure through the
    /// thickness.
    #[serde(default)]
    pub artificial_energy_nmm: f64,
    /// Largest work done on the sheet, or by its internal forces, up to any increment [N mm].
    #[serde(default)]
    pub work_nmm: f64,
    /// Largest relative volume error over the increments. It compares the volumes of the elements with the undeformed
    /// volumes changed by the elastic strains of their material points; magnitudes are summed. None for a material
    /// without plasticity.
    #[serde(default)]
    pub volume_error: Option<f64>,
    /// Deepest penetration of a node at the end of an increment [mm].
    pub penetration_mm: f64,
    /// Largest penetration of a tool into an element face, between its nodes, over all increments.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub face_penetration: Option<FacePenetrationRecord>,
    /// Localised thinning: a band, or a thickness below what sheet metals withstand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub necking: Option<NeckingRecord>,
    /// Thickness of the sheet in the last equilibrium; absent in files of older programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thickness: Option<ThicknessRecord>,
    /// Why the result must not be trusted as it is: doubts about the scene, then about the result so far
    /// (`docs/reference/doubts.md`).
    #[serde(default)]
    pub doubts: Vec<Doubt>,
    /// Self-penetration of the sheet: self-contact is not modelled.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub self_penetration: Option<SelfPenetrationRecord>,
    /// Hourglass mode: forces are far too low there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hourglass: Option<HourglassRecord>,
    /// Through-thickness shear at the friction limit, where elements or layers do not resolve it: forces are wrong
    /// by factors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub through_thickness_shear: Option<ThroughThicknessShearRecord>,
    /// Overhang of the sheet at a tool edge: forces there depend on the mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub overhang: Option<OverhangRecord>,
    /// Nodes inside a tool at the end of a stage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inside_tool: Option<InsideToolRecord>,
    /// The blank holder that the sheet pushed back farthest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub holder_lift: Option<HolderLiftRecord>,
    /// The first blank holder under force that the sheet left.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub holder_lost: Option<HolderLostRecord>,
    /// Contact pressure under each blank holder: a tool that a force presses against a stationary one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub holder_pressure: Vec<HolderPressureRecord>,
    /// Waves of the sheet between two tools; absent where none can be evaluated: no sheet under compression between
    /// tools, or a material without a stress history.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub waves: Option<WavesRecord>,
    /// Tools that have travelled and never touched the sheet; only of a run that has ended.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tools_never_touched: Vec<String>,
    /// Strains of the sheet in the last equilibrium; absent in files of older programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strain: Option<StrainRecord>,
    /// Formability in the last equilibrium with tools: thinning, margin to the forming limit, zones, strain paths; absent
    /// before the first equilibrium, and in files of older programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub formability: Option<FormabilityRecord>,
    /// Limits of quality of the scene; absent if it has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quality: Option<Quality>,
    /// Springback from the last equilibrium with tools to the current one without; absent while tools are present.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub springback: Option<SpringbackRecord>,
    /// Estimated errors, of a run that ends a sequence of runs to an accuracy.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<AccuracyRecord>,
    /// Sections of the sheet that the scene asks for, at the end of the run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sections: Vec<SectionRecord>,
    /// Order of convergence of the Newton iteration: median over the increments in which it can be measured (2:
    /// quadratic).
    pub convergence_order: Option<f64>,
    /// SHA-256 of the scene and of every file it names (tools, mesh of the blank, history). Keys are paths as given in
    /// the scene.
    pub inputs: BTreeMap<String, String>,
    /// The absolute path of the scene file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<String>,
    /// Values of the scene that were set from outside, `PATH=VALUE`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub set: Vec<String>,
    /// Files of the run; empty in files of older programs.
    #[serde(default)]
    pub files: FilesRecord,
    /// Number of stages of the scene; 0 in files of older programs.
    #[serde(default)]
    pub stages: usize,
    /// Tool patches excluded by `--auto` because the sheet cannot touch them.
    #[serde(rename = "left_out", default, skip_serializing_if = "Vec::is_empty")]
    pub excluded_patches: Vec<ExcludedPatchesRecord>,
    /// Build that computed it: version, commit, profile, features; of a continued run all of them, joined by `then`.
    #[serde(default)]
    pub build: String,
    /// Class of vector instructions used (`x86-v3`, `x86-v4`, `aarch64`, `scalar`); of a continued run all of them.
    #[serde(default)]
    pub cpu: String,
    /// The process that wrote the record, if the system identifies it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub process: Option<Process>,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Running => "running",
            Self::Completed => "completed",
            Self::Doubtful => "doubtful",
            Self::NotConverged => "not converged",
            Self::Stopped => "stopped",
        })
    }
}

/// Version of `run.json`.
pub const VERSION: u32 = 2;

impl RunRecord {
    /// Parses the bytes of a `run.json`.
    ///
    /// # Errors
    /// Another version, or a key that is missing or has the wrong type.
    pub fn parse(text: &[u8]) -> Result<Self, String> {
        #[derive(Deserialize)]
        struct Head {
            version: u32,
        }
        let head: Head = serde_json::from_slice(text).map_err(|e| e.to_string())?;
        if head.version != VERSION {
            return Err(format!(
                "version {} of run.json, where this program reads version {VERSION}",
                head.version
            ));
        }
        serde_json::from_slice(text).map_err(|e| e.to_string())
    }
}

impl Verdict {
    /// Whether all stages are done.
    #[must_use]
    pub fn is_complete(self) -> bool {
        matches!(self, Self::Completed | Self::Doubtful)
    }
}

impl RunRecord {
    /// Writes the complete `run.json`.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        write_atomic(path, |w| {
            serde_json::to_writer_pretty(&mut *w, self)?;
            writeln!(w)
        })
    }
}
