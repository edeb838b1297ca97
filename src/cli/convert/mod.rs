//! `kanagata convert FILE -o TOOL`.

mod kinds;
mod print;

use std::path::{Path, PathBuf};

use clap::ValueEnum;

use self::kinds::{bezier, exchange};
use self::print::{print_reach, print_report};
use super::cad::read_model;
use super::exit::{EXIT_HELP, Exit, Failure};
use super::mesh::MesherArgs;
use super::quantity::{angle_deg, length_mm};
use crate::audit::AuditReport;
use crate::cad::Model;
use crate::convert::reach::{ReachError, Reached, Zone, within_reach};
use crate::convert::tolerance::Borders as Meeting;
use crate::convert::tolerance::{Goal, ToleranceError, to_patches, to_tolerance};
use crate::convert::{ConvertError, ConvertOptions, ConvertReport, convert};
use crate::files::sha256_hex;
use crate::geometry::Vec3;
use crate::mesh::{attach, io};
use crate::tool::edge::EdgeRule;
use crate::tool::file::{Provenance, ToolFile};
use crate::tool::{ToolKind, ToolModel};

/// Arguments of `convert`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Examples:\n  kanagata convert die.igs -o die.tool.json --sheet-side +z\n  \
    kanagata convert punch.stp -o punch.tool.json --sheet-side=-z --arc-divisions 6\n  \
    kanagata convert die.igs -o die.tool.json --sheet-side +z --tol 0.01mm --normal-tol 0.5deg\n  \
    kanagata convert die.igs -o die.tool.json --mesh die.msh\n  \
    kanagata convert die.stp -o die.tool.json --tol 0.01mm --reach cup.scene.json\n  \
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
    /// Take this mesh (.msh, .stl, .obj, .vtu; other formats through Python's meshio) instead of making one
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// Refine until the largest |shape error| is within this, as `0.01mm` [mm], with as few patches as that takes
    #[arg(long, value_name = "LENGTH", value_parser = length_mm, conflicts_with = "patches")]
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
    /// With --tol or --patches: how the patches of neighbouring faces meet
    #[arg(long, value_enum, default_value_t = Borders::Conforming)]
    borders: Borders,
    /// Leave out faces that the sheet of this scene cannot touch; the tool is the one of this name or output file there
    #[arg(long, value_name = "SCENE", conflicts_with = "mesh")]
    reach: Option<PathBuf>,
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

/// How faces meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Borders {
    /// They share vertices and curves: no gap
    Conforming,
    /// Each face has its own divisions, as few as its own error allows: gaps within the tolerance, measured and reported
    Independent,
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
    refined: Option<Fit>,
}

/// What refinement says of its model.
struct Fit {
    audit: AuditReport,
    /// Largest distance that a vertex was moved off the CAD [mm].
    moved_mm: f64,
    borders: Meeting,
    /// Faces were to be divided independently.
    asked_apart: bool,
}

/// Converts the file.
///
/// # Errors
/// Exit code 2 for a file that is no CAD, cannot be meshed or not within the tolerance, 4 when files cannot be read
/// or written.
pub fn run(args: &ConvertArgs) -> Result<Exit, Failure> {
    check_borders(args)?;
    if let Some(to) = args.to {
        return exchange(args, to);
    }
    if args.mesh.is_some() && is_refined(args) {
        return Err(Failure::input(
            "--tol with --mesh; allowed: with --kind bezier; a given mesh is not refined, leave one of them out",
        ));
    }
    let whole = read_model(&args.file)?;
    let reached = args.reach.as_deref().map(|scene| reach(args, scene, &whole)).transpose()?;
    let model = reached.as_ref().map_or(&whole, |r| &r.model);
    if args.kind == Kind::Bezier {
        return bezier(args, model, reached.as_ref());
    }
    let options = options(args, reached.as_ref());
    let mut made = if is_refined(args) {
        refined(args, model, &options, reached.as_ref())?
    } else {
        let mesh = match &args.mesh {
            Some(path) => attach::attach(&io::read(path)?, model)?,
            None => args.mesher.mesh(&args.file, model)?,
        };
        let (tool, report) = convert(model, &mesh, &options)?;
        Converted { tool, report, refined: None }
    };
    if let Some(reached) = &reached {
        reached.renumber(&mut made.tool);
        made.report.turned = reached.turned;
    }
    if !made.report.folded.is_empty() && !args.allow_folds && edge(args) != Edge::Plain {
        print_report(&made);
        return Err(Failure::input(format!(
            "{}: {} patches fold; allowed: none; mesh finer (--arc-divisions, --max-size-mm, --tol), or write them with --allow-folds",
            args.file.display(),
            made.report.folded.len()
        )));
    }
    let error_mm = made.refined.as_ref().map(|r| r.audit.worst_mm());
    let provenance = provenance(args, &model.unit, error_mm, reached.as_ref())?;
    ToolFile::of_model(&made.tool, options.edges, provenance).write(&args.output)?;
    print_report(&made);
    reached.iter().for_each(print_reach);
    println!("  {}", args.output.display());
    Ok(Exit::Done)
}

