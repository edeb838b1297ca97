//! Maps from a file's surface parameters to those of [`RawSurface`], and points on raw surfaces.

use crate::raw::RawSurface;
use kanagata_geometry::nurbs::Curve2;
use kanagata_geometry::{Vec2, Vec3};
use nalgebra::{Matrix2, Rotation3, Unit};

/// An affine map of the parameter plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct UvMap {
    /// Linear part.
    pub linear: Matrix2<f64>,
    /// Translation.
    pub shift: Vec2,
}

impl UvMap {
    /// The identity map.
    pub fn identity() -> Self {
        Self::scales(1.0, 1.0)
    }

    /// `(a u, b v)`.
    pub fn scales(a: f64, b: f64) -> Self {
        Self { linear: Matrix2::new(a, 0.0, 0.0, b), shift: Vec2::zeros() }
    }

    /// Independent maps of both parameters: `(a0 + a1 u, b0 + b1 v)`.
    pub fn axes([a0, a1]: [f64; 2], [b0, b1]: [f64; 2]) -> Self {
        Self { linear: Matrix2::new(a1, 0.0, 0.0, b1), shift: Vec2::new(a0, b0) }
    }

    /// `self` after exchanging the file's parameters.
    pub fn swapped(self) -> Self {
        Self { linear: self.linear * Matrix2::new(0.0, 1.0, 1.0, 0.0), shift: self.shift }
    }

    /// Image of a point.
    pub fn point(&self, p: Vec2) -> Vec2 {
        self.linear * p + self.shift
    }

    /// Image of a curve; `None` if it is no valid curve.
    pub fn curve(&self, curve: &Curve2) -> Option<Curve2> {
        let points = curve.points().iter().map(|p| self.point(*p)).collect();
        let weights = Some(curve.weights().to_vec());
        Curve2::try_new(curve.degree(), curve.knots().to_vec(), points, weights).ok()
    }

    /// True for an orientation-reversing map, which changes the sign of `su x sv`.
    pub fn mirrors(&self) -> bool {
        self.linear.determinant() < 0.0
    }
}

/// Point of a raw surface; `None` for offsets.
pub(crate) fn point_on(surface: &RawSurface, uv: Vec2) -> Option<Vec3> {
    let (u, v) = (uv.x, uv.y);
    let around = |f: &kanagata_geometry::Frame, radius: f64, height: f64| {
        f.origin + (f.x * u.cos() + f.y * u.sin()) * radius + f.z * height
    };
    Some(match surface {
        RawSurface::Plane(f) => f.origin + f.x * u + f.y * v,
        RawSurface::Cylinder { frame, radius } => around(frame, *radius, v),
        RawSurface::Cone { frame, radius, semi_angle } => {
            around(frame, radius + v * semi_angle.tan(), v)
        }
        RawSurface::Sphere { frame, radius } => around(frame, radius * v.cos(), radius * v.sin()),
        RawSurface::Torus { frame, major, minor, .. } => {
            around(frame, major + minor * v.cos(), minor * v.sin())
        }
        RawSurface::Revolution { generatrix, origin, axis, .. } => {
            let turn = Rotation3::from_axis_angle(&Unit::new_normalize(*axis), u);
            origin + turn * (generatrix.point(v) - origin)
        }
        RawSurface::Extrusion { directrix, direction, .. } => directrix.point(u) + direction * v,
        RawSurface::Nurbs(surface) => surface.point(uv),
        RawSurface::Offset { .. } => return None,
    })
}
