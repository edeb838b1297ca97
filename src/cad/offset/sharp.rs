//! Places where the normal of a model jumps: its offset has a gap or an overlap there.

use rayon::prelude::*;

use super::error::SharpPlace;
use crate::Model;
use crate::model::{EdgeUse, Face};
use crate::trim_region::TrimRegion;
use kanagata_geometry::frame::unit;
use kanagata_geometry::{Vec2, Vec3};

/// Points of an edge, of a knot line or of a collapsed side at which normals are compared.
const POINTS: usize = 17;
/// Distance from a knot line, relative to the domain, at which the normals on both sides are taken.
const BESIDE_REL: f64 = 1e-9;

/// Places of an offset to the side of `distance` where normals differ by more than `smooth` [rad], the sharpest first:
/// the worst of each edge between faces, of each knot line across which a surface may have a crease, and of each side
/// that is one point in space (the apex of a cone).
pub(super) fn sharp_places(model: &Model, distance: f64, smooth: f64) -> Vec<SharpPlace> {
    let edges: Vec<SharpPlace> = (0..model.edges.len())
        .into_par_iter()
        .filter_map(|e| at_edge(model, e, distance))
        .collect();
    let inside: Vec<SharpPlace> = (0..model.faces.len())
        .into_par_iter()
        .flat_map_iter(|f| inside_face(&model.faces[f], f, distance))
        .collect();
    let mut found: Vec<SharpPlace> = [edges, inside].concat();
    found.retain(|p| p.angle_deg.to_radians() > smooth);
    // Equal angles keep the order of edges and faces.
    found.sort_by(|a, b| b.angle_deg.total_cmp(&a.angle_deg));
    found
}

/// The sharpest place of an edge between faces.
fn at_edge(model: &Model, edge: usize, distance: f64) -> Option<SharpPlace> {
    let uses = &model.edges[edge].uses;
    let (first, others) = uses.split_first()?;
    let used = |[f, l, k]: [usize; 3]| (&model.faces[f], &model.faces[f].loops[l].uses[k]);
    let (face, side) = used(*first);
    let mut worst: Option<SharpPlace> = None;
    // Not at the ends, where a surface may be degenerate.
    for uv in inner_points_of(side) {
        let at = face.surface.point(uv);
        let Some(n) = face.normal(uv) else { continue };
        for other in others {
            let (beyond, use_beyond) = used(*other);
            let there = parameters_at(beyond, use_beyond, &at);
            let Some(m) = beyond.normal(there) else { continue };
            let opens = into(beyond, use_beyond, there).dot(&n) * distance < 0.0;
            record(&mut worst, (at, [n, m]), [first[0], other[0]], opens);
        }
    }
    worst
}

/// Keeps the place with the larger angle.
fn record(
    worst: &mut Option<SharpPlace>,
    (at, [n, m]): (Vec3, [Vec3; 2]),
    faces: [usize; 2],
    opens: bool,
) {
    let angle_deg = n.cross(&m).norm().atan2(n.dot(&m)).to_degrees();
    if worst.is_none_or(|w| angle_deg > w.angle_deg) {
        *worst = Some(SharpPlace { at, angle_deg, faces, opens });
    }
}

/// Parameters of points of a side, its ends included.
fn points_of(side: &EdgeUse) -> impl Iterator<Item = Vec2> + '_ {
    let [a, b] = side.pcurve.domain();
    (0..POINTS).map(move |k| side.pcurve.point(a + (b - a) * k as f64 / (POINTS - 1) as f64))
}

/// Parameters of points of a side between its ends.
fn inner_points_of(side: &EdgeUse) -> impl Iterator<Item = Vec2> + '_ {
    let [a, b] = side.pcurve.domain();
    (0..POINTS).map(move |k| side.pcurve.point(a + (b - a) * (k as f64 + 0.5) / POINTS as f64))
}

/// Parameters of the point of a side of `face` closest to `p`.
pub(super) fn parameters_at(face: &Face, side: &EdgeUse, p: &Vec3) -> Vec2 {
    let off = |uv: &Vec2| (face.surface.point(*uv) - p).norm_squared();
    let nearest = points_of(side).min_by(|a, b| off(a).total_cmp(&off(b)));
    let start = nearest.unwrap_or_else(|| side.pcurve.points()[0]);
    let (uv, d) = face.surface.closest_locally(p, start);
    // A search that ends elsewhere: the point of the side.
    if (d.s - p).norm_squared() <= off(&start) { uv } else { start }
}

