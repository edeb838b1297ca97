//! `kanagata audit TOOL... --cad FILE` and `kanagata audit TOOL --against TOOL`.

mod clearance;
mod print;

use std::path::{Path, PathBuf};

use self::clearance::clearances;
use self::print::{file_name, print_report, print_row};
use super::cad::{LostFaces, read_model};
use super::ended::print_doubts;
use super::exit::{EXIT_HELP, Exit, Failure};
use super::own::refuse_clashes;
use super::quantity::{angle_deg, length_mm};
use super::say::{err, out};
use crate::audit::{
    Audit, AuditError, AuditOptions, AuditReport, CadReference, audit, doubts, map, page, view,
};
use crate::cad::raw::LostFace;
use crate::files::{sha256_hex, write_atomic};
use crate::geometry::Vec3;
use crate::report::doubt::Doubt;
use crate::tool::file::{Provenance, ToolFileError, read};

/// Arguments of `audit`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Example:\n  kanagata audit die.tool.json --cad die.igs --tol 0.02 \
    --json die.audit.json --vtu die.audit.vtu --html die.audit.html\n  \
    kanagata audit coarse.tool.json fine.tool.json --cad die.igs\n  \
    kanagata audit punch.tool.json --against die.tool.json --travel 0,0,-60 --thickness 0.8\n\n{EXIT_HELP}"))]
pub struct AuditArgs {
    /// Tool files; several are compared in one table
    #[arg(required = true, value_name = "TOOL")]
    tools: Vec<PathBuf>,
    /// The CAD file they were made from
    #[arg(long, value_name = "FILE", required_unless_present = "against")]
    cad: Option<PathBuf>,
    /// Clearance to this tool file at the end of --travel, against --thickness; exit code 1 below it
    #[arg(long, value_name = "TOOL", requires = "thickness", conflicts_with_all = ["cad", "vtu", "html", "map"])]
    against: Option<PathBuf>,
    /// Travel of the tools, as 0,0,-60 [mm]
    #[arg(long, value_name = "X,Y,Z", value_parser = vector_mm, allow_hyphen_values = true, requires = "against")]
    travel: Option<Vec3>,
    /// Thickness of the sheet, as `0.8mm` [mm]
    #[arg(long, value_name = "LENGTH", value_parser = length_mm, requires = "against")]
    thickness: Option<f64>,
    /// Share of the thickness that the clearance may fall short of it
    #[arg(long, value_name = "SHARE", default_value_t = 0.01, requires = "against")]
    pinch: f64,
    /// Largest |shape error| and largest deviation of free borders allowed [mm]; exit code 1 above it
    #[arg(long, value_name = "LENGTH", value_parser = length_mm)]
    tol: Option<f64>,
    /// Largest normal error allowed [degrees]; exit code 1 above it
    #[arg(long, value_name = "ANGLE", value_parser = angle_deg)]
    normal_tol: Option<f64>,
    /// Intervals of the grid of points along a side of a patch
    #[arg(long, value_name = "N", default_value_t = 8)]
    samples: usize,
    /// End with exit code 0 although there are doubts; they are listed all the same
    #[arg(long)]
    accept_doubts: bool,
    /// Write the figures; with several tools a list of them
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write the patches coloured by their error
    #[arg(long, value_name = "FILE")]
    vtu: Option<PathBuf>,
    /// Write a map (SVG): the tool seen along -z, coloured by its shape error
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
    /// Write a page with tables, histogram and a 3-D view
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
}

impl AuditArgs {
    /// Files that are read.
    fn inputs(&self) -> Vec<&Path> {
        self.tools.iter().chain(&self.cad).chain(&self.against).map(PathBuf::as_path).collect()
    }

