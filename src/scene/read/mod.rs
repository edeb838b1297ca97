//! Reads and checks a scene and loads its files: a [`Plan`] holds everything a run needs.

use std::path::Path;
use std::sync::Arc;

use serde::Deserialize as _;

use super::check::{check, check_numbers};
use super::comments::without_comments;
use super::error::{Fault, SceneError};
use super::file_sheet::{FileSheet, of_file};
use super::follow::followed;
use super::large_sheet::LargeSheet;
use super::plan::{Plan, PlannedFile, PlannedTool};
use super::set_value::SetValue;
use super::toml_text::{is_toml, json_text};
use super::types::{Blank, BlankShape, MaterialChoice, Scene};
use kanagata_contact::ToolSurface;
use kanagata_files::{FileKind, sha256_hex};
use kanagata_solver::material::Material;
use kanagata_solver::material::card::{self, CardError, MaterialCard};
use kanagata_tool::Patch;
use kanagata_tool::file::read as read_tool;

pub use super::check::VERSION;

/// Reads and checks the scene at `path`.
///
/// # Errors
/// [`SceneError`] names the file, the key, what was found and what is allowed.
pub fn read(path: &Path) -> Result<Plan, SceneError> {
    read_with(path, &[])
}

/// As [`read`], with values of the scene set from outside.
///
/// # Errors
/// As [`read`].
pub fn read_with(path: &Path, set: &[SetValue]) -> Result<Plan, SceneError> {
    let (mut scene, bytes) = scene_with(path, set)?;
    let mesh_file = complete_blank(&mut scene.blank, path, folder_of(path))?;
    Ok(plan_of(path, scene, &bytes, mesh_file)?.with_set(set))
}

/// As [`read_with`], for the text `bytes` of a scene. `path` need not exist: its name is that of messages, and its folder that
/// of the files that the scene names.
///
/// # Errors
/// As [`read`].
pub fn read_text_with(bytes: &[u8], path: &Path, set: &[SetValue]) -> Result<Plan, SceneError> {
    let (mut scene, bytes) = text_with(bytes.to_vec(), path, set)?;
    let mesh_file = complete_blank(&mut scene.blank, path, folder_of(path))?;
    Ok(plan_of(path, scene, &bytes, mesh_file)?.with_set(set))
}

/// As [`read_with`], but a mesh file of the blank that is too large for a check is not read.
///
/// # Errors
/// As [`read`].
pub fn read_for_check(
    path: &Path,
    set: &[SetValue],
) -> Result<(Plan, Option<LargeSheet>), SceneError> {
    let (mut scene, bytes) = scene_with(path, set)?;
    let large = LargeSheet::of(&scene.blank, folder_of(path));
    let mesh_file = match large {
        Some(_) => None,
        None => complete_blank(&mut scene.blank, path, folder_of(path))?,
    };
    Ok((plan_of(path, scene, &bytes, mesh_file)?.with_set(set), large))
}

/// The folder that the paths of a scene are relative to.
fn folder_of(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}

/// The plan of a scene with the text `bytes` and a complete blank: loads tools, material and followed run.
fn plan_of(
    path: &Path,
    scene: Scene,
    bytes: &[u8],
    mesh_file: Option<PlannedFile>,
) -> Result<Plan, SceneError> {
    let folder = folder_of(path).to_path_buf();
    let tools = load_tools(&scene, path, &folder)?;
    let followed = followed(&scene, path, &folder)?;
    let card_of = |cause| SceneError::Material { path: path.to_path_buf(), cause };
    let (card, card_file) = match &scene.material {
        MaterialChoice::Named(name) if is_path(name) => {
            let (card, file) = card_of_file(name, path, &folder)?;
            (card, Some(file))
        }
        MaterialChoice::Named(name) => (card::find(name).map_err(card_of)?, None),
        MaterialChoice::Card(card) => ((**card).clone(), None),
    };
    let material = law(&card, &scene).map_err(|cause| match &card_file {
        Some(file) => {
            let (path, file) = (path.to_path_buf(), folder.join(&file.file));
            SceneError::CardFile { path, file, cause: cause.to_string() }
        }
        None => card_of(cause),
    })?;
    let files = mesh_file.into_iter().chain(card_file).collect();
    let sha256 = sha256_hex(bytes);
    let set = Vec::new();
    Ok(Plan { scene, folder, sha256, set, tools, card, material, files, followed })
}

