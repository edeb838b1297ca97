//! The file of a study of patches, version 1.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::mesh::mapped::MeshStyle;
use crate::study::StudyError;
use crate::tool::ToolKind;

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
    /// Direction to the sheet: the model is turned round if its faces look the other way on the whole.
    #[serde(default)]
    pub sheet_side: Option<[f64; 3]>,
    /// What closest points are looked for.
    pub queries: Queries,
    /// What is compared, a line of the charts each; 1 to 11.
    pub methods: Vec<Method>,
}

/// The constant that marks a study of patches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum FormatTag {
    /// `kanagata-patches`
    #[serde(rename = "kanagata-patches")]
    Patches,
}

/// Random points near the surface, the same for all models; each is looked up without any hint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Queries {
    /// Seed of the random numbers.
    pub seed: u64,
    /// Number of points, 1 to 1000000.
    pub points: usize,
    /// Largest distance from the surface, to both sides [mm], > 0.
    pub distance_mm: f64,
}

/// A way to make tool models, with the sizes it is tried at: `divisions` or `tolerances_mm`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Method {
    /// Name in table and charts.
    pub name: String,
    /// What the patches are.
    pub kind: ToolKind,
    /// Kinds of element.
    #[serde(default)]
    pub style: MeshStyle,
    /// How edges of Nagata patches are curved; `guarded` when not given, with tolerances `cad`.
    #[serde(default)]
    pub edges: Option<Edges>,
    /// With tolerances: leave all vertices on the CAD instead of balancing them about it.
    #[serde(default)]
    pub on_cad: bool,
    /// With tolerances: faces are divided independently where that takes fewer patches, borders within the tolerance.
    #[serde(default)]
    pub independent: bool,
    /// Uniform meshes: divisions of 90 degrees, 1 to 256 each (Nagata patches and facets).
    #[serde(default)]
    pub divisions: Vec<usize>,
    /// As few patches as keep the largest |shape error| within this [mm], > 0 each.
    #[serde(default)]
    pub tolerances_mm: Vec<f64>,
}

/// How the edges of Nagata patches are curved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Edges {
    /// Eq. 8 where its curve runs forward, straight elsewhere.
    Guarded,
    /// Eq. 8 everywhere, also where it fails.
    Plain,
    /// Eq. 8, and where it leaves the curve open or fails, through the CAD.
    Cad,
}

impl Method {
    /// The rule for edges that holds when none is given too.
    pub(super) fn edges(&self) -> Edges {
        let usual = if self.divisions.is_empty() { Edges::Cad } else { Edges::Guarded };
        self.edges.unwrap_or(usual)
    }

    /// What of it makes no sense: key, what was found, what is allowed.
    fn fault(&self) -> Option<(String, String, &'static str)> {
        let fault = |place: &str, found: String, allowed| Some((place.to_owned(), found, allowed));
        if self.name.trim().is_empty() {
            return fault("name", "nothing".into(), "a name");
        }
        let (given, asked) = (self.divisions.len(), self.tolerances_mm.len());
        if (given == 0) == (asked == 0) {
            let found = format!("{given} divisions and {asked} tolerances_mm");
            return fault("divisions", found, "one of the two lists, with at least one number");
        }
        if self.kind == ToolKind::Bezier && given > 0 {
            return fault("divisions", format!("{given}"), "tolerances_mm for Bezier patches");
        }
        if self.kind != ToolKind::Nagata && self.edges.is_some() {
            let found = format!("{:?}", self.edges()).to_lowercase();
            return fault("edges", found, "none but for Nagata patches");
        }
        if self.on_cad && (given > 0 || self.kind == ToolKind::Bezier) {
            let allowed = "false, but for Nagata patches and facets with tolerances_mm";
            return fault("on_cad", "true".into(), allowed);
        }
        if self.independent && (given > 0 || self.kind == ToolKind::Bezier) {
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

/// Refuses what makes no sense.
///
/// # Errors
/// [`StudyError::Value`] with file, place, what was found and what is allowed.
pub(in crate::study) fn check(study: &PatchStudy, file: &Path) -> Result<(), StudyError> {
    const MOST: usize = 11;
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
    if !(1..=MOST).contains(&study.methods.len()) {
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
