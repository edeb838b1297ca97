//! Interface between readers and `build`: faces as in the file [mm], before any repair.

use std::sync::Arc;

use super::Diagnostic;
use super::attributes::{Attributes, Body};
use kanagata_geometry::nurbs::{Curve2, Curve3, Surface};
use kanagata_geometry::{Frame, Vec3};

/// Result of reading a file.
#[derive(Debug, Clone, Default)]
pub struct RawModel {
    /// Unit of length as named in the file (`mm`, `INCH`, ...).
    pub unit: String,
    /// Millimetres in one unit of the file.
    pub unit_mm: f64,
    /// Software that wrote the file.
    pub writer: String,
    /// Smallest significant distance stated in the file [mm]; 0 when not stated.
    pub resolution_mm: f64,
    /// Number of entities by kind (`128:0` in IGES as `type:form`, keyword in STEP).
    pub entities: std::collections::BTreeMap<String, usize>,
    /// Faces, one for every placed instance of an assembly.
    pub faces: Vec<RawFace>,
    /// Solids, shells and sets of faces, one for every placed instance.
    pub bodies: Vec<Body>,
    /// Unreadable faces of the file.
    pub lost: Vec<LostFace>,
    /// Curves that bound no face (not meshed).
    pub loose_curves: usize,
    /// Diagnostics of the reader.
    pub diagnostics: Vec<Diagnostic>,
    /// Size of the file [bytes]; the cost of the model is limited in proportion to it.
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

/// Maximum number of sides (see [`RawFace::sides`]) of all faces of a file of `bytes` bytes, including every placed
/// instance. A side takes about 25 bytes of a file, 2 kB of memory and 15 us.
#[must_use]
pub fn max_sides(bytes: usize) -> usize {
    (32_768 + bytes / 8).min(2_000_000)
}

/// A trimmed face as in the file.
#[derive(Debug, Clone)]
pub struct RawFace {
    /// The surface in the file's parametrisation.
    pub surface: RawSurface,
    /// Boundary loops. Empty: the face is the whole surface.
    pub loops: Vec<RawLoop>,
    /// True when the outward normal of the face is opposite to `su x sv` of the surface.
    pub flipped: bool,
    /// Entity, for messages: `D145 (144)` or `#45 (ADVANCED_FACE)`.
    pub source: String,
    /// Shell or solid of the face, numbered from 0; `None` for a single face. Faces of one shell are consistently
    /// oriented in the file.
    pub shell: Option<usize>,
    /// Body (index into [`RawModel::bodies`]), name, layers and colour.
    pub attributes: Arc<Attributes>,
}

impl RawFace {
    /// Cost of the face, in sides of a simple face: at least four, plus one for every 32 control points.
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
    /// `origin + (major + minor cos v)(cos u x + sin u y) + minor sin v z`; may self-intersect on its axis.
    Torus {
        /// Centre and axis.
        frame: Frame,
        /// Major radius [mm].
        major: f64,
        /// Minor radius [mm].
        minor: f64,
        /// For spindle tori (`major < minor`): `true` is the outer part (apple), `false` the inner part (lemon), `None`
        /// both.
        keep_outer: Option<bool>,
    },
    /// Revolution of `generatrix(v)` by the angle u about the axis; `angles` is the range of u if stated in the file.
    Revolution {
        /// Generatrix.
        generatrix: Curve3,
        /// A point of the axis.
        origin: Vec3,
        /// Direction of the axis (unit); rotation is right-handed about it.
        axis: Vec3,
        /// Range of u [rad]; `None` = 0 to 2 pi.
        angles: Option<[f64; 2]>,
        /// True where the file's parameters are (curve, angle) instead of (angle, curve): IGES 120.
        curve_first: bool,
    },
    /// `directrix(u) + v direction`.
    Extrusion {
        /// Directrix.
        directrix: Curve3,
        /// Translation for v = 1 [mm].
        direction: Vec3,
        /// Range of v; `None` = unbounded (determined from the loops).
        range: Option<[f64; 2]>,
    },
    /// A rational B-spline surface (ruled surfaces, splines, Bezier: converted by the reader).
    Nurbs(Surface),
    /// `base + distance * normal(base)`.
    Offset {
        /// Base surface.
        base: Box<RawSurface>,
        /// Distance along its normal [mm].
        distance: f64,
    },
}

impl RawSurface {
    /// Number of control points.
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

/// A closed boundary loop; each edge ends at the start of the next.
#[derive(Debug, Clone, Default)]
pub struct RawLoop {
    /// Whether the file marks the loop as the outer one.
    pub outer: Option<bool>,
    /// Edges in the order of the loop.
    pub edges: Vec<RawEdge>,
    /// A loop that is a single point (STEP `VERTEX_LOOP`, IGES pole).
    pub vertex: Option<Vec3>,
}

impl RawLoop {
    /// Reverses the direction of the loop.
    pub fn reverse(&mut self) {
        self.edges.reverse();
        self.edges.iter_mut().for_each(RawEdge::reverse);
    }
}

/// One edge of a loop; both curves have the direction of the loop.
#[derive(Debug, Clone, Default)]
pub struct RawEdge {
    /// Space curve, trimmed to the edge [mm].
    pub curve: Option<Curve3>,
    /// Curve in the native parameters of the surface (angles in rad), trimmed to the edge.
    pub pcurve: Option<Curve2>,
    /// The file prefers the parameter curve (IGES 142 PREF = 1).
    pub prefer_pcurve: bool,
    /// Identity of a shared topological edge (equal numbers = same edge), if the file has topology.
    pub edge_id: Option<usize>,
    /// Start and end vertex given by the file, if it has topology [mm].
    pub ends: Option<[Vec3; 2]>,
}

impl RawEdge {
    /// Reverses the direction of both curves.
    pub fn reverse(&mut self) {
        self.curve = self.curve.take().map(|c| c.reversed());
        self.pcurve = self.pcurve.take().map(|c| c.reversed());
        self.ends = self.ends.map(|[a, b]| [b, a]);
    }
}
