//! Fraction of starting points from which Newton's method of the paper (Eq. 19-23) finds the closest point of a patch.

use std::ops::Range;

use rayon::prelude::*;

use super::description::NewtonMap;
use super::panel::Panel;
use kanagata_contact::ToolSurface;
use kanagata_contact::paper::newton;
use kanagata_geometry::{Vec2, Vec3};
use kanagata_report::drawing::HeatMap;
use kanagata_tool::build::build;
use kanagata_tool::edge::EdgeRule;
use kanagata_tool::model::PatchCorners;
use kanagata_tool::{ToolKind, ToolModel};

/// Range of the distance from the patch towards the axis of the cylinder, over its radius; the axis is at 1.
const DISTANCE_RANGE: Range<f64> = -1.0..1.25;
/// Fraction of the half angle of the patch within which points are placed.
const ANGLE_FRACTION: f64 = 0.98;
/// Tolerance of the distance to the closest point.
const DISTANCE_TOLERANCE: f64 = 1e-9;

/// One map per angle of a patch.
pub(super) fn maps(plan: &NewtonMap) -> Vec<Panel> {
    plan.angles_deg.iter().map(|&angle| panel(plan, angle)).collect()
}

/// A Nagata quadrilateral on a cylinder of radius 1 about the y axis, with normals towards the axis.
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
        let across = ((i as f64 + 0.5) / plan.columns as f64 * 2.0 - 1.0) * ANGLE_FRACTION * half;
        let share = (j as f64 + 0.5) / plan.rows as f64;
        let distance = DISTANCE_RANGE.start + share * (DISTANCE_RANGE.end - DISTANCE_RANGE.start);
        let (s, c) = across.sin_cos();
        let p = Vec3::new(s, 0.0, -c) * (1.0 - distance) + Vec3::new(0.0, 0.45, 0.0);
        converged_fraction(&surface, &p, plan.starts)
    };
    let values: Vec<f64> = (0..plan.columns * plan.rows).into_par_iter().map(cell).collect();
    let inside = values.iter().filter(|v| v.is_finite()).count();
    let sound = values.iter().filter(|v| **v == 1.0).count() as f64 / inside.max(1) as f64;
    let reach = ANGLE_FRACTION * 0.5 * angle_deg;
    let map = HeatMap {
        title: format!("patch of {angle_deg} deg"),
        x: ("angle from its middle [deg]".into(), -reach..reach),
        y: ("distance / radius (axis at 1)".into(), DISTANCE_RANGE),
        columns: plan.columns,
        values,
    };
    Panel { map, sound }
}

/// Fraction of the starting points from which Newton's method finds the closest point of the patch. NaN if that is on
/// the border, where Eq. 19 does not apply.
fn converged_fraction(surface: &ToolSurface, p: &Vec3, starts: usize) -> f64 {
    let best = surface.closest(p, None);
    if best.location != kanagata_contact::Location::Inside {
        return f64::NAN;
    }
    let patch = &surface.model().patches[0];
    let distance = (p - best.point).norm();
    let found = |k: usize| {
        let at = |i: usize| (i as f64 + 0.5) / starts as f64;
        let start = Vec2::new(at(k % starts), at(k / starts));
        let inside = |x: &Vec2| x.min() >= -1e-6 && x.max() <= 1.0 + 1e-6;
        newton(patch, p, start).is_some_and(|foot| {
            inside(&foot.at) && foot.distance.abs() <= distance + DISTANCE_TOLERANCE
        })
    };
    (0..starts * starts).filter(|&k| found(k)).count() as f64 / (starts * starts) as f64
}
