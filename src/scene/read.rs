//! Reads a scene, checks it, loads its tools: a [`Plan`] holds everything a run needs.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::follow::{Followed, followed};
use super::types::{BlankShape, Drive, MaterialChoice, Scene, SolverLimits};
use crate::contact::ToolSurface;
use crate::files::sha256_hex;
use crate::solver::material::Material;
use crate::solver::material::card::{self, CardError, MaterialCard};
use crate::tool::file::{ToolFileError, read as read_tool};

/// Scene file version this program reads.
pub const VERSION: u32 = 1;

/// Why a scene cannot be run.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The scene file cannot be opened or read.
    #[error("cannot read scene {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// The text is not a scene.
    #[error("{}, line {line}, column {column}: {found}; allowed: the keys and values of schemas/scene.schema.json", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What the reader says.
        found: String,
    },
    /// A value out of its range.
    #[error("{}, {place}: found {found}; allowed: {allowed}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// Key, as a path into the scene.
        place: String,
        /// What was found.
        found: String,
        /// What is allowed.
        allowed: String,
    },
    /// The blank's mesh file cannot be used.
    #[error("{}, blank.shape.mesh.file: {cause}", path.display())]
    Blank {
        /// The scene.
        path: PathBuf,
        /// What is wrong with the file.
        cause: String,
    },
    /// A tool file that cannot be used.
    #[error("{}, {place}: {cause}", path.display())]
    Tool {
        /// The scene.
        path: PathBuf,
        /// Key, as a path into the scene.
        place: String,
        /// What is wrong with the tool file.
        cause: Box<ToolFileError>,
    },
    /// A material that cannot be used.
    #[error("{}, material: {cause}", path.display())]
    Material {
        /// The scene.
        path: PathBuf,
        /// What is wrong with the card.
        cause: CardError,
    },
}

/// A scene ready to run: checked, with its tools and material loaded.
pub struct Plan {
    /// The scene as written, defaults filled in.
    pub scene: Scene,
    /// Folder its paths are relative to.
    pub folder: PathBuf,
    /// SHA-256 of the scene file.
    pub sha256: String,
    /// Tools, in the scene's order.
    pub tools: Vec<PlannedTool>,
    /// The card in use.
    pub card: MaterialCard,
    /// The material law, its axes turned to the rolling direction.
    pub material: Arc<dyn Material>,
    /// The run whose increments are taken.
    pub followed: Option<Followed>,
}

/// A tool with its surface.
pub struct PlannedTool {
    /// Tool file as it was found.
    pub path: PathBuf,
    /// SHA-256 of the tool file.
    pub sha256: String,
    /// Surface with its search tree.
    pub surface: Arc<ToolSurface>,
    /// Largest |shape error| its file records [mm].
    pub shape_error_mm: Option<f64>,
}

impl Plan {
    /// The whole process over the modelled part: 2 for each symmetry plane.
    #[must_use]
    pub fn share(&self) -> f64 {
        2f64.powi(self.scene.symmetry.len() as i32)
    }
}

/// Reads and checks the scene at `path`.
///
/// # Errors
/// [`SceneError`] names the file, the key, what was found and what is allowed.
pub fn read(path: &Path) -> Result<Plan, SceneError> {
    let (mut scene, bytes) = scene_of(path)?;
    let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
    super::blank::fill_in(&mut scene.blank, path, &folder)?;
    let tools = load_tools(&scene, path, &folder)?;
    let followed = followed(&scene, path, &folder)?;
    let card_of = |cause| SceneError::Material { path: path.to_path_buf(), cause };
    let card = match &scene.material {
        MaterialChoice::Named(name) => card::find(name).map_err(card_of)?,
        MaterialChoice::Card(card) => (**card).clone(),
    };
    let angle = scene.blank.rolling_direction_deg.to_radians();
    let material = card.build(angle).map_err(card_of)?;
    Ok(Plan { scene, folder, sha256: sha256_hex(&bytes), tools, card, material, followed })
}

/// Reads and checks the scene at `path` without its tool files, which need not be there yet; with the file's bytes.
///
/// # Errors
/// As [`read`], but for tools and material.
pub fn scene_of(path: &Path) -> Result<(Scene, Vec<u8>), SceneError> {
    let bytes = std::fs::read(path)
        .map_err(|source| SceneError::Io { path: path.to_path_buf(), source })?;
    let scene: Scene = serde_json::from_slice(&bytes).map_err(|e| SceneError::Syntax {
        path: path.to_path_buf(),
        line: e.line(),
        column: e.column(),
        found: e.to_string(),
    })?;
    check(&scene).map_err(|(place, found, allowed)| SceneError::Value {
        path: path.to_path_buf(),
        place,
        found,
        allowed,
    })?;
    Ok((scene, bytes))
}

