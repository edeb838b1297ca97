//! Choice of faces of a CAD file, as a tool file has it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Faces that every given list chooses. An item that begins with `!` excludes; a list of exclusions alone chooses all
/// other faces.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FaceSelection {
    /// Bodies: numbers from 1, or names with `*` and `?` as wildcards. A name is a product, an occurrence, the body
    /// itself, or the whole path with `/` between them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub bodies: Vec<String>,
    /// Faces: numbers from 0, ranges as `3-9`, entities as `#120` or `D25`, or names with wildcards.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub faces: Vec<String>,
    /// Layers and groups: names with wildcards.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub layers: Vec<String>,
    /// Colours: `#rrggbb`, `black`, `red`, `green`, `blue`, `yellow`, `magenta`, `cyan`, `white`, or `none`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub colours: Vec<String>,
    /// Boxes that contain the faces [mm].
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub boxes: Vec<SelectionBox>,
    /// Direction that the faces look in.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub facing: Option<Facing>,
    /// Closed curve in plan (seen along z): faces inside. Faces that it crosses are split along it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub within: Vec<PlanPiece>,
    /// Closed curve in plan: faces outside. Faces that it crosses are split along it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outside: Vec<PlanPiece>,
}

/// A piece of a closed curve in plan: a rational B-spline whose end is the start of the next piece.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlanPiece {
    /// Degree.
    pub degree: usize,
    /// Knots, non-decreasing.
    pub knots: Vec<f64>,
    /// Control points x, y [mm].
    pub points: Vec<[f64; 2]>,
    /// Weights; none: all are 1.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub weights: Vec<f64>,
}

/// A box; it chooses the faces that are inside as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SelectionBox {
    /// Smallest coordinates [mm].
    pub min: [f64; 3],
    /// Largest coordinates [mm].
    pub max: [f64; 3],
    /// The faces inside are excluded.
    #[serde(default)]
    pub excluded: bool,
}

/// Faces whose mean normal is near a direction. Normals are those of the CAD file, out of a solid.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Facing {
    /// The direction.
    pub direction: [f64; 3],
    /// Largest angle between the mean normal and the direction [degrees].
    pub angle_deg: f64,
}

impl FaceSelection {
    /// True when all faces are chosen.
    #[must_use]
    pub fn is_all(&self) -> bool {
        *self == Self::default()
    }
}
