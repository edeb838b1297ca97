//! The scene file, version 1. Lengths in mm, forces in N, stresses in MPa, angles in degrees.

use schemars::JsonSchema;
use serde::de::{self, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

pub use super::accuracy::Accuracy;
pub use super::course::Course;
pub use super::drive::{Drive, Spring};
pub use super::output::{Output, Section};
pub use super::refine::{PlanRegion, Refine};
pub use super::tool_cad::{SheetSurface, ToolCad};
use kanagata_report::record::Quality;
use kanagata_solver::element::ElementKind;
use kanagata_solver::limits::{ContactMethod, Limits};
use kanagata_solver::material::card::MaterialCard;

/// A forming process: sheet, material, tools and stages.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// `kanagata-scene`.
    pub format: FormatTag,
    /// File version: 1.
    pub version: u32,
    /// Name, for reports.
    pub name: String,
    /// The sheet.
    pub blank: Blank,
    /// Material of the sheet: name of a card in the library, a card file (`"./steel.json"`), or a complete card.
    pub material: MaterialChoice,
    /// Symmetry planes of the modelled part.
    #[serde(default)]
    pub symmetry: Vec<SymmetryPlane>,
    /// Constrained nodes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub holds: Vec<Hold>,
    /// Nodal forces.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub loads: Vec<Load>,
    /// Rigid tools.
    pub tools: Vec<Tool>,
    /// Stages in order.
    pub stages: Vec<Stage>,
    /// Limits of the solver.
    #[serde(default)]
    pub solver: SolverLimits,
    /// Output files.
    #[serde(default)]
    pub output: Output,
    /// Limits of quality of the part. Each that is exceeded is a doubt, and the run ends with exit code 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quality: Option<Quality>,
    /// Errors that a sequence of runs may leave in the results.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<Accuracy>,
}

/// The format tag of a scene file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum FormatTag {
    /// `kanagata-scene`
    #[serde(rename = "kanagata-scene")]
    Scene,
}

/// The undeformed sheet: hexahedra in layers, with the thickness along z (for a mesh file: as in the file).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Blank {
    /// Outline and elements in plan.
    pub shape: BlankShape,
    /// Thickness [mm], > 0. Optional for a file of hexahedra, whose thickness is then their shortest dimension. If
    /// given, it selects the thickness direction of a sheet that is narrower than thick.
    #[serde(default)]
    pub thickness_mm: f64,
    /// Elements through the thickness, >= 1. A file of hexahedra defines its own.
    #[serde(default = "one")]
    pub layers: usize,
    /// Elements that are split in plan, for example over the radii of the tools.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub refine: Vec<Refine>,
    /// z of the lower face [mm]; for a mesh file a shift along z.
    #[serde(default)]
    pub z_mm: f64,
    /// Element formulation.
    #[serde(default)]
    pub element: ElementKind,
    /// Angle about z from x to the rolling direction [degrees], for a sheet normal to z.
    #[serde(default)]
    pub rolling_direction_deg: f64,
    /// Rolling direction of a sheet of any orientation, in place of the angle: a vector that is projected on the
    /// mid-surface of each element, at least 10 degrees from all element normals. Required for an anisotropic material
    /// if the sheet is not normal to z. The third material axis is the normal of each element.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rolling_direction: Option<[f64; 3]>,
}

fn one() -> usize {
    1
}

