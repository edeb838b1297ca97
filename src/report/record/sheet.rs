//! Records of `run.json` about the state of the sheet.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::doubt::place_mm;

/// Thickness over the initial thickness, below which a doubt is raised. Sheet metals neck and fracture before.
pub(super) const THICKNESS_MIN_REL: f64 = 0.5;

/// Springback since the tools were released. At the end the sheet is moved rigidly, as far as its constraints permit, to
/// the best fit with its shape in the tools.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SpringbackRecord {
    /// Largest displacement of a node [mm].
    pub largest_mm: f64,
    /// RMS of the displacements over the volume of the sheet [mm].
    pub rms_mm: f64,
    /// Sum of the magnitudes of the forces of the released tools, of the whole process [N].
    pub force_n: f64,
    /// Released elastic energy, of the whole process [N mm].
    pub energy_nmm: f64,
    /// Increment of the last equilibrium with tools; absent in files of older programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_increment: Option<usize>,
    /// Node with the largest displacement along the normal, positive towards the upper face; absent in files of older
    /// programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal_max: Option<NormalDisplacementRecord>,
    /// Node with the smallest one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal_min: Option<NormalDisplacementRecord>,
}

/// Displacement of a node in springback along the normal of the mid-surface in the last equilibrium with tools.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NormalDisplacementRecord {
    /// The displacement, positive towards the upper face of the sheet [mm].
    pub displacement_mm: f64,
    /// The node in the VTU files.
    pub node: usize,
    /// Its current position [mm].
    pub at_mm: [f64; 3],
}

/// Unaccounted energy of an increment.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct UnaccountedEnergyRecord {
    /// The increment.
    pub increment: usize,
    /// Its magnitude [N mm].
    pub energy_nmm: f64,
    /// Work done so far, or the rounding error of the work if that is larger [N mm].
    pub work_nmm: f64,
}

/// A blank holder that the sheet pushed back.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HolderLiftRecord {
    /// The tool.
    pub tool: String,
    /// Increment with the largest lift.
    pub increment: usize,
    /// Largest travel at any increment against its direction, from the farthest position reached under force control
    /// [mm].
    pub lift_mm: f64,
}

/// A blank holder that presses on no sheet any more.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HolderLostRecord {
    /// The tool.
    pub tool: String,
    /// First increment after which the sheet is not between it and the tool opposite.
    pub increment: usize,
    /// Area of the sheet between them then, of the modelled part [mm2].
    pub area_mm2: f64,
    /// The same over the area of the blank.
    pub area_rel: f64,
}

impl HolderLostRecord {
    /// Ratio of the area between holder and die to that of the blank below which the sheet is not between them.
    pub const AREA_MIN_REL: f64 = 0.01;
}

/// Contact pressure under a blank holder while a force drives it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HolderPressureRecord {
    /// The tool.
    pub tool: String,
    /// Last increment in which it is pressed on the sheet.
    pub increment: usize,
    /// Mean pressure then: sum of the normal contact forces over the area in contact [MPa].
    pub mean_mpa: f64,
    /// Area in contact then, of the modelled part [mm2].
    pub area_mm2: f64,
    /// Largest pressure at a node then [MPa].
    pub max_mpa: f64,
    /// Position of that node [mm].
    pub max_at_mm: [f64; 3],
    /// Largest pressure at a node over all increments so far.
    pub peak: PressurePeakRecord,
}

/// The largest contact pressure over several increments.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PressurePeakRecord {
    /// The increment.
    pub increment: usize,
    /// Pressure at a node [MPa].
    pub max_mpa: f64,
    /// Position of the node [mm].
    pub at_mm: [f64; 3],
}

/// The largest offset of waves: distance of the sheet from the nearer of two tools, where both are within a thickness and
/// the minor principal membrane stress is compressive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WaveRecord {
    /// The increment.
    pub increment: usize,
    /// The offset [mm].
    pub offset_mm: f64,
    /// The offset over the initial thickness there.
    pub offset_rel: f64,
    /// Position of the node, on the upper face [mm].
    pub at_mm: [f64; 3],
    /// Tools below and above it.
    pub tools: [String; 2],
}

