//! Corners of triangles inverted along a curved boundary: corrected by an interior node.

use spade::handles::FixedVertexHandle;
use spade::{Point2, PositionInTriangulation, Triangulation};

use super::triangulator::Triangulator;
use crate::mapped::edge_tangents::{EdgeTangents, INVERTED_CORNER_SINE};
use kanagata_geometry::Vec2;

/// Maximum number of correction rounds.
const CORRECTION_ROUNDS_MAX: usize = 3;

/// Location for an interior node near the boundary, in the plane.
struct InsertionSite {
    /// A node there.
    node: usize,
    /// A point on the boundary.
    middle: Vec2,
    /// Inward vector with the length of the adjacent sides.
    reach: Vec2,
    /// Length of these sides in space [mm].
    length: f64,
}

impl Triangulator<'_> {
    /// Adds an interior node at every corner of a triangle that is inverted along a curved boundary: next to the node
    /// where both sides are on the boundary, next to the curved side where the other side cuts through it.
    pub(super) fn correct_inverted_corners(
        &mut self,
        edge_tangents: &EdgeTangents,
    ) -> Result<(), String> {
        if edge_tangents.is_empty() {
            return Ok(());
        }
        for _ in 0..CORRECTION_ROUNDS_MAX {
            let inside = self.inside();
            let places: Vec<InsertionSite> = inside
                .iter()
                .flat_map(|t| (0..3).map(|k| [t[(k + 2) % 3], t[k], t[(k + 1) % 3]]))
                .filter_map(|corner| self.insertion_site(corner, edge_tangents))
                .collect();
            let before = self.nodes.len();
            for place in places {
                self.insert_at(&place)?;
            }
            if self.nodes.len() == before {
                break;
            }
        }
        Ok(())
    }

    /// Location of a node for a corner of a triangle, if it needs one.
    fn insertion_site(
        &self,
        corner: [usize; 3],
        edge_tangents: &EdgeTangents,
    ) -> Option<InsertionSite> {
        let [before, at, after] = corner;
        let sine = edge_tangents.corner(corner.map(|n| &self.nodes[n]), &self.normals[at]?)?;
        if sine > INVERTED_CORNER_SINE {
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
            InsertionSite { node: from, middle, reach: inwards * side, length }
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

    /// Adds a node there, as far inside as possible.
    fn insert_at(&mut self, site: &InsertionSite) -> Result<(), String> {
        let mut fraction = 0.7;
        for _ in 0..4 {
            let p = site.middle + site.reach * fraction;
            let (p, count) = (Point2::new(p.x, p.y), self.nodes.len());
            if self.is_inside(p) {
                self.insert_inside(p, fraction * site.length, site.node)?;
            }
            if self.nodes.len() > count {
                break;
            }
            fraction *= 0.5;
        }
        Ok(())
    }

    /// True for a point in a triangle between the loops.
    fn is_inside(&self, p: Point2<f64>) -> bool {
        let PositionInTriangulation::OnFace(face) = self.cdt.locate(p) else { return false };
        let corners = self.cdt.face(face).vertices().map(|v| v.fix().index());
        self.inside().contains(&corners)
    }
}
