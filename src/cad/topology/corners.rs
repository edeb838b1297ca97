//! Corner points, each once, however many sides end there.

use rustc_hash::{FxHashMap, FxHashSet};

use super::piece::{OWN_EDGE, Piece};
use crate::geometry::Vec3;

/// Width of a cell in tolerances: corners are rarely this near to each other, and a corner's surroundings rarely reach
/// into a second cell.
const CELL: f64 = 16.0;
/// Places nearer to each other than this share of the tolerance are one.
const SAME_PLACE: f64 = 1e-3;

/// Corner points, each once, found by a grid of cells.
pub(super) struct Corners {
    pub points: Vec<Vec3>,
    /// Places and the corners they stand for: a corner has several where a file's edge ends twice.
    cells: FxHashMap<[i64; 3], Vec<(Vec3, usize)>>,
    /// The corner that each stands for, or a nearer one to it: the smallest number is the corner itself.
    parents: Vec<usize>,
    tolerance: f64,
}

impl Corners {
    pub fn new(tolerance: f64) -> Self {
        Self { points: Vec::new(), cells: FxHashMap::default(), parents: Vec::new(), tolerance }
    }

    /// Corners where sides end, each with its `tips`, and the file's edges that more than one side uses.
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
                corners.same(*own, *known);
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
                corners.also(*own, [curve.point(a), curve.point(b)]);
            }
        }
        (corners, shared)
    }

    fn cell(&self, p: &Vec3) -> [i64; 3] {
        let size = CELL * self.tolerance.max(f64::MIN_POSITIVE);
        // Coordinates beyond all measure share cells.
        [0, 1, 2].map(|k| (p[k] / size).floor().clamp(-1e15, 1e15) as i64)
    }

    /// The corner within the tolerance of `p`, or a new one.
    pub fn id(&mut self, p: &Vec3) -> usize {
        if let Some(id) = self.find(p) {
            return id;
        }
        self.points.push(*p);
        self.parents.push(self.parents.len());
        self.cells.entry(self.cell(p)).or_default().push((*p, self.points.len() - 1));
        self.points.len() - 1
    }

    /// The ends of one side of an edge stand for the corners at the ends of another, whichever way it runs.
    pub fn same(&mut self, own: [Vec3; 2], first: [Vec3; 2]) {
        let apart = |k: usize| (own[0] - first[k]).norm() + (own[1] - first[1 - k]).norm();
        let swap = usize::from(apart(1) < apart(0));
        let near = (OWN_EDGE * (first[1] - first[0]).norm()).max(10.0 * self.tolerance);
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

    /// The ends of a side's curve in space stand for its corners, as far as they are within the tolerance of them: two
    /// sides whose curves meet meet, though their surfaces lie off the curves.
    pub fn also(&mut self, own: [Vec3; 2], curve: [Vec3; 2]) {
        for (p, q) in own.iter().zip(&curve) {
            if (p - q).norm() > self.tolerance {
                continue;
            }
            let id = self.id(p);
            // Nearest is mostly the side's own corner; which other one the curve's end meets is what counts.
            if let Some((_, other)) = self.nearest(q, Some(id)) {
                self.parents[id.max(other)] = id.min(other);
            }
            // A place of its own, however near the corner: the next side's curve may end there, its surface a tolerance
            // off to the other side.
            if self.nearest(q, None).is_none_or(|n| n.0 > SAME_PLACE * self.tolerance) {
                let id = self.root(id);
                self.cells.entry(self.cell(q)).or_default().push((*q, id));
            }
        }
    }

    /// The corner that a corner stands for.
    pub fn root(&self, mut id: usize) -> usize {
        while self.parents[id] != id {
            id = self.parents[id];
        }
        id
    }

    /// The nearest corner within the tolerance of `p`.
    pub fn find(&self, p: &Vec3) -> Option<usize> {
        self.nearest(p, None).map(|n| n.1)
    }

    /// Distance and number of the nearest corner within the tolerance of `p`, of all or of all but one.
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
