//! `kanagata audit TOOL... --cad FILE` and `kanagata audit TOOL --against TOOL`.

use std::path::{Path, PathBuf};

use super::cad::{LostFaces, read_model};
use super::ended::print_doubts;
use super::exit::{EXIT_HELP, Exit, Failure};
use super::own::refuse_clashes;
use super::quantity::{angle_deg, length_mm};
use super::say::{err, out};
use crate::audit::clearance::{ClearanceOptions, ClearanceReport, clearance};
use crate::audit::{
    Audit, AuditError, AuditOptions, AuditReport, CadReference, audit, doubts, map, page, view,
};
use crate::cad::raw::LostFace;
use crate::contact::ToolSurface;
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

/// The tools against another one.
fn clearances(args: &AuditArgs, against: &Path, thickness_mm: f64) -> Result<Vec<Exit>, Failure> {
    let die = ToolSurface::new(read(against)?.model);
    if args.tools.len() > 1 {
        let (clearance, pinch, below) = ("clearance [mm]", "pinch %", "below %");
        out!("{:32} {:>8} {clearance:>14} {pinch:>9} {below:>11}", "tool", "patches");
    }
    let each = |tool: &PathBuf| cleared(args, tool, &die, thickness_mm);
    let found = args.tools.iter().map(each).collect::<Result<Vec<_>, _>>()?;
    let (reports, exits): (Vec<_>, Vec<_>) = found.into_iter().unzip();
    write_json(args, &reports)?;
    Ok(exits)
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

/// The figures of one of several tools.
fn print_row(tool: &Path, r: &AuditReport) {
    out!(
        "{:32} {:>8} {:>+10.5} {:>+10.5} {:>10.5} {:>10.5} {:>8.3} {:>8.3} {:>9.1e}",
        short(tool),
        r.patches,
        r.max_mm,
        r.min_mm,
        r.rms_mm,
        r.percentiles_mm.p99,
        r.normal_max_deg,
        r.jumps.normal_deg,
        r.jumps.position_mm.max(r.jumps.border_gap_mm)
    );
}

/// One tool against another.
fn cleared(
    args: &AuditArgs,
    tool: &Path,
    against: &ToolSurface,
    thickness_mm: f64,
) -> Result<(ClearanceReport, Exit), Failure> {
    let loaded = read(tool)?;
    let options = ClearanceOptions {
        travel: args.travel.unwrap_or_else(Vec3::zeros),
        thickness_mm,
        samples: args.samples.max(2),
        refine: 256,
        nearest: 10,
    };
    let mut r = clearance(&loaded.model, against, &options);
    r.tool_file = file_name(tool);
    r.against_file = args.against.as_deref().map_or_else(String::new, file_name);
    let Some(min) = r.min_mm else {
        write_json(args, &[&r])?;
        return Err(Failure::input(format!(
            "{}: no point faces {} at the end of the travel; check --travel and the tools' sides",
            tool.display(),
            r.against_file
        )));
    };
    let [pinch, below] = [100.0 * r.pinch, 100.0 * r.share_below];
    if args.tools.len() > 1 {
        out!(
            "{:32} {:>8} {min:>14.5} {pinch:>9.2} {below:>11.3}",
            short(tool),
            loaded.model.patches.len()
        );
    } else {
        print_clearance(&r, min);
    }
    let exit = if r.pinch > args.pinch { Exit::Limit } else { Exit::Done };
    Ok((r, exit))
}

fn print_clearance(r: &ClearanceReport, min: f64) {
    out!("{} against {} after {:?} mm", r.tool_file, r.against_file, r.travel_mm);
    out!(
        "  least clearance {min:.5} mm, {:.2} % below the {} mm asked for",
        100.0 * r.pinch,
        r.thickness_mm
    );
    out!(
        "  {:.3} % of the {:.1} mm2 that face each other have less",
        100.0 * r.share_below,
        r.facing_mm2
    );
    for n in r.nearest.iter().take(3) {
        let [x, y, z] = n.point;
        out!(
            "  patch {} on face {}: {:.5} mm to patch {} at ({x:.3}, {y:.3}, {z:.3})",
            n.patch,
            n.face,
            n.clearance_mm,
            n.against
        );
    }
}

fn file_name(p: &Path) -> String {
    p.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Folder and name, without the ending: what a table has room for.
fn short(p: &Path) -> String {
    let folder = p.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy();
    let name = file_name(p);
    let name = name.strip_suffix(".tool.json").unwrap_or(&name);
    if folder.is_empty() { name.to_owned() } else { format!("{folder}/{name}") }
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

fn print_borders(r: &AuditReport) {
    let b = &r.borders;
    if let (Some([x, y, z]), Some(face)) = (b.at, b.face) {
        out!(
            "  free borders: tool up to {:.5} mm from the CAD's, CAD up to {:.5} mm from the tool's, largest at ({x:.3}, {y:.3}, {z:.3}) mm on face {face}; compared every {:.3} mm",
            b.tool_to_cad_mm,
            b.cad_to_tool_mm,
            b.step_mm
        );
    }
}

fn print_report(r: &AuditReport) {
    out!("{} against {}: {} patches, {} points", r.tool_file, r.cad_file, r.patches, r.points);
    out!(
        "  shape error {:+.5} to {:+.5} mm, rms {:.5} mm; 99 % of the area within {:.5} mm",
        r.min_mm,
        r.max_mm,
        r.rms_mm,
        r.percentiles_mm.p99
    );
    out!(
        "  normal error up to {:.3} deg; across shared edges normals jump by up to {:.3} deg",
        r.normal_max_deg,
        r.jumps.normal_deg
    );
    out!(
        "  {} edges shared, {} of them creases, gap up to {:.1e} mm; {} sides do not meet their neighbours', gap up to {:.5} mm",
        r.jumps.shared_edges,
        r.jumps.creases,
        r.jumps.position_mm,
        r.jumps.open_sides,
        r.jumps.border_gap_mm
    );
    if let (Some([x, y, z]), Some(patch)) = (r.jumps.border_gap_at, r.jumps.border_gap_patch) {
        out!("    that gap is at patch {patch} at ({x:.3}, {y:.3}, {z:.3})");
    }
    print_borders(r);
    if !r.folded.is_empty() {
        out!(
            "  {} patches fold, the first ones {:?}",
            r.folded.len(),
            &r.folded[..r.folded.len().min(8)]
        );
    }
    for w in r.worst.iter().take(3) {
        out!(
            "  patch {} on face {}: {:+.5} mm at ({:.3}, {:.3}, {:.3})",
            w.patch,
            w.face,
            w.delta_mm,
            w.point[0],
            w.point[1],
            w.point[2]
        );
    }
    if let Some(tolerance) = r.tolerance_mm {
        let kept = if r.within_tolerance == Some(true) { "within" } else { "ABOVE" };
        out!("  {kept} the {tolerance} mm asked for");
    }
}
