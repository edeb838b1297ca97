//! `kanagata init`: a scene to start from, proposed from tool files or CAD.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::ValueEnum;

use super::convert::named_bodies;
use super::exit::{EXIT_HELP, Exit, Failure};
use super::output_clash::refuse_clashes;
use super::paths::output_path;
use super::quantity::length_mm;
use super::read::{LostFaces, read_model};
use super::terminal::{err, out};
use crate::cad::Model;
use crate::contact::ToolSurface;
use crate::convert::ConvertOptions;
use crate::convert::select::choose;
use crate::convert::unfolded::{UnfoldedError, mesh_and_convert};
use crate::files::standard::is_stdout;
use crate::files::{FileKind, Input, write_atomic};
use crate::mesh::mapped::MappedOptions;
use crate::run::propose::{GivenTool, Layout, PartKind, Wishes, propose, template};
use crate::scene::types::ToolCad;
use crate::tool::selection::FaceSelection;

/// Tolerance of tool models over the thickness of the sheet.
const TOLERANCE_REL: f64 = 0.01;

/// Kinds of parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// A cup, drawn from a disc
    Cup,
    /// A pan, drawn from a rectangle
    Pan,
    /// A strip drawn over two radii, plane strain
    UDraw,
    /// A strip bent without a holder, plane strain
    Bend,
}

impl From<Kind> for PartKind {
    fn from(kind: Kind) -> Self {
        match kind {
            Kind::Cup => Self::Cup,
            Kind::Pan => Self::Pan,
            Kind::UDraw => Self::UDraw,
            Kind::Bend => Self::Bend,
        }
    }
}

/// Arguments of `init`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Examples:\n  kanagata init --tools fixtures/bodies/die-set.stp -o out/cup/cup.scene.json --thickness 0.8mm\n  \
    kanagata init --tools die.tool.json holder.tool.json punch.tool.json -o part.scene.json\n  \
    kanagata init --kind u-draw -o u.scene.json\n\n\
    The tools move along z. Proposed from their surfaces: directions, roles, symmetry planes, blank, elements, and\n\
    the travel at which they close on the sheet. Comments in the scene say what to check. Tools from CAD files\n\
    name them, and `kanagata run` converts them.\n\n{EXIT_HELP}"))]
pub struct InitArgs {
    /// Tool files, or IGES or STEP files with one tool in each body
    #[arg(long, num_args = 1.., value_name = "FILE", required_unless_present = "kind")]
    tools: Vec<PathBuf>,
    /// Kind of the part; without tools a template of this kind
    #[arg(long, value_enum)]
    kind: Option<Kind>,
    /// The scene to write; - for standard output
    #[arg(short, long, value_name = "FILE", value_parser = output_path)]
    output: PathBuf,
    /// Thickness of the sheet
    #[arg(long, value_name = "LENGTH", value_parser = length_mm, default_value = "1mm")]
    thickness: f64,
    /// Material: a card of the library, or a card file relative to the scene
    #[arg(long, value_name = "NAME", default_value = "mild-steel-neto2012")]
    material: String,
    /// Replace a scene that is there
    #[arg(long)]
    overwrite: bool,
}

/// Writes the scene and prints what comes next.
///
/// # Errors
/// Exit code 2 for files that are no tools, tools without a side, and a scene that exists; 4 for files.
pub fn run(args: &InitArgs) -> Result<Exit, Failure> {
    let inputs: Vec<&Path> = args.tools.iter().map(PathBuf::as_path).collect();
    refuse_clashes(&inputs, &[("--output", Some(&args.output))])?;
    if args.output.exists() && !args.overwrite {
        let path = args.output.display();
        return Err(Failure::input(format!(
            "{path} exists; allowed: a new file, or --overwrite to replace it"
        )));
    }
    let wishes = Wishes {
        name: name_of(&args.output),
        thickness_mm: args.thickness,
        material: args.material.clone(),
        kind: args.kind.map(PartKind::from),
    };
    let layout = match wishes.kind {
        Some(kind) if args.tools.is_empty() => template(kind, &wishes),
        _ => propose(&given(args)?, &wishes).map_err(Failure::input)?,
    };
    let text = layout.text();
    crate::scene::read::parse(text.as_bytes(), &args.output)?;
    if let Some(folder) = args.output.parent().filter(|f| !f.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).map_err(|e| {
            Failure::new(Exit::Io, format!("cannot make the folder {}: {e}", folder.display()))
        })?;
    }
    write_atomic(&args.output, |w| w.write_all(text.as_bytes()))?;
    print(&layout, &args.output);
    Ok(Exit::Done)
}

/// Name of a scene: its file name without `.scene.json`; `part` for standard output.
fn name_of(path: &Path) -> String {
    if is_stdout(path) {
        return "part".into();
    }
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let stem = name.strip_suffix(".json").unwrap_or(&name);
    stem.strip_suffix(".scene").unwrap_or(stem).to_owned()
}

