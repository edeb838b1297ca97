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
use crate::scene::types::{Scene, SheetSurface, Tool as SceneTool, ToolCad};
use crate::tool::file::Provenance;

/// A tool of a scene that has CAD.
#[derive(Debug)]
pub struct MadeTool {
    /// Name in the scene.
    pub name: String,
    /// Tool file, relative to the scene: that of the scene or, for other values of it, one of its own.
    pub file: String,
    /// Whether the file is one of its own.
    pub is_variant: bool,
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
    // The scene of the file, where other values are set; one that is not complete without them has no tools of its own.
    let own = (!set.is_empty()).then(|| crate::scene::read::scene_with(path, &[]).ok()).flatten();
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
        let is_own = set.is_empty()
            || own.as_ref().is_some_and(|own| {
                is_of_scene(&own.0, folder, (tool, &provenance), (&cad, &scene_name))
            });
        let file = if is_own { tool.file.clone() } else { variant_file(&tool.file, &provenance) };
        let (name, is_variant) = (tool.name.clone(), !is_own);
        let earlier = earlier_tool(&folder.join(&file), given.tol_mm, &provenance);
        if let Some(tool) = earlier {
            let tool = tool.with_doubts(source.doubts(Some(given.tol_mm)));
            made.push(MadeTool { name, file, is_variant, tool, is_new: false });
            continue;
        }
        note(&name);
        let tool = converted(&source, &settings, provenance).map_err(|e| cad.named(e))?;
        tool.write(folder.join(&file))?;
        made.push(MadeTool { name, file, is_variant, tool, is_new: true });
    }
    Ok(made)
}

/// Whether a tool is that of the scene `own` without other values, or has a file that is set.
fn is_of_scene(
    own: &Scene,
    folder: &Path,
    (tool, wanted): (&SceneTool, &Provenance),
    (cad, scene_name): (&Cad, &str),
) -> bool {
    let Some(before) = own.tools.iter().find(|before| before.name == tool.name) else {
        return true;
    };
    if before.file != tool.file {
        return true;
    }
    let Some(given) = &before.cad else { return false };
    let origin = || {
        let settings = settings_of(before, given, own.blank.thickness_mm).ok()?;
        let zone = Zone::of_scene(own, folder, &before.file, &before.name).ok()?;
        let source = cad.source(&settings, Some((&zone, scene_name))).ok()?;
        Some(cad.provenance(&settings, &source))
    };
    let same_cad = tool.cad.as_ref().is_some_and(|cad| cad.file == given.file);
    same_cad && origin().is_some_and(|origin| origin == *wanted)
}

/// The tool in a file that was made from `wanted` within `tol_mm`.
fn earlier_tool(file: &Path, tol_mm: f64, wanted: &Provenance) -> Option<Tool> {
    Tool::read(file)
        .ok()
        .filter(|tool| tool.shape_error_mm().is_some_and(|error| error <= tol_mm))
        .filter(|tool| is_same(tool.provenance(), wanted))
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
