//! `convert --kind bezier` and `convert --to KIND`.

use super::print::print_reach;
use super::{ConvertArgs, To, provenance, side_and_flip, stem};
use crate::cad::Model;
use crate::cli::exit::{Exit, Failure};
use crate::convert::bezier::{BezierOptions, bezier_from_cad};
use crate::convert::reach::Reached;
use crate::mesh::{attach, io};
use crate::tool::edge::EdgeRule;
use crate::tool::exchange::{to_bezier, to_nagata};
use crate::tool::file::ToolFile;

/// Bezier patches straight from the CAD, a quarter turn in 1, 2, 4 ... patches until they are within the tolerance.
pub(super) fn bezier(
    args: &ConvertArgs,
    model: &Model,
    reached: Option<&Reached>,
) -> Result<Exit, Failure> {
    const TOLERANCE: f64 = 1e-4;
    const FINEST: usize = 64;
    let tolerance_mm = args.tol.unwrap_or(TOLERANCE);
    let options = BezierOptions {
        name: args.name.clone().unwrap_or_else(|| stem(&args.output)),
        tolerance_mm,
        sheet_side: side_and_flip(args, reached).0,
        flip: side_and_flip(args, reached).1,
    };
    let mut divisions = 1;
    let (mut tool, report) = loop {
        let mesh = match &args.mesh {
            Some(path) => attach::attach(&io::read(path)?, model)?,
            // Finer borders may bound a face that coarse chords do not.
            None => match args.mesher.with_divisions(divisions).mesh(&args.file, model) {
                Err(_) if divisions < FINEST => {
                    divisions *= 2;
                    continue;
                }
                made => made?,
            },
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
    if let Some(reached) = reached {
        reached.renumber(&mut tool);
    }
    let mut provenance = provenance(args, &model.unit, Some(report.error_mm), reached)?;
    if args.mesh.is_none() {
        let first = args.mesher.describe();
        let last = args.mesher.with_divisions(divisions).describe();
        provenance.mesher = provenance.mesher.replacen(&first, &last, 1);
    }
    provenance.mesher += &format!(" bezier tol-mm={tolerance_mm}");
    ToolFile::of_model(&tool, EdgeRule::Guarded, provenance).write(&args.output)?;
    println!(
        "{} patches of degree up to {}, {:.2e} mm off the CAD's surfaces at most",
        tool.patches.len(),
        report.degree,
        report.error_mm
    );
    if report.turned || reached.is_some_and(|r| r.turned) {
        println!("  turned round to look at the sheet");
    }
    if let Some(reached) = reached {
        print_reach(reached);
    }
    println!("  {}", args.output.display());
    Ok(Exit::Done)
}

/// A tool file from one kind to another.
pub(super) fn exchange(args: &ConvertArgs, to: To) -> Result<Exit, Failure> {
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
