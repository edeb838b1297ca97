//! File of a patch study, version 1.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::StudyError;
use kanagata_mesh::mapped::MeshStyle;
use kanagata_tool::ToolKind;

/// One CAD file, converted by several methods at several sizes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PatchStudy {
    /// `kanagata-patches`.
    pub format: FormatTag,
    /// File version: 1.
    pub version: u32,
    /// Name, for reports.
    pub name: String,
    /// IGES or STEP file, relative to the folder of this one.
    pub cad: PathBuf,
    /// Direction towards the sheet: the normals are reversed if most faces point away from it.
    #[serde(default)]
    pub sheet_side: Option<[f64; 3]>,
    /// Query points of the closest-point search.
    pub queries: Queries,
    /// The methods to compare, one line per chart each; 1 to 11.
    pub methods: Vec<Method>,
}

/// The format tag of a patch study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum FormatTag {
    /// `kanagata-patches`
    #[serde(rename = "kanagata-patches")]
    Patches,
}

/// Random points near the surface, the same for all models; the search has no starting guess.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Queries {
    /// Seed of the random numbers.
    pub seed: u64,
    /// Number of points, 1 to 1000000.
    pub points: usize,
    /// Largest distance from the surface on both sides [mm], > 0.
    pub distance_mm: f64,
}

/// A conversion method with its sizes: `divisions` or `tolerances_mm`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Method {
    /// Name in table and charts.
    pub name: String,
    /// Kind of the patches.
    pub kind: ToolKind,
    /// Kind of the mesh elements.
    #[serde(default)]
    pub style: MeshStyle,
    /// Curvature of the edges of Nagata patches; default `guarded`, with tolerances `cad`.
    #[serde(default)]
    pub edges: Option<Edges>,
    /// With tolerances: keep all vertices on the CAD surface instead of balancing the error on both sides.
    #[serde(default)]
    pub on_cad: bool,
    /// With tolerances: divide faces independently where that needs fewer patches, with borders within the tolerance.
    #[serde(default)]
    pub independent: bool,
    /// Uniform meshes: divisions per 90 degrees, 1 to 256 each (Nagata patches and facets).
    #[serde(default)]
    pub divisions: Vec<usize>,
    /// Tolerances: the fewest patches with a largest |shape error| within each value [mm], > 0.
    #[serde(default)]
    pub tolerances_mm: Vec<f64>,
}

/// Curvature of the edges of Nagata patches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Edges {
    /// Eq. 8 where its curve advances monotonically, straight elsewhere.
    Guarded,
    /// Eq. 8 everywhere, also where it fails.
    Plain,
    /// Eq. 8; where it is undetermined or fails, from the CAD.
    Cad,
}

impl Method {
    /// The edge rule, including the default.
    pub(super) fn edges(&self) -> Edges {
        let default = if self.divisions.is_empty() { Edges::Cad } else { Edges::Guarded };
        self.edges.unwrap_or(default)
    }

    /// The first fault: key, what was found, what is allowed.
    fn fault(&self) -> Option<(String, String, &'static str)> {
        let fault = |place: &str, found: String, allowed| Some((place.to_owned(), found, allowed));
        if self.name.trim().is_empty() {
            return fault("name", "nothing".into(), "a name");
        }
        let (divisions, tolerances) = (self.divisions.len(), self.tolerances_mm.len());
        if (divisions == 0) == (tolerances == 0) {
            let found = format!("{divisions} divisions and {tolerances} tolerances_mm");
            return fault("divisions", found, "one of the two lists, with at least one number");
        }
        if self.kind == ToolKind::Bezier && divisions > 0 {
            return fault("divisions", format!("{divisions}"), "tolerances_mm for Bezier patches");
        }
        if self.kind != ToolKind::Nagata && self.edges.is_some() {
            let found = format!("{:?}", self.edges()).to_lowercase();
            return fault("edges", found, "none but for Nagata patches");
        }
        if self.on_cad && (divisions > 0 || self.kind == ToolKind::Bezier) {
            let allowed = "false, but for Nagata patches and facets with tolerances_mm";
            return fault("on_cad", "true".into(), allowed);
        }
        if self.independent && (divisions > 0 || self.kind == ToolKind::Bezier) {
            let allowed = "false, but for Nagata patches and facets with tolerances_mm";
            return fault("independent", "true".into(), allowed);
        }
        if let Some(k) = self.divisions.iter().position(|n| !(1..=256).contains(n)) {
            return fault(&format!("divisions[{k}]"), self.divisions[k].to_string(), "1 to 256");
        }
        let bad = |t: &f64| !(t.is_finite() && *t > 0.0);
        let k = self.tolerances_mm.iter().position(bad)?;
        let found = self.tolerances_mm[k].to_string();
        fault(&format!("tolerances_mm[{k}]"), found, "above 0 mm")
    }
}

/// Checks the values of a patch study.
///
/// # Errors
/// [`StudyError::Value`] with file, place, what was found and what is allowed.
pub(crate) fn check(study: &PatchStudy, file: &Path) -> Result<(), StudyError> {
    const METHODS_MAX: usize = 11;
    let fault = |place: String, found: String, allowed: &str| {
        let (path, allowed) = (file.to_path_buf(), allowed.into());
        Err(StudyError::Value { path, place, found, allowed })
    };
    if study.version != 1 {
        return fault("version".into(), study.version.to_string(), "1");
    }
    if let Some([x, y, z]) = study.sheet_side {
        let length = x.hypot(y).hypot(z);
        if !(length.is_finite() && length > 0.0) {
            return fault("sheet_side".into(), format!("[{x}, {y}, {z}]"), "a direction");
        }
    }
    let Queries { points, distance_mm, .. } = study.queries;
    if !(1..=1_000_000).contains(&points) {
        return fault("queries.points".into(), points.to_string(), "1 to 1000000");
    }
    if !(distance_mm.is_finite() && distance_mm > 0.0) {
        return fault("queries.distance_mm".into(), distance_mm.to_string(), "above 0 mm");
    }
    if !(1..=METHODS_MAX).contains(&study.methods.len()) {
        return fault("methods".into(), study.methods.len().to_string(), "1 to 11");
    }
    for (k, method) in study.methods.iter().enumerate() {
        if let Some((place, found, allowed)) = method.fault() {
            return fault(format!("methods[{k}].{place}"), found, allowed);
        }
        if study.methods[..k].iter().any(|m| m.name == method.name) {
            let found = format!("'{}' again", method.name);
            return fault(format!("methods[{k}].name"), found, "a name of its own");
        }
    }
    Ok(())
}