/// Waves of the sheet between two tools, over the increments with a VTU file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WavesRecord {
    /// The largest offset of all these increments.
    pub largest: WaveRecord,
    /// The largest one at the last of them that has any.
    pub last: WaveRecord,
}

/// Thickness of the sheet, measured between opposite nodes of its faces.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ThicknessRecord {
    /// Thickness where its ratio to the initial thickness is smallest [mm].
    pub minimum_mm: f64,
    /// Initial thickness there [mm].
    pub initial_mm: f64,
    /// Current position of that node, on the upper face [mm].
    pub at_mm: [f64; 3],
    /// Maximum thickness [mm].
    pub maximum_mm: f64,
}

/// Self-penetration of the sheet, or penetration of its image beyond a symmetry plane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SelfPenetrationRecord {
    /// First increment with self-penetration.
    pub first_increment: usize,
    /// Largest number of penetrating nodes at any increment.
    pub nodes: usize,
    /// Position of one of them at the end of the first such increment [mm].
    pub at_mm: [f64; 3],
}

/// Overhang of the sheet at a tool edge: contact conditions are at nodes, and the edge lies between them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OverhangRecord {
    /// First increment with overhang.
    pub first_increment: usize,
    /// The tool.
    pub tool: String,
    /// Largest number of nodes beyond the border of the tool at any increment.
    pub nodes: usize,
    /// Largest depth of the edge at any increment: below straight lines from nodes beyond it to nodes in contact with
    /// the tool [mm].
    pub depth_mm: f64,
    /// Position of the largest depth in the first such increment [mm].
    pub at_mm: [f64; 3],
}

/// The largest penetration of a tool into an element face. Contact conditions are at nodes: between them a face may lie
/// inside a tool, or a feature of a tool inside the sheet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FacePenetrationRecord {
    /// The tool.
    pub tool: String,
    /// Increment with the largest penetration.
    pub increment: usize,
    /// Depth [mm].
    pub depth_mm: f64,
    /// Depth over the mean initial thickness of the sheet.
    pub depth_rel: f64,
    /// Position [mm].
    pub at_mm: [f64; 3],
    /// First increment with a penetration above 5 % of the thickness.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_increment: Option<usize>,
}

impl FacePenetrationRecord {
    /// Depth over the thickness, above which a doubt is raised: faces that sag so much change forces by some per cent.
    pub const ALLOWED_REL: f64 = 0.05;
    /// The same in a sequence of runs to an accuracy, up to which meshes are not refined for it alone: nothing tells what it
    /// changes in a single run, but the distance of meshes contains it. Elements may be 1.7 times as long as for 5 %. With half
    /// of it they are 1.4 times as short, for two to three times the time; with twice of it a feature of a tool may pass.
    pub const ALLOWED_IN_SEQUENCE_REL: f64 = 0.15;
}

/// Type of localised thinning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NeckingKind {
    /// A band thins while the rest of the sheet unloads, past the maximum force of a tool.
    Band,
    /// Nodes are thinner than their neighbours, at a distance shorter than the thickness.
    Dip,
    /// Thickness below half of the initial thickness.
    Torn,
}

/// Localised thinning of the sheet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NeckingRecord {
    /// Type.
    pub kind: NeckingKind,
    /// First increment in which it was found, or in which it started.
    pub first_increment: usize,
    /// Position of the minimum thickness, on the upper face [mm].
    pub at_mm: [f64; 3],
    /// Minimum thickness there over the initial thickness.
    pub thickness_rel: f64,
    /// Maximum of the force before a band: the onset of necking (Considère). Absent for other types.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub maximum_force: Option<MaximumForceRecord>,
}