/// Direction into a face at the point `uv` of one of its sides, along its surface.
fn into(face: &Face, side: &EdgeUse, uv: Vec2) -> Vec3 {
    let (t, _) = side.pcurve.closest(&uv);
    let step = side.pcurve.derivs(t).d1;
    let d = face.surface.derivs(uv);
    // Loops are counter-clockwise in the (u, v) plane: the face is to the left.
    let along = d.su * step.x + d.sv * step.y;
    unit(d.su.cross(&d.sv).cross(&along)).unwrap_or_else(Vec3::zeros)
}

/// The sharpest places inside a face.
fn inside_face(face: &Face, f: usize, distance: f64) -> Vec<SharpPlace> {
    let region = TrimRegion::new(face);
    let mut found: Vec<SharpPlace> = Vec::new();
    for (axis, line) in crease_lines(face, &region) {
        found.extend(along_line(face, (f, &region), (axis, line), distance));
    }
    for side in face.loops.iter().flat_map(|l| &l.uses).filter(|u| u.edge.is_none()) {
        found.extend(at_apex(face, f, side, distance));
    }
    found
}

/// Largest angle between the normals on both sides of a knot line within the loops of a face [rad]. Files have fillets
/// whose patches are tangent to a hundredth of a degree.
pub(super) fn largest_kink(face: &Face) -> f64 {
    let region = TrimRegion::new(face);
    let lines = crease_lines(face, &region).into_iter();
    let places = lines.filter_map(|line| along_line(face, (0, &region), line, 1.0));
    places.map(|p| p.angle_deg.to_radians()).fold(0.0, f64::max)
}

/// Knot lines within the region across which the surface need not be smooth.
fn crease_lines(face: &Face, region: &TrimRegion) -> Vec<(usize, f64)> {
    let mut found = Vec::new();
    for axis in 0..2 {
        let (knots, degree) = (face.surface.knots()[axis], face.surface.degrees()[axis]);
        let mut lines: Vec<f64> = knots.to_vec();
        lines.retain(|t| *t > region.low[axis] && *t < region.high[axis]);
        lines.dedup();
        lines.retain(|t| knots.iter().filter(|k| *k == t).count() >= degree);
        found.extend(lines.into_iter().map(|t| (axis, t)));
    }
    found
}

/// The sharpest place of a knot line.
fn along_line(
    face: &Face,
    (f, region): (usize, &TrimRegion),
    (axis, line): (usize, f64),
    distance: f64,
) -> Option<SharpPlace> {
    let [low, high] = [region.low[1 - axis], region.high[1 - axis]];
    let domain = face.surface.domain()[axis];
    let beside = BESIDE_REL * (domain[1] - domain[0]);
    let mut worst = None;
    for k in 0..POINTS {
        let along = low + (high - low) * (k as f64 + 0.5) / POINTS as f64;
        let at = |across: f64| {
            if axis == 0 { Vec2::new(across, along) } else { Vec2::new(along, across) }
        };
        if !region.contains(at(line)) {
            continue;
        }
        let sides = [line - beside, line + beside];
        let [Some(n), Some(m)] = sides.map(|t| face.normal(at(t))) else { continue };
        let d = face.surface.derivs(at(line + beside));
        let across = if axis == 0 { d.su } else { d.sv };
        record(&mut worst, (d.s, [n, m]), [f, f], across.dot(&n) * distance < 0.0);
    }
    worst
}

/// The spread of the normals along a side that is one point in space.
fn at_apex(face: &Face, f: usize, side: &EdgeUse, distance: f64) -> Option<SharpPlace> {
    let normals: Vec<(Vec2, Vec3)> =
        points_of(side).filter_map(|uv| Some((uv, face.normal(uv)?))).collect();
    let (uv, first) = *normals.first()?;
    let at = face.surface.point(uv);
    let [u, v] = face.surface.domain();
    let outward = at - face.surface.point(0.5 * Vec2::new(u[0] + u[1], v[0] + v[1]));
    let mut worst = None;
    for (_, n) in &normals {
        record(&mut worst, (at, [first, *n]), [f, f], outward.dot(&(first + n)) * distance > 0.0);
    }
    worst
}
