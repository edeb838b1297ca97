//! The CAD of a tool, from which its file is made.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::Fault;
use kanagata_tool::selection::FaceSelection;

/// CAD of a tool, from which `kanagata run` makes the tool file. The solver alone does not read it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToolCad {
    /// IGES or STEP file, relative to the scene.
    pub file: String,
    /// Largest shape error (Eq. 24) [mm], 1e-6 or above. The tool has the fewest patches found within it.
    #[serde(default = "tolerance")]
    pub tol_mm: f64,
    /// Bodies of the file that make the tool: numbers from 1, or names with `*` and `?`. Default: all. An item that begins
    /// with `!` excludes, here and below; faces that all given lists choose are taken.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bodies: Vec<String>,
    /// Faces: numbers from 0, ranges as `3-9`, entities as `#120` or `D25`, or names with `*` and `?`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faces: Vec<String>,
    /// Layers and groups, by names with `*` and `?`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub layers: Vec<String>,
    /// Colours: `#rrggbb`, a name such as `red`, or `none`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub colours: Vec<String>,
    /// Offset of the surface [mm] along its normals that look at the sheet, before `flip`: the thickness and `flip` make the
    /// punch of a die.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset_mm: Option<f64>,
    /// The CAD is this surface of the sheet, not of the tool. The tool is offset by the thickness of the blank, or half of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sheet_surface: Option<SheetSurface>,
    /// Reverses the normals after they are turned towards the sheet, against the direction of the tool.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub flip: bool,
}

/// Surface of the sheet that a CAD file describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SheetSurface {
    /// The lower surface, which a tool below the sheet touches.
    Lower,
    /// The middle surface.
    Middle,
    /// The upper surface, which a tool above the sheet touches.
    Upper,
}

/// Least shape error that can be asked for [mm]: files have coordinates of about this accuracy.
const TOLERANCE_MIN_MM: f64 = 1e-6;

/// Default of the shape error [mm]: a hundredth of a sheet of 1 mm, below what gauges of dies resolve.
fn tolerance() -> f64 {
    0.01
}

impl ToolCad {
    /// The choice of faces; `None` for all.
    #[must_use]
    pub fn selection(&self) -> Option<FaceSelection> {
        let Self { bodies, faces, layers, colours, .. } = self.clone();
        let selection =
            FaceSelection { bodies, faces, layers, colours, ..FaceSelection::default() };
        (selection != FaceSelection::default()).then_some(selection)
    }

    /// Checks the values; `place` is the path of the key.
    pub(super) fn check(&self, place: &str) -> Result<(), Fault> {
        let fault = |key: &str, found: f64, allowed: &str| {
            Err((format!("{place}.{key}"), found.to_string(), allowed.to_owned()))
        };
        let lists = [&self.bodies, &self.faces, &self.layers, &self.colours];
        let names = ["bodies", "faces", "layers", "colours"];
        let items =
            names.iter().zip(lists).flat_map(|(name, list)| list.iter().map(move |s| (*name, s)));
        for (key, text) in std::iter::once(("file", &self.file)).chain(items) {
            if text.is_empty() || text.chars().any(char::is_control) {
                let allowed = "a text without control characters".to_owned();
                return Err((format!("{place}.{key}"), format!("{text:?}"), allowed));
            }
        }
        if !(TOLERANCE_MIN_MM..f64::INFINITY).contains(&self.tol_mm) {
            return fault("tol_mm", self.tol_mm, "1e-6 or above");
        }
        match self.offset_mm {
            Some(d) if !d.is_finite() => fault("offset_mm", d, "a finite length"),
            Some(d) if self.sheet_surface.is_some() => {
                fault("offset_mm", d, "`offset_mm` or `sheet_surface`, not both")
            }
            _ => Ok(()),
        }
    }
}