fn load_tools(scene: &Scene, path: &Path, folder: &Path) -> Result<Vec<PlannedTool>, SceneError> {
    let mut tools = Vec::with_capacity(scene.tools.len());
    for (k, tool) in scene.tools.iter().enumerate() {
        let file = folder.join(&tool.file);
        let loaded = read_tool(&file).map_err(|cause| SceneError::Tool {
            path: path.to_path_buf(),
            place: format!("tools[{k}].file"),
            cause: Box::new(cause),
        })?;
        tools.push(PlannedTool {
            path: file,
            sha256: loaded.sha256,
            surface: Arc::new(ToolSurface::new(loaded.model)),
            shape_error_mm: loaded.provenance.shape_error_mm,
        });
    }
    Ok(tools)
}

type Fault = (String, String, String);

fn check(scene: &Scene) -> Result<(), Fault> {
    let need = |ok: bool, place: String, found: String, allowed: &str| {
        if ok { Ok(()) } else { Err((place, found, allowed.to_owned())) }
    };
    need(scene.version == VERSION, "version".into(), scene.version.to_string(), "1")?;
    check_blank(scene)?;
    need(!scene.tools.is_empty(), "tools".into(), "none".into(), "at least one tool")?;
    for (k, tool) in scene.tools.iter().enumerate() {
        let at = |key: &str| format!("tools[{k}].{key}");
        let word = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        let named = !tool.name.is_empty() && tool.name.chars().all(word);
        let name = format!("'{}'", tool.name);
        need(named, at("name"), name.clone(), "letters, digits, '-' and '_'")?;
        let first = scene.tools.iter().position(|t| t.name == tool.name) == Some(k);
        need(first, at("name"), name, "a name of its own")?;
        let length = tool.direction.iter().map(|x| x * x).sum::<f64>().sqrt();
        let direction = length > 0.0 && length.is_finite();
        need(
            direction,
            at("direction"),
            format!("{:?}", tool.direction),
            "a vector that is not zero",
        )?;
        let mu = tool.friction;
        need((0.0..10.0).contains(&mu), at("friction"), mu.to_string(), "0 to 10")?;
    }
    need(!scene.stages.is_empty(), "stages".into(), "none".into(), "at least one stage")?;
    for (k, stage) in scene.stages.iter().enumerate() {
        let unknown = stage.drive.keys().find(|n| !scene.tools.iter().any(|t| t.name == **n));
        if let Some(name) = unknown {
            let names: Vec<&str> = scene.tools.iter().map(|t| t.name.as_str()).collect();
            let place = format!("stages[{k}].drive");
            return Err((place, format!("tool '{name}'"), names.join(", ")));
        }
        for (name, drive) in &stage.drive {
            if let Drive::Spring(spring) = drive {
                let stiffness = spring.stiffness_n_per_mm;
                let place = format!("stages[{k}].drive.{name}.spring.stiffness_n_per_mm");
                let fits = stiffness > 0.0 && stiffness.is_finite();
                need(fits, place, stiffness.to_string(), "above 0")?;
                let place = format!("stages[{k}].drive.{name}.spring.force_n");
                need(spring.force_n.is_finite(), place, spring.force_n.to_string(), "a number")?;
            }
        }
        for (key, value) in [
            ("first_increment", stage.first_increment),
            ("largest_increment", stage.largest_increment),
        ] {
            let fits = value.is_none_or(|v| v > 0.0 && v <= 1.0);
            need(fits, format!("stages[{k}].{key}"), format!("{value:?}"), "above 0, at most 1")?;
        }
    }
    check_solver(&scene.solver)
}

fn check_solver(solver: &SolverLimits) -> Result<(), Fault> {
    const LEAST_TOLERANCE: f64 = 1e-13;
    let fault = |key: &str, found: &dyn std::fmt::Debug, allowed: &str| {
        Err((format!("solver.{key}"), format!("{found:?}"), allowed.to_owned()))
    };
    let tolerance = solver.force_tolerance;
    if !(LEAST_TOLERANCE..0.1).contains(&tolerance) {
        return fault("force_tolerance", &tolerance, "1e-13 to 0.1");
    }
    if solver.iterations == 0 || solver.wanted_iterations == 0 {
        let found = (solver.iterations, solver.wanted_iterations);
        return fault("iterations, wanted_iterations", &found, "at least 1");
    }
    let step = solver.smallest_increment;
    if !(step > 0.0 && step <= 1.0) {
        return fault("smallest_increment", &step, "above 0, at most 1");
    }
    let transition = solver.friction_transition;
    if !(0.0..1.0).contains(&transition) {
        return fault("friction_transition", &transition, "0 to 1");
    }
    match solver.contact.stiffness() {
        Some(stiffness) if !(stiffness > 0.0 && stiffness.is_finite()) => {
            fault("contact.stiffness", &stiffness, "above 0")
        }
        _ => Ok(()),
    }
}

/// Elements of a blank, at most.
const MOST_ELEMENTS: usize = 20_000_000;

