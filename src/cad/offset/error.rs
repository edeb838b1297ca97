//! The reasons why a model has no offset.

use std::fmt;

use kanagata_geometry::Vec3;

/// Places listed in a message.
const LISTED_MAX: usize = 5;

/// The reason why a model has no offset. Faces are numbered as in the model.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OffsetError {
    /// A distance that is no length.
    #[error("an offset by {0} mm; allowed: a finite distance other than 0")]
    Distance(f64),
    /// Edges or points where the normal jumps.
    #[error(
        "the offset by {distance} mm is not defined at {} sharp edges, the sharpest {}; allowed: faces whose normals agree within \
         {smooth_deg} degrees; choose faces between the sharp edges, round the edges in the CAD, or allow a larger angle",
        places.len(),
        listed(places)
    )]
    Sharp {
        /// Distance [mm].
        distance: f64,
        /// Largest angle that is not sharp [degrees].
        smooth_deg: f64,
        /// The sharp edges, the sharpest first.
        places: Vec<SharpPlace>,
    },
    /// Faces whose offset folds.
    #[error(
        "the offset by {distance} mm folds on {} faces, where their radius of curvature is smaller: {}; allowed: a distance below the \
         radius; take a smaller distance, or enlarge the radii in the CAD",
        places.len(),
        listed(places)
    )]
    Folds {
        /// Distance [mm].
        distance: f64,
        /// The tightest place of each face, the tightest first.
        places: Vec<FoldPlace>,
    },
    /// Parts of the model that are closer than the offset allows.
    #[error(
        "the offset by {distance} mm intersects itself at {} of the points examined, the deepest {}; allowed: no point closer \
         to another face than the distance; take a smaller distance, or choose faces without the narrow place",
        places.len(),
        listed(places)
    )]
    Overlaps {
        /// Distance [mm].
        distance: f64,
        /// Points of the offset, the deepest first.
        places: Vec<OverlapPlace>,
    },
    /// A face whose offset cannot be made.
    #[error(
        "face {face} ({source_entity}): its offset by {distance} mm cannot be made: {reason}; repair the face in the CAD, or choose other faces"
    )]
    Face {
        /// The face.
        face: usize,
        /// Its entity in the file.
        source_entity: String,
        /// Distance [mm].
        distance: f64,
        /// What is wrong.
        reason: String,
    },
}

impl OffsetError {
    /// The same error with other face numbers.
    #[must_use]
    pub fn renumbered(mut self, number: impl Fn(usize) -> usize) -> Self {
        match &mut self {
            Self::Sharp { places, .. } => {
                places.iter_mut().flat_map(|p| &mut p.faces).for_each(|f| *f = number(*f));
            }
            Self::Folds { places, .. } => places.iter_mut().for_each(|p| p.face = number(p.face)),
            Self::Overlaps { places, .. } => {
                places.iter_mut().flat_map(|p| &mut p.faces).for_each(|f| *f = number(*f));
            }
            Self::Face { face, .. } => *face = number(*face),
            Self::Distance(_) => {}
        }
        self
    }
}

/// A place where the normal jumps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SharpPlace {
    /// The place of the largest angle [mm].
    pub at: Vec3,
    /// Angle between the normals [degrees].
    pub angle_deg: f64,
    /// The faces; twice the same for a crease or an apex inside a face.
    pub faces: [usize; 2],
    /// The offset leaves a gap there; otherwise its sides overlap.
    pub opens: bool,
}

impl fmt::Display for SharpPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b] = self.faces;
        let faces = if a == b { format!("in face {a}") } else { format!("faces {a} and {b}") };
        let sides = if self.opens { "opens" } else { "overlaps" };
        write!(f, "{} ({faces}, {:.1} degrees, {sides})", place(&self.at), self.angle_deg)
    }
}

/// A place where an offset folds.
#[derive(Debug, Clone, PartialEq)]
pub struct FoldPlace {
    /// The face.
    pub face: usize,
    /// Its entity in the file.
    pub source: String,
    /// The place on the face [mm].
    pub at: Vec3,
    /// Radius of curvature there [mm], towards the side of the offset.
    pub radius: f64,
}

impl fmt::Display for FoldPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { face, source, at, radius } = self;
        write!(f, "face {face} ({source}) at {}, radius {radius:.4} mm", place(at))
    }
}

/// A point of an offset that is too close to the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OverlapPlace {
    /// The point of the offset [mm].
    pub at: Vec3,
    /// The face of the point, and the face that is too close.
    pub faces: [usize; 2],
    /// Distance of the point from the model [mm].
    pub distance: f64,
}

impl fmt::Display for OverlapPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b] = self.faces;
        write!(f, "{} (offset of face {a}, {:.4} mm from face {b})", place(&self.at), self.distance)
    }
}

fn place(p: &Vec3) -> String {
    format!("({:.2}, {:.2}, {:.2}) mm", p.x, p.y, p.z)
}

/// The first places of a list.
fn listed<T: fmt::Display>(places: &[T]) -> String {
    let more = if places.len() > LISTED_MAX { ", ..." } else { "" };
    let first: Vec<String> = places.iter().take(LISTED_MAX).map(T::to_string).collect();
    first.join(", ") + more
}