/// Sets thickness [mm] and layers of a blank from the hexahedra of its mesh file. Returns the mesh file, if any.
pub(super) fn complete_blank(
    blank: &mut Blank,
    scene: &Path,
    folder: &Path,
) -> Result<Option<PlannedFile>, SceneError> {
    let BlankShape::Mesh { file, state } = &blank.shape else { return Ok(None) };
    let state = *state;
    let path = folder.join(file);
    let sheet = of_file(blank, scene, &path, state)?;
    let bytes = kanagata_files::read(&path, kanagata_files::Input::Mesh).map_err(|e| {
        SceneError::Blank { path: scene.to_path_buf(), cause: format!("{}: {e}", path.display()) }
    })?;
    let (file, sha256) = (file.clone(), sha256_hex(&bytes));
    if let FileSheet::Solid(mesh) = &sheet {
        blank.layers = mesh.nodes_per_column.saturating_sub(1).max(1);
        if blank.thickness_mm <= 0.0 {
            blank.thickness_mm = mesh.mean_thickness();
        }
    }
    Ok(Some(PlannedFile { file, sha256, sheet: Some(Arc::new(sheet)) }))
}

/// The material law of a card with its axes in the rolling direction.
fn law(card: &MaterialCard, scene: &Scene) -> Result<Arc<dyn Material>, CardError> {
    card.build(scene.blank.rolling_direction_deg.to_radians())
}

/// Checks keys, values and material of a scene in memory. The files that it names need not exist.
///
/// # Errors
/// The key as a path into the scene (empty if the whole value is invalid), what was found, and what is allowed.
pub fn check_value(value: &serde_json::Value) -> Result<Scene, Fault> {
    let scene = Scene::deserialize(value).map_err(|e| {
        let allowed = "the keys and values of schemas/scene.schema.json";
        (String::new(), e.to_string(), allowed.to_owned())
    })?;
    check(&scene)?;
    let found = match &scene.material {
        MaterialChoice::Named(name) if is_path(name) => return Ok(scene),
        MaterialChoice::Named(name) => card::find(name).and_then(|card| law(&card, &scene)),
        MaterialChoice::Card(card) => law(card, &scene),
    };
    found.map_err(|e| match e {
        CardError::Value { key, found, allowed, .. } => {
            (format!("material.{key}"), found.to_string(), allowed)
        }
        CardError::FormingLimit { cause, .. } => {
            (format!("material.forming_limit.{}", cause.key), cause.found, cause.allowed.into())
        }
        e => {
            let allowed = "the name of a card of the library, or a card in full";
            ("material".into(), e.to_string(), allowed.into())
        }
    })?;
    Ok(scene)
}

/// Whether a material is a file rather than a card of the library.
pub fn is_path(name: &str) -> bool {
    name.ends_with(".json") || name.contains(['/', '\\'])
}

/// Parses a material card. Its values are checked when the law is built.
///
/// # Errors
/// What was found, with line and column, and what is allowed.
pub fn parse_card(bytes: &[u8]) -> Result<MaterialCard, String> {
    serde_json::from_slice(&without_comments(bytes))
        .map_err(|e| format!("{e}; allowed: {}", card::KEYS))
}

fn card_of_file(
    name: &str,
    path: &Path,
    folder: &Path,
) -> Result<(MaterialCard, PlannedFile), SceneError> {
    let file = folder.join(name);
    let fault = |cause: String| SceneError::CardFile {
        path: path.to_path_buf(),
        file: file.clone(),
        cause,
    };
    let bytes = kanagata_files::read(&file, kanagata_files::Input::Description).map_err(|e| {
        let allowed = "a file with a material card, or the name of a card of the library";
        fault(format!("{e}; allowed: {allowed}"))
    })?;
    let card = parse_card(&bytes).map_err(|e| fault(format!("found {e}")))?;
    let (file, sha256) = (name.to_owned(), sha256_hex(&bytes));
    Ok((card, PlannedFile { file, sha256, sheet: None }))
}

/// Reads and checks the scene at `path` without its tool files, which need not exist. Also returns the bytes of the
/// file.
///
/// # Errors
/// As [`read`], except for tools and material.
pub fn scene_of(path: &Path) -> Result<(Scene, Vec<u8>), SceneError> {
    scene_with(path, &[])
}

/// As [`scene_of`], with values set from outside.
///
/// # Errors
/// As [`scene_of`].
pub fn scene_with(path: &Path, set: &[SetValue]) -> Result<(Scene, Vec<u8>), SceneError> {
    let bytes = kanagata_files::read(path, kanagata_files::Input::Description)
        .map_err(|source| SceneError::Io { path: path.to_path_buf(), source })?;
    text_with(bytes, path, set)
}

/// The scene of a text with values set from outside, and its text.
fn text_with(
    bytes: Vec<u8>,
    path: &Path,
    set: &[SetValue],
) -> Result<(Scene, Vec<u8>), SceneError> {
    if set.is_empty() {
        return Ok((parse(&bytes, path)?, bytes));
    }
    let json = json_text(&bytes, path)?;
    let Ok(mut value) = serde_json::from_slice::<serde_json::Value>(&without_comments(&json))
    else {
        return Ok((parse_json(&json, path)?, bytes));
    };
    let error = |set: String, cause: String| SceneError::Set { path: path.into(), set, cause };
    for one in set {
        one.apply(&mut value).map_err(|(place, found, allowed)| {
            let place = if place.is_empty() { "scene".into() } else { place };
            error(one.to_string(), format!("{place}: found {found}; allowed: {allowed}"))
        })?;
    }
    let bytes = value.to_string().into_bytes();
    let scene = parse_json(&bytes, path).map_err(|cause| {
        let all = set.iter().map(SetValue::to_string).collect::<Vec<_>>().join(", ");
        match cause {
            SceneError::Syntax { found, .. } => error(all, found),
            SceneError::Value { place, found, allowed, .. } => {
                error(all, format!("{place}: found {found}; allowed: {allowed}"))
            }
            other => other,
        }
    })?;
    Ok((scene, bytes))
}

