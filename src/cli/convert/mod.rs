//! `kanagata convert FILE -o TOOL`: [`own`] for meshes, [`kinds`] for Bezier patches and tool files, here for the rest.

mod args;
mod kinds;
mod own;
mod print;

use std::collections::BTreeSet;
use std::path::Path;

pub use self::args::ConvertArgs;
use self::args::{Borders, Edge, Kind, SheetSide};
use self::kinds::{bezier, exchange};
use self::print::{print_reach, print_report};
use super::cad::read_model;
use super::exit::{Exit, Failure};
use super::skip::{renumbered, skipping};
use crate::audit::AuditReport;
use crate::cad::Model;
use crate::cad::raw::LostFace;
use crate::cli::own::refuse_clashes;
use crate::cli::say::{err, out};
use crate::convert::reach::{ReachError, Reached, Zone, within_reach};
use crate::convert::tolerance::Borders as Meeting;
use crate::convert::tolerance::{Goal, ToleranceError, to_patches, to_tolerance};
use crate::convert::unfolded::{UnfoldedError, mesh_and_convert};
use crate::convert::{ConvertError, ConvertOptions, ConvertReport, convert, renumber};
use crate::files::sha256_hex;
use crate::mesh::mapped::MappedOptions;
use crate::mesh::{attach, io};
use crate::tool::edge::EdgeRule;
use crate::tool::file::{Provenance, ToolFile};
use crate::tool::{ToolKind, ToolModel};

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

impl Converted {
    /// Gives faces the numbers that they have in the whole model: `whole[f]` for face f.
    fn renumber(&mut self, whole: &[usize]) {
        renumber(&mut self.tool, whole);
        let (finer, bare) = (&mut self.report.finer, &mut self.report.bare);
        finer.iter_mut().chain(bare).for_each(|f| *f = whole[*f]);
    }
}

/// What refinement says of its model.
struct Fit {
    audit: AuditReport,
    /// Largest distance that a vertex was moved off the CAD [mm].
    moved_mm: f64,
    /// Largest distance that a vertex slid within a flat, off its smooth border [mm].
    slid_mm: f64,
    borders: Meeting,
    /// The search for fewer patches ended by itself, not at its work limit.
    saved_all: bool,
    /// Faces were to be divided independently.
    asked_apart: bool,
}

