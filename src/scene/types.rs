//! The scene file, version 1. Lengths in mm, forces in N, stresses in MPa, angles in degrees.

use schemars::JsonSchema;
use serde::de::{self, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

pub use super::course::Course;
pub use super::drive::{Drive, Spring};
use crate::solver::element::ElementKind;
use crate::solver::limits::{ContactMethod, Limits};
use crate::solver::material::card::MaterialCard;

/// A forming run.
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
    /// Its material: the name of a card in the library, a card file (`"./steel.json"`), or a card in full.
    pub material: MaterialChoice,
    /// Symmetry planes of the modelled part.
    #[serde(default)]
    pub symmetry: Vec<SymmetryPlane>,
    /// Nodes that are held.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub holds: Vec<Hold>,
    /// Forces on nodes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub loads: Vec<Load>,
    /// Rigid tools.
    pub tools: Vec<Tool>,
    /// Stages, one after the other.
    pub stages: Vec<Stage>,
    /// Limits of the solver.
    #[serde(default)]
    pub solver: SolverLimits,
    /// What is written.
    #[serde(default)]
    pub output: Output,
}

/// The constant that marks a scene file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum FormatTag {
    /// `kanagata-scene`
    #[serde(rename = "kanagata-scene")]
    Scene,
}

/// The sheet before forming: hexahedra in layers, thickness along z (of a file, as it is there).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Blank {
    /// Its outline and elements in plan.
    pub shape: BlankShape,
    /// Thickness [mm], > 0; may be left out when the blank is a file of hexahedra, whose thickness is then the shortest way
    /// through all of them. Given, it tells which way of a narrow slice is meant.
    #[serde(default)]
    pub thickness_mm: f64,
    /// Elements through the thickness, >= 1; those of a file of hexahedra are the file's.
    #[serde(default = "one")]
    pub layers: usize,
    /// z of its lower face [mm]; how far a mesh from a file is shifted along z.
    #[serde(default)]
    pub z_mm: f64,
    /// Element formulation.
    #[serde(default)]
    pub element: ElementKind,
    /// Angle about z from x to the rolling direction [degrees], of a sheet that lies across z.
    #[serde(default)]
    pub rolling_direction_deg: f64,
    /// Rolling direction of a sheet that lies in any way, in place of the angle: a vector, of which what lies in each element's
    /// mid-surface counts; at least 10 degrees from the normals of all elements. Needed where the material is anisotropic and
    /// the sheet does not lie across z: its third axis is along the normal of each element.
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
    /// A disc about the origin: four quarter discs. It needs no symmetry planes; what keeps it from gliding and turning in its
    /// plane (friction, `holds`) is the scene's to say.
    Disc {
        /// Radius [mm], > 0.
        radius_mm: f64,
        /// Elements along half a side of the square core, >= 1; the rim has eight times as many.
        core: usize,
        /// Elements from the core to the rim, >= 1.
        rings: usize,
    },
    /// A mesh file: the hexahedra of .msh (2.2, 4.1), .vtu or an Abaqus deck (.inp: C3D8*, SC8R*), numbered and turned
    /// in any way, or the quadrilaterals of those (S4*, M3D4*, CPS4*, CPE4*, CAX4*) and of .obj: the sheet's lower face.
    Mesh {
        /// Mesh file, relative to the scene.
        file: String,
        /// What becomes of strains, stresses and thicknesses in the file. A file with such fields is refused without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        state: Option<MeshState>,
    },
}

/// What becomes of the state of a sheet that a mesh file has results of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MeshState {
    /// It is dropped: the blank is free of stress and strain, in the shape and thickness of the mesh.
    Drop,
}

/// Nodes held where they are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hold {
    /// Which nodes.
    #[serde(rename = "where")]
    pub region: Region,
    /// Directions in which they cannot move.
    pub axes: Vec<Axis>,
}

/// A constant force on nodes: it grows from zero over the first stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// Which nodes.
    #[serde(rename = "where")]
    pub region: Region,
    /// Force of the whole process [N]: the modelled part, one of 2, 4 or 8 that symmetry planes make, takes as much less, whichever
    /// way the force points (an end that a plane mirrors into another is two ends). It is spread evenly over the elements that the nodes there make up, else over their faces or edges.
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

