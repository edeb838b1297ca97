//! Constrained Delaunay triangulation of one face, refined until it approximates the surface.

use std::collections::{BTreeMap, BTreeSet};

use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, PositionInTriangulation, Triangulation};

use super::plane::Plane;
use crate::mapped::demand::divisions;
use crate::mapped::options::MappedOptions;
use crate::mapped::patchwork::Node;
use crate::mapped::sample::angle;
use kanagata_cad::model::Face;
use kanagata_geometry::{Vec2, Vec3};

pub(super) type Delaunay = ConstrainedDelaunayTriangulation<Point2<f64>>;

/// Distance in the plane (of size 1) below which nodes of one vertex coincide.
const COINCIDENCE_TOLERANCE: f64 = 1e-9;

/// Maximum number of bisection rounds.
const BISECTION_ROUNDS_MAX: usize = 24;

/// Bisections of a side in the search for a kink.
const KINK_BISECTIONS: usize = 16;

/// Maximum number of nodes of a face.
pub(super) const NODES_MAX: usize = 400_000;

/// Number of required divisions above which an edge is bisected.
const DIVISIONS_PER_EDGE_MAX: usize = 1;

pub(super) struct Triangulator<'f> {
    pub(super) face: &'f Face,
    pub(super) plane: Plane,
    /// Diagonal of the bounding box of its boundary [mm].
    pub(super) size: f64,
    pub(super) cdt: Delaunay,
    /// Node of each triangulation vertex.
    pub(super) nodes: Vec<Node>,
    pub(super) normals: Vec<Option<Vec3>>,
    /// Nodes at each vertex of the model's boundary: several at a pole or on a seam.
    pub(super) vertices: BTreeMap<u32, Vec<usize>>,
}

