//! What is wrong with the data of a tool model.

/// Why vertices, normals and corners do not make a tool model.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ToolError {
    /// A patch with fewer than three or more than four corners, or as many normals as corners is not so.
    #[error(
        "patch {patch} has {vertices} vertices and {normals} normals; allowed: 3 or 4 of each, as many normals as vertices"
    )]
    Corners {
        /// Patch, from 0.
        patch: usize,
        /// Vertex ids it lists.
        vertices: usize,
        /// Normal ids it lists.
        normals: usize,
    },
    /// An id past the end of its table.
    #[error("patch {patch} names {what} {id}; allowed: 0 to {last}")]
    Id {
        /// Patch, from 0.
        patch: usize,
        /// `vertex` or `normal`.
        what: &'static str,
        /// Id found.
        id: u32,
        /// Largest allowed.
        last: i64,
    },
    /// A patch that uses one vertex twice next to itself twice over, leaving less than three corners.
    #[error("patch {patch} has fewer than three different vertices")]
    Collapsed {
        /// Patch, from 0.
        patch: usize,
    },
    /// Corners that run the other way round than their normals say, of this patch and most others.
    #[error(
        "corners of patch {patch}, as of {count} of {of} patches, run clockwise seen from where their normals point; allowed: counter-clockwise: turn the order of the corners round, or the normals (out of the tool, to the sheet)"
    )]
    Turned {
        /// Patch, from 0: the first of them.
        patch: usize,
        /// Of so many.
        count: usize,
        /// Patches.
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
        /// The number, and what is allowed.
        found: String,
    },
    /// A given curve of an edge that no Nagata patch has.
    #[error("curve {index} is of the edge {}-{}, which no patch has; allowed: edges of Nagata patches", vertices[0], vertices[1])]
    Curve {
        /// Curve, from 0.
        index: usize,
        /// Vertices it names.
        vertices: [u32; 2],
    },
    /// Bezier degrees outside 1 to 6, or control points that do not fill the net.
    #[error("patch {patch} is a Bezier patch of degrees {} x {} with {points} control points; allowed: degrees 1 to 6 and (n + 1)(m + 1) points", degrees[0], degrees[1])]
    Net {
        /// Patch, from 0.
        patch: usize,
        /// Degrees found.
        degrees: [usize; 2],
        /// Control points found.
        points: usize,
    },
    /// A gap between borders that is none.
    #[error("border_gap_mm is {found}; allowed: 0 to {most:.4}, a hundredth of the tool's size")]
    Gap {
        /// Gap found [mm].
        found: f64,
        /// Largest allowed [mm].
        most: f64,
    },
}
