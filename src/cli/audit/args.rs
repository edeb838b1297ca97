//! Arguments of `kanagata audit`.

use std::path::{Path, PathBuf};

use crate::cli::exit::EXIT_HELP;
use crate::cli::paths::{input_path, named_path, output_path};
use crate::cli::quantity::{angle_deg, length_mm};
use crate::cli::stages::QuietArgs;
use crate::geometry::Vec3;

/// Arguments of `audit`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Example:\n  kanagata audit die.tool.json --cad die.igs --tol 0.02 \
    --json die.audit.json --vtu die.audit.vtu --html die.audit.html\n  \
    kanagata audit coarse.tool.json fine.tool.json --cad die.igs\n  \
    kanagata audit punch.tool.json --against die.tool.json --travel 0,0,-60 --thickness 0.8\n\n{EXIT_HELP}"))]
pub struct AuditArgs {
    /// Tool files; several are compared in one table; - for one from standard input
    #[arg(required = true, value_name = "TOOL", value_parser = input_path)]
    pub(super) tools: Vec<PathBuf>,
    /// The CAD file from which the tools were made; - for standard input
    #[arg(long, value_name = "FILE", required_unless_present = "against", value_parser = input_path)]
    pub(super) cad: Option<PathBuf>,
    /// Measure the clearance to this tool at the end of --travel and compare it with --thickness; exit code 1 below it
    #[arg(long, value_name = "TOOL", requires = "thickness", conflicts_with_all = ["cad", "vtu", "html", "map"])]
    pub(super) against: Option<PathBuf>,
    /// Travel of the tools, as 0,0,-60 [mm]
    #[arg(long, value_name = "X,Y,Z", value_parser = vector_mm, allow_hyphen_values = true, requires = "against")]
    pub(super) travel: Option<Vec3>,
    /// Thickness of the sheet, as `0.8mm` [mm]
    #[arg(long, value_name = "LENGTH", value_parser = length_mm, requires = "against")]
    pub(super) thickness: Option<f64>,
    /// Fraction of the thickness by which the clearance may be smaller
    #[arg(long, value_name = "SHARE", default_value_t = 0.01, requires = "against")]
    pub(super) pinch: f64,
    /// Largest allowed |shape error| and deviation of free borders [mm]; exit code 1 above it
    #[arg(long, value_name = "LENGTH", value_parser = length_mm)]
    pub(super) tol: Option<f64>,
    /// Largest allowed normal error [degrees]; exit code 1 above it
    #[arg(long, value_name = "ANGLE", value_parser = angle_deg)]
    pub(super) normal_tol: Option<f64>,
    /// Sampling intervals along a side of a patch
    #[arg(long, value_name = "N", default_value_t = 8)]
    pub(super) samples: usize,
    /// End with exit code 0 in spite of doubts, which are still listed
    #[arg(long)]
    pub(super) accept_doubts: bool,
    /// Write the figures as JSON; with several tools as a list; - for standard output
    #[arg(long, value_name = "FILE", value_parser = output_path)]
    pub(super) json: Option<PathBuf>,
    /// Write the patches coloured by their shape error
    #[arg(long, value_name = "FILE", value_parser = named_path)]
    pub(super) vtu: Option<PathBuf>,
    /// Write a map (SVG): the tool seen along -z, coloured by its shape error
    #[arg(long, value_name = "FILE", value_parser = named_path)]
    pub(super) map: Option<PathBuf>,
    /// Write a page with tables, histogram and a 3-D view
    #[arg(long, value_name = "FILE", value_parser = named_path)]
    pub(super) html: Option<PathBuf>,
    #[command(flatten)]
    pub(super) quiet: QuietArgs,
}

impl AuditArgs {
    /// Input files.
    pub(super) fn inputs(&self) -> Vec<&Path> {
        self.tools.iter().chain(&self.cad).chain(&self.against).map(PathBuf::as_path).collect()
    }

    /// Output files with their options.
    pub(super) fn outputs(&self) -> [(&'static str, Option<&Path>); 4] {
        [
            ("--json", self.json.as_deref()),
            ("--vtu", self.vtu.as_deref()),
            ("--map", self.map.as_deref()),
            ("--html", self.html.as_deref()),
        ]
    }
}

/// Parses three numbers [mm] separated by commas.
fn vector_mm(text: &str) -> Result<Vec3, String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|t| t.trim().parse().ok()).collect();
    match numbers[..] {
        [x, y, z] if text.split(',').count() == 3 && [x, y, z].iter().all(|v| v.is_finite()) => {
            Ok(Vec3::new(x, y, z))
        }
        _ => Err("allowed: three numbers with commas between, as 0,0,-60".into()),
    }
}
