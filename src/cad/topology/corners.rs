//! Corner points, unique for all sides that end there.

use rustc_hash::{FxHashMap, FxHashSet};

use super::piece::{Piece, SHARED_EDGE_TOLERANCE_REL};
use kanagata_geometry::Vec3;

/// Cell width in tolerances. Corners are rarely this close to each other, and the search range of a corner rarely
/// covers a second cell.
const CELL_WIDTH_TOLERANCES: f64 = 16.0;
/// Distance relative to the tolerance below which two registered positions coincide.
const COINCIDENCE_TOLERANCE_REL: f64 = 1e-3;

/// Unique corner points, found with a grid of cells.
pub(super) struct Corners {
    pub points: Vec<Vec3>,
    /// Positions and the corners they represent. A corner has several where sides of a file's edge end at different
    /// positions.
    cells: FxHashMap<[i64; 3], Vec<(Vec3, usize)>>,
    /// Union-find parents of corners; the root with the smallest index represents the corner.
    parents: Vec<usize>,
    tolerance: f64,
}

impl Corners {
    pub fn new(tolerance: f64) -> Self {
        Self { points: Vec::new(), cells: FxHashMap::default(), parents: Vec::new(), tolerance }
    }

    /// Corners at the ends of sides with the end points `tips`, and the file's edges used by more than one side.
    pub fn of_sides(
        pieces: &[Piece],
        tips: &[[Vec3; 2]],
        tolerance: f64,
    ) -> (Self, FxHashSet<usize>) {
        let mut corners = Self::new(tolerance);
        let mut first: FxHashMap<usize, [Vec3; 2]> = FxHashMap::default();
        let mut shared = FxHashSet::default();
        for (piece, own) in pieces.iter().zip(tips) {
            if let Some((id, known)) = piece.edge_id.and_then(|id| Some((id, first.get(&id)?))) {
                shared.insert(id);
                corners.merge_ends(*own, *known);
            } else {
                for p in own {
                    corners.id(p);
                }
                if let Some(id) = piece.edge_id {
                    first.insert(id, *own);
                }
            }
            if let Some(curve) = &piece.curve {
                let [a, b] = curve.domain();
                corners.register_ends(*own, [curve.point(a), curve.point(b)]);
            }
        }
        (corners, shared)
    }

    fn cell(&self, p: &Vec3) -> [i64; 3] {
        let size = CELL_WIDTH_TOLERANCES * self.tolerance.max(f64::MIN_POSITIVE);
        // Coordinates beyond the range of the grid share cells.
        [0, 1, 2].map(|k| (p[k] / size).floor().clamp(-1e15, 1e15) as i64)
    }

    /// Index of the corner within the tolerance of `p`, created if necessary.
    pub fn id(&mut self, p: &Vec3) -> usize {
        if let Some(id) = self.find(p) {
            return id;
        }
        self.points.push(*p);
        self.parents.push(self.parents.len());
        self.cells.entry(self.cell(p)).or_default().push((*p, self.points.len() - 1));
        self.points.len() - 1
    }

    /// Merges the ends of a side with the corners at the ends of another side of the same edge, in either direction.
    pub fn merge_ends(&mut self, own: [Vec3; 2], first: [Vec3; 2]) {
        let apart = |k: usize| (own[0] - first[k]).norm() + (own[1] - first[1 - k]).norm();
        let swap = usize::from(apart(1) < apart(0));
        let near =
            (SHARED_EDGE_TOLERANCE_REL * (first[1] - first[0]).norm()).max(10.0 * self.tolerance);
        for (k, p) in own.iter().enumerate() {
            let there = first[(k + swap) % 2];
            let id = self.id(&there);
            match self.find(p) {
                None => self.cells.entry(self.cell(p)).or_default().push((*p, id)),
                Some(other) if (p - there).norm() <= near => {
                    self.parents[id.max(other)] = id.min(other);
                }
                Some(_) => {}
            }
        }
    }

    /// Registers the ends of a side's space curve as positions of its corners, if within the tolerance. Two sides whose
    /// space curves meet are then joined, although their surfaces deviate from the curves.
    pub fn register_ends(&mut self, own: [Vec3; 2], curve: [Vec3; 2]) {
        for (p, q) in own.iter().zip(&curve) {
            if (p - q).norm() > self.tolerance {
                continue;
            }
            let id = self.id(p);
            // The nearest corner is usually the side's own; the other one at the end of the curve has to be merged.
            if let Some((_, other)) = self.nearest(q, Some(id)) {
                self.parents[id.max(other)] = id.min(other);
            }
            // Always register the position: the space curve of the next side may end there, with its surface a
            // tolerance away on the other side.
            if self
                .nearest(q, None)
                .is_none_or(|n| n.0 > COINCIDENCE_TOLERANCE_REL * self.tolerance)
            {
                let id = self.root(id);
                self.cells.entry(self.cell(q)).or_default().push((*q, id));
            }
        }
    }

    /// Representative of a corner.
    pub fn root(&self, mut id: usize) -> usize {
        while self.parents[id] != id {
            id = self.parents[id];
        }
        id
    }

    /// The corner closest to `p` within the tolerance.
    pub fn find(&self, p: &Vec3) -> Option<usize> {
        self.nearest(p, None).map(|n| n.1)
    }

    /// Distance and index of the corner closest to `p` within the tolerance, optionally excluding one.
    fn nearest(&self, p: &Vec3, but: Option<usize>) -> Option<(f64, usize)> {
        let reach = Vec3::repeat(self.tolerance);
        let (low, high) = (self.cell(&(p - reach)), self.cell(&(p + reach)));
        let mut best: Option<(f64, usize)> = None;
        for (x, y) in (low[0]..=high[0]).flat_map(|x| (low[1]..=high[1]).map(move |y| (x, y))) {
            for z in low[2]..=high[2] {
                for &(place, id) in self.cells.get(&[x, y, z]).into_iter().flatten() {
                    let d = (place - p).norm();
                    let nearer = d <= self.tolerance && best.is_none_or(|b| d < b.0);
                    if nearer && (but.is_none() || but != Some(self.root(id))) {
                        best = Some((d, id));
                    }
                }
            }
        }
        best.map(|(d, id)| (d, self.root(id)))
    }
}