/// Outline of a sheet and its elements in plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum BlankShape {
    /// A rectangle along x and y.
    Rectangle {
        /// Smallest x and y [mm].
        #[serde(default)]
        corner_mm: [f64; 2],
        /// Size along x and y [mm], > 0.
        size_mm: [f64; 2],
        /// Elements along x and y, each >= 1.
        elements: [usize; 2],
    },
    /// The quarter `x, y >= 0` of a disc about the origin.
    QuarterDisc {
        /// Radius [mm], > 0.
        radius_mm: f64,
        /// Elements along a side of the square core, >= 1; the rim has twice as many.
        core: usize,
        /// Elements from the core to the rim, >= 1.
        rings: usize,
    },
    /// A disc about the origin, of four quarter discs. It needs no symmetry planes, but friction or `holds` must prevent
    /// rigid-body motion in its plane.
    Disc {
        /// Radius [mm], > 0.
        radius_mm: f64,
        /// Elements along half a side of the square core, >= 1; the rim has eight times as many.
        core: usize,
        /// Elements from the core to the rim, >= 1.
        rings: usize,
    },
    /// A mesh file: hexahedra of .msh (2.2, 4.1), .vtu or an Abaqus deck (.inp: C3D8*, SC8R*) in any numbering and
    /// orientation, or quadrilaterals of these (S4*, M3D4*, CPS4*, CPE4*, CAX4*) and of .obj, which form the lower face.
    Mesh {
        /// Mesh file, relative to the scene.
        file: String,
        /// Treatment of strains, stresses and thicknesses in the file. A file with such fields is refused without this
        /// key.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        state: Option<MeshState>,
    },
}

/// Treatment of the state in a mesh file with results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MeshState {
    /// The state is dropped: the blank is free of stress and strain, with the shape and thickness of the mesh.
    Drop,
}

/// Nodes constrained at their initial position.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hold {
    /// The nodes.
    #[serde(rename = "where")]
    pub region: Region,
    /// Constrained directions.
    pub axes: Vec<Axis>,
}

/// A constant force on nodes. It rises from zero over the first stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// The nodes.
    #[serde(rename = "where")]
    pub region: Region,
    /// Force of the whole process [N]. The modelled part, one of 2, 4 or 8 symmetric parts, carries the corresponding
    /// fraction in any direction (a mirrored end is a second end). It is distributed uniformly over the elements of
    /// these nodes, otherwise over their faces or edges.
    pub force_n: [f64; 3],
}

/// Nodes of the undeformed sheet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Region {
    /// All nodes (`true`).
    All(bool),
    /// Nodes on a plane.
    Plane(SymmetryPlane),
    /// Nodes at least this far from the z axis [mm].
    BeyondRadiusMm(f64),
    /// Nodes in a box [mm].
    Box {
        /// Smallest coordinates.
        min_mm: [f64; 3],
        /// Largest coordinates.
        max_mm: [f64; 3],
    },
}

/// A material by name or as a card.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum MaterialChoice {
    /// Name of a card in the library. A name that ends in `.json` or contains `/` or `\` is a card file, relative to the
    /// scene.
    Named(String),
    /// A complete card.
    Card(Box<MaterialCard>),
}

impl<'de> Deserialize<'de> for MaterialChoice {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(MaterialVisitor)
    }
}

/// Visitor that reports the faults of a card itself; derived code for an untagged enum does not.
struct MaterialVisitor;

impl<'de> Visitor<'de> for MaterialVisitor {
    type Value = MaterialChoice;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the name of a material, a card file or a card")
    }

    fn visit_str<E: de::Error>(self, name: &str) -> Result<MaterialChoice, E> {
        Ok(MaterialChoice::Named(name.to_owned()))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<MaterialChoice, A::Error> {
        let card = MaterialCard::deserialize(de::value::MapAccessDeserializer::new(map))?;
        Ok(MaterialChoice::Card(Box::new(card)))
    }
}

/// A symmetry plane normal to a coordinate axis. The blank lies on one side; nodes on the plane remain on it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SymmetryPlane {
    /// Axis normal to the plane.
    pub normal: Axis,
    /// Coordinate of the plane on that axis [mm].
    #[serde(default)]
    pub at_mm: f64,
}

/// A coordinate axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// x
    X,
    /// y
    Y,
    /// z
    Z,
}

impl Axis {
    /// 0, 1 or 2.
    #[must_use]
    pub fn index(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
            Self::Z => 2,
        }
    }
}