/// Parses a scene and checks its keys and values. A `path` that ends in `.toml` says that the text is TOML.
///
/// # Errors
/// [`SceneError::Syntax`], [`SceneError::Value`].
pub fn parse(bytes: &[u8], path: &Path) -> Result<Scene, SceneError> {
    parse_json(&json_text(bytes, path)?, path)
}

/// Parses the JSON text of a scene and checks its keys and values.
fn parse_json(bytes: &[u8], path: &Path) -> Result<Scene, SceneError> {
    let text = without_comments(bytes);
    let scene: Scene = parsed(&text).map_err(|(e, key)| {
        if is_toml(bytes, path) {
            // Lines of the JSON text are none of the file.
            let place = if key.is_empty() { "scene".to_owned() } else { key };
            let allowed = "the keys and values of schemas/scene.schema.json".to_owned();
            return SceneError::Value {
                path: path.into(),
                place,
                found: without_place(&e),
                allowed,
            };
        }
        let other = FileKind::other_than(FileKind::Scene, bytes, path.to_path_buf());
        other.map_or_else(
            || SceneError::Syntax {
                path: path.to_path_buf(),
                line: e.line(),
                column: e.column(),
                found: at_key(&key, &without_place(&e)),
            },
            SceneError::Kind,
        )
    })?;
    let written = serde_json::from_slice(&text).unwrap_or_default();
    check_numbers(&written).and_then(|()| check(&scene)).map_err(|(place, found, allowed)| {
        SceneError::Value { path: path.to_path_buf(), place, found, allowed }
    })?;
    Ok(scene)
}

/// Deserialises a scene. The error: that of the parser, and the key if known.
fn parsed(text: &[u8]) -> Result<Scene, (serde_json::Error, String)> {
    let mut reader = serde_json::Deserializer::from_slice(text);
    let scene = serde_path_to_error::deserialize(&mut reader).map_err(|e| {
        let key = e.path().to_string();
        (e.into_inner(), if key == "." { String::new() } else { key })
    })?;
    reader.end().map_err(|e| (e, String::new()))?;
    Ok(scene)
}

/// The message of a parser without its line and column.
fn without_place(error: &serde_json::Error) -> String {
    let message = error.to_string();
    let place = format!(" at line {} column {}", error.line(), error.column());
    message.strip_suffix(&place).unwrap_or(&message).to_owned()
}

/// A parser message with its key. Two messages about surplus values are replaced by clearer ones.
fn at_key(key: &str, message: &str) -> String {
    let message = match message {
        "trailing characters" if !key.is_empty() => "more values than there are to be",
        "expected value" if !key.is_empty() => "more than the one key and its value that are to be",
        other => other,
    };
    if key.is_empty() { message.to_owned() } else { format!("{key}: {message}") }
}

fn load_tools(scene: &Scene, path: &Path, folder: &Path) -> Result<Vec<PlannedTool>, SceneError> {
    let mut tools = Vec::with_capacity(scene.tools.len());
    for (k, tool) in scene.tools.iter().enumerate() {
        let file = folder.join(&tool.file);
        let loaded = read_tool(&file).map_err(|cause| SceneError::Tool {
            path: path.to_path_buf(),
            place: format!("tools[{k}].file"),
            has_cad: tool.cad.is_some(),
            cause: Box::new(cause),
        })?;
        if loaded.model.patches.is_empty() {
            return Err(SceneError::Value {
                path: path.to_path_buf(),
                place: format!("tools[{k}].file"),
                found: format!("{}, which has no patches", tool.file),
                allowed: "a tool with patches: convert its CAD again".into(),
            });
        }
        if loaded.model.patches.iter().all(Patch::is_degenerate) {
            return Err(SceneError::Value {
                path: path.to_path_buf(),
                place: format!("tools[{k}].file"),
                found: format!("{}, none of whose patches has an area", tool.file),
                allowed: "a tool with faces: convert its CAD again".into(),
            });
        }
        tools.push(PlannedTool {
            path: file,
            sha256: loaded.sha256,
            surface: Arc::new(ToolSurface::new(loaded.model)),
            shape_error_mm: loaded.provenance.shape_error_mm,
            reachable_only: loaded.provenance.is_of_reachable_faces(),
        });
    }
    Ok(tools)
}

#[cfg(test)]
mod tests;
