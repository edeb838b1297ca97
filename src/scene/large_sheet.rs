//! A blank whose mesh file is too large to be read during a check: counts estimated from the size of the file, and a
//! set-up with the data that the cost of a run depends on.

use std::path::{Path, PathBuf};

use super::error::SceneError;
use super::plan::Plan;
use super::preview::SheetCounts;
use super::types::{Blank, BlankShape};
use kanagata_solver::assembly::Body;
use kanagata_solver::sheet::hex_mesh::rectangle;
use kanagata_solver::{Constraints, SimulationSetup};

/// Largest mesh file that a check reads [B], for a blank in one layer. A file of 15.7 MB with 233,000 quadrilaterals
/// takes 1.1 s of processor time and 119 MB (docs/results/faults.md).
const EXAMINED_BYTES_MAX: f64 = 16e6;
/// Work of examining a further layer over that of the first.
const LAYER_WORK_REL: f64 = 0.5;
/// Size per element in text mesh files with one node per element [B] (MSH, VTU, Abaqus: 50 to 62).
const BYTES_PER_ELEMENT: f64 = 60.0;
/// Thickness for the cost estimate if only the file has it [mm].
const ASSUMED_THICKNESS_MM: f64 = 1.0;

/// A mesh file that was not read.
#[derive(Debug, Clone, PartialEq)]
pub struct LargeSheet {
    /// The file.
    pub path: PathBuf,
    /// Its size [B].
    pub bytes: u64,
    /// Counts estimated from the size, for a square sheet.
    pub counts: SheetCounts,
}

impl LargeSheet {
    /// The mesh file of a blank if it is too large to be read during a check. `folder`: base of its path. A file whose
    /// elements are refined is read in any case, since their number depends on it.
    pub(super) fn of(blank: &Blank, folder: &Path) -> Option<Self> {
        if !blank.refine.is_empty() {
            return None;
        }
        let BlankShape::Mesh { file, .. } = &blank.shape else { return None };
        let path = folder.join(file);
        let bytes = std::fs::metadata(&path).ok().filter(std::fs::Metadata::is_file)?.len();
        let layers = blank.layers.max(1) as f64;
        let work = bytes as f64 * (1.0 + LAYER_WORK_REL * (layers - 1.0));
        (work > EXAMINED_BYTES_MAX).then(|| {
            let quads = bytes as f64 / BYTES_PER_ELEMENT;
            let counts = SheetCounts {
                elements: (quads * layers) as usize,
                nodes: (quads * (layers + 1.0)) as usize,
                columns: [quads.sqrt(); 2],
                levels: blank.layers.max(1) + 1,
            };
            Self { path, bytes, counts }
        })
    }
}

impl Plan {
    /// A set-up of one element without tools and constraints. Element kind, material, stages and limits are those of the
    /// scene.
    ///
    /// # Errors
    /// [`SceneError::Value`] when the element is invalid.
    pub fn one_element(&self, path: &Path) -> Result<SimulationSetup, SceneError> {
        let blank = &self.scene.blank;
        let thickness = blank.thickness_mm;
        let thickness = if thickness > 0.0 { thickness } else { ASSUMED_THICKNESS_MM };
        let mesh = rectangle(thickness, thickness, thickness, 1, 1, 1);
        let constraints = Constraints::none(mesh.nodes.len());
        let body = Body::new(mesh, blank.element, self.material.clone()).map_err(|e| {
            SceneError::Value {
                path: path.to_path_buf(),
                place: "blank".into(),
                found: e.to_string(),
                allowed: "a thickness that an element can have".into(),
            }
        })?;
        Ok(SimulationSetup {
            body,
            constraints,
            loads: Vec::new(),
            tools: Vec::new(),
            stages: self.stages(),
            limits: self.limits(),
            share: self.symmetry_factor(),
        })
    }
}
