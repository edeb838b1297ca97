//! A tool model with its file.

use std::path::Path;
use std::sync::OnceLock;

use rayon::prelude::*;

use super::error::Error;
use crate::contact::{Projection, ToolSurface};
use crate::geometry::Vec3;
use crate::report::doubt::Doubt;
use crate::run::fields::tessellate;
use crate::tool::edge::EdgeRule;
use crate::tool::file::{Provenance, ToolFile, read};
use crate::tool::{ToolKind, ToolModel};

/// A tool of Nagata patches, Bezier patches or facets [mm]; its normals point to the sheet.
///
/// ```
/// use kanagata::prelude::Tool;
///
/// let punch = Tool::read("examples/strip/punch.tool.json")?;
/// let foot = punch.closest(&[[0.0, 0.0, 50.0]])[0];
/// assert!((foot.normal.norm() - 1.0).abs() < 1e-12);
/// # Ok::<(), kanagata::prelude::Error>(())
/// ```
pub struct Tool {
    pub(super) model: ToolModel,
    pub(super) provenance: Provenance,
    doubts: Vec<Doubt>,
    edges: EdgeRule,
    surface: OnceLock<ToolSurface>,
}

impl std::fmt::Debug for Tool {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Tool")
            .field("name", &self.model.name)
            .field("kind", &self.model.kind)
            .field("patches", &self.model.patches.len())
            .finish_non_exhaustive()
    }
}

impl Tool {
    /// A tool that was made of CAD.
    pub(super) fn made(
        model: ToolModel,
        edges: EdgeRule,
        provenance: Provenance,
        doubts: Vec<Doubt>,
    ) -> Self {
        Self { model, provenance, doubts, edges, surface: OnceLock::new() }
    }

    /// The same tool with other doubts.
    pub(super) fn with_doubts(self, doubts: Vec<Doubt>) -> Self {
        Self { doubts, ..self }
    }

    /// Reads a tool file.
    ///
    /// # Errors
    /// [`super::ErrorKind::Io`] for a file that cannot be read, [`super::ErrorKind::Input`] for one that is no tool file.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        let loaded = read(path.as_ref())?;
        Ok(Self::made(loaded.model, loaded.edges, loaded.provenance, Vec::new()))
    }

    /// Writes the tool file.
    ///
    /// # Errors
    /// [`super::ErrorKind::Io`] when the folder is missing or full.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let file = ToolFile::of_model(&self.model, self.edges, self.provenance.clone());
        Ok(file.write(path.as_ref())?)
    }

    /// Name of the tool.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.model.name
    }

    /// Kind of patch.
    #[must_use]
    pub fn kind(&self) -> ToolKind {
        self.model.kind
    }

    /// Number of patches.
    #[must_use]
    pub fn patches(&self) -> usize {
        self.model.patches.len()
    }

    /// Largest absolute shape error found when it was converted (Eq. 24) [mm]; `None` without a search or audit.
    #[must_use]
    pub fn shape_error_mm(&self) -> Option<f64> {
        self.provenance.shape_error_mm
    }

    /// Where the tool comes from.
    #[must_use]
    pub fn provenance(&self) -> &Provenance {
        &self.provenance
    }

    /// Why the tool should not be trusted as it is.
    #[must_use]
    pub fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }

    /// The patches.
    #[must_use]
    pub fn model(&self) -> &ToolModel {
        &self.model
    }

    /// Points [mm] and triangles of a picture of the patches, `divisions` >= 1 a side; neighbours share no points.
    #[must_use]
    pub fn triangles(&self, divisions: usize) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
        let (points, triangles) = tessellate(&self.model, divisions.max(1), &Vec3::zeros());
        (points.into_iter().map(Into::into).collect(), triangles)
    }

    /// Closest point of the tool to each point [mm], on all threads.
    #[must_use]
    pub fn closest(&self, points: &[[f64; 3]]) -> Vec<Projection> {
        let surface = self.surface.get_or_init(|| ToolSurface::new(self.model.clone()));
        points.par_iter().map(|p| surface.closest(&Vec3::from(*p), None)).collect()
    }
}
