//! `kanagata convert FILE -o TOOL`.

use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::cad::read_model;
use super::exit::{EXIT_HELP, Exit, Failure};
use super::mesh::MesherArgs;
use super::quantity::{angle_deg, length_mm};
use crate::audit::AuditReport;
use crate::cad::Model;
use crate::convert::bezier::{BezierOptions, bezier_from_cad};
use crate::convert::tolerance::{Goal, ToleranceError, to_patches, to_tolerance};
use crate::convert::{ConvertError, ConvertOptions, ConvertReport, convert};
use crate::files::sha256_hex;
use crate::geometry::Vec3;
use crate::mesh::{attach, io};
use crate::tool::build::StraightEdge;
use crate::tool::edge::EdgeRule;
use crate::tool::exchange::{to_bezier, to_nagata};
use crate::tool::file::{Provenance, ToolFile};
use crate::tool::{ToolKind, ToolModel};

/// Arguments of `convert`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Examples:\n  kanagata convert die.igs -o die.tool.json --sheet-side +z\n  \
    kanagata convert punch.stp -o punch.tool.json --sheet-side=-z --arc-divisions 6\n  \
    kanagata convert die.igs -o die.tool.json --sheet-side +z --tol 0.01mm --normal-tol 0.5deg\n  \
    kanagata convert die.igs -o die.tool.json --mesh die.msh\n  \
    kanagata convert die.tool.json -o bezier.tool.json --to bezier\n\n{EXIT_HELP}"))]
pub struct ConvertArgs {
    /// IGES or STEP file; with --to a tool file
    file: PathBuf,
    /// Tool file
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Name of the tool; from the output file when not given
    #[arg(long)]
    name: Option<String>,
    /// What the patches are
    #[arg(long, value_enum, default_value_t = Kind::Nagata)]
    kind: Kind,
    /// From a tool file to one of this kind: Nagata patches and facets to biquadratic Bezier patches (Eq. 15), and back
    #[arg(long, value_enum, value_name = "KIND")]
    to: Option<To>,
    /// How edges are curved; `guarded` when not given, with --tol or --patches `cad`
    #[arg(long, value_enum)]
    edge: Option<Edge>,
    /// Write a tool file although patches fold
    #[arg(long)]
    allow_folds: bool,
    /// Side the sheet is on: the model is turned round when its faces look the other way on the whole
    #[arg(long, value_enum, value_name = "SIDE", allow_hyphen_values = true)]
    sheet_side: Option<SheetSide>,
    /// Turn the model round
    #[arg(long)]
    flip: bool,
    /// Normals of neighbouring faces closer than this are one [degrees]
    #[arg(long, value_name = "DEG", default_value_t = 0.5)]
    smooth_deg: f64,
    /// Take this mesh (.msh, .stl, .obj, .vtu) instead of making one
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// Refine until the largest |shape error| is within this, as `0.01mm` [mm], with as few patches as that takes
    #[arg(long, value_name = "LENGTH", value_parser = length_mm, conflicts_with_all = ["mesh", "patches"])]
    tol: Option<f64>,
    /// Refine until the largest normal error is within this, as `0.5deg` [degrees]
    #[arg(long, value_name = "ANGLE", value_parser = angle_deg, conflicts_with_all = ["mesh", "patches"])]
    normal_tol: Option<f64>,
    /// As small an error as so many patches can have
    #[arg(long, value_name = "N", conflicts_with = "mesh")]
    patches: Option<usize>,
    /// With --tol or --patches: leave all vertices on the CAD instead of balancing them about it
    #[arg(long)]
    on_cad: bool,
    #[command(flatten)]
    mesher: MesherArgs,
}

/// Kinds of patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// Nagata patches
    Nagata,
    /// Flat triangles and bilinear quadrilaterals
    Facets,
    /// Bezier patches of degree 1 to 6 straight from the CAD's faces, within --tol (1e-4 mm when not given)
    Bezier,
}

/// Kinds that tool files are converted to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum To {
    /// Nagata patches
    Nagata,
    /// Bezier patches
    Bezier,
}