/// Refuses independent borders where there is nothing to divide independently.
fn check_borders(args: &ConvertArgs) -> Result<(), Failure> {
    let reason = match args.borders {
        Borders::Conforming => return Ok(()),
        _ if args.to.is_some() => "with --to; a tool file keeps the borders it has",
        _ if args.kind == Kind::Bezier => {
            "with --kind bezier; patches straight from the CAD share their control points; convert to --kind nagata and that file with --to bezier"
        }
        _ if !is_refined(args) => {
            "without --tol, --normal-tol or --patches; nothing is refined, and uniform meshes are conforming"
        }
        Borders::Independent => return Ok(()),
    };
    Err(Failure::input(format!("--borders independent {reason}; or leave --borders out")))
}

/// What of the model the sheet of a scene can touch.
fn reach(args: &ConvertArgs, scene: &Path, model: &Model) -> Result<Reached, Failure> {
    if !args.mesher.is_built_in() {
        return Err(Failure::input(
            "--mesher gmsh with --reach; allowed: the built-in mesher, which takes faces one by one; leave --mesher out",
        ));
    }
    let (read, _) = crate::scene::read::scene_of(scene)?;
    let folder = scene.parent().unwrap_or(Path::new(""));
    let file = args.output.file_name().unwrap_or_default().to_string_lossy();
    let name = args.name.clone().unwrap_or_else(|| stem(&args.output));
    let side = args.sheet_side.map(SheetSide::direction);
    let found = Zone::of_scene(&read, folder, &file, &name)
        .and_then(|zone| within_reach(model, &zone, side, args.flip));
    found.map_err(|e| match e {
        ReachError::Mesh(e) => e.into(),
        other => Failure::input(format!("{}: {other}", scene.display())),
    })
}

/// Side the sheet is on and whether to flip: with a reach that was settled on the whole model.
fn side_and_flip(args: &ConvertArgs, reached: Option<&Reached>) -> (Option<Vec3>, bool) {
    match reached {
        Some(reached) => (None, reached.turned),
        None => (args.sheet_side.map(SheetSide::direction), args.flip),
    }
}

fn edge(args: &ConvertArgs) -> Edge {
    let usual = if is_refined(args) { Edge::Cad } else { Edge::Guarded };
    args.edge.unwrap_or(usual)
}

fn is_refined(args: &ConvertArgs) -> bool {
    let asked = args.tol.is_some() || args.normal_tol.is_some() || args.patches.is_some();
    asked && args.kind != Kind::Bezier
}

fn options(args: &ConvertArgs, reached: Option<&Reached>) -> ConvertOptions {
    let (sheet_side, flip) = side_and_flip(args, reached);
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
        sheet_side,
        flip,
    }
}

fn refined(
    args: &ConvertArgs,
    model: &Model,
    options: &ConvertOptions,
    reached: Option<&Reached>,
) -> Result<Converted, Failure> {
    let mesh = args.mesher.mapped_for_refinement()?;
    let whole = |error: ToleranceError| match (error, reached) {
        (
            ToleranceError::NotReached { face, source_entity, found, allowed, unit, patches },
            Some(r),
        ) => {
            let face = r.kept[face];
            ToleranceError::NotReached { face, source_entity, found, allowed, unit, patches }
        }
        (ToleranceError::NoPatches { face, source_entity }, Some(r)) => {
            ToleranceError::NoPatches { face: r.kept[face], source_entity }
        }
        (other, _) => other,
    };
    let borders = match args.borders {
        Borders::Conforming => Meeting::Conforming,
        Borders::Independent => Meeting::Independent,
    };
    let found = match args.patches {
        Some(patches) => {
            to_patches(model, &mesh, options, patches, !args.on_cad, borders).map_err(whole)?
        }
        None => {
            let goal = Goal {
                tol_mm: args.tol.unwrap_or(f64::INFINITY),
                normal_deg: args.normal_tol.unwrap_or(f64::INFINITY),
                two_sided: !args.on_cad,
                borders,
            };
            to_tolerance(model, &mesh, options, &goal).map_err(whole)?
        }
    };
    Ok(Converted {
        tool: found.tool,
        report: found.report,
        refined: Some(Fit {
            audit: found.audit,
            moved_mm: found.moved_mm,
            borders: found.borders,
            asked_apart: borders == Meeting::Independent,
        }),
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
    reached: Option<&Reached>,
) -> Result<Provenance, Failure> {
    let bytes = std::fs::read(&args.file)
        .map_err(|e| Failure::new(Exit::Io, format!("cannot read {}: {e}", args.file.display())))?;
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let within = reached.zip(args.reach.as_deref()).map_or_else(String::new, |(r, scene)| {
        let all = r.kept.len() + r.left_out.len();
        format!(" reach={} faces={}/{all}", name(scene), r.kept.len())
    });
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
        } + &within,
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
    let borders = match args.borders {
        Borders::Conforming => "",
        Borders::Independent => " borders=independent",
    };
    format!("{tol}{normal}{patches}{vertices}{edges}{borders}")
}
