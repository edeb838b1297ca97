//! `kanagata convert FILE -o TOOL`.

use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::cad::read_model;
use super::exit::{EXIT_HELP, Exit, Failure};
use super::mesh::MesherArgs;
use crate::convert::{ConvertError, ConvertOptions, ConvertReport, convert};
use crate::files::sha256_hex;
use crate::geometry::Vec3;
use crate::mesh::{attach, io};
use crate::tool::ToolKind;
use crate::tool::edge::EdgeRule;
use crate::tool::file::{Provenance, ToolFile};

/// Arguments of `convert`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Examples:\n  kanagata convert die.igs -o die.tool.json --sheet-side +z\n  \
    kanagata convert punch.stp -o punch.tool.json --sheet-side=-z --arc-divisions 6\n  \
    kanagata convert die.igs -o die.tool.json --mesh die.msh\n\n{EXIT_HELP}"))]
pub struct ConvertArgs {
    /// IGES or STEP file
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
    /// How edges are curved
    #[arg(long, value_enum, default_value_t = Edge::Guarded)]
    edge: Edge,
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
}

/// Rules for edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Edge {
    /// Eq. 8 where its curve runs forward, straight elsewhere
    Guarded,
    /// Eq. 8 everywhere, also where it fails
    Plain,
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

/// Converts the file.
///
/// # Errors
/// Exit code 2 for a file that is no CAD or cannot be meshed, 4 when files cannot be read or written.
pub fn run(args: &ConvertArgs) -> Result<Exit, Failure> {
    let model = read_model(&args.file)?;
    let mesh = match &args.mesh {
        Some(path) => attach::attach(&io::read(path)?, &model)?,
        None => args.mesher.mesh(&args.file, &model)?,
    };
    let edges = match args.edge {
        Edge::Guarded => EdgeRule::Guarded,
        Edge::Plain => EdgeRule::Plain,
    };
    let options = ConvertOptions {
        name: args.name.clone().unwrap_or_else(|| stem(&args.output)),
        kind: match args.kind {
            Kind::Nagata => ToolKind::Nagata,
            Kind::Facets => ToolKind::Facets,
        },
        edges,
        smooth_deg: args.smooth_deg,
        sheet_side: args.sheet_side.map(SheetSide::direction),
        flip: args.flip,
    };
    let (tool, report) = convert(&model, &mesh, &options)?;
    let provenance = provenance(args, &model.unit)?;
    ToolFile::of_model(&tool, edges, provenance).write(&args.output)?;
    print_report(args, tool.patches.len(), tool.vertices.len(), &report);
    Ok(Exit::Done)
}

/// The file's name without `.tool.json`.
fn stem(path: &Path) -> String {
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let stem = name.strip_suffix(".json").unwrap_or(&name);
    stem.strip_suffix(".tool").unwrap_or(stem).to_owned()
}

fn provenance(args: &ConvertArgs, unit: &str) -> Result<Provenance, Failure> {
    let bytes = std::fs::read(&args.file)
        .map_err(|e| Failure::new(Exit::Io, format!("cannot read {}: {e}", args.file.display())))?;
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(Provenance {
        cad_file: name(&args.file),
        cad_sha256: sha256_hex(&bytes),
        cad_unit: unit.to_owned(),
        mesher: match &args.mesh {
            Some(path) => format!("mesh file {}", name(path)),
            None => args.mesher.describe(),
        },
        program: concat!("kanagata ", env!("CARGO_PKG_VERSION")).into(),
        shape_error_mm: None,
    })
}

fn print_report(args: &ConvertArgs, patches: usize, vertices: usize, report: &ConvertReport) {
    println!("{patches} patches, {vertices} vertices, {} crease edges", report.creases);
    if report.turned {
        println!("  turned round to look at the sheet");
    }
    const MOST: usize = 10;
    for edge in report.straight.iter().take(MOST) {
        let [a, b] = edge.vertices;
        eprintln!(
            "warning: edge {a}-{b} of patches {:?} made straight: {:?}",
            edge.patches, edge.fault
        );
    }
    if report.straight.len() > MOST {
        eprintln!("warning: and {} more edges made straight", report.straight.len() - MOST);
    }
    if !report.folded.is_empty() {
        eprintln!(
            "warning: {} patches fold, the first ones {:?}; mesh finer there",
            report.folded.len(),
            &report.folded[..report.folded.len().min(MOST)]
        );
    }
    println!("  {}", args.output.display());
}
