//! Errors in the control data of curves and surfaces.

/// The reason why control data does not define a rational B-spline.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NurbsError {
    /// Degree outside 1..=25.
    #[error("degree {found} is outside 1 to 25")]
    Degree {
        /// Degree given.
        found: usize,
    },
    /// Fewer control points than degree + 1, or a control net that is not rectangular.
    #[error("{found} control points where {needed} are needed")]
    PointCount {
        /// Points given.
        found: usize,
        /// Points needed.
        needed: usize,
    },
    /// Number of knots is not points + degree + 1.
    #[error("{found} knots where {needed} are needed (control points + degree + 1)")]
    KnotCount {
        /// Knots given.
        found: usize,
        /// Knots needed.
        needed: usize,
    },
    /// Knots decrease or leave no interval.
    #[error("knot {index} ({right}) does not continue the rising sequence after {left}")]
    Knots {
        /// Index of the offending knot.
        index: usize,
        /// The knot before it.
        left: f64,
        /// The offending knot.
        right: f64,
    },
    /// A weight that is zero, negative or not finite.
    #[error("weight {index} is {found}; it must be positive and finite")]
    Weight {
        /// Index of the weight.
        index: usize,
        /// Weight given.
        found: f64,
    },
    /// A coordinate or knot that is not finite.
    #[error("control data holds a number that is not finite")]
    NotFinite,
    /// An empty or reversed parameter range.
    #[error("parameter range {from} to {to} is empty or outside the domain {low} to {high}")]
    Range {
        /// Start asked for.
        from: f64,
        /// End asked for.
        to: f64,
        /// Domain start.
        low: f64,
        /// Domain end.
        high: f64,
    },
}