/// The maximum force of the tool whose force falls while a band thins.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MaximumForceRecord {
    /// The tool.
    pub tool: String,
    /// Increment of the maximum force in its stage.
    pub increment: usize,
    /// Its magnitude along the tool's direction, of the whole process [N].
    pub force_n: f64,
}

/// Hourglass mode: thickness fibres of the mesh tilt in alternate directions. Elements that are wide for their layer
/// deform so under pressure through the thickness, and forces are far too low.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HourglassRecord {
    /// First increment with the mode.
    pub first_increment: usize,
    /// Largest fraction of thickness fibres in the mode at any increment.
    #[serde(rename = "share")]
    pub fraction: f64,
    /// Position of one of them at the end of the first such increment [mm].
    pub at_mm: [f64; 3],
}

/// Through-thickness shear at the friction limit; it needs `hex8` elements in four layers or more.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ThroughThicknessShearRecord {
    /// First increment with this shear.
    pub first_increment: usize,
    /// Largest fraction at any increment of the nodes whose friction limit exceeds the shear flow stress. Nodes under
    /// edges and lines of tools are excluded.
    #[serde(rename = "share")]
    pub fraction: f64,
    /// Position of one of them at the end of the first such increment [mm].
    pub at_mm: [f64; 3],
}

/// Nodes inside a tool at the end of a stage. Contact includes only nodes of the face that the tool is to touch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct InsideToolRecord {
    /// The tool.
    pub tool: String,
    /// The stage at whose end they were found.
    pub stage: String,
    /// Nodes inside it.
    pub nodes: usize,
    /// Largest depth at the end of any stage [mm].
    pub depth_mm: f64,
    /// Position of the largest depth [mm].
    pub at_mm: [f64; 3],
}

impl ThicknessRecord {
    /// Whether the thickness is below half of the initial one.
    #[must_use]
    pub fn is_below_half(&self) -> bool {
        self.minimum_mm < THICKNESS_MIN_REL * self.initial_mm
    }
}

impl fmt::Display for WaveRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { increment, offset_mm, offset_rel, at_mm, tools: [below, above] } = self;
        write!(
            f,
            "{offset_mm:.3} mm off the nearer tool ({:.1} % of the thickness) at {}, between {below} and {above}, increment {increment}",
            100.0 * offset_rel,
            place_mm(at_mm)
        )
    }
}

impl fmt::Display for NormalDisplacementRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:+.3} mm at {}", self.displacement_mm, place_mm(&self.at_mm))
    }
}

impl fmt::Display for ThicknessRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { minimum_mm, initial_mm, at_mm: [x, y, z], .. } = self;
        write!(f, "{minimum_mm:.4} of {initial_mm:.4} mm at ({x:.1}, {y:.1}, {z:.1}) mm")
    }
}

/// Largest strains of the sheet, measured from the undeformed blank.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StrainRecord {
    /// Largest major strain: logarithmic, of the mid-surface at the centre of an element.
    pub major: f64,
    /// Minor strain at the same place.
    pub minor: f64,
    /// Current position [mm].
    pub at_mm: [f64; 3],
    /// Largest equivalent plastic strain; none for a material without plasticity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plastic: Option<PlasticStrainRecord>,
}

/// The largest equivalent plastic strain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlasticStrainRecord {
    /// Its value, at a material point.
    pub largest: f64,
    /// Current position of the centre of the element [mm].
    pub at_mm: [f64; 3],
}

impl fmt::Display for StrainRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { major, minor, at_mm: [x, y, z], plastic } = self;
        write!(f, "major {major:.4} with minor {minor:.4} at ({x:.1}, {y:.1}, {z:.1}) mm")?;
        let Some(PlasticStrainRecord { largest, at_mm: [x, y, z] }) = plastic else {
            return Ok(());
        };
        write!(f, ", plastic {largest:.4} at ({x:.1}, {y:.1}, {z:.1}) mm")
    }
}
