//! Points of an offset that are closer to the model than the distance: there the offset intersects itself.
//!
//! A ball of radius `r` that touches the model at `p` on the side of the offset is empty if its centre is at the
//! distance `r` from the whole model. For a cell of the size `h` the ball at its middle has the radius
//! `|d| + 2 h + h^2 / (4 |d|)`. If it is empty, the balls of radius `|d|` of the cell are taken to be empty: they lie within
//! it, but for a lens above the surface that is at most `|d| / 2` high at the border of the cell. Other cells are divided
//! down to `|d| / 4`, where the balls of radius `|d|` themselves are examined. Overlaps smaller than that, and parts as
//! flat as the lens, are not found; folds ([`super::curvature`]) are.

use rayon::prelude::*;

use super::cell::{Cell, cells_of};
use super::error::OverlapPlace;
use crate::Model;
use crate::closest::{ClosestPoint, WorkLimitReached};
use crate::model::Face;
use crate::trim_region::TrimRegion;
use kanagata_geometry::{Aabb, Vec2, Vec3};
use kanagata_progress::Progress;

/// Size of a cell over the distance below which it is not divided.
const SMALLEST_REL: f64 = 0.25;
/// Radius of the ball that clears a cell, above the distance, over the size of the cell.
const RADIUS_PER_SIZE: f64 = 2.0;
/// Height of what may lie between that ball and the cell, over the distance.
const LENS_REL: f64 = 0.5;
/// Angle between normals of a cell above which it is divided [rad].
const TURN_MAX: f64 = 0.5;
/// Depth over the distance to which a neighbouring face that is tilted within the smooth angle may enter a ball.
const TILT_MAX_REL: f64 = 0.1;
/// Searches for closest points, shared by the faces in proportion to the squares of their sizes, in addition to
/// [`SEARCHES_PER_FACE`] for each; a search takes about 15 us.
const SEARCHES: f64 = 1e6;
const SEARCHES_PER_FACE: usize = 10_000;
/// Points of a face that are too close, after which its examination ends.
const PLACES_PER_FACE_MAX: usize = 100;
/// Bisections of a knot span at most, in both directions together.
const DEPTH_MAX: u32 = 28;
/// Accuracy of closest points relative to the size of the model.
const ACCURACY_REL: f64 = 1e-8;

/// What the examination found.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Overlaps {
    /// Points that are too close, the deepest first.
    pub places: Vec<OverlapPlace>,
    /// False when a face reached its limit of searches.
    pub complete: bool,
}

/// The examination of one model.
struct Examination<'m> {
    search: &'m ClosestPoint<'m>,
    distance: f64,
    /// Angle between normals of neighbouring faces up to which they count as smooth [rad].
    smooth: f64,
    /// Accuracy of distances [mm].
    accuracy: f64,
}

/// Points of the offset of a model by `distance` [mm] that are too close to it. Neighbouring faces whose normals differ
/// by `smooth` [rad] enter a ball of radius r by `r (1 - cos smooth)`, which is permitted up to a tenth of the distance.
pub(super) fn overlaps(
    search: &ClosestPoint<'_>,
    distance: f64,
    smooth: f64,
    progress: &Progress,
) -> Overlaps {
    let model = search.model();
    let accuracy = model.join_tolerance.max(ACCURACY_REL * model.bbox().diagonal());
    let examination = Examination { search, distance, smooth, accuracy };
    let weights: Vec<f64> = model
        .faces
        .par_iter()
        .map(|f| Aabb::of_points(f.surface.points()).diagonal().powi(2))
        .collect();
    let all: f64 = weights.iter().sum();
    let allowed = |f: usize| SEARCHES_PER_FACE + (SEARCHES * weights[f] / all) as usize;
    let stage = progress.stage("offset, self-intersections", "faces", model.faces.len() as u64);
    let examined = |f: usize| {
        let found = examination.face(f, allowed(f));
        stage.add(1);
        found
    };
    let found: Vec<(Vec<OverlapPlace>, bool)> =
        (0..model.faces.len()).into_par_iter().map(examined).collect();
    let complete = found.iter().all(|f| f.1);
    let mut places: Vec<OverlapPlace> = found.into_iter().flat_map(|f| f.0).collect();
    // Equal distances keep the order of faces.
    places.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    Overlaps { places, complete }
}

/// What a ball says of its cell.
enum Judged {
    /// The offset of the cell does not intersect itself.
    Clear,
    /// Smaller cells are to be examined.
    Unknown,
    /// The search for the closest point of a cell that is not divided reached its work limit.
    Unanswered,
    /// The point `at` of the offset is too close to the face `other`.
    Close { at: Vec3, other: usize, distance: f64 },
}