impl Triangulator<'_> {
    /// Adds a node; the point location starts at node `from`.
    pub(super) fn add(&mut self, node: Node, from: usize) -> Result<FixedVertexHandle, String> {
        let place = self.known_place(&node).unwrap_or_else(|| self.plane.to_plane(node.uv));
        let hint = FixedVertexHandle::from_index(from);
        let added = self.cdt.insert_with_hint(place, hint);
        let handle = added.map_err(|e| format!("parameters {e}"))?;
        if handle.index() == self.nodes.len() {
            if let Some(id) = node.id {
                self.vertices.entry(id).or_default().push(self.nodes.len());
            }
            self.nodes.push(node);
            self.normals.push(self.face.surface.normal(node.uv));
        }
        Ok(handle)
    }

    /// Position of the same vertex on another loop or side with equal parameters to rounding.
    pub(super) fn known_place(&self, node: &Node) -> Option<Point2<f64>> {
        let place = self.plane.to_plane(node.uv);
        let ids = self.vertices.get(&node.id?)?;
        let places = ids.iter().map(|&n| self.place(n));
        places.into_iter().find(|p| (p.x - place.x).hypot(p.y - place.y) < COINCIDENCE_TOLERANCE)
    }

    pub(super) fn insert_border(
        &mut self,
        loops: &[Vec<Node>],
    ) -> Result<BTreeSet<[usize; 2]>, String> {
        let mut rings = Vec::new();
        for nodes in loops {
            let added = nodes.iter().map(|&n| self.add(n, self.nodes.len().saturating_sub(1)));
            let mut ring = added.collect::<Result<Vec<_>, _>>()?;
            ring.dedup();
            rings.push(ring);
        }
        let mut segments = BTreeSet::new();
        for ring in &rings {
            for k in 0..ring.len() {
                let (a, b) = (ring[k], ring[(k + 1) % ring.len()]);
                if a == b {
                    continue;
                }
                if !self.cdt.can_add_constraint(a, b) {
                    return Err("chords of its border cross".into());
                }
                self.cdt.add_constraint(a, b);
                if !segments.insert([a.index(), b.index()]) {
                    return Err("its border runs twice over the same chord".into());
                }
            }
        }
        Ok(segments)
    }

    /// Triangles inside the boundary: separated from the outside by an odd number of boundary segments.
    pub(super) fn inside(&self) -> Vec<[usize; 3]> {
        let outer = self.cdt.outer_face().fix();
        let mut parity = vec![None; self.cdt.num_all_faces()];
        parity[outer.index()] = Some(false);
        let mut queue: std::collections::VecDeque<_> = self
            .cdt
            .convex_hull()
            .map(|e| (e.rev().face().fix(), e.is_constraint_edge()))
            .collect();
        while let Some((face, odd)) = queue.pop_front() {
            if parity[face.index()].is_some() {
                continue;
            }
            parity[face.index()] = Some(odd);
            if let Some(inner) = self.cdt.face(face).as_inner() {
                for e in inner.adjacent_edges() {
                    queue.push_back((e.rev().face().fix(), odd ^ e.is_constraint_edge()));
                }
            }
        }
        let faces = self.cdt.inner_faces();
        faces
            .filter(|f| parity[f.fix().index()] == Some(true))
            .map(|f| f.vertices().map(|v| v.fix().index()))
            .collect()
    }

    /// Checks that every boundary segment is a side of exactly one interior triangle, in the direction of the loop.
    pub(super) fn check_border(
        &self,
        inside: &[[usize; 3]],
        segments: &BTreeSet<[usize; 2]>,
    ) -> Result<(), String> {
        let mut sides = BTreeSet::new();
        for t in inside {
            (0..3).for_each(|k| {
                sides.insert([t[k], t[(k + 1) % 3]]);
            });
        }
        let unmatched = sides.iter().filter(|[a, b]| !sides.contains(&[*b, *a])).count();
        let met = segments.iter().filter(|s| sides.contains(*s)).count();
        if met == segments.len() && unmatched == segments.len() {
            Ok(())
        } else {
            Err(format!("the chords of its border touch ({met} of {} are sides)", segments.len()))
        }
    }

    /// Bisects interior edges along which the surface requires more than one division, until there are more than
    /// `limit` nodes.
    pub(super) fn refine(&mut self, options: &MappedOptions, limit: usize) -> Result<(), String> {
        for _ in 0..BISECTION_ROUNDS_MAX {
            let mut wanted: Vec<(f64, Point2<f64>, usize)> = Vec::new();
            let mut seen = BTreeSet::new();
            for t in self.inside() {
                let (length, a, b, apex) = self.longest_side_to_bisect(&t, options);
                if length > 0.0 && seen.insert([a.min(b), a.max(b)]) {
                    let (pa, pb) = (self.place(a), self.place(b));
                    let mid = Point2::new(0.5 * (pa.x + pb.x), 0.5 * (pa.y + pb.y));
                    let span = (pa.x - pb.x).hypot(pa.y - pb.y);
                    let c = self.place(apex);
                    if (c.x - mid.x).hypot(c.y - mid.y) > 0.2 * span {
                        wanted.push((length, mid, a));
                    }
                }
            }
            if wanted.is_empty() || self.nodes.len() > limit {
                break;
            }
            wanted.sort_by(|a, b| b.0.total_cmp(&a.0));
            for (length, mid, near) in wanted {
                self.insert_inside(mid, length, near)?;
            }
        }
        Ok(())
    }

    pub(super) fn place(&self, n: usize) -> Point2<f64> {
        self.plane.to_plane(self.nodes[n].uv)
    }

    /// Longest interior side of a triangle that requires division: its length in space (0: none), ends, apex.
    pub(super) fn longest_side_to_bisect(
        &self,
        t: &[usize; 3],
        options: &MappedOptions,
    ) -> (f64, usize, usize, usize) {
        let mut best = (0.0, 0, 0, 0);
        for k in 0..3 {
            let (a, b, apex) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
            let handle = |n: usize| FixedVertexHandle::from_index(n);
            let on_border = self
                .cdt
                .get_edge_from_neighbors(handle(a), handle(b))
                .is_none_or(|e| e.is_constraint_edge());
            if on_border {
                continue;
            }
            let uv = (self.nodes[a].uv + self.nodes[b].uv) * 0.5;
            let (middle, normal) = (self.face.surface.point(uv), self.face.surface.normal(uv));
            let length =
                (middle - self.nodes[a].point).norm() + (self.nodes[b].point - middle).norm();
            let turn = |n: Option<Vec3>| n.zip(normal).map_or(0.0, |(a, b)| angle(&a, &b));
            let turn = turn(self.normals[a]) + turn(self.normals[b]);
            // A diagonal may turn by 1.5 times the angle of a side.
            let too_long = divisions(options, turn / 1.5, length / 1.5) > DIVISIONS_PER_EDGE_MAX;
            if length > best.0 && too_long && !self.is_kink([a, b], length, options) {
                best = (length, a, b, apex);
            }
        }
        best
    }

    /// True when the turning angle of a side is concentrated in one point, so that bisection cannot reduce it: an
    /// internal crease of the surface, or a surface that folds back. Sides across it are as short as elements of such
    /// divisions on an arc of the face's size.
    pub(super) fn is_kink(&self, [a, b]: [usize; 2], length: f64, options: &MappedOptions) -> bool {
        if length * 4.0 * options.arc_divisions as f64 > self.size {
            return false;
        }
        let mut ends = [a, b].map(|n| (self.nodes[n].uv, self.normals[n]));
        let turn = |ends: &[(Vec2, Option<Vec3>); 2]| {
            ends[0].1.zip(ends[1].1).map_or(0.0, |(a, b)| angle(&a, &b))
        };
        let mut limit = 0.0f64;
        for _ in 0..KINK_BISECTIONS {
            let uv = (ends[0].0 + ends[1].0) * 0.5;
            let middle = (uv, self.face.surface.normal(uv));
            let halves = [[ends[0], middle], [middle, ends[1]]];
            ends = halves[usize::from(turn(&halves[1]) > turn(&halves[0]))];
            limit = limit.max(turn(&ends));
        }
        turn(&ends) > 0.1 * limit
    }

    /// Adds a point (point location from node `from`), unless it lies on the boundary or within 0.3 of `length` of an
    /// existing node.
    pub(super) fn insert_inside(
        &mut self,
        p: Point2<f64>,
        length: f64,
        from: usize,
    ) -> Result<(), String> {
        let hint = FixedVertexHandle::from_index(from);
        let edge_or_face: Vec<usize> = match self.cdt.locate_with_hint(p, hint) {
            PositionInTriangulation::OnFace(f) => {
                self.cdt.face(f).vertices().iter().map(|v| v.fix().index()).collect()
            }
            PositionInTriangulation::OnEdge(e) => {
                let edge = self.cdt.directed_edge(e);
                if edge.is_constraint_edge() {
                    return Ok(());
                }
                edge.vertices().iter().map(|v| v.fix().index()).collect()
            }
            _ => return Ok(()),
        };
        let node = Node::inside(self.face, self.plane.to_uv(p));
        let near =
            edge_or_face.iter().any(|&n| (self.nodes[n].point - node.point).norm() < 0.3 * length);
        if !near {
            self.add(node, edge_or_face[0])?;
        }
        Ok(())
    }

    /// Laplacian smoothing of the nodes from `first` on, while no adjacent triangle becomes thinner.
    pub(super) fn smooth(&mut self, first: usize) {
        if self.nodes.len() == first {
            return;
        }
        let triangles = self.inside();
        let mut around: Vec<Vec<[usize; 3]>> = vec![Vec::new(); self.nodes.len()];
        for t in &triangles {
            t.iter().for_each(|&n| around[n].push(*t));
        }
        let mut place: Vec<Vec2> =
            (0..self.nodes.len()).map(|n| Vec2::new(self.place(n).x, self.place(n).y)).collect();
        for _ in 0..3 {
            for n in first..place.len() {
                let star = &around[n];
                let others = star.iter().flatten().filter(|&&m| m != n);
                let count = 2 * star.len();
                if count == 0 {
                    continue;
                }
                let (old, before) = (place[n], min_shape_ratio(star, &place));
                place[n] = others.map(|&m| place[m]).sum::<Vec2>() / count as f64;
                if min_shape_ratio(star, &place) <= before {
                    place[n] = old;
                }
            }
        }
        for (node, p) in self.nodes.iter_mut().zip(&place).skip(first) {
            *node = Node::inside(self.face, self.plane.to_uv(Point2::new(p.x, p.y)));
        }
    }
}

/// Smallest ratio of twice the area to the square of the longest side; negative when a triangle is inverted.
fn min_shape_ratio(triangles: &[[usize; 3]], place: &[Vec2]) -> f64 {
    let ratio = |t: &[usize; 3]| {
        let [a, b, c] = t.map(|n| place[n]);
        let (u, v, w) = (b - a, c - a, c - b);
        (u.x * v.y - u.y * v.x) / u.norm_squared().max(v.norm_squared()).max(w.norm_squared())
    };
    triangles.iter().map(ratio).fold(f64::INFINITY, f64::min)
}