/// Rules for edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Edge {
    /// Eq. 8 where its curve runs forward, straight elsewhere
    Guarded,
    /// Eq. 8 everywhere, also where it fails
    Plain,
    /// Eq. 8, and where it leaves the curve open or fails, through the CAD; given in the tool file
    Cad,
}

/// Sides along the coordinate axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SheetSide {
    /// Towards +x
    #[value(name = "+x")]
    PlusX,
    /// Towards -x
    #[value(name = "-x")]
    MinusX,
    /// Towards +y
    #[value(name = "+y")]
    PlusY,
    /// Towards -y
    #[value(name = "-y")]
    MinusY,
    /// Towards +z
    #[value(name = "+z")]
    PlusZ,
    /// Towards -z
    #[value(name = "-z")]
    MinusZ,
}

impl SheetSide {
    fn direction(self) -> Vec3 {
        match self {
            Self::PlusX => Vec3::x(),
            Self::MinusX => -Vec3::x(),
            Self::PlusY => Vec3::y(),
            Self::MinusY => -Vec3::y(),
            Self::PlusZ => Vec3::z(),
            Self::MinusZ => -Vec3::z(),
        }
    }
}

impl From<ConvertError> for Failure {
    fn from(error: ConvertError) -> Self {
        Self::input(error)
    }
}

impl From<ToleranceError> for Failure {
    fn from(error: ToleranceError) -> Self {
        Self::input(error)
    }
}

/// What a conversion gives, whichever way it was made.
struct Converted {
    tool: ToolModel,
    report: ConvertReport,
    refined: Option<(AuditReport, f64)>,
}

/// Converts the file.
///
/// # Errors
/// Exit code 2 for a file that is no CAD, cannot be meshed or not within the tolerance, 4 when files cannot be read
/// or written.
pub fn run(args: &ConvertArgs) -> Result<Exit, Failure> {
    if let Some(to) = args.to {
        return exchange(args, to);
    }
    let model = read_model(&args.file)?;
    if args.kind == Kind::Bezier {
        return bezier(args, &model);
    }
    let options = options(args);
    let made = if is_refined(args) {
        refined(args, &model, &options)?
    } else {
        let mesh = match &args.mesh {
            Some(path) => attach::attach(&io::read(path)?, &model)?,
            None => args.mesher.mesh(&args.file, &model)?,
        };
        let (tool, report) = convert(&model, &mesh, &options)?;
        Converted { tool, report, refined: None }
    };
    if !made.report.folded.is_empty() && !args.allow_folds && edge(args) != Edge::Plain {
        print_report(&made);
        return Err(Failure::input(format!(
            "{}: {} patches fold; allowed: none; mesh finer (--arc-divisions, --max-size-mm, --tol), or write them with --allow-folds",
            args.file.display(),
            made.report.folded.len()
        )));
    }
    let provenance = provenance(args, &model.unit, made.refined.as_ref().map(|r| r.0.worst_mm()))?;
    ToolFile::of_model(&made.tool, options.edges, provenance).write(&args.output)?;
    print_report(&made);
    println!("  {}", args.output.display());
    Ok(Exit::Done)
}

