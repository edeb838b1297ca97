//! The records of a run folder: `history.csv`, a line an increment, `iterations.csv`, and `run.json`.

mod doubts;
mod history;
mod origin;
mod sheet;

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::doubt::Doubt;
use crate::files::{WriteError, write_atomic};

pub use history::{Energies, History, HistoryRow, IterationRow, write_iterations};
pub use origin::{LeftOutRecord, Process};
pub use sheet::{
    FacePenetrationRecord, HolderLiftRecord, InToolRecord, NeckingKind, NeckingRecord,
    OpenedRecord, OverEdgeRecord, PlasticRecord, ShearedRecord, SpringbackRecord, StrainRecord,
    ThicknessRecord, ThroughItselfRecord, ZigzagRecord,
};

/// How a run ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Still going, or killed.
    #[default]
    Running,
    /// All stages done, without doubts.
    Completed,
    /// All stages done, and `doubts` says why the result must not be trusted as it is.
    Doubtful,
    /// The solver did not converge; the last converged state is on disk.
    NotConverged,
    /// Stopped from outside; it can continue from its checkpoint.
    Stopped,
}

/// `run.json`: what went in, what it cost, how it ended.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RunRecord {
    /// `kanagata-run`.
    pub format: String,
    /// File version: [`VERSION`].
    pub version: u32,
    /// Program version that wrote it.
    pub program: String,
    /// Scene name.
    pub name: String,
    /// How it ended.
    pub verdict: Verdict,
    /// Why the run ended early, from the solver.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
    /// Increments done.
    pub increments: usize,
    /// Newton iterations in them, those of cut increments included.
    pub iterations: usize,
    /// Step cuts: increments that were repeated with a shorter step.
    #[serde(rename = "step_cuts")]
    pub cuts: usize,
    /// Snap-throughs: the sheet moved to an equilibrium that is not near the last one.
    #[serde(default)]
    #[serde(rename = "snap_throughs")]
    pub snaps: usize,
    /// Elastic energy released in snap-throughs [N mm].
    #[serde(default)]
    pub released_elastic_nmm: f64,
    /// Increments that needed viscous stabilisation (active-set cycling); it was removed before they were accepted.
    #[serde(default)]
    pub stabilised_increments: usize,
    /// Increments that ended in an unstable equilibrium, from which the sheet would wrinkle or buckle; shorter
    /// steps found no other.
    #[serde(default)]
    #[serde(rename = "unstable_increments")]
    pub unstable: usize,
    /// The first of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_unstable: Option<usize>,
    /// Bucklings: the sheet left an unstable equilibrium along its softest mode and reached a stable one.
    #[serde(default)]
    pub buckles: usize,
    /// The increment of the first of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_buckle: Option<usize>,
    /// Factorisations of the matrix.
    #[serde(default)]
    pub factorisations: usize,
    /// Times the factors were brought up to date for a changed active set instead.
    #[serde(default)]
    pub updates: usize,
    /// Iterations with active-set cycling, in which only a part of the wrong contact states was changed.
    #[serde(default)]
    #[serde(rename = "active_set_cycling")]
    pub cycling: usize,
    /// Wall time [s].
    pub wall_s: f64,
    /// Processor time of all threads [s].
    pub cpu_s: f64,
    /// Largest memory of the process [MB].
    pub peak_mb: f64,
    /// Wall time by phase [s]. `search`: search of the tools and projection on their patches. `contact`: contact
    /// conditions. `elements`: element loop and assembly. `factor`, `update`, `solve`: factorisation, updates of
    /// the factors, substitution. `stability`: factorisations that judge the stability of every equilibrium.
    /// `penetration`: penetration of faces of elements.
    pub timings_s: BTreeMap<String, f64>,
    /// Threads used.
    pub threads: usize,
    /// Unknowns of the model.
    pub unknowns: usize,
    /// Largest difference of tool forces and nodal contact forces, over the force.
    pub force_error: f64,
    /// Unaccounted energy over `work_nmm`, or over the work of rounding where that is more.
    pub energy_error: f64,
    /// Unaccounted energy so far [N mm]: external work less the energy found in the sheet and in friction.
    #[serde(default)]
    pub unaccounted_nmm: f64,
    /// The increment with the largest change of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[serde(rename = "largest_unaccounted")]
    pub opened: Option<OpenedRecord>,
    /// Work of the inner forces by the trapezoidal rule that is neither elastic energy nor plastic work, as the same share: it
    /// falls with the increments' length.
    #[serde(default)]
    pub stored_energy_error: f64,
    /// Work that forces of released tools did on the sheet [N mm]; negative where it springs back against them.
    #[serde(default)]
    pub released_force_work_nmm: f64,
    /// Artificial (hourglass) energy [N mm]: work of the stabilisation of elements under pressure through the
    /// thickness.
    #[serde(default)]
    pub artificial_energy_nmm: f64,
    /// The most work that had been done on the sheet, or by its inner forces, at any increment [N mm].
    #[serde(default)]
    pub work_nmm: f64,
    /// Largest volume error over the increments, over the volume: volumes of the elements against what the elastic
    /// strains of their points leave of the undeformed ones, summed without regard to sign. None for a material
    /// without plasticity.
    #[serde(default)]
    pub volume_error: Option<f64>,
    /// Deepest penetration of a node at the end of an increment [mm].
    pub penetration_mm: f64,
    /// The deepest penetration of a tool into a face of an element, between its nodes, over all increments.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub face_penetration: Option<FacePenetrationRecord>,
    /// Where the sheet thins in a band of its own, or is thinner than a sheet can be.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub necking: Option<NeckingRecord>,
    /// Thickness of the sheet at the last balance; none in what an older program wrote.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thickness: Option<ThicknessRecord>,
    /// Why the result must not be trusted as it is: doubts about the scene, then about the result so far
    /// (`docs/reference/doubts.md`).
    #[serde(default)]
    pub doubts: Vec<Doubt>,
    /// Self-penetration of the sheet: self-contact is not modelled.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub self_penetration: Option<ThroughItselfRecord>,
    /// Hourglass mode: forces are far too low there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hourglass: Option<ZigzagRecord>,
    /// Through-thickness shear at the friction limit, where elements or layers do not resolve it: forces are wrong
    /// by factors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub through_thickness_shear: Option<ShearedRecord>,
    /// Overhang of the sheet at a tool edge: forces there depend on the mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub overhang: Option<OverEdgeRecord>,
    /// Where the sheet stood inside a tool at the end of a stage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inside_tool: Option<InToolRecord>,
    /// The blank holder that the sheet pushed back farthest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub holder_lift: Option<HolderLiftRecord>,
    /// Tools that have travelled and never touched the sheet, of a run that has ended.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tools_never_touched: Vec<String>,
    /// Strains of the sheet at the last balance; none in what an older program wrote.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strain: Option<StrainRecord>,
    /// From the last balance with tools to the present one without; none while tools are there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub springback: Option<SpringbackRecord>,
    /// Order of convergence of the Newton iteration: median over the increments that show one (a quadratic
    /// iteration has 2).
    pub convergence_order: Option<f64>,
    /// SHA-256 of the scene and of every file it names (tools, a mesh of the blank, a history), by path as the scene has it.
    pub inputs: BTreeMap<String, String>,
    /// The scene file, as a whole path.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<String>,
    /// Stages of the scene; 0 when an older program wrote this.
    #[serde(default)]
    pub stages: usize,
    /// What `--auto` left out: patches that the sheet did not come near.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<LeftOutRecord>,
    /// The process that wrote this, where the system names it.
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
    /// The record in the bytes of a `run.json`.
    ///
    /// # Errors
    /// What was found: another version, or a key that is missing or of another kind.
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
    /// Writes `run.json` whole.
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
