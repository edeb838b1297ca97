//! Penetration between nodes in the current configuration.

use std::time::Instant;

use crate::solver::contact::face_penetration::FacePenetration;
use crate::solver::contact::face_penetration::faces::{Face, Faces};
use rayon::prelude::*;

use super::system::System;
use crate::geometry::Vec3;
use crate::solver::tools::role::Role;

const NOWHERE: (f64, Vec3) = (0.0, Vec3::new(0.0, 0.0, 0.0));

impl System {
    /// Deepest penetration between nodes in the current configuration; `None` if there is none.
    pub(in crate::solver) fn face_penetration(&mut self) -> Option<FacePenetration> {
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

    /// Largest depth in a tool of the centres of faces and the midpoints of their sides [mm], and its position.
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

    /// Largest depth of a feature of a tool behind the closest face of the sheet [mm], and its position.
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

/// The first of the deepest, independent of the number of threads.
pub(in crate::solver) fn deepest_of(found: Vec<(f64, Vec3)>) -> (f64, Vec3) {
    found.into_iter().reduce(|a, b| if b.0 > a.0 { b } else { a }).unwrap_or(NOWHERE)
}
