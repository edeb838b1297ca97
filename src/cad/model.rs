//! Trimmed NURBS faces, joined at their edges.

use std::ops::Range;
use std::sync::Arc;

use super::attributes::{Attributes, Body};
use kanagata_geometry::nurbs::{Curve2, Curve3, Surface, SurfaceDerivs};
use kanagata_geometry::{Vec2, Vec3};

/// A CAD model: faces in mm, oriented outwards, with the topology from joining their edges.
#[derive(Debug, Clone, Default)]
pub struct Model {
    /// Name of the file.
    pub name: String,
    /// Name of the unit in the file.
    pub unit: String,
    /// Millimetres in one unit of the file.
    pub unit_mm: f64,
    /// Entities of the file by kind.
    pub entities: std::collections::BTreeMap<String, usize>,
    /// Solids, shells and connected faces of neither, in the order of their first faces.
    pub bodies: Vec<Body>,
    /// Trimmed faces.
    pub faces: Vec<Face>,
    /// Faces of the file that are not in `faces`: unreadable, or of zero area.
    pub lost: Vec<super::raw::LostFace>,
    /// Index ranges of faces that are parts of one face of the file, split along creases.
    pub cut: Vec<Range<usize>>,
    /// Edges, used by one face (free), two, or more. Where faces meet along part of an edge it is split, so that every
    /// use is an entire edge.
    pub edges: Vec<Edge>,
    /// Edges that a face which is not taken uses too: they are free in this model, and not in the CAD.
    pub left_out: std::collections::BTreeSet<usize>,
    /// Corner points [mm].
    pub vertices: Vec<Vec3>,
    /// Largest gap closed by joining [mm].
    pub join_tolerance: f64,
}

/// Surface type of a face in the file.
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
    /// Surface of revolution of a free-form curve.
    Revolution,
    /// Extrusion of a free-form curve.
    Extrusion,
    /// Rational B-spline.
    Nurbs,
    /// Offset of another surface.
    Offset,
}

/// A trimmed face.
#[derive(Debug, Clone)]
pub struct Face {
    /// Rational B-spline surface, with a domain that covers the loops.
    pub surface: Surface,
    /// Surface type in the file.
    pub kind: SurfaceKind,
    /// The plane, quadric or torus of which `surface` is an exact patch.
    pub analytic: Option<Analytic>,
    /// Closed loops in the parameter plane, outer loop first and counter-clockwise, holes clockwise (in the (u, v)
    /// plane, for any value of `flipped`).
    pub loops: Vec<TrimLoop>,
    /// The outward normal is `-(su x sv)/|su x sv|`.
    pub flipped: bool,
    /// Entity in the file.
    pub source: String,
    /// Shell in the file.
    pub shell: Option<usize>,
    /// Body, name, layers and colour.
    pub attributes: Arc<Attributes>,
}

/// A closed loop in the parameter plane.
#[derive(Debug, Clone)]
pub struct TrimLoop {
    /// Edge uses, each ending at the start of the next.
    pub uses: Vec<EdgeUse>,
}

/// One side of an edge: its curve in the parameter plane of a face, in the direction of the loop.
#[derive(Debug, Clone)]
pub struct EdgeUse {
    /// Parameter curve (in the parameters of `Face::surface`), in the direction of the loop.
    pub pcurve: Curve2,
    /// Index into `Model::edges`; `None` for a degenerate side (pole: one point in space).
    pub edge: Option<usize>,
    /// The use traverses the edge against its curve.
    pub reversed: bool,
}

/// An edge of the joined model.
#[derive(Debug, Clone)]
pub struct Edge {
    /// Curve in space from `vertices[0]` to `vertices[1]`.
    pub curve: Curve3,
    /// Vertex ids; equal for a closed edge.
    pub vertices: [usize; 2],
    /// Uses of the edge, as (face, loop, position in the loop). A seam is used twice by one face.
    pub uses: Vec<[usize; 3]>,
}

/// Location of the closest point of a trimmed face.
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
    /// Face of the foot point (for edges and vertices: one of the adjacent faces).
    pub face: usize,
    /// Parameters on that face.
    pub uv: Vec2,
    /// Closest point [mm].
    pub point: Vec3,
    /// Outward unit normal of `face` (zero where the surface is degenerate).
    pub normal: Vec3,
    /// Distance [mm], >= 0.
    pub distance: f64,
    /// Inside a face, on an edge, at a vertex.
    pub location: FootLocation,
}

impl Model {
    /// Range of the faces that were one face of the file with face `f`.
    #[must_use]
    pub fn cut_with(&self, f: usize) -> Range<usize> {
        self.cut.iter().find(|parts| parts.contains(&f)).cloned().unwrap_or(f..f + 1)
    }
}

impl Face {
    /// Lengths of the tangents along u and v, each times the width of its parameter range [mm]. One is small where the
    /// surface is nearly degenerate.
    #[must_use]
    pub fn reach(&self, d: &SurfaceDerivs) -> [f64; 2] {
        let [u, v] = self.surface.domain();
        [d.su.norm() * (u[1] - u[0]), d.sv.norm() * (v[1] - v[0])]
    }

    /// Outward unit normal at `uv`; `None` where the surface is degenerate.
    #[must_use]
    pub fn normal(&self, uv: Vec2) -> Option<Vec3> {
        let n = self.surface.normal(uv)?;
        Some(if self.flipped { -n } else { n })
    }
}

pub use super::analytic::Analytic;
