//! A CAD file.

use std::path::{Path, PathBuf};

use super::convert::ConvertSettings;
use super::error::{Error, ErrorKind};
use super::make::{Source, converted};
use super::tool::Tool;
use crate::cad::{CadError, Creases, Diagnostic, Model, Severity, usable};
use crate::files::{Input, sha256_hex};
use crate::reach::Zone;
use crate::tool::file::Provenance;

/// Accuracy of areas relative to the squared size of a face.
const AREA_ACCURACY_REL: f64 = 1e-9;

/// The trimmed faces of an IGES or STEP file [mm].
///
/// ```
/// use kanagata::prelude::Cad;
///
/// let punch = Cad::read("fixtures/forming/hemi_punch_144.igs")?;
/// assert!(punch.faces() > 0 && punch.unit() == "MM");
/// let [low, high] = punch.bounds_mm();
/// assert!(low.iter().zip(high).all(|(low, high)| *low < high));
/// # Ok::<(), kanagata::prelude::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Cad {
    pub(super) model: Model,
    pub(super) sha256: String,
    path: PathBuf,
    diagnostics: Vec<Diagnostic>,
}

impl Cad {
    /// Reads an IGES or STEP file, identified by its content. Faces are split along creases, which no smooth patch may cross.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] for a file that cannot be read, [`ErrorKind::Input`] for one that is no CAD file.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let (model, diagnostics) = crate::cad::read_with(path, Creases::Cut)?;
        let bytes = crate::files::read(path, Input::Cad)
            .map_err(|source| CadError::Io { path: path.to_path_buf(), source })?;
        Ok(Self { model, sha256: sha256_hex(&bytes), path: path.to_path_buf(), diagnostics })
    }

    /// Number of faces.
    #[must_use]
    pub fn faces(&self) -> usize {
        self.model.faces.len()
    }

    /// Area of each face [mm2].
    #[must_use]
    pub fn areas_mm2(&self) -> Vec<f64> {
        self.model.faces.iter().map(|face| face.area(AREA_ACCURACY_REL)).collect()
    }

    /// Least and greatest coordinates [mm].
    #[must_use]
    pub fn bounds_mm(&self) -> [[f64; 3]; 2] {
        let bounds = self.model.bbox();
        [bounds.min.into(), bounds.max.into()]
    }

    /// Unit of length in the file, by its name there.
    #[must_use]
    pub fn unit(&self) -> &str {
        &self.model.unit
    }

    /// Names of the bodies from the outermost product on, with `/` between; empty where the file names nothing.
    #[must_use]
    pub fn bodies(&self) -> Vec<String> {
        self.model.bodies.iter().map(|body| body.path_text()).collect()
    }

    /// Faces of the file that cannot be read or have no area: entity and reason.
    #[must_use]
    pub fn lost_faces(&self) -> Vec<[String; 2]> {
        self.model.lost.iter().map(|f| [f.source.clone(), f.reason.clone()]).collect()
    }

    /// Warnings about the content of the file: code, place, text; and faces that end beside each other without being joined.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let warnings = self.diagnostics.iter().filter(|d| d.severity == Severity::Warning);
        let texts = warnings.map(|d| format!("{} {}: {}", d.code, d.place, d.text));
        texts.chain(self.model.open_joints_text()).collect()
    }

    /// Converts the faces to a tool.
    ///
    /// A tolerance that is not reached gives the tool with the least error found, and a doubt ([`Tool::doubts`]).
    ///
    /// # Errors
    /// [`ErrorKind::Input`] for a model of unknown unit or with lost faces, a choice that has no face, an offset that
    /// intersects itself, faces that cannot be meshed, and patches that remain folded.
    pub fn convert(&self, settings: &ConvertSettings) -> Result<Tool, Error> {
        let source = self.source(settings, None)?;
        converted(&source, settings, self.provenance(settings, &source)).map_err(|e| self.named(e))
    }

    /// The faces that a conversion takes; `reach`: of those only which the sheet can touch, and the name of the scene.
    pub(super) fn source(
        &self,
        settings: &ConvertSettings,
        reach: Option<(&Zone, &str)>,
    ) -> Result<Source, Error> {
        usable::check(&self.model, &self.diagnostics, settings.skip_lost_faces)
            .map_err(|cause| self.named(cause))?;
        Source::new(&self.model, settings, reach).map_err(|cause| self.named(cause))
    }

    /// Where a tool of `source` comes from, without its shape error.
    pub(super) fn provenance(&self, settings: &ConvertSettings, source: &Source) -> Provenance {
        Provenance {
            cad_file: self.path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            cad_sha256: self.sha256.clone(),
            cad_unit: self.model.unit.clone(),
            mesher: settings.describe() + &source.words,
            selection: source.selection(settings),
            offset_mm: source.offset.as_ref().map(|report| report.distance_mm),
            faces_lost: self.model.lost.iter().map(|f| f.source.clone()).collect(),
            program: concat!("kanagata ", env!("CARGO_PKG_VERSION")).into(),
            shape_error_mm: None,
        }
    }

    /// An error about the file.
    pub(super) fn named(&self, cause: impl std::fmt::Display) -> Error {
        Error::new(ErrorKind::Input, format!("{}: {cause}", self.path.display()))
    }
}