/// Bezier patches straight from the CAD, a quarter turn in 1, 2, 4 ... patches until they are within the tolerance.
fn bezier(args: &ConvertArgs, model: &Model) -> Result<Exit, Failure> {
    const TOLERANCE: f64 = 1e-4;
    const FINEST: usize = 64;
    let tolerance_mm = args.tol.unwrap_or(TOLERANCE);
    let options = BezierOptions {
        name: args.name.clone().unwrap_or_else(|| stem(&args.output)),
        tolerance_mm,
        sheet_side: args.sheet_side.map(SheetSide::direction),
        flip: args.flip,
    };
    let mut divisions = 1;
    let (tool, report) = loop {
        let mesh = match &args.mesh {
            Some(path) => attach::attach(&io::read(path)?, model)?,
            None => args.mesher.with_divisions(divisions).mesh(&args.file, model)?,
        };
        let (tool, report) = bezier_from_cad(model, &mesh, &options)?;
        if report.error_mm <= tolerance_mm && (report.folded.is_empty() || args.allow_folds) {
            break (tool, report);
        }
        divisions *= 2;
        if divisions > FINEST || args.mesh.is_some() {
            return Err(Failure::input(format!(
                "{}: Bezier patches of degree 6 are {:.2e} mm off on patch {}, and {} fold; allowed: {tolerance_mm} mm, none; allow more with --tol and --allow-folds, or mesh finer",
                args.file.display(),
                report.error_mm,
                report.worst,
                report.folded.len()
            )));
        }
    };
    let mut provenance = provenance(args, &model.unit, Some(report.error_mm))?;
    provenance.mesher = match &args.mesh {
        Some(_) => provenance.mesher,
        None => args.mesher.with_divisions(divisions).describe(),
    };
    provenance.mesher += &format!(" bezier tol-mm={tolerance_mm}");
    ToolFile::of_model(&tool, EdgeRule::Guarded, provenance).write(&args.output)?;
    println!(
        "{} patches of degree up to {}, {:.2e} mm off the CAD's surfaces at most",
        tool.patches.len(),
        report.degree,
        report.error_mm
    );
    if report.turned {
        println!("  turned round to look at the sheet");
    }
    println!("  {}", args.output.display());
    Ok(Exit::Done)
}

/// A tool file from one kind to another.
fn exchange(args: &ConvertArgs, to: To) -> Result<Exit, Failure> {
    let loaded = crate::tool::file::read(&args.file)?;
    let mut tool = match to {
        To::Bezier => to_bezier(&loaded.model),
        To::Nagata => {
            let (tool, lost) = to_nagata(&loaded.model)
                .map_err(|e| Failure::input(format!("{}: {e}", args.file.display())))?;
            println!("largest discrepancy {:.3e} mm, on patch {}", lost.max_mm, lost.patch);
            tool
        }
    };
    tool.name = args.name.clone().unwrap_or(tool.name);
    let mut provenance = loaded.provenance;
    provenance.mesher += &format!(" to={to:?}").to_lowercase();
    provenance.shape_error_mm = provenance.shape_error_mm.filter(|_| to == To::Bezier);
    ToolFile::of_model(&tool, EdgeRule::Guarded, provenance).write(&args.output)?;
    println!("{} patches\n  {}", tool.patches.len(), args.output.display());
    Ok(Exit::Done)
}

fn edge(args: &ConvertArgs) -> Edge {
    let usual = if is_refined(args) { Edge::Cad } else { Edge::Guarded };
    args.edge.unwrap_or(usual)
}

fn is_refined(args: &ConvertArgs) -> bool {
    args.tol.is_some() || args.normal_tol.is_some() || args.patches.is_some()
}

fn options(args: &ConvertArgs) -> ConvertOptions {
    ConvertOptions {
        name: args.name.clone().unwrap_or_else(|| stem(&args.output)),
        kind: match args.kind {
            Kind::Nagata => ToolKind::Nagata,
            Kind::Facets => ToolKind::Facets,
            Kind::Bezier => ToolKind::Bezier,
        },
        edges: match edge(args) {
            Edge::Plain => EdgeRule::Plain,
            Edge::Guarded | Edge::Cad => EdgeRule::Guarded,
        },
        through_cad: edge(args) == Edge::Cad,
        smooth_deg: args.smooth_deg,
        sheet_side: args.sheet_side.map(SheetSide::direction),
        flip: args.flip,
    }
}

fn refined(
    args: &ConvertArgs,
    model: &Model,
    options: &ConvertOptions,
) -> Result<Converted, Failure> {
    let mesh = args.mesher.mapped_for_refinement()?;
    let found = match args.patches {
        Some(patches) => to_patches(model, &mesh, options, patches, !args.on_cad)?,
        None => {
            let goal = Goal {
                tol_mm: args.tol.unwrap_or(f64::INFINITY),
                normal_deg: args.normal_tol.unwrap_or(f64::INFINITY),
                two_sided: !args.on_cad,
            };
            to_tolerance(model, &mesh, options, &goal)?
        }
    };
    Ok(Converted {
        tool: found.tool,
        report: found.report,
        refined: Some((found.audit, found.moved_mm)),
    })
}

