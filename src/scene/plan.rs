//! A scene ready to run.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::error::SceneError;
use super::file_sheet::FileSheet;
use super::follow::Followed;
use super::set_value::SetValue;
use super::types::Scene;
use kanagata_contact::ToolSurface;
use kanagata_solver::material::Material;
use kanagata_solver::material::card::MaterialCard;
use kanagata_solver::material::forming_limit::Diagram;

/// A scene ready to run: checked, with its tools and material loaded.
#[derive(Clone)]
pub struct Plan {
    /// The scene with its defaults.
    pub scene: Scene,
    /// Folder that its paths are relative to.
    pub folder: PathBuf,
    /// SHA-256 of the scene file; with values set from outside, of the scene that results.
    pub sha256: String,
    /// Values set from outside, `PATH=VALUE`.
    pub set: Vec<String>,
    /// Tools, in the order of the scene.
    pub tools: Vec<PlannedTool>,
    /// The material card.
    pub card: MaterialCard,
    /// The material law with its axes in the rolling direction.
    pub material: Arc<dyn Material>,
    /// Mesh file of the blank and card file of the material, if any.
    pub files: Vec<PlannedFile>,
    /// The run whose increments are followed.
    pub followed: Option<Followed>,
}

/// A file named by the scene.
#[derive(Debug, Clone)]
pub struct PlannedFile {
    /// Path as in the scene.
    pub file: String,
    /// SHA-256 of the file.
    pub sha256: String,
    /// The sheet, for the mesh file of the blank.
    pub sheet: Option<Arc<FileSheet>>,
}

/// A tool with its surface.
#[derive(Clone)]
pub struct PlannedTool {
    /// Path of the tool file.
    pub path: PathBuf,
    /// SHA-256 of the tool file.
    pub sha256: String,
    /// Surface with its search tree.
    pub surface: Arc<ToolSurface>,
    /// Largest |shape error| recorded in its file [mm].
    pub shape_error_mm: Option<f64>,
    /// It was made of the faces that the sheet of a scene can touch.
    pub reachable_only: bool,
}

impl Plan {
    /// The plan of a scene in which `set` has set values.
    pub(super) fn with_set(self, set: &[SetValue]) -> Self {
        Self { set: set.iter().map(SetValue::to_string).collect(), ..self }
    }

    /// Number of symmetric parts of the process: 2 to the power of the number of symmetry planes.
    #[must_use]
    pub fn symmetry_factor(&self) -> f64 {
        2f64.powi(self.scene.symmetry.len() as i32)
    }

    /// The forming limit diagram of the blank. `path`: the scene, for messages.
    ///
    /// # Errors
    /// [`SceneError::Material`] for a forming limit out of range.
    pub fn forming_limit_diagram(&self, path: &Path) -> Result<Diagram, SceneError> {
        let diagram = self.card.diagram(self.scene.blank.thickness_mm);
        diagram.map_err(|cause| SceneError::Material { path: path.to_path_buf(), cause })
    }
}
