//! Errors in the data of a tool model.

/// The reason why vertices, normals and corners do not define a tool model.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ToolError {
    /// A patch with fewer than three or more than four corners, or with different numbers of normals and corners.
    #[error(
        "patch {patch} has {vertices} vertices and {normals} normals; allowed: 3 or 4 of each, as many normals as vertices"
    )]
    Corners {
        /// Patch, from 0.
        patch: usize,
        /// Number of vertex ids.
        vertices: usize,
        /// Number of normal ids.
        normals: usize,
    },
    /// An id beyond the end of its table.
    #[error("patch {patch} names {what} {id}; allowed: 0 to {last}")]
    Id {
        /// Patch, from 0.
        patch: usize,
        /// `vertex` or `normal`.
        what: &'static str,
        /// Id found.
        id: u32,
        /// Largest admissible id.
        last: i64,
    },
    /// A patch with fewer than three distinct corners.
    #[error("patch {patch} has fewer than three different vertices")]
    Collapsed {
        /// Patch, from 0.
        patch: usize,
    },
    /// Corners with the opposite orientation of their normals, in the majority of patches.
    #[error(
        "corners of patch {patch}, as of {count} of {of} patches, are clockwise with respect to their normals; allowed: counter-clockwise; reverse the order of the corners, or the normals (out of the tool, to the sheet)"
    )]
    Turned {
        /// First such patch, from 0.
        patch: usize,
        /// Number of such patches.
        count: usize,
        /// Number of patches.
        of: usize,
    },
    /// A normal that is not a unit vector.
    #[error("normal {index} has length {length}; allowed: 1 within 1e-6")]
    NormalLength {
        /// Normal, from 0.
        index: usize,
        /// Length found.
        length: f64,
    },
    /// A coordinate that is not finite or too large.
    #[error("{what} {index} holds {found}")]
    Number {
        /// `vertex`, `normal`, `curve` or `control point of patch`.
        what: &'static str,
        /// Its id.
        index: usize,
        /// Value found and admissible range.
        found: String,
    },
    /// A given curve of an edge that no Nagata patch has.
    #[error("curve {index} is of the edge {}-{}, which no patch has; allowed: edges of Nagata patches", vertices[0], vertices[1])]
    Curve {
        /// Curve, from 0.
        index: usize,
        /// Its vertices.
        vertices: [u32; 2],
    },
    /// Bezier degrees outside 1 to 6, or a wrong number of control points.
    #[error("patch {patch} is a Bezier patch of degrees {} x {} with {points} control points; allowed: degrees 1 to 6 and (n + 1)(m + 1) points", degrees[0], degrees[1])]
    Net {
        /// Patch, from 0.
        patch: usize,
        /// Degrees found.
        degrees: [usize; 2],
        /// Control points found.
        points: usize,
    },
    /// An inadmissible border gap.
    #[error("border_gap_mm is {found}; allowed: 0 to {limit:.4}, 1 % of the tool's size")]
    Gap {
        /// Gap found [mm].
        found: f64,
        /// Largest admissible gap [mm].
        limit: f64,
    },
}