fn check_blank(scene: &Scene) -> Result<(), Fault> {
    let blank = &scene.blank;
    let lengths = match &blank.shape {
        BlankShape::Rectangle { size_mm: [x, y], .. } => {
            vec![("shape.rectangle.size_mm[0]", *x), ("shape.rectangle.size_mm[1]", *y)]
        }
        BlankShape::QuarterDisc { radius_mm, .. } => {
            vec![("shape.quarter_disc.radius_mm", *radius_mm)]
        }
        BlankShape::Mesh { .. } => Vec::new(),
    };
    // Hexahedra of a file bring their thickness.
    let own = matches!(blank.shape, BlankShape::Mesh { .. }) && blank.thickness_mm == 0.0;
    for (key, value) in lengths.into_iter().chain([("thickness_mm", blank.thickness_mm)]) {
        if !(value > 0.0 && value.is_finite() || own) {
            return Err((format!("blank.{key}"), value.to_string(), "above 0".into()));
        }
    }
    let counts = match blank.shape {
        BlankShape::Rectangle { elements: [nx, ny], .. } => [nx, ny, blank.layers],
        // The core once, and two sides of it to the rim: fewer than this.
        BlankShape::QuarterDisc { core, rings, .. } => {
            [core, core.saturating_add(rings.saturating_mul(2)), blank.layers]
        }
        BlankShape::Mesh { .. } => [1, 1, blank.layers],
    };
    let count = counts.iter().try_fold(1usize, |n, &k| n.checked_mul(k));
    let none = matches!(blank.shape, BlankShape::QuarterDisc { rings: 0, .. });
    if none || !count.is_some_and(|n| (1..=MOST_ELEMENTS).contains(&n)) {
        let allowed = format!("at least 1 each, at most {MOST_ELEMENTS} in all");
        return Err(("blank".into(), format!("elements {counts:?}"), allowed));
    }
    for (k, load) in scene.loads.iter().enumerate() {
        if load.force_n.iter().any(|f| !f.is_finite()) {
            let found = format!("{:?}", load.force_n);
            return Err((format!("loads[{k}].force_n"), found, "numbers".into()));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene() -> serde_json::Value {
        serde_json::json!({
            "format": "kanagata-scene", "version": 1, "name": "t",
            "blank": {
                "shape": {"rectangle": {"size_mm": [10.0, 10.0], "elements": [2, 2]}},
                "thickness_mm": 1.0
            },
            "material": "mild-steel-neto2012",
            "tools": [{"name": "die", "file": "die.tool.json", "direction": [0, 0, 1]}],
            "stages": [{"name": "draw", "drive": {"die": {"travel_mm": 1.0}}}],
        })
    }

    fn fails(change: impl Fn(&mut serde_json::Value)) -> String {
        let mut value = scene();
        change(&mut value);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.scene.json");
        std::fs::write(&path, value.to_string()).unwrap();
        match read(&path) {
            Ok(_) => String::new(),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn a_missing_tool_file_is_named_with_its_key_and_remedy() {
        let message = fails(|_| {});
        assert!(
            message.contains("tools[0].file") && message.contains("die.tool.json"),
            "{message}"
        );
        assert!(message.contains("kanagata convert"), "{message}");
    }

    #[test]
    fn unknown_keys_and_values_out_of_range_are_named() {
        let message = fails(|s| s["blank"]["colour"] = 1.into());
        assert!(message.contains("colour"), "{message}");
        let message = fails(|s| s["blank"]["thickness_mm"] = (-0.8).into());
        assert!(message.contains("blank.thickness_mm") && message.contains("-0.8"), "{message}");
        let message = fails(|s| {
            s["blank"]["shape"]["rectangle"]["elements"] =
                serde_json::json!([4_000_000_000u32, 4_000_000_000u32])
        });
        assert!(message.contains("blank: found elements"), "{message}");
        let message =
            fails(|s| s["stages"][0]["drive"] = serde_json::json!({"dye": {"travel_mm": 1}}));
        assert!(message.contains("'dye'") && message.contains("allowed: die"), "{message}");
        let message = fails(|s| s["tools"][0]["direction"] = serde_json::json!([0, 0, 0]));
        assert!(message.contains("tools[0].direction"), "{message}");
        let message = fails(|s| {
            s["stages"][0]["drive"] =
                serde_json::json!({"die": {"spring": {"stiffness_n_per_mm": 0}}})
        });
        assert!(message.contains("drive.die.spring.stiffness_n_per_mm: found 0"), "{message}");
        let spring = |stiffness: f64| serde_json::json!({"penalty": {"stiffness": stiffness}});
        let message = fails(|s| s["solver"] = serde_json::json!({"contact": spring(-1.0)}));
        assert!(message.contains("solver.contact.stiffness: found -1"), "{message}");
        let message = fails(|s| s["solver"] = serde_json::json!({"force_tolerance": 0}));
        assert!(message.contains("solver.force_tolerance: found 0"), "{message}");
        let message = fails(|s| s["version"] = 3.into());
        assert!(message.contains("version: found 3"), "{message}");
    }

    #[test]
    fn a_scene_that_is_no_scene_has_a_line_and_column() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.scene.json");
        std::fs::write(&path, "{\n \"format\": \"kanagata-tool\"}").unwrap();
        let message = read(&path).map(|_| ()).unwrap_err().to_string();
        assert!(message.contains("line 2, column"), "{message}");
    }
}
