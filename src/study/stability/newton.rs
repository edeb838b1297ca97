//! From how many starting points the paper's Newton (Eq. 19-23) finds the closest point of a patch.

use std::ops::Range;

use rayon::prelude::*;

use super::description::NewtonMap;
use super::panel::Panel;
use crate::contact::ToolSurface;
use crate::contact::paper::newton;
use crate::geometry::{Vec2, Vec3};
use crate::report::drawing::HeatMap;
use crate::tool::build::build;
use crate::tool::edge::EdgeRule;
use crate::tool::model::PatchCorners;
use crate::tool::{ToolKind, ToolModel};

/// Distance from the patch towards its axis over its radius; the axis is at 1.
const DISTANCE: Range<f64> = -1.0..1.25;
/// Share of the patch's half angle up to which points are taken.
const REACH: f64 = 0.98;
/// Parameters of starts and feet keep to this from the border.
const FOUND: f64 = 1e-9;

/// One map for each angle of a patch.
pub(super) fn maps(plan: &NewtonMap) -> Vec<Panel> {
    plan.angles_deg.iter().map(|&angle| panel(plan, angle)).collect()
}

/// A Nagata quadrilateral on a cylinder of radius 1 about the y axis, its normals towards the axis.
pub(super) fn trough(half_angle: f64) -> ToolModel {
    let corner = |side: f64, y: f64| {
        let (s, c) = (side * half_angle).sin_cos();
        (Vec3::new(s, y, -c), Vec3::new(-s, 0.0, c))
    };
    let all = [corner(-1.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    let (vertices, normals) = all.into_iter().unzip();
    let ids: Vec<u32> = (0..4).collect();
    let corners = vec![PatchCorners { vertices: ids.clone(), normals: ids, face: 0 }];
    build("trough".into(), ToolKind::Nagata, vertices, normals, corners, EdgeRule::Guarded)
        .expect("four sound corners")
        .0
}

fn panel(plan: &NewtonMap, angle_deg: f64) -> Panel {
    let half = 0.5 * angle_deg.to_radians();
    let model = trough(half);
    let surface = ToolSurface::new(model);
    let cell = |k: usize| {
        let (i, j) = (k % plan.columns, k / plan.columns);
        let across = ((i as f64 + 0.5) / plan.columns as f64 * 2.0 - 1.0) * REACH * half;
        let share = (j as f64 + 0.5) / plan.rows as f64;
        let distance = DISTANCE.start + share * (DISTANCE.end - DISTANCE.start);
        let (s, c) = across.sin_cos();
        let p = Vec3::new(s, 0.0, -c) * (1.0 - distance) + Vec3::new(0.0, 0.45, 0.0);
        share_found(&surface, &p, plan.starts)
    };
    let values: Vec<f64> = (0..plan.columns * plan.rows).into_par_iter().map(cell).collect();
    let judged = values.iter().filter(|v| v.is_finite()).count();
    let sound = values.iter().filter(|v| **v == 1.0).count() as f64 / judged.max(1) as f64;
    let reach = REACH * 0.5 * angle_deg;
    let map = HeatMap {
        title: format!("patch of {angle_deg} deg"),
        x: ("angle from its middle [deg]".into(), -reach..reach),
        y: ("distance / radius (axis at 1)".into(), DISTANCE),
        columns: plan.columns,
        values,
    };
    Panel { map, sound }
}

/// Share of the starting points from which the closest point of the patch is found; no number where it lies on the
/// border, which Eq. 19 does not know.
fn share_found(surface: &ToolSurface, p: &Vec3, starts: usize) -> f64 {
    let best = surface.closest(p, None);
    if best.location != crate::contact::Location::Inside {
        return f64::NAN;
    }
    let patch = &surface.model().patches[0];
    let distance = (p - best.point).norm();
    let found = |k: usize| {
        let at = |i: usize| (i as f64 + 0.5) / starts as f64;
        let start = Vec2::new(at(k % starts), at(k / starts));
        let inside = |x: &Vec2| x.min() >= -1e-6 && x.max() <= 1.0 + 1e-6;
        newton(patch, p, start)
            .is_some_and(|foot| inside(&foot.at) && foot.distance.abs() <= distance + FOUND)
    };
    (0..starts * starts).filter(|&k| found(k)).count() as f64 / (starts * starts) as f64
}
