//! Errors of regions in plan.

/// The reason why faces cannot be chosen by a closed curve.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RegionError {
    /// No closed curve.
    #[error("the curve of the region is not usable: {found}; allowed: {allowed}")]
    Curve {
        /// What was found.
        found: String,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A face that cannot be split.
    #[error(
        "face {face} ({source_entity}) cannot be split along the curve of the region: {reason}; move the curve a little, away from edges and walls that it touches"
    )]
    Face {
        /// Index of the face.
        face: usize,
        /// Entity in the file.
        source_entity: String,
        /// Why.
        reason: String,
    },
}

impl RegionError {
    pub(super) fn curve(found: impl Into<String>) -> Self {
        let allowed = "one closed curve in plan that does not cross itself: lines, arcs, splines, or at least 3 points";
        Self::Curve { found: found.into(), allowed }
    }
}
