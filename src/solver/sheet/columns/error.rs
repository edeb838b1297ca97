//! Errors in the connectivity of a sheet.

/// Elements that do not form a sheet. Elements and nodes are numbered from 0.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SheetError {
    /// A face or side with more than two elements.
    #[error(
        "found element {element} on a face or side with two others; allowed: at most two elements on each"
    )]
    Branches {
        /// The third element.
        element: usize,
    },
    /// Elements that are not connected by faces or sides.
    #[error(
        "found {parts} parts, element {element} begins the second; allowed: one sheet, its elements joined by whole faces or sides"
    )]
    Parts {
        /// Number of parts.
        parts: usize,
        /// An element of the second part.
        element: usize,
    },
    /// There is no consistent thickness direction.
    #[error(
        "found no direction that runs through all elements in layers; allowed: hexahedra swept through the thickness of a sheet"
    )]
    NoDirection,
    /// Columns with different numbers of nodes.
    #[error(
        "found {found} nodes through the thickness at ({x}, {y}, {z}) mm and {others} elsewhere; allowed: the same number everywhere"
    )]
    Levels {
        /// Nodes in this column.
        found: usize,
        /// Nodes in the first one.
        others: usize,
        /// Its lowest node [mm].
        x: f64,
        /// Its lowest node [mm].
        y: f64,
        /// Its lowest node [mm].
        z: f64,
    },
    /// Elements that cannot be oriented consistently.
    #[error(
        "found element {element} turned both ways by its neighbours (a band with one side); allowed: a sheet with two sides"
    )]
    OneSided {
        /// The element.
        element: usize,
    },
    /// An element that uses a node twice.
    #[error(
        "found element {element} with one node at two corners; allowed: eight nodes, or four, all different"
    )]
    Degenerate {
        /// The element.
        element: usize,
    },
}
