//! Settings of a conversion.

use crate::convert::offset::OffsetRequest;
use crate::convert::tolerance::Borders;
use crate::progress::Progress;
use crate::tool::ToolKind;
use crate::tool::selection::FaceSelection;

/// How CAD becomes a tool. The default are Nagata patches with four divisions of a fillet of 90 degrees, without a search.
///
/// ```
/// use kanagata::prelude::{Cad, ConvertSettings};
///
/// let settings = ConvertSettings { sheet_side: Some([0.0, 0.0, -1.0]), ..ConvertSettings::within(0.05) };
/// let punch = Cad::read("fixtures/forming/hemi_punch_144.igs")?.convert(&settings)?;
/// assert!(punch.shape_error_mm().unwrap() <= 0.05);
/// # Ok::<(), kanagata::prelude::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ConvertSettings {
    /// Name of the tool.
    pub name: String,
    /// Kind of patch.
    pub kind: ToolKind,
    /// Largest absolute shape error (Eq. 24) [mm], > 0. The fewest patches within it are searched.
    pub tolerance_mm: Option<f64>,
    /// Largest error of the normals [degrees], > 0. The fewest patches within it are searched.
    pub normal_tolerance_deg: Option<f64>,
    /// The least shape error with at most this many patches; it takes the place of the tolerances.
    pub patches: Option<usize>,
    /// Time for the search [s]; the result depends on the speed of the machine then.
    pub time_s: Option<f64>,
    /// Divisions of a fillet of 90 degrees, 1 to 1000, without a search.
    pub arc_divisions: usize,
    /// Components of edge coefficients that Eq. 8 leaves undetermined follow the CAD. Default: with a search.
    pub edges_on_cad: Option<bool>,
    /// Connection of adjacent faces, with a search.
    pub borders: Borders,
    /// Angle between the normals of adjacent faces below which they are one [degrees].
    pub smooth_deg: f64,
    /// Direction towards the sheet. Tools that look away from it are reversed.
    pub sheet_side: Option<[f64; 3]>,
    /// Reverses the tool, after `sheet_side`.
    pub flip: bool,
    /// Makes the tool of the offset of the CAD.
    pub offset: Option<OffsetRequest>,
    /// Makes the tool of some faces.
    pub faces: Option<FaceSelection>,
    /// Continues without faces that cannot be read; the tool file names them.
    pub skip_lost_faces: bool,
    /// Where the progress is reported.
    pub progress: Progress,
}

impl Default for ConvertSettings {
    fn default() -> Self {
        Self {
            name: "tool".into(),
            kind: ToolKind::Nagata,
            tolerance_mm: None,
            normal_tolerance_deg: None,
            patches: None,
            time_s: None,
            arc_divisions: 4,
            edges_on_cad: None,
            borders: Borders::Conforming,
            smooth_deg: 0.5,
            sheet_side: None,
            flip: false,
            offset: None,
            faces: None,
            skip_lost_faces: false,
            progress: Progress::default(),
        }
    }
}

impl ConvertSettings {
    /// The fewest patches within a shape error (Eq. 24) [mm].
    #[must_use]
    pub fn within(tolerance_mm: f64) -> Self {
        Self { tolerance_mm: Some(tolerance_mm), ..Self::default() }
    }

    /// Whether divisions are searched.
    pub(super) fn is_refined(&self) -> bool {
        self.tolerance_mm.is_some()
            || self.normal_tolerance_deg.is_some()
            || self.patches.is_some()
            || self.time_s.is_some()
    }

    /// Whether edges follow the CAD.
    pub(super) fn edges_follow_cad(&self) -> bool {
        self.edges_on_cad.unwrap_or(self.is_refined())
    }

    /// Mesher and its options, for the provenance.
    pub(super) fn describe(&self) -> String {
        let given = [
            ("tol-mm", self.tolerance_mm),
            ("normal-tol-deg", self.normal_tolerance_deg),
            ("time-s", self.time_s),
            ("patches", self.patches.map(|n| n as f64)),
        ];
        let given = given.into_iter().filter_map(|(key, value)| Some(format!(" {key}={}", value?)));
        let goal: String = given.collect();
        let divisions = if goal.is_empty() {
            format!(" arc-divisions={}", self.arc_divisions)
        } else {
            String::new()
        };
        let edges = if self.edges_follow_cad() { " edges=cad" } else { "" };
        let borders =
            if self.borders == Borders::Independent { " borders=independent" } else { "" };
        let side =
            self.sheet_side.map_or_else(String::new, |[x, y, z]| format!(" side={x},{y},{z}"));
        let flip = if self.flip { " flip" } else { "" };
        format!("mapped{divisions} style=structured{goal}{edges}{borders}{side}{flip}")
    }
}
