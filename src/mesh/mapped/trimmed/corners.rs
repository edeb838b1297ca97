//! Corners of triangles that are turned over along a bent border: opened by a node inside.

use spade::handles::FixedVertexHandle;
use spade::{Point2, PositionInTriangulation, Triangulation};

use super::triangulator::Triangulator;
use crate::geometry::Vec2;
use crate::mesh::mapped::bends::{Bends, TURNED};

/// Rounds of opening corners.
const CORNER_ROUNDS: usize = 3;

/// Room for a node beside the border, in the plane.
struct Beside {
    /// A node there.
    node: usize,
    /// A place on the border.
    middle: Vec2,
    /// From there inwards, as long as the sides there.
    reach: Vec2,
    /// Their length in space.
    length: f64,
}

impl Triangulator<'_> {
    /// Adds a node inside beside every corner of a triangle that is turned over along a bent border: beside
    /// the node where both sides are on the border, beside the bent side where the other side cuts through it.
    pub(super) fn open_corners(&mut self, bends: &Bends) -> Result<(), String> {
        if bends.is_empty() {
            return Ok(());
        }
        for _ in 0..CORNER_ROUNDS {
            let inside = self.inside();
            let places: Vec<Beside> = inside
                .iter()
                .flat_map(|t| (0..3).map(|k| [t[(k + 2) % 3], t[k], t[(k + 1) % 3]]))
                .filter_map(|corner| self.room_beside(corner, bends))
                .collect();
            let before = self.nodes.len();
            for place in places {
                self.open(&place)?;
            }
            if self.nodes.len() == before {
                break;
            }
        }
        Ok(())
    }

    /// Where to add a node for a corner of a triangle, if it needs one.
    fn room_beside(&self, corner: [usize; 3], bends: &Bends) -> Option<Beside> {
        let [before, at, after] = corner;
        let sine = bends.corner(corner.map(|n| &self.nodes[n]), &self.normals[at]?)?;
        if sine > TURNED {
            return None;
        }
        let handle = |n: usize| FixedVertexHandle::from_index(n);
        let on_border = |a: usize, b: usize| {
            let edge = self.cdt.get_edge_from_neighbors(handle(a), handle(b));
            edge.is_some_and(|e| e.is_constraint_edge())
        };
        let place = |n: usize| Vec2::new(self.place(n).x, self.place(n).y);
        let point = |n: usize| self.nodes[n].point;
        let long =
            |a: usize, b: usize| ((place(b) - place(a)).norm(), (point(b) - point(a)).norm());
        let of = |from: usize, to: usize, middle: Vec2, (side, length): (f64, f64)| {
            let along = place(to) - place(from);
            let inwards = Vec2::new(-along.y, along.x) / along.norm();
            Beside { node: from, middle, reach: inwards * side, length }
        };
        Some(match (on_border(before, at), on_border(at, after)) {
            (true, true) => {
                let (a, b) = (long(before, at), long(at, after));
                of(before, after, place(at), (a.0.min(b.0), a.1.min(b.1)))
            }
            (true, false) => of(before, at, (place(before) + place(at)) * 0.5, long(before, at)),
            _ => of(at, after, (place(at) + place(after)) * 0.5, long(at, after)),
        })
    }

    /// Adds a node there, as far inside as there is room for.
    fn open(&mut self, beside: &Beside) -> Result<(), String> {
        let mut share = 0.7;
        for _ in 0..4 {
            let p = beside.middle + beside.reach * share;
            let (p, count) = (Point2::new(p.x, p.y), self.nodes.len());
            if self.is_inside(p) {
                self.insert_inside(p, share * beside.length, beside.node)?;
            }
            if self.nodes.len() > count {
                break;
            }
            share *= 0.5;
        }
        Ok(())
    }

    /// Whether a place is in a triangle between the loops.
    fn is_inside(&self, p: Point2<f64>) -> bool {
        let PositionInTriangulation::OnFace(face) = self.cdt.locate(p) else { return false };
        let corners = self.cdt.face(face).vertices().map(|v| v.fix().index());
        self.inside().contains(&corners)
    }
}
