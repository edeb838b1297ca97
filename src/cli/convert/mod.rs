//! `kanagata convert FILE -o TOOL`: [`mesh_only`] for meshes, [`kinds`] for Bezier patches and tool files, this module for the
//! rest.

mod args;
mod converted;
mod folds;
mod kinds;
mod mesh_only;
mod options;
mod print;
mod provenance;

use std::path::Path;

pub use self::args::ConvertArgs;
use self::args::{Borders, Edge, Kind, SheetSide};
use self::converted::{Converted, Fit};
use self::folds::{refuse_folds, warn_of_folds};
use self::kinds::{bezier, exchange};
use self::options::{options, stem};
use self::print::{print_reach, print_report};
use self::provenance::provenance;
use super::exit::{Exit, Failure};
use super::read::read_model;
use super::skip::{renumbered, skipping};
use crate::cad::Model;
use crate::cli::output_clash::refuse_clashes;
use crate::cli::terminal::out;
use crate::convert::reach::{ReachError, Reached, Zone, within_reach};
use crate::convert::tolerance::Borders as Meeting;
use crate::convert::tolerance::{Goal, ToleranceError, to_patches, to_tolerance};
use crate::convert::unfolded::{UnfoldedError, mesh_and_convert};
use crate::convert::{ConvertError, ConvertOptions, ConvertReport, convert};
use crate::mesh::mapped::MappedOptions;
use crate::mesh::{attach, io};
use crate::tool::ToolModel;
use crate::tool::file::ToolFile;

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

/// Converts the file.
///
/// # Errors
/// Exit code 2 for a file that is not CAD, cannot be meshed or not within the tolerance; 4 when files cannot be read or
/// written.
pub fn run(args: &ConvertArgs) -> Result<Exit, Failure> {
    args.check_borders()?;
    args.check_refinement()?;
    args.mesher.check()?;
    refuse_clashes(&args.inputs(), &[("--output", Some(&args.output))])?;
    if let Some(to) = args.to {
        return exchange(args, to);
    }
    if io::is_mesh(&args.file) {
        return mesh_only::convert(args);
    }
    args.check_cad()?;
    let whole = read_model(&args.file, args.mesher.lost_faces())?;
    let reached = args.reach.as_deref().map(|scene| reach(args, scene, &whole)).transpose()?;
    let model = reached.as_ref().map_or(&whole, |r| &r.model);
    if args.kind == Kind::Bezier {
        return bezier(args, model, reached.as_ref());
    }
    let options = options(args, reached.as_ref());
    let (mut made, part) =
        skipping(args.mesher.skips_faces(), model, |model| convert_model(args, model, &options))
            .map_err(|failure| of_whole(failure, reached.as_ref()))?;
    if let Some(part) = &part {
        made.renumber(&part.kept);
    }
    if let Some(reached) = &reached {
        made.renumber(&reached.kept);
        made.report.turned = reached.turned;
    }
    refuse_folds(args, &made)?;
    let error_mm = made.refined.as_ref().map(|r| r.audit.worst_mm());
    let lost = part.as_ref().map_or(&whole.lost, |p| &p.model.lost);
    let provenance = provenance(args, (&whole, lost), error_mm, reached.as_ref())?;
    ToolFile::of_model(&made.tool, options.edges, provenance).write(&args.output)?;
    print_report(&made);
    warn_of_folds(args, &made);
    reached.iter().for_each(print_reach);
    out!("  {}", args.output.display());
    Ok(Exit::Done)
}

/// Converts a model.
fn convert_model(
    args: &ConvertArgs,
    model: &Model,
    options: &ConvertOptions,
) -> Result<Converted, Failure> {
    if args.is_refined() {
        return refined(args, model, options);
    }
    let (tool, report) = meshed(args, model, options)?;
    Ok(Converted { tool, report, refined: None })
}

/// The part of the model that the sheet of a scene can touch.
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
        other => Failure::of_file(scene, other),
    })
}

/// Converts a model with one mesh. Faces with folded patches are meshed more finely, unless folds are allowed.
fn meshed(
    args: &ConvertArgs,
    model: &Model,
    options: &ConvertOptions,
) -> Result<(ToolModel, ConvertReport), Failure> {
    let may_fold = args.allow_folds || args.edge() == Edge::Plain;
    let mesh = match (&args.mesh, args.mesher.built_in()) {
        (Some(path), _) => attach::attach(&io::read(path)?, model)?,
        (None, Some(mesh)) if !may_fold => {
            let mesh = MappedOptions { through_cad: options.through_cad, ..mesh };
            return mesh_and_convert(model, &mesh, options).map_err(|error| match error {
                UnfoldedError::Mesh(error) => error.into(),
                UnfoldedError::Convert(error) => error.into(),
            });
        }
        (None, _) => args.mesher.mesh(&args.file, model)?,
    };
    Ok(convert(model, &mesh, options)?)
}

fn refined(
    args: &ConvertArgs,
    model: &Model,
    options: &ConvertOptions,
) -> Result<Converted, Failure> {
    let mesh = args.mesher.mapped_for_refinement()?;
    let borders = match args.borders {
        Borders::Conforming => Meeting::Conforming,
        Borders::Independent => Meeting::Independent,
    };
    let found = match args.patches {
        Some(patches) => to_patches(model, &mesh, options, patches, !args.on_cad, borders)?,
        None => {
            let goal = Goal {
                tol_mm: args.tol.unwrap_or(f64::INFINITY),
                normal_deg: args.normal_tol.unwrap_or(f64::INFINITY),
                two_sided: !args.on_cad,
                borders,
            };
            to_tolerance(model, &mesh, options, &goal)?
        }
    };
    Ok(Converted {
        tool: found.tool,
        report: found.report,
        refined: Some(Fit {
            audit: found.audit,
            moved_mm: found.moved_mm,
            slid_mm: found.slid_mm,
            borders: found.borders,
            search_converged: found.saved_all,
            independent_requested: borders == Meeting::Independent,
        }),
    })
}

/// An error with the face index of the whole model instead of its reachable part.
fn of_whole(failure: Failure, reached: Option<&Reached>) -> Failure {
    match reached {
        Some(reached) => renumbered(failure, |f| reached.kept[f]),
        None => failure,
    }
}
