//! In-plane stretch modes of a solid-shell along its axes.
//!
//! In-plane bending makes fibres along `ξ` longer on one side of the element. Fibres along `η` follow by an internal
//! displacement that leaves the nodes unchanged. Its gradient acts multiplicatively: `C' = Uᵀ C U` with
//! `U = 1 + Σ b_k c_k ⊗ c^k`; `c_k` and `c^k` are the base vectors of the undeformed centre and their duals.
//!
//! A mode added to the strain would give a fibre of stress `τ` and modulus `h` the stiffness `h - 2 τ`, where the
//! fibre itself has `h - τ`. Such a mode becomes unstable after large draw-in.
//!
//! Since `U c_k = (1 + b_k) c_k`, all derivatives can be expressed by quantities of the stretched state.

use kanagata_geometry::{Mat3, Vec3};

/// Number of stretch modes: along the first and along the second axis.
pub(super) const STRETCHES: usize = 2;

/// Axes of an element in the reference configuration.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axes {
    /// `c_k`.
    pub base: [Vec3; STRETCHES],
    /// `c^k`.
    pub dual: [Vec3; STRETCHES],
}

/// Stretches at a point of the mid-surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch<'a> {
    pub axes: &'a Axes,
    /// `U`.
    pub gradient: Mat3,
    /// `∂ ln(1 + b_k) / ∂α_k`.
    pub rates: [f64; STRETCHES],
}

impl Axes {
    /// Axes from the base vectors of the centre, the columns of `base`, and their inverse.
    pub fn new(base: &Mat3, inverse: &Mat3) -> Self {
        Self {
            base: [0, 1].map(|k| base.column(k).into_owned()),
            dual: [0, 1].map(|k| inverse.row(k).transpose()),
        }
    }

    /// Stretches `b_k = values[k] alpha[k]`.
    ///
    /// # Errors
    /// `1 + b_k` of the first axis for which it is not positive.
    pub fn stretched(
        &self,
        values: [f64; STRETCHES],
        alpha: [f64; STRETCHES],
    ) -> Result<Stretch<'_>, f64> {
        let mut stretch =
            Stretch { axes: self, gradient: Mat3::identity(), rates: [0.0; STRETCHES] };
        for k in 0..STRETCHES {
            let b = values[k] * alpha[k];
            if b <= -1.0 || b.is_nan() {
                return Err(1.0 + b);
            }
            stretch.gradient += self.base[k] * self.dual[k].transpose() * b;
            stretch.rates[k] = values[k] / (1.0 + b);
        }
        Ok(stretch)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_fibres_along_the_axes_are_stretched() {
        let base = Mat3::from_columns(&[
            Vec3::new(1.0, 0.1, 0.0),
            Vec3::new(0.4, 0.8, 0.1),
            Vec3::new(0.0, -0.1, 0.3),
        ]);
        let axes = Axes::new(&base, &base.try_inverse().unwrap());
        let f = Mat3::new(1.2, 0.3, 0.0, -0.1, 0.7, 0.2, 0.0, 0.1, 1.1);
        let values = [0.5, -0.4];
        let alpha = [0.4, 0.25];
        let stretch = axes.stretched(values, alpha).unwrap();
        let moved = f * stretch.gradient * base;
        for (k, factor) in [1.2, 0.9, 1.0].into_iter().enumerate() {
            assert!((moved.column(k) - factor * f * base.column(k)).norm() < 1e-14);
        }
        assert!(axes.stretched(values, [-3.0, 0.0]).is_err());
    }
}
