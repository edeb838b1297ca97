//! Names of the search methods.

use super::paper::PaperSearch;
use super::projection::ContactSearch;
use super::surface::ToolSurface;
use kanagata_tool::ToolModel;

/// Which search.
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
#[serde(rename_all = "kebab-case")]
pub enum SearchKind {
    /// Tree of boxes, certified.
    #[default]
    Tree,
    /// The paper's Sec. 3.1: grid of Eq. 16, ten candidates, Newton of Eq. 19-23.
    BezierGrid,
    /// The paper's Sec. 3.2: nearest nodes of Eq. 17, grid of Eq. 18, ten candidates, the same Newton.
    NagataNodes,
}

impl SearchKind {
    /// Prepares the search for a model.
    #[must_use]
    pub fn prepare(self, model: ToolModel) -> Box<dyn ContactSearch> {
        match self {
            Self::Tree => Box::new(ToolSurface::new(model)),
            Self::BezierGrid => Box::new(PaperSearch::bezier_grid(model)),
            Self::NagataNodes => Box::new(PaperSearch::nagata_nodes(model)),
        }
    }
}
