//! `kanagata audit TOOL... --cad FILE` and `kanagata audit TOOL --against TOOL`.

mod args;
mod clearance;
mod json;
mod print;

use std::path::{Path, PathBuf};

pub use self::args::AuditArgs;
use self::clearance::clearances;
use self::json::write_json;
use self::print::{file_name, print_report, print_row, short};
use super::doubts::print_doubts;
use super::exit::{Exit, Failure};
use super::output_clash::refuse_clashes;
use super::read::{LostFaces, read_model};
use super::stages::{name_part, progress, show};
use super::terminal::{err, out};
use crate::audit::{
    Audit, AuditError, AuditOptions, AuditReport, CadReference, audit, doubts, map, page, view,
};
use crate::cad::Model;
use crate::cad::raw::LostFace;
use crate::convert::origin::moved;
use crate::convert::select::{Chosen, ChosenReference, SelectError, choose};
use crate::files::{sha256_hex, write_atomic};
use crate::report::doubt::Doubt;
use crate::tool::file::{Provenance, ToolFileError, read};

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
    let _shown = show(args.quiet);
    let exits = match (&args.against, args.thickness, &args.cad) {
        (Some(against), Some(thickness), _) => clearances(args, against, thickness)?,
        (_, _, Some(cad)) => audits(args, cad)?,
        _ => Vec::new(),
    };
    Ok(if exits.contains(&Exit::Limit) { Exit::Limit } else { Exit::Done })
}

/// Audits the tools against their CAD.
fn audits(args: &AuditArgs, cad: &Path) -> Result<Vec<Exit>, Failure> {
    let model = read_model(cad, LostFaces::Skip)?;
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
    let each = |tool: &PathBuf| audited(args, tool, (cad, &cad_sha256), (&model, &reference));
    let found = args.tools.iter().map(each).collect::<Result<Vec<_>, _>>()?;
    write_json(args, &found)?;
    let doubts: Vec<Doubt> = found.iter().flat_map(|r| named_doubts(args, r)).collect();
    print_doubts(&doubts, args.accept_doubts);
    Ok(vec![Exit::of_doubts(&doubts, args.accept_doubts)])
}

/// Doubts about a tool, preceded by its file if several are audited.
fn named_doubts(args: &AuditArgs, report: &AuditReport) -> Vec<Doubt> {
    let mut doubts = report.doubts.clone();
    if args.tools.len() > 1 {
        doubts.iter_mut().for_each(|d| d.text = format!("{}: {}", report.tool_file, d.text));
    }
    doubts
}

/// Prints from which faces of the CAD a tool was made.
fn print_origin(tool: &Path, chosen: &Chosen, model: &Model, offset_mm: Option<f64>) {
    let (n, all) = (chosen.kept.len(), model.faces.len());
    let moved = offset_mm.map_or_else(String::new, |d| format!(", offset by {d} mm"));
    out!("{}: made from {n} of {all} faces{moved}, compared with these", tool.display());
}

/// Audits one tool against its CAD.
fn audited(
    args: &AuditArgs,
    tool: &Path,
    (cad, cad_sha256): (&Path, &str),
    (model, whole): (&Model, &CadReference<'_>),
) -> Result<AuditReport, Failure> {
    if args.tools.len() > 1 {
        name_part(format!("{}: ", short(tool)));
    }
    let mut loaded = read(tool)?;
    let is_same = loaded.provenance.cad_sha256 == cad_sha256;
    let chosen = reference_of(tool, &loaded.provenance, model, is_same)?;
    let part = chosen.as_ref().map(ChosenReference::new);
    if !is_same {
        warn_of_other_file(tool, &loaded.provenance.cad_file, cad);
        loaded.model.faces = match &part {
            Some(part) => part.faces_of(&loaded.model),
            None => whole.faces_of(&loaded.model),
        };
    }
    let options = options(args);
    let mut found = match &part {
        Some(part) => audit(&loaded.model, part, &options)?,
        None => audit(&loaded.model, whole, &options)?,
    };
    name_inputs(&mut found.report, tool, cad, [loaded.sha256, cad_sha256.to_owned()]);
    found.report.faces_lost.extend(skipped(&loaded.provenance, &found.report.faces_lost));
    found.report.doubts = doubts(&found.report);
    write_pictures(args, &loaded.model, &found)?;
    if let Some(chosen) = &chosen {
        print_origin(tool, chosen, model, loaded.provenance.offset_mm);
    }
    let several = args.tools.len() > 1;
    if several {
        print_row(tool, &found.report)
    } else {
        print_report(&found.report)
    }
    Ok(found.report)
}

/// The faces from which a tool was made, moved by its offset, if they were chosen or moved.
fn reference_of(
    tool: &Path,
    provenance: &Provenance,
    model: &Model,
    is_same: bool,
) -> Result<Option<Chosen>, Failure> {
    let chosen = chosen(provenance, model, is_same).map_err(|e| Failure::of_file(tool, e))?;
    moved(provenance, model, chosen).map_err(|e| Failure::of_file(tool, e))
}

fn warn_of_other_file(tool: &Path, made_from: &str, cad: &Path) {
    err!(
        "warning: {} was made from another file ({made_from}) than {}; each patch is put on the face nearest to it",
        tool.display(),
        cad.display()
    );
}

fn options(args: &AuditArgs) -> AuditOptions {
    AuditOptions {
        samples: args.samples,
        tolerance_mm: args.tol,
        normal_tolerance_deg: args.normal_tol,
        progress: progress(),
        ..AuditOptions::default()
    }
}

/// The faces from which a tool was made, if they were chosen. In a CAD file other than its own (`is_same` false) they
/// are all faces where the choice does not apply.
fn chosen(
    provenance: &Provenance,
    model: &Model,
    is_same: bool,
) -> Result<Option<Chosen>, SelectError> {
    let Some(selection) = &provenance.selection else { return Ok(None) };
    match choose(model, selection) {
        Err(error) if !is_same => {
            err!("warning: {error}; compared with all faces of this CAD file");
            Ok(None)
        }
        found => found.map(Some),
    }
}

/// Faces that the tool file lists as skipped and that are not in `known`.
fn skipped(provenance: &Provenance, known: &[LostFace]) -> Vec<LostFace> {
    let is_new = |name: &&String| known.iter().all(|f| f.source != **name);
    let new = provenance.faces_lost.iter().filter(is_new);
    let reason = "left out of the tool by --skip-bad-faces";
    new.map(|source| LostFace { source: source.clone(), reason: reason.into() }).collect()
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
