//! Penetration between nodes in the current configuration.

use std::time::Instant;

use crate::contact::face_penetration::FaceDepths;
use crate::contact::face_penetration::faces::{Face, Faces};
use rayon::prelude::*;

use super::system::System;
use crate::tools::role::Role;
use kanagata_geometry::Vec3;

impl System {
    /// Penetration between nodes in the current configuration.
    pub(crate) fn face_penetration(&mut self) -> FaceDepths {
        let start = Instant::now();
        let found = self.face_depths();
        self.timings.penetration += start.elapsed().as_secs_f64();
        found
    }

    fn face_depths(&self) -> FaceDepths {
        let x = self.positions();
        let elements = self.body.mesh().elements.len();
        let mut out = FaceDepths { of_elements: vec![0.0; elements], ..FaceDepths::default() };
        for tool in (0..self.tools.len()).filter(|tool| self.roles[*tool] != Role::Absent) {
            let faces = self.penetration.faces(self.tools[tool].setup.side);
            out.add(tool, &self.faces_in_tool(tool, faces, &x));
            out.add(tool, &self.tool_in_faces(tool, faces, &x));
        }
        out
    }

    /// Largest depth in a tool of the centre of each face and the midpoints of its sides [mm], its position, and the
    /// element.
    fn faces_in_tool(&self, tool: usize, faces: &[Face], x: &[Vec3]) -> Vec<(f64, Vec3, u32)> {
        let (tool, reach) = (&self.tools[tool], self.lengths.longest_edge);
        let bounds = tool.setup.surface.bounds().widened(reach);
        let deepest = |face: &Face| {
            let corners = face.corners(x);
            let middle = 0.25 * corners.iter().sum::<Vec3>();
            let sides = (0..4).map(|k| 0.5 * (corners[k] + corners[(k + 1) % 4]));
            let mut best = (0.0, middle, face.element);
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
                    best = (-foot.gap, p, face.element);
                }
            }
            best
        };
        faces.par_iter().map(deepest).collect()
    }

    /// Depth of the features of a tool behind the closest face of the sheet [mm], their positions and elements.
    fn tool_in_faces(&self, tool: usize, faces: &[Face], x: &[Vec3]) -> Vec<(f64, Vec3, u32)> {
        let features = &self.penetration.features[tool];
        if features.points.is_empty() || faces.is_empty() {
            return Vec::new();
        }
        let (shift, reach) = (self.tools[tool].shift(), self.lengths.longest_edge);
        let faces = Faces::new(faces, x);
        let sheet = faces.bounds().widened(reach);
        let near = |k: &usize| sheet.distance_squared(&(features.points[*k].0 + shift)) == 0.0;
        let near: Vec<usize> = (0..features.points.len()).filter(near).collect();
        let depth = |&k: &usize| {
            let (point, normal) = &features.points[k];
            let p = point + shift;
            faces.depth(&p, normal, reach).map(|(depth, element)| (depth, p, element))
        };
        near.par_iter().filter_map(depth).collect()
    }
}
