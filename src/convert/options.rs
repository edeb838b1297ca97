//! Choices of a conversion, and what it found.

use crate::geometry::Vec3;
use crate::tool::ToolKind;
use crate::tool::build::StraightEdge;
use crate::tool::edge::EdgeRule;

/// Choices of a conversion.
#[derive(Debug, Clone, PartialEq)]
pub struct ConvertOptions {
    /// Name of the tool.
    pub name: String,
    /// Nagata patches or facets.
    pub kind: ToolKind,
    /// How edges are curved.
    pub edges: EdgeRule,
    /// What Eq. 8 leaves open, and edges that its guard catches, follow the CAD (Nagata).
    pub through_cad: bool,
    /// Normals of neighbouring faces closer than this at a vertex are one [degrees].
    pub smooth_deg: f64,
    /// Direction to the sheet: the model is turned round if its faces look the other way on the whole.
    pub sheet_side: Option<Vec3>,
    /// Turns the model round (after `sheet_side`).
    pub flip: bool,
    /// Edges of patches that fold whatever else is done are made straight (Nagata).
    pub straighten: bool,
}

impl Default for ConvertOptions {
    fn default() -> Self {
        Self {
            name: "tool".into(),
            kind: ToolKind::Nagata,
            edges: EdgeRule::Guarded,
            through_cad: false,
            smooth_deg: 0.5,
            sheet_side: None,
            flip: false,
            straighten: false,
        }
    }
}

/// What a conversion found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ConvertReport {
    /// Edges at which the faces on both sides keep normals of their own.
    pub creases: usize,
    /// Edges that the guard made straight.
    pub straight: Vec<StraightEdge>,
    /// Edges that the guard would have made straight and that follow the CAD instead, off their normals.
    pub bent: Vec<StraightEdge>,
    /// Quadrilaterals that folded and were split in two triangles.
    pub split: usize,
    /// Faces that were divided more finely than asked, as patches of them folded.
    pub finer: Vec<usize>,
    /// Faces without a patch: of no area within the tolerance to which the model is joined, or not in the mesh.
    pub bare: Vec<usize>,
    /// Patches whose edges lost the curves that were asked for, as patches folded with them.
    pub redone: Vec<u32>,
    /// Patches that fold still: somewhere `(S_eta x S_zeta) . n < 0`.
    pub folded: Vec<u32>,
    /// The model was turned round to look at the sheet.
    pub turned: bool,
}
