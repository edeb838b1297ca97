//! Validation of the numbers of a face: bounded and finite before any geometric computation.

use std::cell::LazyCell;

use super::native::Native;
use super::raw::{RawEdge, RawFace, RawSurface};
use kanagata_geometry::numbers::{
    coordinate_fault, curve_fault, parameter_curve_fault, parameter_fault, point_fault,
    surface_fault,
};
use kanagata_geometry::{Aabb, Frame, Vec2, Vec3};

/// First inadmissible number of a face with the admissible range; bounds of [`numbers`](kanagata_geometry::numbers).
fn fault_of(face: &RawFace) -> Option<String> {
    let edges = face.loops.iter().flat_map(|l| &l.edges);
    let vertices = || face.loops.iter().filter_map(|l| l.vertex.as_ref());
    let of_loops = || edges.into_iter().find_map(edge);
    surface(&face.surface).or_else(of_loops).or_else(|| vertices().find_map(point_fault))
}

/// Bounding box of a face, or the reason why the face is unusable.
pub(super) fn usable_bounds(face: &RawFace) -> Result<Aabb, String> {
    if let Some(fault) = fault_of(face) {
        return Err(fault);
    }
    let bounds = face_bounds(face);
    let corners = [bounds.min, bounds.max];
    let finite = bounds.is_empty() || corners.iter().flatten().all(|x| x.is_finite());
    if finite { Ok(bounds) } else { Err("it has points that are not finite".to_owned()) }
}

/// Bounding box of a face's boundary curves, or of its surface when it has none.
fn face_bounds(face: &RawFace) -> Aabb {
    let mut bounds = Aabb::EMPTY;
    let native = LazyCell::new(|| Native::new(&face.surface));
    for edge in face.loops.iter().flat_map(|l| &l.edges) {
        if let Some(curve) = &edge.curve {
            curve.points().iter().for_each(|p| bounds.grow(p));
        } else if let Some(pcurve) = &edge.pcurve {
            let [a, b] = pcurve.domain();
            for k in 0..=8 {
                let uv = pcurve.point(a + (b - a) * f64::from(k) / 8.0);
                bounds.grow(&native.point(native.order(uv)));
            }
        }
    }
    if bounds.is_empty()
        && let Some([u, v]) = native.natural_range()
    {
        for (i, j) in (0..=8).flat_map(|i| (0..=8).map(move |j| (i, j))) {
            let at = |r: [f64; 2], k: i32| r[0] + (r[1] - r[0]) * f64::from(k) / 8.0;
            bounds.grow(&native.point(Vec2::new(at(u, i), at(v, j))));
        }
    }
    bounds
}

fn edge(edge: &RawEdge) -> Option<String> {
    let curve = || edge.curve.as_ref().and_then(curve_fault);
    let pcurve = || edge.pcurve.as_ref().and_then(parameter_curve_fault);
    let ends = || edge.ends.iter().flatten().find_map(point_fault);
    curve().or_else(pcurve).or_else(ends)
}

fn surface(surface: &RawSurface) -> Option<String> {
    match surface {
        RawSurface::Plane(of) => frame(of),
        RawSurface::Cylinder { frame: of, radius } | RawSurface::Sphere { frame: of, radius } => {
            frame(of).or_else(|| coordinate_fault(*radius))
        }
        RawSurface::Cone { frame: of, radius, semi_angle } => {
            frame(of).or_else(|| coordinate_fault(*radius)).or_else(|| parameter_fault(*semi_angle))
        }
        RawSurface::Torus { frame: of, major, minor, .. } => {
            frame(of).or_else(|| coordinate_fault(*major)).or_else(|| coordinate_fault(*minor))
        }
        RawSurface::Revolution { generatrix, origin, axis, angles, .. } => curve_fault(generatrix)
            .or_else(|| point_fault(origin))
            .or_else(|| direction(axis))
            .or_else(|| angles.iter().flatten().find_map(|&a| parameter_fault(a))),
        RawSurface::Extrusion { directrix, direction, range } => curve_fault(directrix)
            .or_else(|| point_fault(direction))
            .or_else(|| range.iter().flatten().find_map(|&v| parameter_fault(v))),
        RawSurface::Nurbs(surface) => surface_fault(surface),
        RawSurface::Offset { base, distance } => {
            coordinate_fault(*distance).or_else(|| self::surface(base))
        }
    }
}