impl Examination<'_> {
    fn model(&self) -> &Model {
        self.search.model()
    }

    /// Points of a face that are too close, and whether `left` searches sufficed.
    fn face(&self, f: usize, mut left: usize) -> (Vec<OverlapPlace>, bool) {
        let face = &self.model().faces[f];
        let region = TrimRegion::new(face);
        let (mut found, mut complete) = (Vec::new(), true);
        let mut stack = cells_of(face, &region);
        while let Some(cell) = stack.pop() {
            if !cell.is_in(&region) {
                continue;
            }
            if left == 0 || found.len() == PLACES_PER_FACE_MAX {
                return (found, left > 0);
            }
            left -= 1;
            match self.cell(face, &region, &cell) {
                Judged::Clear => {}
                Judged::Unanswered => complete = false,
                Judged::Unknown => stack.extend(cell.parts(lengths(face, &cell))),
                Judged::Close { at, other, distance } => {
                    found.push(OverlapPlace { at, faces: [f, other], distance });
                }
            }
        }
        (found, complete)
    }

    /// Judges a cell by a ball at its middle.
    fn cell(&self, face: &Face, region: &TrimRegion, cell: &Cell) -> Judged {
        let (size, turn) = extent(face, cell);
        let distance = self.distance.abs();
        let is_last = size <= SMALLEST_REL * distance || cell.depth >= DEPTH_MAX;
        let undecided = if is_last { Judged::Clear } else { Judged::Unknown };
        let middle = cell.middle();
        let normal = region.contains(middle).then(|| face.normal(middle)).flatten();
        let Some(n) = normal.filter(|_| is_last || turn <= TURN_MAX) else { return undecided };
        let p = face.surface.point(middle);
        if !is_last {
            let sagitta_radius = size * size / (8.0 * LENS_REL * distance);
            let radius = distance + RADIUS_PER_SIZE * size + sagitta_radius;
            return match self.intruder(&p, &n, radius) {
                Ok(None) => Judged::Clear,
                _ => Judged::Unknown,
            };
        }
        match self.intruder(&p, &n, distance) {
            Ok(Some((other, distance))) => {
                Judged::Close { at: p + n * self.distance, other, distance }
            }
            Ok(None) => Judged::Clear,
            Err(WorkLimitReached) => Judged::Unanswered,
        }
    }

    /// The face within the ball of radius `r` that touches the model at `p`, and the distance of the centre from it;
    /// `None` when the ball is empty.
    fn intruder(
        &self,
        p: &Vec3,
        n: &Vec3,
        r: f64,
    ) -> Result<Option<(usize, f64)>, WorkLimitReached> {
        let tilted = r * (1.0 - self.smooth.cos());
        let permitted = self.accuracy + tilted.min(TILT_MAX_REL * self.distance.abs());
        let centre = p + n * (r * self.distance.signum());
        let foot = self.search.closest_within(&centre, r - permitted, None)?;
        Ok(foot.map(|foot| (foot.face, foot.distance)))
    }
}

/// Lengths of the lines through the middle of a cell along u and v [mm].
fn lengths(face: &Face, cell: &Cell) -> [f64; 2] {
    let middle = cell.middle();
    let centre = face.surface.point(middle);
    [0, 1].map(|k| {
        let end = |to: Vec2| {
            let mut uv = middle;
            uv[k] = to[k];
            (face.surface.point(uv) - centre).norm()
        };
        end(cell.low) + end(cell.high)
    })
}

/// Size of a cell [mm] and the largest angle between its normals and that in its middle [rad].
fn extent(face: &Face, cell: &Cell) -> (f64, f64) {
    let middle = cell.middle();
    let (centre, n) = (face.surface.point(middle), face.normal(middle));
    let (mut size, mut turn) = (0.0_f64, 0.0_f64);
    for uv in cell.points() {
        size = size.max(2.0 * (face.surface.point(uv) - centre).norm());
        if let (Some(n), Some(m)) = (n, face.normal(uv)) {
            turn = turn.max(n.cross(&m).norm().atan2(n.dot(&m)));
        }
    }
    (size, turn)
}

/// Smallest and largest distance of points of an offset model from the original [mm], at points of every face.
pub(super) fn distances(
    search: &ClosestPoint<'_>,
    offset: &Model,
    progress: &Progress,
) -> [f64; 2] {
    const STEPS: usize = 6;
    let stage = progress.stage("offset, distances", "faces", offset.faces.len() as u64);
    let of_face = |face: &Face| {
        stage.add(1);
        let region = TrimRegion::new(face);
        let size = region.high - region.low;
        let at = |i: usize, j: usize| {
            let step = |k: usize| (k as f64 + 0.5) / STEPS as f64;
            region.low + Vec2::new(size.x * step(i), size.y * step(j))
        };
        let all = (0..STEPS).flat_map(|i| (0..STEPS).map(move |j| (i, j)));
        let inside = all.map(|(i, j)| at(i, j)).filter(|uv| region.contains(*uv));
        let distance = |uv: Vec2| Some(search.closest(&face.surface.point(uv))?.distance);
        inside
            .filter_map(distance)
            .fold([f64::INFINITY, 0.0_f64], |r, d| [r[0].min(d), r[1].max(d)])
    };
    let each: Vec<[f64; 2]> = offset.faces.par_iter().map(of_face).collect();
    each.into_iter().fold([f64::INFINITY, 0.0], |r, d| [r[0].min(d[0]), r[1].max(d[1])])
}
