//! A tool model in memory: what a tool file holds, and the patches derived from it.

use crate::geometry::Vec3;

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

/// A tool model: vertices, normals, patches; coefficients are derived, each shared edge once.
#[derive(Debug, Clone, PartialEq)]
pub struct ToolModel {
    /// Name of the tool.
    pub name: String,
    /// What its patches are.
    pub kind: ToolKind,
    /// Vertex positions [mm] (Nagata, facets).
    pub vertices: Vec<Vec3>,
    /// Unit normals, out of the tool.
    pub normals: Vec<Vec3>,
    /// Corner ids (Nagata, facets).
    pub corners: Vec<PatchCorners>,
    /// Edges with given coefficients (Nagata); all others have those of Eq. 8.
    pub curves: Vec<GivenCurve>,
    /// Patches ready for evaluation, in file order.
    pub patches: Vec<super::Patch>,
    /// CAD face id of each patch.
    pub faces: Vec<u32>,
    /// Faces that were divided independently meet to within this [mm]; 0: neighbours share vertices and curves.
    pub border_gap_mm: f64,
}

impl ToolModel {
    /// Patches without vertices, normals and corners of their own, as Bezier patches have none; `faces`: the CAD face of each.
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

    /// What of its faces looks along a unit vector, less what looks against it, over both: 1 where all do, -1 where
    /// none does, 0 for a closed body and where all are seen edge-on. Areas are those about the patches' middles.
    #[must_use]
    pub fn facing(&self, along: &Vec3) -> f64 {
        /// Share of the whole area that is seen edge-on but for rounding.
        const SEEN: f64 = 1e-9;
        let (mut sum, mut seen, mut area) = (0.0, 0.0, 0.0);
        for patch in &self.patches {
            let part = patch.about_its_middle();
            sum += part.dot(along);
            seen += part.dot(along).abs();
            area += part.norm();
        }
        if seen > SEEN * area { sum / seen } else { 0.0 }
    }
}
