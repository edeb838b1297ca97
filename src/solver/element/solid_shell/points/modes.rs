//! Strain directions and stress resultants of the modes of a solid-shell at points in SIMD lanes.

use pulp::Simd;

use super::state::{Points, vectors};
use crate::element::solid_shell::column::{DIRECTIONS, Frame, Totals};
use crate::element::solid_shell::generalised::lanes::{Powers, add_generalised};
use crate::element::solid_shell::pairs::SHAPES;
use crate::element::solid_shell::stretch::{STRETCHES, Stretch};
use crate::numbers::algebra::{apply, multiply, splat, symmetric, symmetric_matrix};
use crate::numbers::lanes::Lane;

/// Strain directions of the modes: thickness strain, then in-plane stretches.
pub(super) struct Modes<S: Simd> {
    /// Number of active directions.
    count: usize,
    directions: [[Lane<S>; 6]; DIRECTIONS],
    /// Stress contracted with the change of the direction of a stretch.
    work: [[Lane<S>; 6]; STRETCHES],
    second: [[Lane<S>; STRETCHES]; STRETCHES],
}

impl<S: Simd> Modes<S> {
    #[inline(always)]
    pub fn new(
        simd: S,
        frame: &Frame<'_>,
        (points, at): (&Points, usize),
        stress: &[Lane<S>; 6],
    ) -> Self {
        let none = [Lane::splat(simd, 0.0); 6];
        let thickness_strain = splat(simd, &frame.thickness_strain);
        let mut directions = [none; DIRECTIONS];
        for (direction, shape_strain) in directions.iter_mut().zip(&points.shape_strain) {
            *direction = Lane::scaled(thickness_strain, Lane::load(simd, shape_strain, at));
        }
        let mut out = Self {
            count: SHAPES,
            directions,
            work: [none; STRETCHES],
            second: [[none[0]; STRETCHES]; STRETCHES],
        };
        if let Some(stretch) = &frame.stretch {
            out.count = DIRECTIONS;
            let c = symmetric_matrix(&Lane::load_all(simd, &points.stretched, at));
            out.set_stretches(simd, stretch, &c, &symmetric_matrix(stress));
        }
        out
    }

    /// Sets the directions of the stretches for the given stretched Cauchy-Green tensors and stresses.
    #[inline(always)]
    fn set_stretches(
        &mut self,
        simd: S,
        stretch: &Stretch<'_>,
        c: &[[Lane<S>; 3]; 3],
        s: &[[Lane<S>; 3]; 3],
    ) {
        let base = vectors(simd, &stretch.axes.base);
        let dual = vectors(simd, &stretch.axes.dual);
        let (mut cb, mut sd) = (base, dual);
        for k in 0..STRETCHES {
            for i in 0..3 {
                cb[k][i] = Lane::dot(&c[i], &base[k]);
                sd[k][i] = Lane::dot(&s[i], &dual[k]);
            }
        }
        for k in 0..STRETCHES {
            let rate = Lane::splat(simd, stretch.rates[k]);
            self.directions[SHAPES + k] = Lane::scaled(symmetric(&cb[k], &dual[k]), rate);
            self.work[k] = Lane::scaled(symmetric(&base[k], &sd[k]), rate + rate);
            for l in 0..STRETCHES {
                let rates = rate * stretch.rates[l];
                self.second[k][l] =
                    rates * Lane::dot(&base[k], &cb[l]) * Lane::dot(&dual[k], &sd[l]);
            }
        }
    }