/// The tools that are given: tool files, and the bodies of CAD files.
fn given(args: &InitArgs) -> Result<Vec<GivenTool>, Failure> {
    let mut tools = Vec::new();
    let folder = args.output.parent().unwrap_or(Path::new(""));
    for path in &args.tools {
        let file = relative(path, folder);
        if is_cad(path)? {
            let cad = ToolCad {
                file,
                tol_mm: TOLERANCE_REL * args.thickness,
                bodies: Vec::new(),
                faces: Vec::new(),
                layers: Vec::new(),
                colours: Vec::new(),
                offset_mm: None,
                sheet_surface: None,
                flip: false,
            };
            tools.extend(bodies(path, &cad)?);
        } else {
            let loaded = crate::tool::file::read(path)?;
            let name = name_of(path);
            tools.push(GivenTool {
                name: plain(name.strip_suffix(".tool").unwrap_or(&name)),
                file,
                cad: None,
                surface: Arc::new(ToolSurface::new(loaded.model)),
                has_side: true,
            });
        }
    }
    Ok(tools)
}

/// Whether a file is IGES or STEP, by its content.
fn is_cad(path: &Path) -> Result<bool, Failure> {
    let bytes = crate::files::read(path, Input::Cad)
        .map_err(|e| Failure::new(Exit::Io, format!("cannot read {}: {e}", path.display())))?;
    Ok(matches!(FileKind::of(&bytes), Some(FileKind::Step | FileKind::Iges)))
}

/// The bodies of a CAD file as coarse tools.
fn bodies(path: &Path, cad: &ToolCad) -> Result<Vec<GivenTool>, Failure> {
    let model = read_model(path, LostFaces::Skip)?;
    let numbers: BTreeSet<usize> = model.faces.iter().map(|f| f.attributes.body).collect();
    let mut named = named_bodies(&model, numbers);
    if let [(_, name)] = &mut named[..] {
        *name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    }
    let is_alone = named.len() == 1;
    let tool = |(number, name): (usize, String)| {
        let surface = Arc::new(ToolSurface::new(body_of(&model, number)?));
        let bodies = if is_alone { Vec::new() } else { vec![(number + 1).to_string()] };
        let (cad, file) = (ToolCad { bodies, ..cad.clone() }, format!("{name}.tool.json"));
        Ok(GivenTool { name: plain(&name), file, cad: Some(cad), surface, has_side: false })
    };
    named.into_iter().map(tool).collect()
}

fn body_of(model: &Model, number: usize) -> Result<crate::tool::ToolModel, Failure> {
    let selection = FaceSelection { bodies: vec![(number + 1).to_string()], ..Default::default() };
    let chosen = choose(model, &selection).map_err(Failure::input)?;
    let options = ConvertOptions { straighten: true, ..ConvertOptions::default() };
    let made = mesh_and_convert(&chosen.model, &MappedOptions::default(), &options);
    made.map(|(tool, _)| tool).map_err(|error| match error {
        UnfoldedError::Mesh(error) => error.into(),
        UnfoldedError::Convert(error) => error.into(),
    })
}

/// A name of letters, digits, `-` and `_`.
fn plain(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || matches!(c, '-' | '_') { c } else { '-' };
    let clean: String = name.chars().take(64).map(plain).collect();
    if clean.is_empty() { "tool".into() } else { clean }
}

/// A path as seen from a folder, with `/` between its parts.
fn relative(path: &Path, folder: &Path) -> String {
    let whole = |path: &Path| {
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        std::path::absolute(path).map(|path| path.canonicalize().unwrap_or(path))
    };
    let (Ok(own), Ok(base)) = (whole(path), whole(folder)) else {
        return path.display().to_string();
    };
    let common = own.components().zip(base.components()).take_while(|(a, b)| a == b).count();
    let up = base.components().skip(common).map(|_| "..".to_owned());
    let down = own.components().skip(common);
    let parts = up.chain(down.map(|part| part.as_os_str().to_string_lossy().into_owned()));
    parts.collect::<Vec<_>>().join("/")
}

fn print(layout: &Layout, scene: &Path) {
    for line in layout.summary() {
        out!("  {line}");
    }
    if let Some(text) = layout.size_warning() {
        err!("warning: {text}");
    }
    for name in layout.idle() {
        err!(
            "note: {name} has no drive and stands where it touches the sheet; give it one in the stages"
        );
    }
    if is_stdout(scene) {
        return;
    }
    out!("  {}", scene.display());
    out!("next, after reading the comments in the scene:");
    out!("  kanagata run {} -o {}", scene.display(), scene.with_file_name("run").display());
}