/// A rigid tool.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tool {
    /// Name: up to 64 letters, digits, `-` and `_`; used for columns of `history.csv`.
    pub name: String,
    /// Tool file, relative to the scene.
    pub file: String,
    /// CAD from which the tool file is made where it is missing or was made otherwise (`kanagata run`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cad: Option<ToolCad>,
    /// Positive direction of its travel and of its force on the sheet; need not be a unit vector.
    pub direction: [f64; 3],
    /// Coulomb friction coefficient with the sheet, 0 to 10. If it is not given, 0 is used and a doubt is raised.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Initial position.
    #[serde(default)]
    pub place: Place,
    /// Face of the sheet that it may touch. Default: from its direction and the thickness direction of the sheet (mean
    /// of its columns, upwards). A direction against the thickness direction gives the top, one along it the bottom.
    /// Required if the two are nearly perpendicular.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub side: Option<Side>,
    /// Limit of the travel under force or spring control since the start of the run [mm], >= 0: distance blocks, or the
    /// end of a cylinder. It does not push a tool back from its position at the start of a stage, and does not limit
    /// prescribed travel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stop_mm: Option<f64>,
}

/// Faces of the sheet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// The upper face.
    Top,
    /// The lower face.
    Bottom,
    /// Both.
    Both,
}

/// Initial position of a tool.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Place {
    /// Moved along its direction until it touches the undeformed sheet.
    #[default]
    Touch,
    /// Position of the tool file, shifted by this vector [mm].
    Shift([f64; 3]),
}

/// A stage: each tool is driven by travel or by force, starting from its current travel or force. A tool that is not
/// named keeps its travel or its force.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stage {
    /// Name, used in the history.
    pub name: String,
    /// Drive of each tool by name, one each.
    #[serde(default)]
    pub drive: std::collections::BTreeMap<String, Drive>,
    /// First increment as a fraction of the stage, in (0, 1]; default 0.05.
    #[serde(default)]
    pub first_increment: Option<f64>,
    /// Largest increment as a fraction of the stage, in (0, 1]; default 0.1, or the first increment if that is larger.
    #[serde(default)]
    pub largest_increment: Option<f64>,
    /// Fraction of `loads` at the end of the stage; default 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load_share: Option<f64>,
}

/// Limits of the solver. The defaults suit ordinary sheet forming.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SolverLimits {
    /// Allowed residual force, as a fraction of the acting forces.
    pub force_tolerance: f64,
    /// Newton iterations in an increment above which it is cut.
    pub iterations: usize,
    /// Target number of Newton iterations per increment: the step grows below it and shrinks above.
    pub wanted_iterations: usize,
    /// Smallest increment as a fraction of the first one; below it the run is reported as not converged.
    pub smallest_increment: f64,
    /// Largest number of increments of the run.
    pub increments: usize,
    /// Relative error of the forces from the length of an increment to be kept, 1e-4 to 0.5; estimated where plastic flow
    /// and friction turn within an increment. By default the length of increments follows the iterations alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub increment_error: Option<f64>,
    /// Slip in an increment over which friction rises to the Coulomb limit, as a fraction of the longest element edge. 0
    /// separates stick from slip exactly, takes many times the iterations and may not converge; 1e-8 is practically the
    /// same and as fast as the default.
    pub friction_transition: f64,
    /// Contact method: `exact`, or springs for comparison.
    pub contact: ContactMethod,
    /// `history.csv` of a run of the same stages, relative to the scene: increments end where its increments ended. One
    /// that fails is cut, and the next ends there again. Stages without tools choose their own increments.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub increments_of: Option<String>,
}

/// Friction is then within 1 % of the Coulomb limit from a slip of 7e-4 of an element on.
const FRICTION_TRANSITION: f64 = 1e-5;

impl Default for SolverLimits {
    fn default() -> Self {
        let limits = Limits::default();
        Self {
            force_tolerance: limits.force_tolerance,
            iterations: limits.iterations,
            wanted_iterations: limits.wanted_iterations,
            smallest_increment: limits.smallest_step,
            increments: limits.increments,
            increment_error: limits.increment_error,
            friction_transition: FRICTION_TRANSITION,
            contact: limits.contact,
            increments_of: None,
        }
    }
}
