//! Errors of a choice of faces.

use kanagata_cad::region::RegionError;

/// The reason why a choice of faces cannot be made.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SelectError {
    /// An item that chooses no face.
    #[error("the {what} '{item}' is not in the CAD file; {nearest}")]
    Unknown {
        /// `body`, `face`, `layer` or `colour`.
        what: &'static str,
        /// The item.
        item: String,
        /// What comes nearest to it.
        nearest: String,
    },
    /// An item that cannot be read.
    #[error("the {what} '{item}' cannot be read; allowed: {allowed}")]
    Malformed {
        /// `body`, `face`, `layer` or `colour`.
        what: &'static str,
        /// The item.
        item: String,
        /// What is allowed.
        allowed: &'static str,
    },
    /// Too long a list.
    #[error(
        "a list of {found} {what}; allowed: at most {max} items, each of up to {length} characters with a few wildcards"
    )]
    TooLong {
        /// What the list holds.
        what: &'static str,
        /// Number of items.
        found: usize,
        /// Largest number.
        max: usize,
        /// Largest number of characters of an item.
        length: usize,
    },
    /// A box whose minimum is above its maximum.
    #[error(
        "a box from {min:?} to {max:?} mm is empty; allowed: the smallest x, y, z first, then the largest"
    )]
    EmptyBox {
        /// Smallest coordinates [mm].
        min: [f64; 3],
        /// Largest coordinates [mm].
        max: [f64; 3],
    },
    /// A box without a whole face.
    #[error(
        "no face is inside the box from {min:?} to {max:?} mm as a whole; the model extends from {low:.4?} to {high:.4?} mm"
    )]
    NothingInside {
        /// Smallest coordinates of the box [mm].
        min: [f64; 3],
        /// Largest coordinates of the box [mm].
        max: [f64; 3],
        /// Smallest coordinates of the model [mm].
        low: [f64; 3],
        /// Largest coordinates of the model [mm].
        high: [f64; 3],
    },
    /// A direction of no length, or an angle out of range.
    #[error(
        "direction {direction:?} with the angle {angle} degrees; allowed: a direction that is not zero, an angle from 0 to 180 degrees"
    )]
    Direction {
        /// The direction.
        direction: [f64; 3],
        /// The angle [degrees].
        angle: f64,
    },
    /// No face looks in the direction.
    #[error(
        "the mean normal of no face is within {angle} degrees of the direction {direction:?}; allowed: at least one face; the normals are those of the CAD file, try the opposite direction"
    )]
    NothingFacing {
        /// The direction.
        direction: [f64; 3],
        /// The angle [degrees].
        angle: f64,
    },
    /// No face on the chosen side of a closed curve.
    #[error("no face is {} the curve of the region, which extends from {low:.4?} to {high:.4?} mm in plan; allowed: at least one", if *inside { "inside" } else { "outside" })]
    NothingInRegion {
        /// Whether faces inside were asked for.
        inside: bool,
        /// Smallest coordinates of the curve [mm].
        low: [f64; 2],
        /// Largest coordinates of the curve [mm].
        high: [f64; 2],
    },
    /// A region that cannot be used.
    #[error(transparent)]
    Region(#[from] RegionError),
    /// The lists have no face in common.
    #[error(
        "no face is in all lists of the choice ({counts} of {faces} faces); allowed: at least one; leave a list out"
    )]
    Nothing {
        /// Number of faces of the model.
        faces: usize,
        /// Number of faces that each list chooses.
        counts: String,
    },
}
