//! Placement of faces in an assembly.

use std::sync::Arc;

use crate::raw::{RawEdge, RawFace, RawSurface};
use kanagata_geometry::nurbs::Curve2;
use kanagata_geometry::{Affine, Frame, Vec2};

/// A placed surface.
pub struct Placed {
    /// The surface, in the parameters `(u scale[0], v scale[1])` of the original.
    pub surface: RawSurface,
    /// `su x sv` is opposite to the image of the original's.
    pub turned: bool,
    /// Scale factors of the parameters.
    pub scales: [f64; 2],
}

/// Scale of a similarity (rotation, reflection, uniform scale); `None` for any other map.
#[must_use]
pub fn similarity(map: &Affine) -> Option<f64> {
    let gram = map.linear.transpose() * map.linear;
    let square = gram.trace() / 3.0;
    let off = (gram - kanagata_geometry::Mat3::identity() * square).norm();
    (square > 0.0 && square.is_finite() && off <= 1e-9 * square).then(|| square.sqrt())
}

/// Image of the surface; `None` for a map that is no similarity. A reflected frame is kept right-handed by reversing
/// its z axis, and with it the surface's v.
#[must_use]
pub fn surface(surface: &RawSurface, map: &Affine) -> Option<Placed> {
    let scale = similarity(map)?;
    let mirrored = map.linear.determinant() < 0.0;
    let motion = Motion { map, scale, mirrored };
    let unscaled = |surface| Placed { surface, turned: mirrored, scales: [1.0, 1.0] };
    Some(match surface {
        RawSurface::Plane(f) => Placed {
            surface: RawSurface::Plane(motion.frame(f)),
            turned: mirrored,
            scales: [scale, scale],
        },
        RawSurface::Cylinder { .. }
        | RawSurface::Cone { .. }
        | RawSurface::Sphere { .. }
        | RawSurface::Torus { .. } => {
            let (surface, scales) = motion.place_round(surface)?;
            Placed { surface, turned: false, scales }
        }
        RawSurface::Revolution { generatrix, origin, axis, angles, curve_first } => {
            unscaled(RawSurface::Revolution {
                generatrix: generatrix.transformed(map),
                origin: map.point(origin),
                axis: map.vector(axis) * (motion.v_sign() / scale),
                angles: *angles,
                curve_first: *curve_first,
            })
        }
        RawSurface::Extrusion { directrix, direction, range } => unscaled(RawSurface::Extrusion {
            directrix: directrix.transformed(map),
            direction: map.vector(direction),
            range: *range,
        }),
        RawSurface::Nurbs(net) => unscaled(RawSurface::Nurbs(net.transformed(map))),
        RawSurface::Offset { base, distance } => place_offset(base, *distance, &motion)?,
    })
}

/// Places the offset by `distance` [mm] of `base`.
fn place_offset(base: &RawSurface, distance: f64, motion: &Motion) -> Option<Placed> {
    let base = surface(base, motion.map)?;
    let distance = distance * motion.scale * if base.turned { -1.0 } else { 1.0 };
    let surface = RawSurface::Offset { base: Box::new(base.surface), distance };
    Some(Placed { surface, ..base })
}

/// A similarity.
struct Motion<'a> {
    map: &'a Affine,
    /// Scale factor of lengths.
    scale: f64,
    /// Orientation-reversing.
    mirrored: bool,
}

impl Motion<'_> {
    /// Places a frame as a right-handed frame, also for a reflection.
    fn frame(&self, f: &Frame) -> Frame {
        let (x, y) = (self.map.vector(&f.x) / self.scale, self.map.vector(&f.y) / self.scale);
        Frame { origin: self.map.point(&f.origin), x, y, z: x.cross(&y) }
    }

    /// Sign of v of the image.
    fn v_sign(&self) -> f64 {
        if self.mirrored { -1.0 } else { 1.0 }
    }

    /// Image of a cylinder, cone, sphere or torus, and the scale factors of its parameters. `None` for others.
    fn place_round(&self, surface: &RawSurface) -> Option<(RawSurface, [f64; 2])> {
        let (scale, v) = (self.scale, self.v_sign());
        Some(match surface {
            RawSurface::Cylinder { frame, radius } => {
                let (frame, radius) = (self.frame(frame), radius * scale);
                (RawSurface::Cylinder { frame, radius }, [1.0, v * scale])
            }
            RawSurface::Cone { frame, radius, semi_angle } => {
                let (frame, radius) = (self.frame(frame), radius * scale);
                let semi_angle = semi_angle * v;
                (RawSurface::Cone { frame, radius, semi_angle }, [1.0, v * scale])
            }
            RawSurface::Sphere { frame, radius } => {
                let (frame, radius) = (self.frame(frame), radius * scale);
                (RawSurface::Sphere { frame, radius }, [1.0, v])
            }
            RawSurface::Torus { frame, major, minor, keep_outer } => {
                let (major, minor) = (major * scale, minor * scale);
                let (frame, keep_outer) = (self.frame(frame), *keep_outer);
                (RawSurface::Torus { frame, major, minor, keep_outer }, [1.0, v])
            }
            _ => return None,
        })
    }
}

/// Image of the face; `None` for a map that is no similarity. Edge and shell numbers are unchanged.
#[must_use]
pub fn face(face: &RawFace, map: &Affine) -> Option<RawFace> {
    if *map == Affine::identity() {
        return Some(face.clone());
    }
    let placed = surface(&face.surface, map)?;
    let mut out = RawFace {
        surface: placed.surface,
        loops: face.loops.clone(),
        flipped: face.flipped ^ placed.turned,
        source: face.source.clone(),
        shell: face.shell,
        attributes: Arc::clone(&face.attributes),
    };
    let mirrored = map.linear.determinant() < 0.0;
    for boundary in &mut out.loops {
        boundary.vertex = boundary.vertex.map(|p| map.point(&p));
        boundary.edges.iter_mut().for_each(|edge| move_edge(edge, map, placed.scales));
        if mirrored {
            // A reflection reverses the loop about the outward normal: traverse it backwards.
            boundary.reverse();
        }
    }
    Some(out)
}

fn move_edge(edge: &mut RawEdge, map: &Affine, [su, sv]: [f64; 2]) {
    edge.curve = edge.curve.take().map(|c| c.transformed(map));
    edge.ends = edge.ends.map(|ends| ends.map(|p| map.point(&p)));
    if [su, sv] != [1.0, 1.0] {
        edge.pcurve = edge.pcurve.take().and_then(|c| {
            let points = c.points().iter().map(|p| Vec2::new(p.x * su, p.y * sv)).collect();
            let weights = Some(c.weights().to_vec());
            Curve2::try_new(c.degree(), c.knots().to_vec(), points, weights).ok()
        });
    }
}