/// Converts the file.
///
/// # Errors
/// Exit code 2 for a file that is no CAD, cannot be meshed or not within the tolerance, 4 when files cannot be read
/// or written.
pub fn run(args: &ConvertArgs) -> Result<Exit, Failure> {
    args.check_borders()?;
    args.check_refinement()?;
    args.mesher.check()?;
    refuse_clashes(&args.inputs(), &[("--output", Some(&args.output))])?;
    if let Some(to) = args.to {
        return exchange(args, to);
    }
    if io::is_mesh(&args.file) {
        return own::own(args);
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
        skipping(args.mesher.skips_faces(), model, |model| converted(args, model, &options))
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
    say_of_folds(args, &made);
    reached.iter().for_each(print_reach);
    out!("  {}", args.output.display());
    Ok(Exit::Done)
}

/// The tool of a model.
fn converted(
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

fn options(args: &ConvertArgs, reached: Option<&Reached>) -> ConvertOptions {
    let (sheet_side, flip) = args.side_and_flip(reached);
    ConvertOptions {
        name: args.name.clone().unwrap_or_else(|| stem(&args.output)),
        kind: match args.kind {
            Kind::Nagata => ToolKind::Nagata,
            Kind::Facets => ToolKind::Facets,
            Kind::Bezier => ToolKind::Bezier,
        },
        edges: match args.edge() {
            Edge::Plain => EdgeRule::Plain,
            Edge::Guarded | Edge::Cad => EdgeRule::Guarded,
        },
        through_cad: args.edge() == Edge::Cad,
        smooth_deg: args.smooth_deg,
        sheet_side,
        flip,
        straighten: args.tol.is_some() || args.patches.is_some(),
    }
}

/// Refuses a model with folded patches, which it prints, unless they were asked for.
fn refuse_folds(args: &ConvertArgs, made: &Converted) -> Result<(), Failure> {
    let count = made.report.folded.len();
    if count == 0 || args.allow_folds || args.edge() == Edge::Plain {
        return Ok(());
    }
    print_report(made);
    let file = args.file.display();
    let is_built_in = args.mesh.is_none() && args.mesher.is_built_in();
    let divided = is_built_in && !io::is_mesh(&args.file);
    let advice = if divided {
        "dividing these faces more finely was tried and did not unfold them; repair them in the CAD (`kanagata inspect FILE --health` \
         tells what is wrong there)"
    } else {
        "mesh finer there"
    };
    Err(Failure::input(format!(
        "{file}: {count} patches fold, on faces {}; allowed: none; {advice}, or write them with --allow-folds",
        faces_said(made)
    )))
}

/// Numbers of the faces with folded patches, the first few of them.
fn faces_said(made: &Converted) -> String {
    const MOST: usize = 10;
    let of = |&patch: &u32| made.tool.faces[patch as usize];
    let faces: BTreeSet<u32> = made.report.folded.iter().map(of).collect();
    let listed: Vec<String> = faces.iter().take(MOST).map(u32::to_string).collect();
    let more = if faces.len() > MOST { ", ..." } else { "" };
    format!("{}{more}", listed.join(", "))
}

/// Says what to do about folds that were written all the same.
fn say_of_folds(args: &ConvertArgs, made: &Converted) {
    let count = made.report.folded.len();
    if count == 0 {
        return;
    }
    let advice = if args.edge() == Edge::Plain {
        "--edge guarded or cad keeps edges from turning back"
    } else if args.mesh.is_none() && args.mesher.is_built_in() && !io::is_mesh(&args.file) {
        "without --allow-folds their faces are divided more finely, which may unfold them"
    } else {
        "a finer mesh may unfold them"
    };
    err!(
        "warning: {count} patches fold and are in the tool file, contact on them is not to be relied on; {advice}"
    );
}

/// The model of one mesh; folds are meshed finer unless they were asked for.
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
            saved_all: found.saved_all,
            asked_apart: borders == Meeting::Independent,
        }),
    })
}

/// An error that names a face of the whole model, not of what is within reach.
fn of_whole(failure: Failure, reached: Option<&Reached>) -> Failure {
    match reached {
        Some(reached) => renumbered(failure, |f| reached.kept[f]),
        None => failure,
    }
}

/// The file's name without `.tool.json`.
fn stem(path: &Path) -> String {
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let stem = name.strip_suffix(".json").unwrap_or(&name);
    stem.strip_suffix(".tool").unwrap_or(stem).to_owned()
}

fn provenance(
    args: &ConvertArgs,
    (model, lost): (&Model, &[LostFace]),
    shape_error_mm: Option<f64>,
    reached: Option<&Reached>,
) -> Result<Provenance, Failure> {
    let bytes = crate::files::read(&args.file, crate::files::Input::Cad)
        .map_err(|e| Failure::new(Exit::Io, format!("cannot read {}: {e}", args.file.display())))?;
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let within = reached.zip(args.reach.as_deref()).map_or_else(String::new, |(r, scene)| {
        let all = r.kept.len() + r.left_out.len();
        format!(" reach={} faces={}/{all}", name(scene), r.kept.len())
    });
    Ok(Provenance {
        cad_file: name(&args.file),
        cad_sha256: sha256_hex(&bytes),
        cad_unit: model.unit.clone(),
        mesher: match &args.mesh {
            Some(path) => format!("mesh file {}", name(path)),
            None if args.is_refined() => {
                format!("{}{}", args.mesher.describe_refinement(), goal(args))
            }
            None => args.mesher.describe(),
        } + &within,
        faces_lost: lost.iter().map(|f| f.source.clone()).collect(),
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
    let edges = format!(" edges={}", format!("{:?}", args.edge()).to_lowercase());
    let borders = match args.borders {
        Borders::Conforming => "",
        Borders::Independent => " borders=independent",
    };
    format!("{tol}{normal}{patches}{vertices}{edges}{borders}")
}
