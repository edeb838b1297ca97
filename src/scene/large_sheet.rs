//! A blank whose mesh file is too large to be examined within the time of a check: its counts by the size of the file, and a
//! set-up with as much of it as the cost of a run depends on.

use std::path::{Path, PathBuf};

use super::error::SceneError;
use super::plan::Plan;
use super::preview::SheetCounts;
use super::types::{Blank, BlankShape};
use crate::solver::assembly::Body;
use crate::solver::sheet::hex_mesh::rectangle;
use crate::solver::{Constraints, SimulationSetup};

/// Size of the largest mesh file that is examined [B], of a blank in one layer. One of 15.7 MB with 233,000 quadrilaterals takes
/// 1.1 s of the processor and 119 MB (docs/results/faults.md).
const MAX_EXAMINED_BYTES: f64 = 16e6;
/// What a further layer adds to the work of examining a sheet, over that of the first.
const WORK_OF_A_LAYER: f64 = 0.5;
/// Bytes an element in mesh files of text, with one node an element (MSH, VTU, Abaqus: 50 to 62).
const BYTES_AN_ELEMENT: f64 = 60.0;
/// Thickness [mm] that the cost of a run is estimated with where only the file says it.
const ASSUMED_THICKNESS_MM: f64 = 1.0;

/// A mesh file that was not opened.
#[derive(Debug, Clone, PartialEq)]
pub struct LargeSheet {
    /// The file.
    pub path: PathBuf,
    /// Its size [B].
    pub bytes: u64,
    /// Counts estimated from the size, as of a square sheet.
    pub counts: SheetCounts,
}

impl LargeSheet {
    /// The mesh file of a blank, if it is too large to be examined within the time of a check; `folder`: what its path is
    /// relative to.
    pub(super) fn of(blank: &Blank, folder: &Path) -> Option<Self> {
        let BlankShape::Mesh { file, .. } = &blank.shape else { return None };
        let path = folder.join(file);
        let bytes = std::fs::metadata(&path).ok().filter(std::fs::Metadata::is_file)?.len();
        let layers = blank.layers.max(1) as f64;
        let work = bytes as f64 * (1.0 + WORK_OF_A_LAYER * (layers - 1.0));
        (work > MAX_EXAMINED_BYTES).then(|| {
            let quads = bytes as f64 / BYTES_AN_ELEMENT;
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
    /// A set-up of one element, without tools and constraints: kind of element, state, stages and limits are those of the scene.
    ///
    /// # Errors
    /// [`SceneError::Value`] when the element cannot be made.
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
            share: self.share(),
        })
    }
}
