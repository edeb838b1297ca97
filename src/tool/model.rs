//! Tool model in memory: the contents of a tool file, and the patches derived from it.

use kanagata_geometry::Vec3;

/// What the patches of a tool model are.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum ToolKind {
    /// Nagata patches from vertices and normals.
    Nagata,
    /// Bezier patches from control points.
    Bezier,
    /// Flat triangles and bilinear quadrilaterals.
    Facets,
}

/// A Nagata or facet patch as the tool file lists it.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PatchCorners {
    /// Three or four vertex ids.
    pub vertices: Vec<u32>,
    /// Beside them, normal ids.
    pub normals: Vec<u32>,
    /// CAD face id.
    pub face: u32,
}

/// An edge whose quadratic coefficient c (Eq. 7) is given instead of derived from its normals (Eq. 8): where the
/// normals leave it open, and where the guard caught it, the converter takes it from the CAD.
#[derive(
    Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(deny_unknown_fields)]
pub struct GivenCurve {
    /// Vertex ids of its ends.
    pub vertices: [u32; 2],
    /// Coefficient c of Eq. 7 [mm]; the same in both directions.
    pub c: [f64; 3],
}

/// A tool model: vertices, normals, patches. Coefficients are derived, once per shared edge.
#[derive(Debug, Clone, PartialEq)]
pub struct ToolModel {
    /// Name of the tool.
    pub name: String,
    /// Type of its patches.
    pub kind: ToolKind,
    /// Vertex positions [mm] (Nagata, facets).
    pub vertices: Vec<Vec3>,
    /// Unit normals, out of the tool.
    pub normals: Vec<Vec3>,
    /// Corner ids (Nagata, facets).
    pub corners: Vec<PatchCorners>,
    /// Edges with given coefficients (Nagata); all others follow Eq. 8.
    pub curves: Vec<GivenCurve>,
    /// Patches for evaluation, in file order.
    pub patches: Vec<super::Patch>,
    /// CAD face id of each patch.
    pub faces: Vec<u32>,
    /// Gap between the borders of independently divided faces [mm]; 0: adjacent patches share vertices and curves.
    pub border_gap_mm: f64,
}

impl ToolModel {
    /// A model of patches without vertices, normals and corners, such as Bezier patches; `faces` is the CAD face of
    /// each.
    #[must_use]
    pub fn of_patches(
        name: &str,
        kind: ToolKind,
        patches: Vec<super::Patch>,
        faces: Vec<u32>,
    ) -> Self {
        Self {
            name: name.to_owned(),
            kind,
            vertices: Vec::new(),
            normals: Vec::new(),
            corners: Vec::new(),
            curves: Vec::new(),
            patches,
            faces,
            border_gap_mm: 0.0,
        }
    }

    /// Projected area of the faces with a normal along the unit vector `along`, minus that of the opposite faces, over
    /// the sum of both. 1 when all have it, -1 when none has; 0 for a closed body, and when all faces are edge-on.
    /// Areas are [`super::Patch::area_vector`].
    #[must_use]
    pub fn facing(&self, along: &Vec3) -> f64 {
        /// Fraction of the total area that is edge-on to within rounding.
        const EDGE_ON_FRACTION: f64 = 1e-9;
        let (mut sum, mut seen, mut area) = (0.0, 0.0, 0.0);
        for patch in &self.patches {
            let part = patch.area_vector();
            sum += part.dot(along);
            seen += part.dot(along).abs();
            area += part.norm();
        }
        if seen > EDGE_ON_FRACTION * area { sum / seen } else { 0.0 }
    }
}