fn frame(frame: &Frame) -> Option<String> {
    point_fault(&frame.origin).or_else(|| [frame.x, frame.y, frame.z].iter().find_map(direction))
}

fn direction(of: &Vec3) -> Option<String> {
    let length = of.norm();
    let sound = length.is_finite() && length > 0.0;
    (!sound).then(|| format!("a direction of length {length:e}; allowed: finite, not 0"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::build;
    use crate::raw::{RawLoop, RawModel};
    use kanagata_geometry::nurbs::Curve3;

    /// A square on the plane z = 0 with one corner at (x, 0, 0).
    fn square(x: f64) -> RawFace {
        let at = [[0.0, 0.0], [x, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| Vec3::new(x, y, 0.0));
        let side = |k: usize| RawEdge {
            curve: Some(Curve3::line(at[k], at[(k + 1) % 4])),
            ..RawEdge::default()
        };
        RawFace {
            surface: RawSurface::Plane(Frame::world()),
            loops: vec![RawLoop { edges: (0..4).map(side).collect(), ..RawLoop::default() }],
            flipped: false,
            source: format!("#{x:e}"),
            shell: None,
            attributes: Default::default(),
        }
    }

    #[test]
    fn a_face_with_a_number_out_of_bounds_is_left_out_and_named_and_the_others_stay() {
        for x in [1e9, 1e19, 1e100, f64::MAX, f64::INFINITY, f64::NAN] {
            let raw = RawModel { faces: vec![square(1.0), square(x)], ..RawModel::default() };
            let (model, said) = build(raw, "x");
            assert_eq!((model.faces.len(), model.lost.len()), (1, 1), "{x}");
            let of_face = said.iter().find(|d| d.code == "face-skipped").unwrap();
            assert_eq!(of_face.place, format!("#{x:e}"));
            assert!(of_face.text.contains("allowed: up to 1e7 mm"), "{}", of_face.text);
            assert!(model.bbox().diagonal() < 2.0);
        }
    }

    #[test]
    fn numbers_of_every_surface_are_judged() {
        let frame = Frame { origin: Vec3::repeat(1e8), ..Frame::world() };
        let world = Frame::world();
        let line = |x: f64| Curve3::line(Vec3::zeros(), Vec3::new(x, 0.0, 1.0));
        let far = [
            RawSurface::Plane(frame),
            RawSurface::Plane(Frame { x: Vec3::repeat(f64::NAN), ..world }),
            RawSurface::Cylinder { frame: world, radius: 1e9 },
            RawSurface::Cone { frame: world, radius: 1.0, semi_angle: f64::NAN },
            RawSurface::Sphere { frame: world, radius: -1e9 },
            RawSurface::Torus { frame: world, major: 1.0, minor: 1e10, keep_outer: None },
            RawSurface::Extrusion { directrix: line(1e9), direction: Vec3::y(), range: None },
            RawSurface::Extrusion {
                directrix: line(1.0),
                direction: Vec3::y(),
                range: Some([0.0, 1e30]),
            },
            RawSurface::Revolution {
                generatrix: line(1.0),
                origin: Vec3::zeros(),
                axis: Vec3::zeros(),
                angles: None,
                curve_first: false,
            },
            RawSurface::Offset { base: Box::new(RawSurface::Plane(world)), distance: 1e300 },
        ];
        for surface in &far {
            assert!(super::surface(surface).is_some(), "{surface:?}");
        }
        assert_eq!(super::surface(&RawSurface::Plane(world)), None);
    }
}
