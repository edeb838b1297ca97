//! A scene ready to run.

use std::path::PathBuf;
use std::sync::Arc;

use super::file_sheet::FileSheet;
use super::follow::Followed;
use super::types::Scene;
use crate::contact::ToolSurface;
use crate::solver::material::Material;
use crate::solver::material::card::MaterialCard;

/// A scene ready to run: checked, with its tools and material loaded.
#[derive(Clone)]
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
    /// Mesh file of the blank and card file of the material, where there are such.
    pub files: Vec<PlannedFile>,
    /// The run whose increments are taken.
    pub followed: Option<Followed>,
}

/// A file that the scene names.
#[derive(Debug, Clone)]
pub struct PlannedFile {
    /// As the scene names it.
    pub file: String,
    /// SHA-256 of the file.
    pub sha256: String,
    /// What it says, where it is the mesh file of the blank.
    pub sheet: Option<Arc<FileSheet>>,
}

/// A tool with its surface.
#[derive(Clone)]
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
