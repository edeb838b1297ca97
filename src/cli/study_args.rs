//! Arguments of `kanagata study`.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use super::exit::EXIT_HELP;
use super::study_runner::RunnerArgs;

/// Arguments of `study`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Example:\n  tools/models out/models\n  \
    kanagata study fixtures/studies/cross-tool.json --tools out/models -o out/study --quick\n  \
    kanagata study fixtures/studies/stability.json -o out/stability\n  \
    kanagata study fixtures/studies/patches.json -o out/patches\n\n\
    Cases that are done are not run again; those that were stopped or killed continue from their\n\
    checkpoint. A study whose runs are of other inputs or of another build ends with exit code 2\n\
    unless --renew is given. The folder then holds order.json, study.csv, cost.csv, study.html, and in\n\
    cases/NAME case.json, case.scene.json and run.\n\
    On a cluster: docs/guide/cluster.md.\n\n{EXIT_HELP}"))]
pub struct StudyArgs {
    /// Study file (schemas/study.schema.json, stability.schema.json or patches.schema.json); with --status or --cancel
    /// the folder of a study
    pub(super) file: PathBuf,
    /// Folder for the results; created if missing
    #[arg(short, long, value_name = "DIR", required_unless_present_any = ["status", "cancel"])]
    pub(super) output: Option<PathBuf>,
    /// Folder that the scene's tool files are relative to; default: the folder of the study
    #[arg(long, value_name = "DIR")]
    pub(super) tools: Option<PathBuf>,
    /// Cases at a time; default 1
    #[arg(long, value_name = "N")]
    pub(super) jobs: Option<NonZeroUsize>,
    /// Only the case of this name, or if there is none all cases whose names contain it, and those they follow; may be
    /// repeated
    #[arg(long, value_name = "CASE")]
    pub(super) only: Vec<String>,
    /// Apply the changes of the study for a coarse trial run
    #[arg(long)]
    pub(super) quick: bool,
    /// Run failed cases again
    #[arg(long)]
    pub(super) again: bool,
    /// Run cases again whose runs are of other inputs or of another build, and lose those
    #[arg(long)]
    pub(super) renew: bool,
    /// Take DIR although a study on another host seems to work in it; refused for a study that is alive on this host
    #[arg(long)]
    pub(super) break_lock: bool,
    /// End with exit code 0 instead of 1 when results are doubtful; tables and pages keep the doubts
    #[arg(long)]
    pub(super) accept_doubts: bool,
    /// Run nothing, only compare existing results
    #[arg(long, conflicts_with_all = ["only", "again", "jobs", "renew", "break_lock"])]
    pub(super) collect: bool,
    /// Run nothing, only write the scene and case.json of every case
    #[arg(long, conflicts_with_all = ["collect", "again"])]
    pub(super) prepare: bool,
    /// Show the state of the study in the folder FILE
    #[arg(long, conflicts_with_all = ["collect", "prepare", "again", "renew", "quick"])]
    pub(super) status: bool,
    /// With --status: print JSON
    #[arg(long, requires = "status")]
    pub(super) json: bool,
    #[command(flatten)]
    pub(super) runner: RunnerArgs,
}

impl StudyArgs {
    /// The folder for the results; given unless another is asked for its state.
    pub(super) fn folder(&self) -> &Path {
        self.output.as_deref().unwrap_or(&self.file)
    }
}
