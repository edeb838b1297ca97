//! Tool files of a scene, made from the CAD that it names.

use std::path::Path;

use super::cad::Cad;
use super::convert::ConvertSettings;
use super::error::{Error, ErrorKind};
use super::make::converted;
use super::scene::values_set;
use super::tool::Tool;
use crate::convert::offset::{OffsetRequest, SheetReference};
use crate::files::sha256_hex;
use crate::progress::Progress;
use crate::reach::Zone;
use crate::scene::set_value::SetValue;
use crate::scene::types::{SheetSurface, Tool as SceneTool, ToolCad};
use crate::tool::file::Provenance;

/// A tool of a scene that has CAD.
#[derive(Debug)]
pub struct MadeTool {
    /// Name in the scene.
    pub name: String,
    /// Tool file, relative to the scene: that of the scene or, for other values of it, one of its own.
    pub file: String,
    /// The tool.
    pub tool: Tool,
    /// Whether the file was made; false: it was there already, made from the same CAD in the same way.
    pub is_new: bool,
}

/// Makes the tool files of a scene whose tools have `cad`, of the faces that the sheet can touch.
///
/// A file that was made from the same CAD with the same settings by this version of the program is kept, unless it has missed
/// its tolerance. `note` is called
/// with the name of a tool before it is made.
///
/// # Errors
/// [`ErrorKind::Io`] for files that cannot be read or written; [`ErrorKind::Input`] for a scene or CAD that is not what is
/// allowed.
pub fn make_tools(
    scene: impl AsRef<Path>,
    note: &mut dyn FnMut(&str),
) -> Result<Vec<MadeTool>, Error> {
    make_tools_watched(scene, &[], note, &Progress::default())
}

/// As [`make_tools`] of the scene with the values `set`, each `PATH=VALUE` as for `kanagata run --set`. With values, a tool
/// that is not that of the scene's file gets a file of its own beside it: [`MadeTool::file`].
///
/// # Errors
/// As [`make_tools`], and a path or value that the scene does not have.
pub fn make_tools_with(
    scene: impl AsRef<Path>,
    set: &[&str],
    note: &mut dyn FnMut(&str),
) -> Result<Vec<MadeTool>, Error> {
    make_tools_watched(scene, &values_set(set)?, note, &Progress::default())
}

/// As [`make_tools`] of the scene with the values `set`, with the progress of every conversion reported. With values, a tool
/// that is not that of the scene's file gets a file of its own beside it, with a digest of its origin in the name: variants
/// of a scene do not overwrite each other's tools.
///
/// # Errors
/// As [`make_tools`].
pub fn make_tools_watched(
    scene: impl AsRef<Path>,
    set: &[SetValue],
    note: &mut dyn FnMut(&str),
    progress: &Progress,
) -> Result<Vec<MadeTool>, Error> {
    let path = scene.as_ref();
    let (scene, _) = crate::scene::read::scene_with(path, set)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let scene_name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut made = Vec::new();
    for tool in &scene.tools {
        let Some(given) = &tool.cad else { continue };
        let cad = Cad::read(folder.join(&given.file))?;
        let settings = settings_of(tool, given, scene.blank.thickness_mm)?;
        let settings = ConvertSettings { progress: progress.clone(), ..settings };
        let zone = Zone::of_scene(&scene, folder, &tool.file, &tool.name)?;
        let source = cad.source(&settings, Some((&zone, &scene_name)))?;
        let provenance = cad.provenance(&settings, &source);
        let (file, earlier) =
            earlier_file(folder, tool, given.tol_mm, !set.is_empty(), &provenance);
        let is_new = earlier.is_none();
        let result = match earlier {
            Some(tool) => tool.with_doubts(source.doubts()),
            None => {
                note(&tool.name);
                let new = converted(&source, &settings, provenance).map_err(|e| cad.named(e))?;
                new.write(folder.join(&file))?;
                new
            }
        };
        made.push(MadeTool { name: tool.name.clone(), file, tool: result, is_new });
    }
    Ok(made)
}

/// File of a tool, and the tool if the file was made from `wanted` within `tol_mm`. A tool of other values than the scene's
/// that is not in the scene's file has a file of its own.
fn earlier_file(
    folder: &Path,
    tool: &SceneTool,
    tol_mm: f64,
    has_other_values: bool,
    wanted: &Provenance,
) -> (String, Option<Tool>) {
    let read = |file: &str| {
        Tool::read(folder.join(file))
            .ok()
            .filter(|tool| tool.shape_error_mm().is_some_and(|error| error <= tol_mm))
            .filter(|tool| is_same(tool.provenance(), wanted))
    };
    let found = read(&tool.file);
    if found.is_some() || !has_other_values {
        return (tool.file.clone(), found);
    }
    let variant = variant_file(&tool.file, wanted);
    let found = read(&variant);
    (variant, found)
}

/// File of a tool of other values than the scene's: `die.tool.json` becomes `die-1a2b3c4d.tool.json`.
fn variant_file(file: &str, provenance: &Provenance) -> String {
    let origin = serde_json::to_vec(provenance).unwrap_or_default();
    let digest = &sha256_hex(&origin)[..8];
    let stem = file.strip_suffix(".json").unwrap_or(file);
    let stem = stem.strip_suffix(".tool").unwrap_or(stem);
    format!("{stem}-{digest}.tool.json")
}

/// Whether a file was made in the same way; its shape error is a result.
fn is_same(file: &Provenance, wanted: &Provenance) -> bool {
    Provenance { shape_error_mm: None, ..file.clone() } == *wanted
}

fn settings_of(tool: &SceneTool, cad: &ToolCad, thickness: f64) -> Result<ConvertSettings, Error> {
    let offset = match (cad.offset_mm, cad.sheet_surface) {
        (Some(distance), _) => Some(OffsetRequest::Towards(distance)),
        (None, Some(_)) if thickness <= 0.0 => {
            return Err(Error::new(
                ErrorKind::Input,
                format!(
                    "tool `{}`: `sheet_surface` without `blank.thickness_mm`; give the thickness",
                    tool.name
                ),
            ));
        }
        (None, Some(surface)) => Some(OffsetRequest::Sheet {
            thickness,
            reference: match surface {
                SheetSurface::Lower => SheetReference::Lower,
                SheetSurface::Middle => SheetReference::Middle,
                SheetSurface::Upper => SheetReference::Upper,
            },
        }),
        (None, None) => None,
    };
    Ok(ConvertSettings {
        name: tool.name.clone(),
        sheet_side: Some(tool.direction),
        flip: cad.flip,
        faces: cad.selection(),
        offset,
        ..ConvertSettings::within(cad.tol_mm)
    })
}
