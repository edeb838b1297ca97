//! What the readers hand to `build`: faces as their file describes them, in mm, before any repair.

use super::Diagnostic;
use crate::geometry::nurbs::{Curve2, Curve3, Surface};
use crate::geometry::{Frame, Vec3};

/// Everything a reader found.
#[derive(Debug, Clone, Default)]
pub struct RawModel {
    /// Unit of length the file declares, as it names it (`mm`, `INCH`, ...).
    pub unit: String,
    /// Millimetres in one unit of the file.
    pub unit_mm: f64,
    /// Who wrote the file.
    pub writer: String,
    /// Smallest distance the file's author calls significant [mm]; 0 when not said.
    pub resolution_mm: f64,
    /// Entities by kind (`128:0` in IGES as `type:form`, keyword in STEP) and how many.
    pub entities: std::collections::BTreeMap<String, usize>,
    /// Faces, every placed instance of an assembly once.
    pub faces: Vec<RawFace>,
    /// Faces of the file that could not be read.
    pub lost: Vec<LostFace>,
    /// Curves that bound no face (drawn for the user, never meshed).
    pub loose_curves: usize,
    /// What was survived.
    pub diagnostics: Vec<Diagnostic>,
    /// Length of the file [bytes]: what its model may cost is in proportion to it.
    pub bytes: usize,
}

/// A face of the file that the model lacks.
#[derive(
    Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
pub struct LostFace {
    /// Entity in the file.
    pub source: String,
    /// Why it is not in the model.
    pub reason: String,
}

/// Most sides (see [`RawFace::sides`]) that the faces of a file of so many bytes may have, every placed instance
/// counted: a side takes about 25 bytes of a file, 2 kB of memory and 15 us.
#[must_use]
pub fn most_sides(bytes: usize) -> usize {
    (32_768 + bytes / 8).min(2_000_000)
}

/// A trimmed face as its file has it.
#[derive(Debug, Clone)]
pub struct RawFace {
    /// The surface with the file's own parameters.
    pub surface: RawSurface,
    /// Boundary loops. Empty: the whole surface is the face.
    pub loops: Vec<RawLoop>,
    /// True when the face's outward normal is opposite to the surface's own `su x sv`.
    pub flipped: bool,
    /// Entity, for messages: `D145 (144)` or `#45 (ADVANCED_FACE)`.
    pub source: String,
    /// Shell or solid the face belongs to, numbered from 0; `None` for a face on its own. Faces of one
    /// shell are oriented alike by their file.
    pub shell: Option<usize>,
}

impl RawFace {
    /// What the face costs, in sides of a simple one: four when it has no more, and one for every 32 control points.
    #[must_use]
    pub fn sides(&self) -> usize {
        let edges = || self.loops.iter().flat_map(|l| &l.edges);
        let of_edge = |e: &RawEdge| {
            e.curve.as_ref().map_or(0, |c| c.points().len())
                + e.pcurve.as_ref().map_or(0, |c| c.points().len())
        };
        let points = self.surface.control_points() + edges().map(of_edge).sum::<usize>();
        edges().count().max(4) + points / 32
    }
}

/// A surface in the file's own parametrisation, in mm. Angles are in radians.
#[derive(Debug, Clone)]
pub enum RawSurface {
    /// `origin + u x + v y`.
    Plane(Frame),
    /// `origin + radius (cos u x + sin u y) + v z`.
    Cylinder {
        /// Axis and zero angle.
        frame: Frame,
        /// Radius [mm].
        radius: f64,
    },
    /// `origin + (radius + v tan a)(cos u x + sin u y) + v z`, `a` = semi-angle: STEP's parametrisation.
    Cone {
        /// Axis and zero angle; the origin's circle has `radius`.
        frame: Frame,
        /// Radius at v = 0 [mm].
        radius: f64,
        /// Half angle [rad], |a| < pi/2.
        semi_angle: f64,
    },
    /// `origin + radius (cos v cos u x + cos v sin u y + sin v z)`.
    Sphere {
        /// Centre, poles along z.
        frame: Frame,
        /// Radius [mm].
        radius: f64,
    },
    /// `origin + (major + minor cos v)(cos u x + sin u y) + minor sin v z`; may cross its own axis.
    Torus {
        /// Centre and axis.
        frame: Frame,
        /// Radius of the centre line [mm].
        major: f64,
        /// Radius of the tube [mm].
        minor: f64,
        /// For spindle tori (`major < minor`): true keeps the outer part (apple), false the lens; `None` all.
        keep_outer: Option<bool>,
    },
    /// `generatrix(v)` turned by the angle u about the axis; `angles` limits u where the file does.
    Revolution {
        /// Curve that is turned.
        generatrix: Curve3,
        /// A point of the axis.
        origin: Vec3,
        /// Direction of the axis (unit); turning is right-handed about it.
        axis: Vec3,
        /// Range of u [rad]; `None` = 0 to 2 pi.
        angles: Option<[f64; 2]>,
        /// True where the file's parameters are (curve, angle) instead of (angle, curve): IGES 120.
        curve_first: bool,
    },
    /// `directrix(u) + v direction`.
    Extrusion {
        /// Curve that is swept.
        directrix: Curve3,
        /// Sweep for v = 1 [mm].
        direction: Vec3,
        /// Range of v; `None` = unbounded (taken from the loops).
        range: Option<[f64; 2]>,
    },
    /// A rational B-spline surface (ruled surfaces, splines, Bezier: converted by the reader).
    Nurbs(Surface),
    /// `base + distance * normal(base)`.
    Offset {
        /// Surface that is offset.
        base: Box<RawSurface>,
        /// Distance along its normal [mm].
        distance: f64,
    },
}

impl RawSurface {
    /// Control points of what it is made of.
    fn control_points(&self) -> usize {
        match self {
            RawSurface::Revolution { generatrix: curve, .. }
            | RawSurface::Extrusion { directrix: curve, .. } => curve.points().len(),
            RawSurface::Nurbs(surface) => surface.points().len(),
            RawSurface::Offset { base, .. } => base.control_points(),
            _ => 0,
        }
    }
}

/// A closed boundary loop, edges in order, each ending where the next begins.
#[derive(Debug, Clone, Default)]
pub struct RawLoop {
    /// The file calls it the outer one.
    pub outer: Option<bool>,
    /// Edges in the loop's order.
    pub edges: Vec<RawEdge>,
    /// A loop that is a single point (STEP `VERTEX_LOOP`, IGES pole).
    pub vertex: Option<Vec3>,
}

/// One edge of a loop, both of its curves running in the loop's direction.
#[derive(Debug, Clone, Default)]
pub struct RawEdge {
    /// Curve in space, already cut to the edge [mm].
    pub curve: Option<Curve3>,
    /// Curve in the surface's native parameters (angles in rad), already cut to the edge.
    pub pcurve: Option<Curve2>,
    /// The file prefers the parameter curve (IGES 142 PREF = 1).
    pub prefer_pcurve: bool,
    /// Identity of a shared topological edge (same number = same edge), if the file has topology.
    pub edge_id: Option<usize>,
    /// Vertex positions the file gives for the start and end, if it has topology [mm].
    pub ends: Option<[Vec3; 2]>,
}