    /// Adds residual, stiffness and coupling of the modes to `totals`.
    #[inline(always)]
    pub fn add_to(
        &self,
        transposed: &[[Lane<S>; 6]; 6],
        (stress, tangent): (&[Lane<S>; 6], &[[Lane<S>; 6]; 6]),
        powers: &Powers<S>,
        totals: &mut Totals,
    ) {
        for k in 0..self.count {
            let direction = &self.directions[k];
            totals.residual[k] += Lane::dot(direction, stress).sum();
            let mut column = apply(tangent, direction);
            let mut row = multiply(direction, tangent);
            for l in 0..self.count {
                totals.modes[k][l] += Lane::dot(&row, &self.directions[l]).sum();
            }
            if let Some(stretch) = k.checked_sub(SHAPES) {
                let work = &self.work[stretch];
                for l in 0..SHAPES {
                    let value = Lane::dot(work, &self.directions[l]).sum();
                    totals.modes[k][l] += value;
                    totals.modes[l][k] += value;
                }
                for l in 0..STRETCHES {
                    totals.modes[k][SHAPES + l] += self.second[stretch][l].sum();
                }
                for i in 0..6 {
                    column[i] = column[i] + work[i];
                    row[i] = row[i] + work[i];
                }
            }
            add_generalised(&apply(transposed, &column), powers, &mut totals.left[k]);
            add_generalised(&apply(transposed, &row), powers, &mut totals.right[k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::stretch::Axes;
    use super::*;
    use crate::numbers::tensor::{self, Mandel};
    use kanagata_geometry::{Mat3, Vec3};

    const BASE: [[f64; 3]; 3] = [[1.0, 0.1, 0.0], [0.4, 0.8, 0.1], [0.0, -0.1, 0.3]];
    const VALUES: [f64; 2] = [0.5, -0.4];
    const STRESS: Mandel = [3.0, -1.0, 0.5, 0.7, -0.2, 0.4];

    fn axes() -> Axes {
        let base = Mat3::from_columns(&BASE.map(Vec3::from));
        Axes::new(&base, &base.try_inverse().unwrap())
    }

    /// `E'` for stretch values `alpha`.
    fn strain(f: &Mat3, alpha: [f64; 2]) -> Mandel {
        let axes = axes();
        let moved = f * axes.stretched(VALUES, alpha).unwrap().gradient;
        tensor::from_matrix(&((moved.transpose() * moved - Mat3::identity()) * 0.5))
    }

    fn by(a: Mandel, b: Mandel, step: f64) -> Mandel {
        std::array::from_fn(|i| (a[i] - b[i]) / step)
    }

    /// Directions of the stretches, contraction of the stress with their changes, and the second derivatives.
    fn modes(f: &Mat3, alpha: [f64; 2]) -> ([Mandel; 2], [Mandel; 2], [[f64; 2]; 2]) {
        let axes = axes();
        let stretch = axes.stretched(VALUES, alpha).unwrap();
        let mut points = Points::zero();
        let strain = strain(f, alpha);
        for i in 0..6 {
            points.stretched[i][0] = tensor::UNIT[i] + 2.0 * strain[i];
        }
        let zero = Vec3::zeros();
        let frame = Frame {
            along: [zero; 2],
            tilt: [zero; 2],
            across: zero,
            strain: [0.0; 12],
            gradient: stretch.gradient,
            thickness_strain: [0.0; 6],
            unit: [0.0; 6],
            centre_det: 1.0,
            thickening: [0.0; SHAPES],
            stretch: Some(stretch),
        };
        let simd = pulp::Scalar::new();
        let out = Modes::new(simd, &frame, (&points, 0), &splat(simd, &STRESS));
        let mandel = |v: &[Lane<pulp::Scalar>; 6]| v.map(Lane::sum);
        (
            [0, 1].map(|k| mandel(&out.directions[SHAPES + k])),
            out.work.each_ref().map(mandel),
            out.second.map(|row| row.map(Lane::sum)),
        )
    }

    #[test]
    fn derivatives_of_stretches_agree_with_differences() {
        let f = Mat3::new(1.2, 0.3, 0.0, -0.1, 0.7, 0.2, 0.0, 0.1, 1.1);
        let (alpha, step) = ([0.4, 0.25], 1e-5);
        let (directions, work, second) = modes(&f, alpha);
        let moved = |k: usize, step: f64| {
            let mut other = alpha;
            other[k] += step;
            other
        };
        let perturbed = f + Mat3::new(0.1, -0.2, 0.0, 0.3, 0.1, 0.0, 0.2, 0.0, -0.1) * step;
        for k in 0..2 {
            let ends = [moved(k, 0.5 * step), moved(k, -0.5 * step)];
            let rate = by(strain(&f, ends[0]), strain(&f, ends[1]), step);
            (0..6).for_each(|i| assert!((rate[i] - directions[k][i]).abs() < 1e-9));
            for l in 0..2 {
                let at = |step: f64| modes(&f, moved(l, step)).0[k];
                let change = by(at(0.5 * step), at(-0.5 * step), step);
                assert!((tensor::dot(&change, &STRESS) - second[k][l]).abs() < 1e-8);
            }
            let change = |alpha| by(strain(&perturbed, alpha), strain(&f, alpha), step);
            let rate = by(change(ends[0]), change(ends[1]), step);
            let expected = tensor::dot(&work[k], &change(alpha));
            assert!((tensor::dot(&rate, &STRESS) - expected).abs() < 1e-4);
        }
    }
}
