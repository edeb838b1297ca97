//! What `run.json` says of the sheet itself.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Thickness over the initial one, below which it is a doubt: sheet metals fracture before.
pub(super) const THICKNESS_LEFT: f64 = 0.5;

/// Springback since the tools were released. Rigid motions that no symmetry plane constrains are constrained at as few
/// nodes as necessary, the first of the mesh. At the end a sheet that is constrained nowhere, or along one axis only,
/// is moved rigidly to where it is nearest to its shape in the tools.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SpringbackRecord {
    /// Largest displacement of a node [mm].
    pub largest_mm: f64,
    /// RMS of the displacements of all nodes [mm].
    pub rms_mm: f64,
    /// Sum of the magnitudes of the forces of the released tools, of the whole process [N].
    pub force_n: f64,
    /// Released elastic energy, of the whole process [N mm].
    pub energy_nmm: f64,
}

/// Unaccounted energy of an increment.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OpenedRecord {
    /// The increment.
    pub increment: usize,
    /// Its magnitude [N mm].
    pub energy_nmm: f64,
    /// Work done by then, or the work of rounding where that is more [N mm].
    pub work_nmm: f64,
}

/// A blank holder that the sheet pushed back.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HolderLiftRecord {
    /// The tool.
    pub tool: String,
    /// Increment with the largest lift.
    pub increment: usize,
    /// Travel against its direction from its farthest position while a force drove it, the largest at any increment [mm].
    pub lift_mm: f64,
}

/// The sheet's thickness, between the nodes of its faces.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ThicknessRecord {
    /// Minimum thickness: the smallest over the initial one [mm].
    pub minimum_mm: f64,
    /// Initial thickness there [mm].
    pub initial_mm: f64,
    /// That place, on the upper face, as it is now [mm].
    pub at_mm: [f64; 3],
    /// Maximum thickness [mm].
    pub maximum_mm: f64,
}

/// Self-penetration of the sheet, or penetration of its image beyond a symmetry plane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ThroughItselfRecord {
    /// The first increment that ended so.
    pub first_increment: usize,
    /// Nodes inside other parts of the sheet, the most at any increment.
    pub nodes: usize,
    /// One of them in the first such increment, as it was then [mm].
    pub at_mm: [f64; 3],
}

/// Overhang of the sheet at a tool edge: contact conditions are at nodes, and the edge is between them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OverEdgeRecord {
    /// The first increment that ended so.
    pub first_increment: usize,
    /// The tool.
    pub tool: String,
    /// Nodes beyond its border, the most at any increment.
    pub nodes: usize,
    /// Depth of the edge in the straight lines between nodes beyond it and nodes that the tool holds, the most at any
    /// increment [mm].
    pub depth_mm: f64,
    /// Where the deepest was in the first such increment [mm].
    pub at_mm: [f64; 3],
}

/// The deepest penetration of a tool into a face of an element. Contact conditions hold nodes; between them a face may lie in a
/// tool, or a feature of a tool in the sheet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FacePenetrationRecord {
    /// The tool.
    pub tool: String,
    /// The increment that ended so.
    pub increment: usize,
    /// Depth [mm].
    pub depth_mm: f64,
    /// Depth over the mean initial thickness of the sheet.
    pub depth_rel: f64,
    /// Where [mm].
    pub at_mm: [f64; 3],
    /// The first increment that ended with more than 5 % of the thickness.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_increment: Option<usize>,
}

impl FacePenetrationRecord {
    /// Depth over the thickness above which results are doubtful: a sag of the faces that moves forces by per cents.
    pub const ALLOWED_REL: f64 = 0.05;
}

/// What localised thinning looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NeckingKind {
    /// A band thins while the rest of the sheet unloads, past the maximum force of a tool.
    Band,
    /// Columns of nodes are thinner than those beside them, nearer than the sheet is thick.
    Dip,
    /// Less than half of the thickness is left.
    Torn,
}

/// Localised thinning of the sheet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NeckingRecord {
    /// What it looks like.
    pub kind: NeckingKind,
    /// The increment that it was first seen in, or began with.
    pub first_increment: usize,
    /// Where it is thinnest, on the upper face [mm].
    pub at_mm: [f64; 3],
    /// The least thickness there over the initial one.
    pub thickness_rel: f64,
}

/// Hourglass mode: columns of the mesh tilt in alternate directions. Elements that are wide for their layer deform so
/// under pressure through the thickness, and forces are far too low.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ZigzagRecord {
    /// The first increment that ended so.
    pub first_increment: usize,
    /// Share of the columns, the most at any increment.
    pub share: f64,
    /// One of them in the first such increment, as it was then [mm].
    pub at_mm: [f64; 3],
}

/// Through-thickness shear at the friction limit, which needs `hex8` in four layers or more.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ShearedRecord {
    /// The first increment that ended so.
    pub first_increment: usize,
    /// Share of the nodes that are pressed by more than it bears, but under edges and lines, the most at any increment.
    pub share: f64,
    /// One of them in the first such increment, as it was then [mm].
    pub at_mm: [f64; 3],
}

/// Nodes inside a tool at the end of a stage; contact includes only nodes of the face that the tool is to touch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct InToolRecord {
    /// The tool.
    pub tool: String,
    /// The stage at whose end it was found.
    pub stage: String,
    /// Nodes inside it.
    pub nodes: usize,
    /// Depth of the deepest, the most at the end of any stage [mm].
    pub depth_mm: f64,
    /// Where that was [mm].
    pub at_mm: [f64; 3],
}

impl ThicknessRecord {
    /// Whether the thickness is below half of the initial one.
    #[must_use]
    pub fn is_below_half(&self) -> bool {
        self.minimum_mm < THICKNESS_LEFT * self.initial_mm
    }
}

impl fmt::Display for ThicknessRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { minimum_mm, initial_mm, at_mm: [x, y, z], .. } = self;
        write!(f, "{minimum_mm:.4} of {initial_mm:.4} mm at ({x:.1}, {y:.1}, {z:.1}) mm")
    }
}

/// The largest strains of the sheet, total ones from the undeformed blank on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StrainRecord {
    /// Largest major strain: logarithmic, of the mid-surface at the centre of an element.
    pub major: f64,
    /// Minor strain there.
    pub minor: f64,
    /// That place, as it is now [mm].
    pub at_mm: [f64; 3],
    /// Largest equivalent plastic strain; none for a material without plasticity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plastic: Option<PlasticRecord>,
}

/// The largest equivalent plastic strain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlasticRecord {
    /// Of a material point.
    pub largest: f64,
    /// Centre of the point's element, as it is now [mm].
    pub at_mm: [f64; 3],
}

impl fmt::Display for StrainRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { major, minor, at_mm: [x, y, z], plastic } = self;
        write!(f, "major {major:.4} with minor {minor:.4} at ({x:.1}, {y:.1}, {z:.1}) mm")?;
        let Some(PlasticRecord { largest, at_mm: [x, y, z] }) = plastic else { return Ok(()) };
        write!(f, ", plastic {largest:.4} at ({x:.1}, {y:.1}, {z:.1}) mm")
    }
}