/// The file's name without `.tool.json`.
fn stem(path: &Path) -> String {
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let stem = name.strip_suffix(".json").unwrap_or(&name);
    stem.strip_suffix(".tool").unwrap_or(stem).to_owned()
}

fn provenance(
    args: &ConvertArgs,
    unit: &str,
    shape_error_mm: Option<f64>,
) -> Result<Provenance, Failure> {
    let bytes = std::fs::read(&args.file)
        .map_err(|e| Failure::new(Exit::Io, format!("cannot read {}: {e}", args.file.display())))?;
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(Provenance {
        cad_file: name(&args.file),
        cad_sha256: sha256_hex(&bytes),
        cad_unit: unit.to_owned(),
        mesher: match &args.mesh {
            Some(path) => format!("mesh file {}", name(path)),
            None if is_refined(args) => {
                format!("{}{}", args.mesher.describe_refinement(), goal(args))
            }
            None => args.mesher.describe(),
        },
        program: concat!("kanagata ", env!("CARGO_PKG_VERSION")).into(),
        shape_error_mm,
    })
}

/// What was refined to, for the provenance.
fn goal(args: &ConvertArgs) -> String {
    let tol = args.tol.map_or_else(String::new, |t| format!(" tol-mm={t}"));
    let normal = args.normal_tol.map_or_else(String::new, |t| format!(" normal-tol-deg={t}"));
    let patches = args.patches.map_or_else(String::new, |n| format!(" patches={n}"));
    let vertices = if args.on_cad { " vertices=on-cad" } else { " vertices=balanced" };
    let edges = format!(" edges={}", format!("{:?}", edge(args)).to_lowercase());
    format!("{tol}{normal}{patches}{vertices}{edges}")
}

fn print_report(made: &Converted) {
    let (patches, vertices) = (made.tool.patches.len(), made.tool.vertices.len());
    let report = &made.report;
    println!("{patches} patches, {vertices} vertices, {} crease edges", report.creases);
    if let Some((audit, moved)) = &made.refined {
        println!(
            "  shape error {:+.5} to {:+.5} mm, normal error up to {:.3} deg; vertices up to {moved:.5} mm off the CAD",
            audit.min_mm, audit.max_mm, audit.normal_max_deg
        );
    }
    if report.turned {
        println!("  turned round to look at the sheet");
    }
    list_edges(made, &report.straight, "straight");
    list_edges(made, &report.bent, "follows the CAD, off its normals");
    if report.split > 0 {
        eprintln!("warning: {} folded quadrilaterals split in two triangles", report.split);
    }
    for &patch in report.folded.iter().take(MOST_LISTED) {
        let p = at(made, &made.tool.corners[patch as usize].vertices);
        let face = made.tool.faces[patch as usize];
        eprintln!("warning: patch {patch} on face {face} near {p} folds; mesh finer there");
    }
}

/// Edges and patches listed, at most.
const MOST_LISTED: usize = 50;

/// Mean of some vertices, to be read.
fn at(made: &Converted, vertices: &[u32]) -> String {
    let sum: Vec3 = vertices.iter().map(|&v| made.tool.vertices[v as usize]).sum();
    let p = sum / vertices.len() as f64;
    format!("({:.3}, {:.3}, {:.3}) mm", p.x, p.y, p.z)
}

fn list_edges(made: &Converted, edges: &[StraightEdge], what: &str) {
    for edge in edges.iter().take(MOST_LISTED) {
        let ([a, b], p) = (edge.vertices, at(made, &edge.vertices));
        let patches: Vec<String> = edge.patches.iter().map(u32::to_string).collect();
        let patches = patches.join(", ");
        eprintln!("warning: edge {a}-{b} of patches {patches} near {p}: {what}; {}", edge.fault);
    }
    if edges.len() > MOST_LISTED {
        eprintln!("warning: and {} more edges: {what}", edges.len() - MOST_LISTED);
    }
}
