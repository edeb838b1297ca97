//! What a study of stability maps, and how finely.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::solver::ContactMethod;

/// What is mapped, and how finely.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StabilityStudy {
    /// `kanagata-stability`.
    pub format: FormatTag,
    /// File version: 1.
    pub version: u32,
    /// Name, for reports.
    pub name: String,
    /// Newton's method of Eq. 19-23.
    pub newton: NewtonMap,
    /// Monomials against Bernstein polynomials.
    pub evaluation: EvaluationMap,
    /// Eq. 8 plain and guarded.
    pub edges: EdgeMap,
    /// A strip drawn over a radius.
    pub forming: FormingMap,
}

/// The constant that marks a study of stability.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum FormatTag {
    /// `kanagata-stability`
    #[serde(rename = "kanagata-stability")]
    Stability,
}

/// Points over a Nagata patch on a cylinder, and Newton from a grid of starting points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NewtonMap {
    /// Angles one patch spans [deg], one map each; below 180.
    pub angles_deg: Vec<f64>,
    /// Starting points along each parameter.
    pub starts: usize,
    /// Cells along the angle.
    pub columns: usize,
    /// Cells along the distance.
    pub rows: usize,
}

/// Random polynomials, evaluated in floating point and exactly.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EvaluationMap {
    /// Highest degree, 2 to 12.
    pub highest_degree: usize,
    /// Polynomials of each degree.
    pub polynomials: usize,
}

/// Plane edges over the tilt of their mean normal and the angle between their normals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EdgeMap {
    /// Cells along each axis.
    pub cells: usize,
}

/// A strip of mild steel drawn over a radius of 7 mm by a punch, held down and pulled back: one
/// element wide, two layers of solid-shells.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FormingMap {
    /// Depth [mm], above 0 and at most 15.
    pub depth_mm: f64,
    /// Ways to keep the strip out of the tools, each drawn in each of `increments`.
    pub methods: Vec<ContactMethod>,
    /// Numbers of equal increments, none of which may be cut.
    pub increments: Vec<usize>,
    /// Nagata patches over 90 degrees for these.
    pub patches: usize,
    /// Numbers of Nagata patches, and of facets, over 90 degrees, each drawn with steps as the solver takes them.
    pub divisions: Vec<usize>,
}
