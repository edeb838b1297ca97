//! Report of an audit, as in `*.audit.json`. Lengths in mm, angles in degrees.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use kanagata_cad::raw::LostFace;
use kanagata_report::doubt::Doubt;

/// What the audit of a tool model found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AuditReport {
    /// `kanagata-audit`.
    pub format: String,
    /// File version: 1.
    pub version: u32,
    /// Program and version that wrote it.
    pub program: String,
    /// Name of the tool.
    pub tool: String,
    /// Tool file, as it was named.
    pub tool_file: String,
    /// SHA-256 of the tool file.
    pub tool_sha256: String,
    /// CAD file, as it was named.
    pub cad_file: String,
    /// SHA-256 of the CAD file.
    pub cad_sha256: String,
    /// Why the tool must not be trusted as it is.
    #[serde(default)]
    pub doubts: Vec<Doubt>,
    /// Faces of the CAD file that the model, or the tool, lacks.
    #[serde(default)]
    pub faces_lost: Vec<LostFace>,
    /// Patches audited.
    pub patches: usize,
    /// Largest signed shape error (Eq. 24) [mm]; positive: the patch stands out of the CAD.
    pub max_mm: f64,
    /// Smallest signed shape error [mm].
    pub min_mm: f64,
    /// Root mean square of the shape error over the patches' area [mm].
    pub rms_mm: f64,
    /// Largest distance of a point of a patch to the CAD [mm].
    pub distance_max_mm: f64,
    /// Largest normal error [degrees].
    pub normal_max_deg: f64,
    /// |shape error| that a share of the area does not exceed.
    pub percentiles_mm: Percentiles,
    /// Largest |shape error| allowed [mm].
    pub tolerance_mm: Option<f64>,
    /// Largest normal error allowed [degrees].
    pub normal_tolerance_deg: Option<f64>,
    /// True when both are kept, free borders and gaps between faces divided independently deviate no more, and every point
    /// could be compared; null when nothing was asked.
    pub within_tolerance: Option<bool>,
    /// Area of the patches [mm^2].
    pub area_mm2: f64,
    /// Points compared.
    pub points: usize,
    /// Points that are not finite or have no closest point.
    pub points_lost: usize,
    /// Points where the patch or the CAD has no normal.
    pub points_without_normal: usize,
    /// The tool looks the other way than the CAD; the CAD's normals were turned.
    pub turned: bool,
    /// Patches that fold: a normal more than 90 degrees off.
    pub folded: Vec<u32>,
    /// What happens across shared edges.
    pub jumps: Jumps,
    /// Free borders of the tool against those of the CAD faces that it has patches of.
    #[serde(default)]
    pub borders: Borders,
    /// Edges of the CAD at which faces end beside each other without being joined: the tool is open there, as its CAD is.
    #[serde(default)]
    pub open_joints: OpenJoints,
    /// By CAD face, in order of face ids.
    pub faces: Vec<FaceAudit>,
    /// Patches with the largest |shape error|, worst first.
    pub worst: Vec<WorstPatch>,
    /// By patch, in the tool file's order.
    pub by_patch: Vec<PatchAudit>,
}

/// |shape error| [mm] that a share of the area does not exceed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Percentiles {
    /// Half of the area.
    pub p50: f64,
    /// 90 %.
    pub p90: f64,
    /// 95 %.
    pub p95: f64,
    /// 99 %.
    pub p99: f64,
}

/// Jumps across edges that patches share.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Jumps {
    /// Edges shared by two patches or more.
    pub shared_edges: usize,
    /// Edges used by one patch.
    pub free_edges: usize,
    /// Shared edges at which the CAD has a crease.
    pub creases: usize,
    /// Largest gap between neighbours along a shared edge [mm].
    pub position_mm: f64,
    /// Sides used by one patch beyond which the CAD continues: faces divided independently, hanging vertices.
    #[serde(default)]
    pub open_sides: usize,
    /// Largest distance from a point of such a side to the neighbours across the CAD's edge [mm].
    #[serde(default)]
    pub border_gap_mm: f64,
    /// Where that is [mm].
    #[serde(default)]
    pub border_gap_at: Option<[f64; 3]>,
    /// The patch whose side that is.
    #[serde(default)]
    pub border_gap_patch: Option<u32>,
    /// Largest angle between the normals of neighbours across a smooth shared edge [degrees].
    pub normal_deg: f64,
    /// The two patches of that edge.
    pub normal_patches: Option<[u32; 2]>,
    /// Largest angle across a crease [degrees].
    pub crease_deg: f64,
}

