//! Penetration of tools into the faces of the sheet.
//!
//! Contact conditions hold nodes. Between them the face of an element, a bilinear surface, may lie in a tool: a face of width w
//! bridges a convex radius R with a sag of about w²/(8 R), and a feature that is narrower than w may pass between nodes
//! altogether. After each increment the depth is measured from both sides:
//!
//! - from the sheet: signed distance of the middles of faces and of their sides to every tool;
//! - from the tool: distance of its convex features (`features`) behind the nearest face (`faces`).
//!
//! The largest of all is reported. It tells of the resolution of the mesh, not of the iteration: nodes obey their conditions.

mod faces;
mod features;
pub mod inside;

use std::time::Instant;

use rayon::prelude::*;

use crate::geometry::Vec3;
use crate::solver::sheet::hex_mesh::HexMesh;
use crate::solver::system::system::{Role, System};
use crate::solver::tools::tool::{SheetSide, Tool};
use faces::{Face, Faces, faces_of};
pub(super) use features::Features;

/// The deepest point of a tool inside a face of the sheet, or of a face inside a tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FacePenetration {
    /// Position of the tool.
    pub tool: usize,
    /// Depth [mm].
    pub depth: f64,
    /// Where [mm].
    pub at: Vec3,
}

/// What stays the same during a run: element faces of either side of the sheet, features of every tool.
pub(super) struct Penetration {
    sides: Vec<(SheetSide, Vec<Face>)>,
    features: Vec<Features>,
}

impl Penetration {
    /// For a sheet with elements at most `longest_edge` [mm] long.
    pub(super) fn of(mesh: &HexMesh, tools: &[Tool], longest_edge: f64) -> Self {
        let mut sides: Vec<(SheetSide, Vec<Face>)> = Vec::new();
        for tool in tools {
            let side = tool.setup.side;
            if !sides.iter().any(|(known, _)| *known == side) {
                sides.push((side, faces_of(mesh, side)));
            }
        }
        let features = tools.iter().map(|t| Features::of(&t.setup.surface, longest_edge)).collect();
        Self { sides, features }
    }

    fn faces(&self, side: SheetSide) -> &[Face] {
        self.sides.iter().find(|(known, _)| *known == side).map_or(&[], |(_, faces)| faces)
    }
}

impl System {
    /// The deepest penetration between nodes where sheet and tools are now; `None` where there is none.
    pub(super) fn face_penetration(&mut self) -> Option<FacePenetration> {
        let start = Instant::now();
        let found = self.deepest();
        self.timings.penetration += start.elapsed().as_secs_f64();
        found
    }

    fn deepest(&self) -> Option<FacePenetration> {
        let x = self.positions();
        let present = |tool: &usize| self.roles[*tool] != Role::Absent;
        let of_tool = |tool: usize| {
            let setup = &self.tools[tool].setup;
            let faces = self.penetration.faces(setup.side);
            let [a, b] = [self.faces_in_tool(tool, faces, &x), self.tool_in_faces(tool, faces, &x)];
            let (depth, at) = if b.0 > a.0 { b } else { a };
            (depth > 0.0).then_some(FacePenetration { tool, depth, at })
        };
        let found = (0..self.tools.len()).filter(present).filter_map(of_tool);
        found.reduce(|a, b| if b.depth > a.depth { b } else { a })
    }

    /// Depth of the deepest middle of a face or of one of its sides in a tool [mm], and where.
    fn faces_in_tool(&self, tool: usize, faces: &[Face], x: &[Vec3]) -> (f64, Vec3) {
        let (tool, reach) = (&self.tools[tool], self.lengths.longest_edge);
        let bounds = tool.setup.surface.bounds().widened(reach);
        let deepest = |face: &Face| {
            let corners = face.corners(x);
            let middle = 0.25 * corners.iter().sum::<Vec3>();
            let sides = (0..4).map(|k| 0.5 * (corners[k] + corners[(k + 1) % 4]));
            let mut best = (0.0, middle);
            let mut hint = None;
            for p in std::iter::once(middle).chain(sides) {
                if bounds.distance_squared(&(p - tool.shift())) > 0.0 {
                    continue;
                }
                let foot = tool.within(&p, hint, reach);
                if foot.gap.is_finite() {
                    hint = Some(foot.patch);
                }
                if !foot.past_border && -foot.gap > best.0 {
                    best = (-foot.gap, p);
                }
            }
            best
        };
        deepest_of(faces.par_iter().map(deepest).collect())
    }

    /// Depth of the deepest feature of a tool behind the nearest face of the sheet [mm], and where.
    fn tool_in_faces(&self, tool: usize, faces: &[Face], x: &[Vec3]) -> (f64, Vec3) {
        let features = &self.penetration.features[tool];
        if features.points.is_empty() || faces.is_empty() {
            return NOWHERE;
        }
        let (shift, reach) = (self.tools[tool].shift(), self.lengths.longest_edge);
        let faces = Faces::new(faces, x);
        let sheet = faces.bounds().widened(reach);
        let near = |k: &usize| sheet.distance_squared(&(features.points[*k].0 + shift)) == 0.0;
        let near: Vec<usize> = (0..features.points.len()).filter(near).collect();
        let depth = |&k: &usize| {
            let (point, normal) = &features.points[k];
            let p = point + shift;
            (faces.depth(&p, normal, reach), p)
        };
        deepest_of(near.par_iter().map(depth).collect())
    }
}

const NOWHERE: (f64, Vec3) = (0.0, Vec3::new(0.0, 0.0, 0.0));

/// The first of the deepest: the same for any number of threads.
fn deepest_of(found: Vec<(f64, Vec3)>) -> (f64, Vec3) {
    found.into_iter().reduce(|a, b| if b.0 > a.0 { b } else { a }).unwrap_or(NOWHERE)
}

#[cfg(test)]
mod tests;
