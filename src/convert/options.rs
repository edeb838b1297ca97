//! Options and report of a conversion.

use kanagata_geometry::Vec3;
use kanagata_progress::Progress;
use kanagata_tool::ToolKind;
use kanagata_tool::build::StraightEdge;
use kanagata_tool::edge::EdgeRule;

/// Options of a conversion.
#[derive(Debug, Clone, PartialEq)]
pub struct ConvertOptions {
    /// Name of the tool.
    pub name: String,
    /// Patch kind: Nagata or facets.
    pub kind: ToolKind,
    /// Rule for the coefficient of an edge (Eq. 8).
    pub edges: EdgeRule,
    /// Components of the coefficient that Eq. 8 leaves undetermined follow the CAD, and so do edges rejected by its
    /// guard (Nagata only).
    pub through_cad: bool,
    /// Angle between the normals of adjacent faces at a vertex below which they are merged [degrees].
    pub smooth_deg: f64,
    /// Direction towards the sheet. The model is reversed if its vector area points the other way.
    pub sheet_side: Option<Vec3>,
    /// Reverses the model (after `sheet_side`).
    pub flip: bool,
    /// Edges of patches that remain folded after all other repairs become straight (Nagata only).
    pub straighten: bool,
    /// Where the progress is reported.
    pub progress: Progress,
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
            progress: Progress::default(),
        }
    }
}

impl ConvertOptions {
    /// The same options for the many small conversions of a search, which do not report theirs.
    pub(super) fn unwatched(&self) -> Self {
        Self { progress: Progress::default(), ..self.clone() }
    }
}

/// Report of a conversion.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ConvertReport {
    /// Number of crease edges: the patches on both sides have different normals.
    pub creases: usize,
    /// Edges made straight by the guard or to remove a fold.
    pub straight: Vec<StraightEdge>,
    /// Edges rejected by the guard that follow the CAD instead of a chord; they are not perpendicular to their normals.
    pub bent: Vec<StraightEdge>,
    /// Number of folded quadrilaterals that were split into two triangles.
    pub split: usize,
    /// Faces divided more finely than requested because patches on them folded.
    pub finer: Vec<usize>,
    /// Faces without a patch: not in the mesh, or with zero area to within the joining tolerance.
    pub bare: Vec<usize>,
    /// Patches whose edges were changed to Eq. 8 or to chords because patches folded, each once.
    pub redone: Vec<u32>,
    /// Patches that remain folded: `(S_eta x S_zeta) . n < 0` at some point.
    pub folded: Vec<u32>,
    /// True when the model was reversed to face the sheet.
    pub turned: bool,
}