/// Free edges of the CAD that run beside free edges of other faces.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OpenJoints {
    /// Number of such edges.
    pub edges: usize,
    /// Largest distance of a point of such an edge from the nearest one of another face [mm].
    pub widest_mm: f64,
    /// Where that is [mm].
    pub at: Option<[f64; 3]>,
    /// The face of that edge.
    pub face: Option<u32>,
    /// Distance within which edges of the CAD are joined [mm].
    pub join_tolerance_mm: f64,
}

/// Free borders: trim lines and openings beyond which there is no surface. Distances are exact at points along them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Borders {
    /// Sides of patches at free borders of the tool.
    pub tool_sides: usize,
    /// Edges of the CAD at free borders.
    pub cad_edges: usize,
    /// Largest distance between neighbouring points at which borders were compared [mm].
    pub step_mm: f64,
    /// Largest distance of a point of the tool's borders from the CAD's [mm]; the diagonal of the tool's borders where the
    /// CAD has none.
    pub tool_to_cad_mm: f64,
    /// Largest distance of a point of the CAD's borders from the tool's [mm]; the diagonal of the CAD's borders where the
    /// tool has none.
    pub cad_to_tool_mm: f64,
    /// Where the larger of the two is [mm].
    pub at: Option<[f64; 3]>,
    /// CAD face there.
    pub face: Option<u32>,
}

impl From<kanagata_cad::health::OpenJoints> for OpenJoints {
    fn from(found: kanagata_cad::health::OpenJoints) -> Self {
        Self {
            edges: found.edges,
            widest_mm: found.widest_mm,
            at: Some(found.at.into()),
            face: Some(found.face as u32),
            join_tolerance_mm: found.join_tolerance_mm,
        }
    }
}

impl Borders {
    /// Larger of the deviations in both directions [mm].
    #[must_use]
    pub fn deviation_mm(&self) -> f64 {
        self.tool_to_cad_mm.max(self.cad_to_tool_mm)
    }
}

/// One CAD face.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FaceAudit {
    /// CAD face id.
    pub face: u32,
    /// Patches on it.
    pub patches: usize,
    /// Largest signed shape error [mm].
    pub max_mm: f64,
    /// Smallest signed shape error [mm].
    pub min_mm: f64,
    /// Root mean square over the area [mm].
    pub rms_mm: f64,
    /// Largest normal error [degrees].
    pub normal_max_deg: f64,
    /// Area of its patches [mm^2].
    pub area_mm2: f64,
    /// Largest deviation of the free borders, of its patches from the CAD or of its edges from the tool [mm].
    #[serde(default)]
    pub border_mm: f64,
}

/// One patch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PatchAudit {
    /// Patch, from 0.
    pub id: u32,
    /// Its CAD face id.
    pub face: u32,
    /// Largest signed shape error [mm].
    pub max_mm: f64,
    /// Smallest signed shape error [mm].
    pub min_mm: f64,
    /// Root mean square over the area [mm].
    pub rms_mm: f64,
    /// Largest normal error [degrees].
    pub normal_max_deg: f64,
    /// Where |shape error| is largest [mm].
    pub worst_point: [f64; 3],
}

/// One of the worst patches, with its worst point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WorstPatch {
    /// Patch, from 0.
    pub patch: u32,
    /// Its CAD face id.
    pub face: u32,
    /// Signed shape error there [mm].
    pub delta_mm: f64,
    /// Parameter of the worst point.
    pub eta: f64,
    /// Parameter of the worst point.
    pub zeta: f64,
    /// The worst point [mm].
    pub point: [f64; 3],
}

impl AuditReport {
    /// Largest |shape error| [mm].
    #[must_use]
    pub fn worst_mm(&self) -> f64 {
        self.max_mm.abs().max(self.min_mm.abs())
    }

    /// Larger of the largest |shape error| and the largest deviation of free borders [mm].
    #[must_use]
    pub fn deviation_mm(&self) -> f64 {
        self.worst_mm().max(self.borders.deviation_mm())
    }
}
