//! Makes the tool of a CAD model and writes its file.

use std::path::Path;
use std::time::Duration;

use super::args::{Borders, ConvertArgs, Edge, Kind, SheetSide};
use super::converted::{Converted, Fit};
use super::folds::refuse_folds;
use super::kinds::bezier;
use super::made::{Made, MadeTool};
use super::offset::offset_of;
use super::options::{options, stem};
use super::provenance::provenance;
use crate::audit::open_joints_doubt;
use crate::cad::Model;
use crate::cli::exit::Failure;
use crate::cli::skip::{renumbered, skipping};
use crate::convert::offset::doubts;
use crate::convert::tolerance::Borders as Meeting;
use crate::convert::tolerance::{Aim, Goal, refined_to};
use crate::convert::unfolded::{UnfoldedError, mesh_and_convert};
use crate::convert::{ConvertOptions, ConvertReport, convert};
use crate::mesh::mapped::MappedOptions;
use crate::mesh::{attach, io};
use crate::reach::{ReachError, Reached, Zone, within_reach};
use crate::tool::ToolModel;
use crate::tool::file::ToolFile;

/// Makes the tool of the chosen faces of a model and writes its file.
pub(super) fn make_tool(args: &ConvertArgs, whole: &Model) -> Result<Made, Failure> {
    let whole_file = args.mesh.as_ref().map(|_| "--mesh");
    let whole_file = whole_file.or((!args.how.mesher.is_built_in()).then_some("--mesher gmsh"));
    args.how.select.refuse_with(whole_file)?;
    args.how.offset.refuse_with(whole_file)?;
    let chosen = args.how.select.choose(&args.file, whole)?;
    let whole = chosen.as_ref().map_or(whole, |c| &c.model);
    let numbers = chosen.as_ref().map(|c| &c.kept[..]);
    let moved = offset_of(args, whole, numbers)?;
    let whole = moved.as_ref().map_or(whole, |m| &m.model);
    let made = tool_of(args, whole, numbers, moved.as_ref().map(|m| m.report.distance_mm));
    let tool =
        made.map_err(|failure| renumbered(failure, |f| numbers.map_or(f, |numbers| numbers[f])))?;
    // The audit of other patches has it.
    let open = match &tool {
        MadeTool::Bezier { within, reached } => {
            let model = reached.as_ref().map_or(whole, |r| &r.model);
            open_joints_doubt(model, args.how.tol.unwrap_or(within.report.error_mm))
        }
        MadeTool::Patches { .. } => None,
    };
    let of_offset = moved.as_ref().map_or_else(Vec::new, |m| doubts(&m.report));
    Ok(Made { tool, source_doubts: of_offset.into_iter().chain(open).collect() })
}

/// Makes the tool of a model; `numbers` are those of its faces in the file, which is offset by `offset_mm`.
fn tool_of(
    args: &ConvertArgs,
    whole: &Model,
    numbers: Option<&[usize]>,
    offset_mm: Option<f64>,
) -> Result<MadeTool, Failure> {
    let reached = args.how.reach.as_deref().map(|scene| reach(args, scene, whole)).transpose()?;
    let model = reached.as_ref().map_or(whole, |r| &r.model);
    if args.how.kind == Kind::Bezier {
        let within = Box::new(bezier(args, model, reached.as_ref(), numbers, offset_mm)?);
        return Ok(MadeTool::Bezier { within, reached });
    }
    let options = options(args, reached.as_ref());
    let (mut made, part) = skipping(args.how.mesher.skips_faces(), model, |model| {
        convert_model(args, model, &options)
    })
    .map_err(|failure| of_whole(failure, reached.as_ref()))?;
    if let Some(part) = &part {
        made.renumber(&part.kept);
    }
    if let Some(reached) = &reached {
        made.renumber(&reached.kept);
        made.report.turned = reached.turned;
    }
    if let Some(numbers) = numbers {
        made.renumber(numbers);
    }
    refuse_folds(args, &made)?;
    let error_mm = made.refined.as_ref().map(|r| r.audit.worst_mm());
    let lost = part.as_ref().map_or(&whole.lost, |p| &p.model.lost);
    let provenance = provenance(args, (whole, lost), error_mm, reached.as_ref(), offset_mm)?;
    ToolFile::of_model(&made.tool, options.edges, provenance).write(&args.output)?;
    Ok(MadeTool::Patches { made: Box::new(made), reached })
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
    if !args.how.mesher.is_built_in() {
        return Err(Failure::input(
            "--mesher gmsh with --reach; allowed: the built-in mesher, which takes faces one by one; leave --mesher out",
        ));
    }
    let (read, _) = crate::scene::read::scene_of(scene)?;
    let folder = scene.parent().unwrap_or(Path::new(""));
    let file = args.output.file_name().unwrap_or_default().to_string_lossy();
    let name = args.name.clone().unwrap_or_else(|| stem(&args.output));
    let side = args.how.sheet_side.map(SheetSide::direction);
    let found = Zone::of_scene(&read, folder, &file, &name)
        .and_then(|zone| within_reach(model, &zone, side, args.how.flip));
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
    let may_fold = args.how.allow_folds || args.edge() == Edge::Plain;
    let mesh = match (&args.mesh, args.how.mesher.built_in()) {
        (Some(path), _) => attach::attach(&io::read(path)?, model)?,
        (None, Some(mesh)) if !may_fold => {
            let mesh = MappedOptions { through_cad: options.through_cad, ..mesh };
            return mesh_and_convert(model, &mesh, options).map_err(|error| match error {
                UnfoldedError::Mesh(error) => error.into(),
                UnfoldedError::Convert(error) => error.into(),
            });
        }
        (None, _) => args.how.mesher.mesh(&args.file, model)?,
    };
    Ok(convert(model, &mesh, options)?)
}

fn refined(
    args: &ConvertArgs,
    model: &Model,
    options: &ConvertOptions,
) -> Result<Converted, Failure> {
    let mesh = args.how.mesher.mapped_for_refinement()?;
    let borders = match args.how.borders {
        Borders::Conforming => Meeting::Conforming,
        Borders::Independent => Meeting::Independent,
    };
    let two_sided = !args.how.on_cad;
    let goal = Goal {
        tol_mm: args.how.tol.unwrap_or(f64::INFINITY),
        normal_deg: args.how.normal_tol.unwrap_or(f64::INFINITY),
        two_sided,
        borders,
    };
    let aim = match args.how.patches {
        Some(patches) => Aim::Patches { patches, two_sided, borders },
        None => Aim::Within(goal, args.how.time.map(Duration::from_secs_f64)),
    };
    let found = refined_to(model, &mesh, options, &aim)?;
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