    /// Files that are written, by their options.
    fn outputs(&self) -> [(&'static str, Option<&Path>); 4] {
        [
            ("--json", self.json.as_deref()),
            ("--vtu", self.vtu.as_deref()),
            ("--map", self.map.as_deref()),
            ("--html", self.html.as_deref()),
        ]
    }
}

impl From<AuditError> for Failure {
    fn from(error: AuditError) -> Self {
        Self::input(error)
    }
}

impl From<ToolFileError> for Failure {
    fn from(error: ToolFileError) -> Self {
        let exit = if matches!(error, ToolFileError::Io { .. }) { Exit::Io } else { Exit::Input };
        Self::new(exit, error)
    }
}

/// Audits the tools.
///
/// # Errors
/// Exit code 2 for bad input, 4 when files cannot be read or written.
pub fn run(args: &AuditArgs) -> Result<Exit, Failure> {
    let several = args.tools.len() > 1;
    if several && (args.vtu.is_some() || args.html.is_some() || args.map.is_some()) {
        return Err(Failure::input(
            "--vtu, --map and --html with several tools; allowed: with one; the table is printed, --json writes a list",
        ));
    }
    refuse_clashes(&args.inputs(), &args.outputs())?;
    let exits = match (&args.against, args.thickness, &args.cad) {
        (Some(against), Some(thickness), _) => clearances(args, against, thickness)?,
        (_, _, Some(cad)) => audits(args, cad)?,
        _ => Vec::new(),
    };
    Ok(if exits.contains(&Exit::Limit) { Exit::Limit } else { Exit::Done })
}

/// The tools against their CAD.
fn audits(args: &AuditArgs, cad: &Path) -> Result<Vec<Exit>, Failure> {
    let model = read_model(cad, LostFaces::LeaveOut)?;
    let reference = CadReference::new(&model);
    if args.tools.len() > 1 {
        out!(
            "{:32} {:>8} {:>10} {:>10} {:>10} {:>10} {:>8} {:>8} {:>9}",
            "tool",
            "patches",
            "max [mm]",
            "min [mm]",
            "rms [mm]",
            "p99 [mm]",
            "normal",
            "jump",
            "gap [mm]"
        );
    }
    let cad_sha256 = sha256_of(cad)?;
    let each = |tool: &PathBuf| audited(args, tool, (cad, &cad_sha256), &reference);
    let found = args.tools.iter().map(each).collect::<Result<Vec<_>, _>>()?;
    write_json(args, &found)?;
    let doubts: Vec<Doubt> = found.iter().flat_map(|r| named_doubts(args, r)).collect();
    print_doubts(&doubts, args.accept_doubts);
    Ok(vec![Exit::of_doubts(&doubts, args.accept_doubts)])
}

/// The doubts about a tool; with its file where several are audited.
fn named_doubts(args: &AuditArgs, report: &AuditReport) -> Vec<Doubt> {
    let mut doubts = report.doubts.clone();
    if args.tools.len() > 1 {
        doubts.iter_mut().for_each(|d| d.text = format!("{}: {}", report.tool_file, d.text));
    }
    doubts
}

/// One tool against its CAD.
fn audited(
    args: &AuditArgs,
    tool: &Path,
    (cad, cad_sha256): (&Path, &str),
    reference: &CadReference<'_>,
) -> Result<AuditReport, Failure> {
    let mut loaded = read(tool)?;
    if loaded.provenance.cad_sha256 != cad_sha256 {
        err!(
            "warning: {} was made from another file ({}) than {}; each patch is put on the face nearest to it",
            tool.display(),
            loaded.provenance.cad_file,
            cad.display()
        );
        loaded.model.faces = reference.faces_of(&loaded.model);
    }
    let options = AuditOptions {
        samples: args.samples,
        tolerance_mm: args.tol,
        normal_tolerance_deg: args.normal_tol,
        ..AuditOptions::default()
    };
    let mut found = audit(&loaded.model, reference, &options)?;
    name_inputs(&mut found.report, tool, cad, [loaded.sha256, cad_sha256.to_owned()]);
    found.report.faces_lost.extend(skipped(&loaded.provenance, &found.report.faces_lost));
    found.report.doubts = doubts(&found.report);
    write_pictures(args, &loaded.model, &found)?;
    let r = &found.report;
    if args.tools.len() > 1 {
        print_row(tool, r);
    } else {
        print_report(r);
    }
    Ok(found.report)
}

/// Faces that were left out when the tool was made and are not among the `known` ones: the tool file names them.
fn skipped(provenance: &Provenance, known: &[LostFace]) -> Vec<LostFace> {
    let is_new = |name: &&String| known.iter().all(|f| f.source != **name);
    let new = provenance.faces_lost.iter().filter(is_new);
    let reason = "left out of the tool by --skip-bad-faces";
    new.map(|source| LostFace { source: source.clone(), reason: reason.into() }).collect()
}

/// Three numbers [mm] with commas between.
fn vector_mm(text: &str) -> Result<Vec3, String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|t| t.trim().parse().ok()).collect();
    match numbers[..] {
        [x, y, z] if text.split(',').count() == 3 && [x, y, z].iter().all(|v| v.is_finite()) => {
            Ok(Vec3::new(x, y, z))
        }
        _ => Err("allowed: three numbers with commas between, as 0,0,-60".into()),
    }
}

fn sha256_of(cad: &Path) -> Result<String, Failure> {
    let bytes = crate::files::read(cad, crate::files::Input::Cad)
        .map_err(|e| Failure::new(Exit::Io, format!("cannot read {}: {e}", cad.display())))?;
    Ok(sha256_hex(&bytes))
}

fn name_inputs(report: &mut AuditReport, tool: &Path, cad: &Path, sha256: [String; 2]) {
    report.tool_file = file_name(tool);
    report.cad_file = file_name(cad);
    [report.tool_sha256, report.cad_sha256] = sha256;
}

/// The figures of one tool, or a list of those of several in the order they were named.
fn write_json<R: serde::Serialize>(args: &AuditArgs, reports: &[R]) -> Result<(), Failure> {
    let Some(path) = &args.json else { return Ok(()) };
    write_atomic(path, |w| {
        match reports {
            [one] if args.tools.len() == 1 => serde_json::to_writer_pretty(&mut *w, one)?,
            several => serde_json::to_writer_pretty(&mut *w, several)?,
        }
        writeln!(w)
    })?;
    Ok(())
}

fn write_pictures(
    args: &AuditArgs,
    tool: &crate::tool::ToolModel,
    found: &Audit,
) -> Result<(), Failure> {
    if let Some(path) = &args.vtu {
        view::grid(tool, &found.samples).write(path)?;
    }
    if let Some(path) = &args.map {
        let text = map::svg(tool, found);
        write_atomic(path, |w| w.write_all(text.as_bytes()))?;
    }
    if let Some(path) = &args.html {
        page::page(tool, found).write(path)?;
    }
    Ok(())
}
