//! Output of a run.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::Fault;

/// Largest number of sections.
const SECTIONS_MAX: usize = 100;

/// Output of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Increments between VTU files, which are also written at stage ends; 0: stage ends only.
    pub vtu_every: usize,
    /// Increments between checkpoints; 0: only when the run is stopped.
    pub checkpoint_every: usize,
    /// Sections of the sheet, with the angles and the curl of their walls before and after springback.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sections: Vec<Section>,
}

/// A section: the material line in which a plane cuts the undeformed sheet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// Normal of the plane.
    pub normal: SectionNormal,
    /// Coordinate of the plane along its normal [mm].
    #[serde(default)]
    pub at_mm: f64,
}

/// Normal of the plane of a section.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SectionNormal {
    /// x
    X,
    /// y
    Y,
}

impl SectionNormal {
    /// 0 or 1.
    #[must_use]
    pub fn index(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
        }
    }
}

impl Default for Output {
    fn default() -> Self {
        Self { vtu_every: 10, checkpoint_every: 5, sections: Vec::new() }
    }
}

impl Output {
    /// Checks the number of sections.
    pub(super) fn check(&self) -> Result<(), Fault> {
        let count = self.sections.len();
        if count <= SECTIONS_MAX {
            return Ok(());
        }
        Err((
            "output.sections".into(),
            format!("{count} sections"),
            format!("up to {SECTIONS_MAX}"),
        ))
    }
}
