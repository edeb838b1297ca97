//! Trimmed NURBS faces, joined at their edges.

use std::ops::Range;

use crate::geometry::nurbs::{Curve2, Curve3, Surface};
use crate::geometry::{Vec2, Vec3};

/// A CAD model: faces in mm, oriented outwards, with the topology found by joining their edges.
#[derive(Debug, Clone, Default)]
pub struct Model {
    /// Name of the file.
    pub name: String,
    /// Unit of the file as it names it.
    pub unit: String,
    /// Millimetres in one unit of the file.
    pub unit_mm: f64,
    /// Entities of the file by kind.
    pub entities: std::collections::BTreeMap<String, usize>,
    /// Trimmed faces.
    pub faces: Vec<Face>,
    /// Faces of the file that are not in `faces`: unreadable, or without area.
    pub lost: Vec<super::raw::LostFace>,
    /// Numbers of faces that are parts of one face of the file, cut at creases inside it.
    pub cut: Vec<Range<usize>>,
    /// Edges, each used by one face (free), two, or more. Faces that meet along part of an edge have it
    /// split there, so that a use is always a whole edge.
    pub edges: Vec<Edge>,
    /// Corner points [mm].
    pub vertices: Vec<Vec3>,
    /// Largest gap that was closed by joining [mm].
    pub join_tolerance: f64,
}

/// What a face's surface was in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SurfaceKind {
    /// Plane.
    Plane,
    /// Circular cylinder.
    Cylinder,
    /// Circular cone.
    Cone,
    /// Sphere.
    Sphere,
    /// Torus.
    Torus,
    /// Surface of revolution of a free curve.
    Revolution,
    /// Sweep of a free curve.
    Extrusion,
    /// Rational B-spline.
    Nurbs,
    /// Offset of another surface.
    Offset,
}

/// A trimmed face.
#[derive(Debug, Clone)]
pub struct Face {
    /// Rational B-spline surface, on a domain that covers the loops.
    pub surface: Surface,
    /// What the surface was in the file.
    pub kind: SurfaceKind,
    /// The plane, quadric or torus of which `surface` is an exact piece.
    pub analytic: Option<Analytic>,
    /// Loops in the parameter plane, closed, outer one counter-clockwise and first, holes clockwise (in
    /// the (u, v) plane, whatever `flipped` is).
    pub loops: Vec<TrimLoop>,
    /// The outward normal is `-(su x sv)/|.|`.
    pub flipped: bool,
    /// Entity in the file.
    pub source: String,
    /// Shell in the file.
    pub shell: Option<usize>,
}

/// A closed loop in the parameter plane.
#[derive(Debug, Clone)]
pub struct TrimLoop {
    /// Edge uses, each ending where the next begins.
    pub uses: Vec<EdgeUse>,
}

/// One side of an edge: its curve in a face's parameter plane, in the loop's direction.
#[derive(Debug, Clone)]
pub struct EdgeUse {
    /// Parameter curve (in the parameters of `Face::surface`), in the loop's direction.
    pub pcurve: Curve2,
    /// Index into `Model::edges`; `None` for a degenerate side (pole: one point in space).
    pub edge: Option<usize>,
    /// The use runs against the edge's own curve.
    pub reversed: bool,
}

/// An edge of the joined model.
#[derive(Debug, Clone)]
pub struct Edge {
    /// Curve in space from `vertices[0]` to `vertices[1]`.
    pub curve: Curve3,
    /// Vertex ids; equal for a closed edge.
    pub vertices: [usize; 2],
    /// Faces that use it, as (face, loop, position in the loop). A seam is used twice by one face.
    pub uses: Vec<[usize; 3]>,
}

/// Where the closest point of a trimmed face lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FootLocation {
    /// Inside a face.
    Inside,
    /// On an edge.
    Edge(usize),
    /// At a vertex.
    Vertex(usize),
}

/// The closest point of a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot {
    /// Face the foot is on (for edges and vertices: one of those that meet there).
    pub face: usize,
    /// Parameters on that face.
    pub uv: Vec2,
    /// Closest point [mm].
    pub point: Vec3,
    /// Outward unit normal of `face` there (zero vector where the surface has none).
    pub normal: Vec3,
    /// Distance [mm], >= 0.
    pub distance: f64,
    /// Inside a face, on an edge, at a vertex.
    pub location: FootLocation,
}

impl Model {
    /// The faces that with face `f` are one face of the file: itself alone, or the parts it was cut into.
    #[must_use]
    pub fn cut_with(&self, f: usize) -> Range<usize> {
        self.cut.iter().find(|parts| parts.contains(&f)).cloned().unwrap_or(f..f + 1)
    }
}

impl Face {
    /// Outward unit normal at `uv`; `None` where the surface has none.
    #[must_use]
    pub fn normal(&self, uv: Vec2) -> Option<Vec3> {
        let n = self.surface.normal(uv)?;
        Some(if self.flipped { -n } else { n })
    }
}

pub use super::analytic::Analytic;