/// A material by name or in full.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum MaterialChoice {
    /// Name of a card in the library; what ends in `.json` or has a `/` or `\` is a card file, relative to the scene.
    Named(String),
    /// A card in full.
    Card(Box<MaterialCard>),
}

impl<'de> Deserialize<'de> for MaterialChoice {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(WrittenMaterial)
    }
}

/// Reads a material; a card's faults are told as the card's, which derived code for two readings would not do.
struct WrittenMaterial;

impl<'de> Visitor<'de> for WrittenMaterial {
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

/// A symmetry plane normal to a coordinate axis: nodes on it stay on it. The blank lies on one side of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SymmetryPlane {
    /// Axis the plane is normal to.
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
    /// Name: up to 64 letters, digits, `-` and `_`; names its columns in `history.csv`.
    pub name: String,
    /// Tool file, relative to the scene.
    pub file: String,
    /// Direction in which its travel and its force on the sheet count positive; need not be a unit vector.
    pub direction: [f64; 3],
    /// Coulomb coefficient of friction with the sheet, 0 to 10. Where it is not given 0 is used, and the result is doubtful.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Where it stands at the start.
    #[serde(default)]
    pub place: Place,
    /// Face of the sheet it may touch. When not said, the one that its direction leads to: against the sheet's thickness
    /// direction (mean of its columns, upwards) the top, along it the bottom; to be said where the two are nearly square.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub side: Option<Side>,
    /// Travel since the start of the run past which a force or a spring does not move it [mm], >= 0: distance blocks, the
    /// end of a cylinder. No farther back than where a stage finds it; a travel that is given is not touched by it.
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

/// Where a tool stands at the start.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Place {
    /// Moved along its direction until it touches the undeformed sheet.
    #[default]
    Touch,
    /// Left as its file has it, shifted by this vector [mm].
    Shift([f64; 3]),
}

/// A stage: each tool is driven by travel or by force, from the travel or the force that it has when the stage begins. A
/// tool that is not named stays as the stage before left it: it holds its travel, or its force.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stage {
    /// Name, for the history.
    pub name: String,
    /// What drives each tool, by its name, one way each.
    #[serde(default)]
    pub drive: std::collections::BTreeMap<String, Drive>,
    /// First increment as a share of the stage, in (0, 1]; 0.05 when not said.
    #[serde(default)]
    pub first_increment: Option<f64>,
    /// Largest increment as a share of the stage, in (0, 1]; when not said 0.1, or the first one where that is more.
    #[serde(default)]
    pub largest_increment: Option<f64>,
    /// Share of `loads` at the end of the stage; 1 when not said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load_share: Option<f64>,
}

/// Limits of the solver. Everything has a default that fits ordinary sheet forming.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SolverLimits {
    /// Out-of-balance force allowed, as a share of the forces at work.
    pub force_tolerance: f64,
    /// Newton iterations allowed in an increment before it is cut.
    pub iterations: usize,
    /// Newton iterations an increment should take: the step grows below and shrinks above.
    pub wanted_iterations: usize,
    /// Smallest increment as a share of the first one below which the run is reported as not converged.
    pub smallest_increment: f64,
    /// Increments allowed in the whole run.
    pub increments: usize,
    /// Slip in an increment over which friction rises to Coulomb's force, as a share of the longest element edge; 0
    /// separates stick from slip, takes many times the iterations and may not converge; 1e-8 comes as near and is
    /// as fast as the default.
    pub friction_transition: f64,
    /// How a node is kept out of a tool: `exact`, or by springs to compare with.
    pub contact: ContactMethod,
    /// `history.csv` of a run of the same stages, relative to the scene: increments end where its own ended (one that
    /// fails is cut, and the next ends there again). Stages that take all tools away choose their own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub increments_of: Option<String>,
}

/// The law's force is then within 1 % of Coulomb's from a slip of 7e-4 of an element on.
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
            friction_transition: FRICTION_TRANSITION,
            contact: limits.contact,
            increments_of: None,
        }
    }
}

/// What a run writes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// A VTU file every so many increments (and at the end of each stage); 0 = stage ends only.
    pub vtu_every: usize,
    /// A checkpoint every so many increments; 0 = only when the run is stopped.
    pub checkpoint_every: usize,
}

impl Default for Output {
    fn default() -> Self {
        Self { vtu_every: 10, checkpoint_every: 5 }
    }
}
