//! File of a stability study, version 1.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use kanagata_solver::ContactMethod;

/// Maps of the convergence of methods, and their resolution.
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
    /// Monomials compared with Bernstein polynomials.
    pub evaluation: EvaluationMap,
    /// Eq. 8, plain and guarded.
    pub edges: EdgeMap,
    /// A strip drawn over a radius.
    pub forming: FormingMap,
}

/// The format tag of a stability study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum FormatTag {
    /// `kanagata-stability`
    #[serde(rename = "kanagata-stability")]
    Stability,
}

/// Closest points on a Nagata patch of a cylinder, by Newton's method from a grid of starting points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NewtonMap {
    /// Angles of a patch [deg], below 180; one map each.
    pub angles_deg: Vec<f64>,
    /// Number of starting points along each parameter.
    pub starts: usize,
    /// Number of cells along the angle.
    pub columns: usize,
    /// Number of cells along the distance.
    pub rows: usize,
}

/// Random polynomials, evaluated in floating point and exactly.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EvaluationMap {
    /// Highest degree, 2 to 12.
    pub highest_degree: usize,
    /// Number of polynomials per degree.
    pub polynomials: usize,
}

/// Plane edges: tilt of the mean normal and angle between the normals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EdgeMap {
    /// Number of cells along each axis.
    pub cells: usize,
}

/// A strip of mild steel drawn over a radius of 7 mm by a punch, with a holder and a pulling force at its end: one
/// element wide, two layers of solid-shell elements.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FormingMap {
    /// Depth [mm], above 0 and at most 15.
    pub depth_mm: f64,
    /// Contact methods, each with every number in `increments`.
    pub methods: Vec<ContactMethod>,
    /// Numbers of equal increments without step cuts.
    pub increments: Vec<usize>,
    /// Nagata patches per 90 degrees for these draws.
    pub patches: usize,
    /// Numbers of Nagata patches and of facets per 90 degrees, each drawn with automatic steps.
    pub divisions: Vec<usize>,
}
