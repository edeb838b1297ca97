//! `convert --kind bezier` and `convert --to KIND`.

use super::args::{ConvertArgs, To};
use super::options::stem;
use super::print::print_reach;
use super::provenance::provenance;
use crate::cad::Model;
use crate::cli::exit::{Exit, Failure};
use crate::cli::mesh::MesherArgs;
use crate::cli::skip::skipping;
use crate::cli::stages::progress;
use crate::cli::terminal::{err, out};
use crate::convert::bezier::{BezierError, BezierOptions, FINEST, Within, within_tolerance};
use crate::convert::renumber;
use crate::mesh::{attach, io};
use crate::reach::Reached;
use crate::tool::edge::EdgeRule;
use crate::tool::exchange::{to_bezier, to_nagata};
use crate::tool::file::ToolFile;

/// Makes Bezier patches directly from the CAD, with 1, 2, 3, 4, 6, ... patches per 90 degrees until they are within the
/// tolerance, and writes the file; `numbers` are those of the faces in the CAD file.
pub(super) fn bezier(
    args: &ConvertArgs,
    model: &Model,
    reached: Option<&Reached>,
    numbers: Option<&[usize]>,
    offset_mm: Option<f64>,
) -> Result<Within, Failure> {
    const TOLERANCE: f64 = 1e-4;
    let tolerance_mm = args.how.tol.unwrap_or(TOLERANCE);
    let (sheet_side, flip) = args.side_and_flip(reached);
    let name = args.name.clone().unwrap_or_else(|| stem(&args.output));
    let options = BezierOptions { name, tolerance_mm, sheet_side, flip, progress: progress() };
    let make = |model: &Model| made_within(args, model, &options);
    let (made, part) = skipping(args.how.mesher.skips_faces(), model, make)?;
    let (mut within, mesher) = made;
    let lists = [part.as_ref().map(|p| &p.kept[..]), reached.map(|r| &r.kept[..]), numbers];
    lists.into_iter().flatten().for_each(|kept| renumber(&mut within.tool, kept));
    let lost = part.as_ref().map_or(&model.lost, |p| &p.model.lost);
    let error_mm = Some(within.report.error_mm);
    let mut provenance = provenance(args, (model, lost), error_mm, reached, offset_mm)?;
    if args.mesh.is_none() {
        let first = args.how.mesher.describe();
        let last = mesher.with_divisions(within.divisions).describe();
        provenance.mesher = provenance.mesher.replacen(&first, &last, 1);
    }
    provenance.mesher += &format!(" bezier tol-mm={tolerance_mm}");
    ToolFile::of_model(&within.tool, EdgeRule::Guarded, provenance).write(&args.output)?;
    Ok(within)
}

/// Prints the figures of a Bezier tool and warns about folded patches.
pub(super) fn print_within(within: &Within, reached: Option<&Reached>) {
    let Within { tool, report, .. } = within;
    out!(
        "{} patches of degree up to {}, largest distance {:.2e} mm from the CAD's surfaces",
        tool.patches.len(),
        report.degree,
        report.error_mm
    );
    if !report.folded.is_empty() {
        let count = report.folded.len();
        err!(
            "warning: {count} patches fold and are in the tool file, contact on them is not to be relied on; without --allow-folds finer meshes are tried"
        );
    }
    if report.turned || reached.is_some_and(|r| r.turned) {
        out!("  turned round to look at the sheet");
    }
    if let Some(reached) = reached {
        print_reach(reached);
    }
}

/// The Bezier tool of a model and its mesher, on the given mesh or the coarsest one within the tolerance.
///
/// If structured meshes fail, mixed ones are tried. They have triangles where quadrilaterals would have two sides along
/// one smooth border.
fn made_within(
    args: &ConvertArgs,
    model: &Model,
    options: &BezierOptions,
) -> Result<(Within, MesherArgs), Failure> {
    let given = match &args.mesh {
        Some(path) => Some(attach::attach(&io::read(path)?, model)?),
        None => None,
    };
    let finest = if given.is_some() { 1 } else { FINEST };
    let made = |mesher: &MesherArgs| {
        let mesh = |divisions| match &given {
            Some(mesh) => Ok(mesh.clone()),
            None => mesher.with_divisions(divisions).mesh(&args.file, model),
        };
        within_tolerance(model, options, args.how.allow_folds, finest, mesh)
    };
    let error = match made(&args.how.mesher) {
        Ok(within) => return Ok((within, args.how.mesher.clone())),
        Err(error) => error,
    };
    let other = args.how.mesher.mixed().filter(|_| given.is_none());
    if matches!(error, BezierError::NotReached { .. })
        && let Some(mixed) = other
        && let Ok(within) = made(&mixed)
    {
        err!(
            "note: meshed with --style mixed, as patches of structured meshes fold or stay too far off"
        );
        return Ok((within, mixed));
    }
    Err(match error {
        BezierError::Mesh(e) => e.into(),
        BezierError::Convert(e) => e.into(),
        BezierError::NotReached { .. } => Failure::of_file(&args.file, error),
    })
}

/// Converts a tool file to another kind.
pub(super) fn exchange(args: &ConvertArgs, to: To) -> Result<Exit, Failure> {
    if args.how.offset.is_given() {
        return Err(Failure::input(
            "--offset or --reference with --to; allowed: with an IGES or STEP file; convert the CAD of the tool with the offset first",
        ));
    }
    let loaded = crate::tool::file::read(&args.file)?;
    let mut tool = match to {
        To::Bezier => to_bezier(&loaded.model),
        To::Nagata => {
            let (tool, lost) =
                to_nagata(&loaded.model).map_err(|e| Failure::of_file(&args.file, e))?;
            out!("largest discrepancy {:.3e} mm, on patch {}", lost.max_mm, lost.patch);
            tool
        }
    };
    tool.name = args.name.clone().unwrap_or(tool.name);
    let mut provenance = loaded.provenance;
    provenance.mesher += &format!(" to={to:?}").to_lowercase();
    provenance.shape_error_mm = provenance.shape_error_mm.filter(|_| to == To::Bezier);
    ToolFile::of_model(&tool, EdgeRule::Guarded, provenance).write(&args.output)?;
    out!("{} patches\n  {}", tool.patches.len(), args.output.display());
    Ok(Exit::Done)
}
