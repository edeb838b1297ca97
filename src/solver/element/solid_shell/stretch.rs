//! Stretches of an element along its axes, the modes of its mid surface.
//!
//! An element that bends in its plane has fibres along `ξ` that are longer on one side; those across are free to follow,
//! by a displacement inside the element that leaves its nodes. Its gradient multiplies: `C' = Uᵀ C U` with
//! `U = 1 + Σ b_k c_k ⊗ c^k`, `c_k` and `c^k` the base of the element's centre before anything moved. A mode added to the
//! strain instead has the stiffness `h - 2 τ` in a fibre of stress `τ` and modulus `h`, where the fibre itself has `h - τ`,
//! and is lost once the sheet has been drawn far.
//!
//! As `U c_k = (1 + b_k) c_k`, all derivatives can be said by what is there after the stretch.

use crate::geometry::{Mat3, Vec3};
use crate::solver::tensor::{self, Mandel};

/// Modes that stretch: along the first axis and along the second.
pub(super) const STRETCHES: usize = 2;

/// Axes of an element before anything moved.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axes {
    /// `c_k`.
    base: [Vec3; STRETCHES],
    /// `c^k`.
    dual: [Vec3; STRETCHES],
}

/// Stretches at a place.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch<'a> {
    axes: &'a Axes,
    /// `U`.
    pub gradient: Mat3,
    /// `∂ ln(1 + b_k) / ∂α_k`.
    rates: [f64; STRETCHES],
}

impl Axes {
    /// With the base vectors of the centre in the columns of `base`, and its inverse.
    pub fn new(base: &Mat3, inverse: &Mat3) -> Self {
        Self {
            base: [0, 1].map(|k| base.column(k).into_owned()),
            dual: [0, 1].map(|k| inverse.row(k).transpose()),
        }
    }

    /// Stretches `b_k = values[k] alpha[k]`.
    ///
    /// # Errors
    /// The least `1 + b_k` when it is not above zero.
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

impl Stretch<'_> {
    /// `∂E'/∂α_k`, from `C'`.
    pub fn directions(&self, stretched: &Mandel) -> [Mandel; STRETCHES] {
        let Axes { base, dual } = self.axes;
        let c = tensor::to_matrix(stretched);
        std::array::from_fn(|k| symmetric(c * base[k] * self.rates[k], dual[k]))
    }

    /// `S : ∂²E'/∂α_k∂α_l`.
    pub fn second(&self, stretched: &Mandel, stress: &Mandel) -> [[f64; STRETCHES]; STRETCHES] {
        let Axes { base, dual } = self.axes;
        let (c, s) = (tensor::to_matrix(stretched), tensor::to_matrix(stress));
        std::array::from_fn(|k| {
            std::array::from_fn(|l| {
                let rates = self.rates[k] * self.rates[l];
                rates * base[k].dot(&(c * base[l])) * dual[k].dot(&(s * dual[l]))
            })
        })
    }

    /// What `S : ∂(dE')/∂α_k` is to `dE'`, a change of the strain by something else.
    pub fn work(&self, stress: &Mandel) -> [Mandel; STRETCHES] {
        let Axes { base, dual } = self.axes;
        let s = tensor::to_matrix(stress);
        std::array::from_fn(|k| symmetric(base[k], s * dual[k] * (2.0 * self.rates[k])))
    }
}

/// `½ (x ⊗ y + y ⊗ x)`.
fn symmetric(x: Vec3, y: Vec3) -> Mandel {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let mixed = |i: usize, j: usize| half * (x[i] * y[j] + x[j] * y[i]);
    [x[0] * y[0], x[1] * y[1], x[2] * y[2], mixed(0, 1), mixed(1, 2), mixed(2, 0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fibres_along_the_axes_are_stretched_and_nothing_else() {
        let base = Mat3::from_columns(&[
            Vec3::new(1.0, 0.1, 0.0),
            Vec3::new(0.4, 0.8, 0.1),
            Vec3::new(0.0, -0.1, 0.3),
        ]);
        let axes = Axes::new(&base, &base.try_inverse().unwrap());
        let f = Mat3::new(1.2, 0.3, 0.0, -0.1, 0.7, 0.2, 0.0, 0.1, 1.1);
        let values = [0.5, -0.4];
        // E' and its change with a change of F.
        let strain = |f: &Mat3, alpha: [f64; 2]| {
            let moved = f * axes.stretched(values, alpha).unwrap().gradient;
            tensor::from_matrix(&((moved.transpose() * moved - Mat3::identity()) * 0.5))
        };
        let alpha = [0.4, 0.25];
        let stretch = axes.stretched(values, alpha).unwrap();
        let moved = f * stretch.gradient * base;
        for (k, factor) in [1.2, 0.9, 1.0].into_iter().enumerate() {
            assert!((moved.column(k) - factor * f * base.column(k)).norm() < 1e-14);
        }
        let stretched = strain(&f, alpha).map(|e| 2.0 * e);
        let stretched = std::array::from_fn(|i| stretched[i] + tensor::UNIT[i]);
        let stress = [3.0, -1.0, 0.5, 0.7, -0.2, 0.4];
        let directions = stretch.directions(&stretched);
        let (second, work) = (stretch.second(&stretched, &stress), stretch.work(&stress));
        let step = 1e-5;
        let moved = |k: usize, step: f64| {
            let mut other = alpha;
            other[k] += step;
            other
        };
        let turned = f + Mat3::new(0.1, -0.2, 0.0, 0.3, 0.1, 0.0, 0.2, 0.0, -0.1) * step;
        let by = |a: Mandel, b: Mandel| -> Mandel { std::array::from_fn(|i| (a[i] - b[i]) / step) };
        for k in 0..2 {
            let rate = by(strain(&f, moved(k, 0.5 * step)), strain(&f, moved(k, -0.5 * step)));
            (0..6).for_each(|i| assert!((rate[i] - directions[k][i]).abs() < 1e-9));
            for l in 0..2 {
                let at = |step: f64| {
                    let alpha = moved(l, step);
                    let c = strain(&f, alpha).map(|e| 2.0 * e);
                    let c = std::array::from_fn(|i| c[i] + tensor::UNIT[i]);
                    axes.stretched(values, alpha).unwrap().directions(&c)[k]
                };
                let change = by(at(0.5 * step), at(-0.5 * step));
                assert!((tensor::dot(&change, &stress) - second[k][l]).abs() < 1e-8);
            }
            let change = |alpha| by(strain(&turned, alpha), strain(&f, alpha));
            let rate = by(change(moved(k, 0.5 * step)), change(moved(k, -0.5 * step)));
            let expected = tensor::dot(&work[k], &change(alpha));
            assert!((tensor::dot(&rate, &stress) - expected).abs() < 1e-4);
        }
        assert!(axes.stretched(values, [-3.0, 0.0]).is_err());
    }
}
