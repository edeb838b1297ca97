//! What a scene has too much or too little of, said before it runs.

use crate::contact::ToolSurface;
use crate::geometry::{Vec2, Vec3};
use crate::scene::Plan;
use crate::solver::SimulationSetup;
use crate::solver::blank::HexMesh;
use crate::solver::element::ElementKind;

/// Elements over 90 degrees of a radius that follow it well.
const OVER_A_RADIUS: f64 = 4.0;
/// In-plane size over layer thickness from which fully integrated hexahedra are far too stiff in bending.
const SLENDER: f64 = 4.0;
/// Angle between normals of a patch [rad] below which it counts as flat.
const FLAT: f64 = 1e-3;

/// Remarks on a scene, each with what it costs; none when there is nothing to say.
#[must_use]
pub fn advice(plan: &Plan, setup: &SimulationSetup) -> Vec<String> {
    let mesh = setup.body.mesh();
    let blank = &plan.scene.blank;
    let size = element_size(mesh);
    let mut out = Vec::new();
    let slender = size / (blank.thickness_mm / blank.layers as f64);
    match blank.element {
        ElementKind::Hex8 if slender > SLENDER => out.push(format!(
            "hex8 elements of {size:.2} mm are {slender:.0} times as long as thick and too stiff where the sheet bends; \
             solid-shell bends with one layer"
        )),
        ElementKind::SolidShell { .. } if blank.layers > 1 => out.push(format!(
            "{} layers of solid-shell: one bends as well, for about {:.0} % of the time",
            blank.layers,
            100.0 / (blank.layers as f64).powf(1.5)
        )),
        _ => {}
    }
    for (tool, loaded) in plan.scene.tools.iter().zip(&plan.tools) {
        let (beyond, patches) = patches_beyond(&loaded.surface, mesh);
        if beyond * 10 > patches {
            out.push(format!(
                "{beyond} of {patches} patches of {} lie beyond the outline of the blank and are never touched",
                tool.name
            ));
        }
        let Some(radius) = smallest_radius(&loaded.surface) else { continue };
        let count = std::f64::consts::FRAC_PI_2 * radius / size;
        if count < OVER_A_RADIUS {
            out.push(format!(
                "elements of {size:.2} mm are coarse for the radius of {radius:.2} mm of {}: {count:.1} over 90 degrees; \
                 {OVER_A_RADIUS} want elements of {:.2} mm and take about {:.0} times as long",
                tool.name,
                size * count / OVER_A_RADIUS,
                (OVER_A_RADIUS / count).powf(3.5)
            ));
        }
    }
    out
}

/// Mean edge of the elements in plan [mm].
fn element_size(mesh: &HexMesh) -> f64 {
    let edge = |e: &[u32; 8], a: usize, b: usize| {
        (mesh.nodes[e[a] as usize] - mesh.nodes[e[b] as usize]).norm()
    };
    let sum: f64 = mesh.elements.iter().map(|e| 0.5 * (edge(e, 0, 1) + edge(e, 1, 2))).sum();
    sum / mesh.elements.len().max(1) as f64
}

/// Patches whose corners all lie outside the blank's box in plan, and patches in all.
fn patches_beyond(surface: &ToolSurface, mesh: &HexMesh) -> (usize, usize) {
    let plan = mesh.column_coordinates();
    let low = plan.iter().copied().reduce(|a, b| a.inf(&b)).unwrap_or_default();
    let high = plan.iter().copied().reduce(|a, b| a.sup(&b)).unwrap_or_default();
    let model = surface.model();
    let of_patch = |vertices: &[u32]| {
        let points = vertices.iter().map(|&v| model.vertices[v as usize].xy());
        let far = |p: Vec2| [p - high, low - p];
        // Beyond one side with all corners.
        let sides = points.map(far).reduce(|a, b| [a[0].inf(&b[0]), a[1].inf(&b[1])]);
        sides.is_some_and(|s| s.iter().any(|v| v.max() > 0.0))
    };
    let beyond = model.corners.iter().filter(|c| of_patch(&c.vertices)).count();
    (beyond, model.corners.len())
}

/// Smallest radius of curvature of a tool [mm], from the turn of the normal along its patches' edges; `None` for a flat
/// tool.
fn smallest_radius(surface: &ToolSurface) -> Option<f64> {
    let model = surface.model();
    let mut least = f64::INFINITY;
    for corners in &model.corners {
        let count = corners.vertices.len();
        for k in 0..count {
            let (a, b) = (k, (k + 1) % count);
            let x = |i: usize| -> Vec3 { model.vertices[corners.vertices[i] as usize] };
            let n = |i: usize| -> Vec3 { model.normals[corners.normals[i] as usize] };
            let angle = n(a).angle(&n(b));
            if angle > FLAT {
                // An arc of this chord.
                least = least.min(0.5 * (x(b) - x(a)).norm() / (0.5 * angle).sin());
            }
        }
    }
    least.is_finite().then_some(least)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::contact::test_tools::{arc, plane, revolved};
    use crate::solver::blank::rectangle;

    #[test]
    fn radii_sizes_and_patches_beyond_are_found() {
        let ball =
            revolved("ball", 4, FRAC_PI_2, &[arc(6, [0.0, 7.0], 7.0, [-FRAC_PI_2, 0.0], 1.0)]);
        let radius = smallest_radius(&ToolSurface::new(ball)).unwrap();
        assert!(radius < 7.0 + 1e-9 && radius > 0.9, "{radius}");
        let mesh = rectangle(10.0, 20.0, 0.8, 5, 10, 2);
        assert!((element_size(&mesh) - 2.0).abs() < 1e-12);
        let flat = |x: f64| plane("p", Vec3::new(x, 0.0, 0.0), Vec3::x(), Vec3::y(), Vec3::z());
        assert_eq!(patches_beyond(&ToolSurface::new(flat(9.5)), &mesh), (0, 1));
        assert_eq!(patches_beyond(&ToolSurface::new(flat(10.5)), &mesh), (1, 1));
        assert!(smallest_radius(&ToolSurface::new(flat(0.0))).is_none());
    }
}
