//! `kanagata convert MESH -o TOOL`: meshes without CAD.

use super::args::{ConvertArgs, Edge, Kind};
use super::converted::Converted;
use super::folds::{refuse_folds, warn_of_folds};
use super::options::options;
use super::print::print_report;
use crate::cli::exit::{Exit, Failure};
use crate::cli::terminal::out;
use crate::convert::own::{NormalSource, convert_mesh};
use crate::files::sha256_hex;
use crate::mesh::io;
use crate::tool::file::{Provenance, ToolFile};

/// Default crease angle [degrees]: fillets of three elements per 90 degrees are smooth, chamfers are not.
const CREASE_DEG: f64 = 40.0;

fn crease_deg(args: &ConvertArgs) -> f64 {
    args.crease_deg.unwrap_or(CREASE_DEG)
}

/// Makes a tool from a mesh file with given or estimated normals.
pub(super) fn convert(args: &ConvertArgs) -> Result<Exit, Failure> {
    check(args)?;
    let file = io::read_file(&args.file)?;
    let options = options(args, None);
    let (tool, report, source) = convert_mesh(&file, &options, crease_deg(args))
        .map_err(|e| Failure::of_file(&args.file, e))?;
    let made = Converted { tool, report, refined: None };
    refuse_folds(args, &made)?;
    ToolFile::of_model(&made.tool, options.edges, provenance(args, &source)?)
        .write(&args.output)?;
    print_report(&made);
    warn_of_folds(args, &made);
    let NormalSource { given, estimated, regions } = source;
    out!(
        "  no CAD: {given} normals of corners from the file, {estimated} estimated from its vertices; {regions} smooth regions"
    );
    out!("  {}", args.output.display());
    Ok(Exit::Done)
}

/// Refuses options that need a CAD file.
fn check(args: &ConvertArgs) -> Result<(), Failure> {
    let option = if args.mesh.is_some() {
        "--mesh"
    } else if args.is_refined() || args.how.tol.is_some() {
        "--tol, --normal-tol or --patches"
    } else if args.how.reach.is_some() {
        "--reach"
    } else if args.how.select.is_given() {
        "a choice of faces"
    } else if args.how.offset.is_given() {
        "--offset or --reference"
    } else if args.how.kind == Kind::Bezier {
        "--kind bezier"
    } else if args.how.edge == Some(Edge::Cad) {
        "--edge cad"
    } else if !args.how.mesher.is_built_in() {
        "--mesher gmsh"
    } else {
        return Ok(());
    };
    Err(Failure::input(format!(
        "{option} with the mesh {} alone; allowed: with an IGES or STEP file; give the CAD first and this file by --mesh",
        args.file.display()
    )))
}

fn provenance(args: &ConvertArgs, source: &NormalSource) -> Result<Provenance, Failure> {
    let bytes = crate::files::read(&args.file, crate::files::Input::Mesh)
        .map_err(|e| Failure::new(Exit::Io, format!("cannot read {}: {e}", args.file.display())))?;
    let name = args.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let normals = match (source.given, source.estimated) {
        (_, 0) => "given".to_owned(),
        (0, _) => format!("estimated crease-deg={}", crease_deg(args)),
        (_, n) => format!("given, {n} corners estimated crease-deg={}", crease_deg(args)),
    };
    Ok(Provenance {
        cad_file: name,
        cad_sha256: sha256_hex(&bytes),
        cad_unit: "mm".into(),
        mesher: format!("mesh file without CAD, normals {normals}"),
        selection: None,
        offset_mm: None,
        faces_lost: Vec::new(),
        program: concat!("kanagata ", env!("CARGO_PKG_VERSION")).into(),
        shape_error_mm: None,
    })
}
