//! Right-handed frames and affine maps.

use super::{Mat3, Vec3};

/// A right-handed orthonormal frame: origin and three unit axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Origin [mm].
    pub origin: Vec3,
    /// First axis (unit).
    pub x: Vec3,
    /// Second axis (unit).
    pub y: Vec3,
    /// Third axis (unit).
    pub z: Vec3,
}

impl Frame {
    /// The global frame.
    #[must_use]
    pub fn world() -> Self {
        Self { origin: Vec3::zeros(), x: Vec3::x(), y: Vec3::y(), z: Vec3::z() }
    }

    /// The frame with third axis `z` and first axis along the projection of `x` onto the plane normal to `z`. An `x`
    /// parallel to `z` is replaced by the global axis with the smallest component along `z`. `None` when either vector
    /// is zero or not finite.
    #[must_use]
    pub fn from_z_x(origin: Vec3, z: Vec3, x: Vec3) -> Option<Self> {
        let z = unit(z)?;
        let across = x - z * z.dot(&x);
        let x = if across.norm() > 1e-9 * x.norm() && across.norm() > 0.0 {
            unit(across)?
        } else {
            let axis = Vec3::ith(z.iamin(), 1.0);
            unit(axis - z * z.dot(&axis))?
        };
        Some(Self { origin, x, y: z.cross(&x), z })
    }

    /// Global coordinates of the point with local coordinates `p`.
    #[must_use]
    pub fn point(&self, p: &Vec3) -> Vec3 {
        self.origin + self.x * p.x + self.y * p.y + self.z * p.z
    }

    /// Local coordinates of the point with global coordinates `p`.
    #[must_use]
    pub fn local(&self, p: &Vec3) -> Vec3 {
        let d = p - self.origin;
        Vec3::new(self.x.dot(&d), self.y.dot(&d), self.z.dot(&d))
    }
}

/// `v / |v|`, or `None` when `v` is zero or not finite.
#[must_use]
pub fn unit(v: Vec3) -> Option<Vec3> {
    let n = v.norm();
    (n.is_finite() && n > 0.0).then(|| v / n)
}

/// The affine map `x -> linear x + shift`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Affine {
    /// Linear part; may include scaling and reflection.
    pub linear: Mat3,
    /// Translation [mm].
    pub shift: Vec3,
}

impl Affine {
    /// The identity map.
    #[must_use]
    pub fn identity() -> Self {
        Self { linear: Mat3::identity(), shift: Vec3::zeros() }
    }

    /// Image of a point.
    #[must_use]
    pub fn point(&self, p: &Vec3) -> Vec3 {
        self.linear * p + self.shift
    }

    /// Image of a vector.
    #[must_use]
    pub fn vector(&self, v: &Vec3) -> Vec3 {
        self.linear * v
    }

    /// The composition `self(first(x))`.
    #[must_use]
    pub fn after(&self, first: &Self) -> Self {
        Self { linear: self.linear * first.linear, shift: self.linear * first.shift + self.shift }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_with_parallel_hint_is_still_right_handed() {
        let f = Frame::from_z_x(Vec3::zeros(), Vec3::new(0.0, 0.0, 2.0), Vec3::z()).unwrap();
        assert!((f.x.cross(&f.y) - f.z).norm() < 1e-15);
        let p = Vec3::new(1.0, 2.0, 3.0);
        assert!((f.point(&f.local(&p)) - p).norm() < 1e-15);
        assert!(Frame::from_z_x(Vec3::zeros(), Vec3::zeros(), Vec3::x()).is_none());
    }
}
