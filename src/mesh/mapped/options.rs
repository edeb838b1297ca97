//! Size and style of a mapped mesh.

use crate::MeshError;

/// What kinds of element a mesh is made of.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Default,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum MeshStyle {
    /// Quads on four-sided faces, three blocks of quads on curved three-sided ones; elsewhere quads with a
    /// few triangles between.
    #[default]
    Structured,
    /// As structured, with triangles on three-sided faces and wherever two of them join badly.
    Mixed,
    /// Triangles only.
    Triangles,
    /// Quads only (but for triangles at poles).
    Quads,
}

/// Size and style of a mapped mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MappedOptions {
    /// Divisions of a fillet that turns through 90 degrees, 1 to 1000.
    pub arc_divisions: usize,
    /// Longest element side [mm], > 0: faces with longer ones are meshed again; `None` = limited by curvature only.
    pub max_size: Option<f64>,
    /// Largest distance of a flat element from the surface [mm] (approximate), > 0.
    pub chord_error: Option<f64>,
    /// Element types.
    pub style: MeshStyle,
    /// Patch sides on CAD edges follow the edges for any normals, so that their corners are never straight.
    pub through_cad: bool,
    /// Edges of strongly uneven curvature are divided by turning angle instead of equal lengths.
    pub by_turn: bool,
    /// Fewest elements for the given divisions: quadrilaterals in place of pairs of triangles at poles, flat faces with
    /// holes without interior nodes.
    pub fewest: bool,
    /// No face is mapped: triangles of about uniform size everywhere, recombined to quadrilaterals by `style`.
    pub unstructured: bool,
}

impl Default for MappedOptions {
    fn default() -> Self {
        Self {
            arc_divisions: 4,
            max_size: None,
            chord_error: None,
            style: MeshStyle::default(),
            through_cad: false,
            by_turn: false,
            fewest: false,
            unstructured: false,
        }
    }
}

pub(super) fn check_options(options: &MappedOptions) -> Result<(), MeshError> {
    if !(1..=1000).contains(&options.arc_divisions) {
        let found = options.arc_divisions.to_string();
        return Err(MeshError::Option { option: "arc_divisions", found, allowed: "1 to 1000" });
    }
    for (option, value) in [("max_size", options.max_size), ("chord_error", options.chord_error)] {
        if let Some(v) = value.filter(|v| !(v.is_finite() && *v > 0.0)) {
            let allowed = "a length in mm above zero";
            return Err(MeshError::Option { option, found: v.to_string(), allowed });
        }
    }
    Ok(())
}
