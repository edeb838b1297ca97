//! The points of a solid-shell above one point of its mid surface.

use super::generalised::{
    GENERALISED, add_curvature, add_generalised, add_generalised_stiffness, derivatives, natural,
    products,
};
use super::stretch::Stretch;
use super::{
    InPlane, MODES, Moved, Pairs, Plane, Shape, Sums, THICKNESS_MODES, base_vectors, inverse,
    to_cartesian,
};
use crate::geometry::Mat3;
use crate::solver::element::modes::ModeSums;
use crate::solver::element::{
    ElementInput, ElementMatrices, FailureReason, PointFailure, Want, compatible,
};
use crate::solver::lanes::POINTS;
use crate::solver::material::log_strain::{self, PointResponse, Responses};
use crate::solver::tensor::{self, Mandel, Mandel66};

/// Generalised stress and stiffness of one column of points.
pub(super) struct Totals<const M: usize> {
    pub stress: [f64; GENERALISED],
    pub stiffness: [[f64; GENERALISED]; GENERALISED],
    pub left: [[f64; GENERALISED]; M],
    pub right: [[f64; GENERALISED]; M],
}

/// The points above one point of the mid surface.
pub(super) struct Column<'a> {
    pub input: &'a ElementInput<'a>,
    pub shape: &'a Shape<'a>,
    pub moved: &'a Moved,
    pub in_plane: &'a InPlane,
    pub index: usize,
    pub xi: f64,
    pub eta: f64,
}

impl Column<'_> {
    /// Generalised stress and stiffness; the modes' sums are added to `sums`, energies to `out`.
    pub(super) fn integrate<const M: usize>(
        &self,
        alpha: &[f64; M],
        new_state: &mut [f64],
        sums: &mut ModeSums<M>,
        out: &mut ElementMatrices,
    ) -> Result<Totals<M>, PointFailure> {
        let (xi, eta) = (self.xi, self.eta);
        let rule = self.shape.rule;
        let at = |pairs: &Pairs, turned| products(pairs, self.in_plane, turned, (xi, eta));
        let before = at(self.shape.pairs, &[0.0; 2]);
        let now = at(&self.moved.pairs, &self.moved.fibres.value);
        let strain: [f64; GENERALISED] = std::array::from_fn(|i| now[i] - before[i]);
        let mut totals = Totals {
            stress: [0.0; GENERALISED],
            stiffness: [[0.0; GENERALISED]; GENERALISED],
            left: [[0.0; GENERALISED]; M],
            right: [[0.0; GENERALISED]; M],
        };
        let first = self.index * rule.len();
        let stretch = self.stretch(alpha)?;
        for (chunk, rule) in rule.chunks(POINTS).enumerate() {
            let first = first + chunk * POINTS;
            let layers = self.layers::<M>(&strain, (alpha, stretch.as_ref()), rule, first)?;
            let mut c = [[1.0; POINTS]; 6];
            for (k, layer) in layers.iter().enumerate() {
                (0..6).for_each(|i| c[i][k] = layer.stretched[i]);
            }
            let len = self.input.material.state_len();
            let range = first * len..(first + rule.len()) * len;
            let histories = (&self.input.old_state[range.clone()], &mut new_state[range]);
            let mut answers = Responses::zero();
            log_strain::update_points(
                self.input.material,
                &c,
                rule.len(),
                histories,
                true,
                &mut answers,
            )
            .map_err(|(k, error)| PointFailure { point: first + k, reason: error.into() })?;
            for (k, layer) in layers.iter().enumerate() {
                let wants_tangent = self.input.want == Want::ResidualAndTangent;
                let answer = answers.at(k);
                layer.add(&answer, stretch.as_ref(), wants_tangent, &mut totals, sums, out);
            }
        }
        Ok(totals)
    }

    /// Adds what the points gave to the element.
    pub(super) fn add<const M: usize>(
        &self,
        totals: &Totals<M>,
        sums: &mut Sums<M>,
        out: &mut ElementMatrices,
    ) {
        let at = (self.xi, self.eta);
        let b = derivatives(self.moved, self.in_plane, at);
        for (row, value) in b.iter().zip(&totals.stress) {
            out.force.iter_mut().zip(row).for_each(|(sum, rate)| *sum += rate * value);
        }
        let modes = &mut sums.modes;
        for k in 0..M {
            for (row, (left, right)) in b.iter().zip(totals.left[k].iter().zip(&totals.right[k])) {
                modes.left[k].iter_mut().zip(row).for_each(|(sum, rate)| *sum += rate * left);
                modes.right[k].iter_mut().zip(row).for_each(|(sum, rate)| *sum += rate * right);
            }
        }
        if self.input.want == Want::ResidualAndTangent {
            compatible::add_congruence(&b, &totals.stiffness, &mut out.tangent);
            let curvature = (&mut sums.curvature, &mut sums.turning);
            add_curvature(&totals.stress, self.in_plane, at, curvature);
        }
    }

    /// Stretches of the column, if it has such modes: the same at all its points, so weighted by the mean of det J.
    fn stretch<const M: usize>(
        &self,
        alpha: &[f64; M],
    ) -> Result<Option<Stretch<'_>>, PointFailure> {
        let [along, across] = match alpha[THICKNESS_MODES..] {
            [along, across] => [along, across],
            _ => return Ok(None),
        };
        let plane = Plane::at(self.xi, self.eta);
        let det = |zeta: f64| base_vectors(self.shape.pairs, &plane, zeta).determinant();
        let (mut sum, mut weights) = (0.0, 0.0);
        for &(zeta, weight) in self.shape.rule {
            sum += weight * det(zeta);
            weights += weight;
        }
        let share = self.shape.centre.1 * weights / sum;
        let stretch =
            self.shape.axes.stretched([self.xi * share, self.eta * share], [along, across]);
        stretch.map(Some).map_err(|ratio| PointFailure {
            point: self.index * self.shape.rule.len(),
            reason: FailureReason::Inverted { ratio },
        })
    }

    /// The points `first` and on, at the places `rule` through the thickness.
    fn layers<const M: usize>(
        &self,
        strain: &[f64; GENERALISED],
        (alpha, stretch): (&[f64; M], Option<&Stretch<'_>>),
        rule: &[(f64, f64)],
        first: usize,
    ) -> Result<Vec<Layer<M>>, PointFailure> {
        let (xi, eta) = (self.xi, self.eta);
        let plane = Plane::at(xi, eta);
        let gradient = stretch.map_or_else(Mat3::identity, |stretch| stretch.gradient);
        let (through, unit) = over(&gradient, &self.shape.centre.0);
        let layer = |(k, &(zeta, quadrature)): (usize, &(f64, f64))| {
            let base = base_vectors(self.shape.pairs, &plane, zeta);
            let (inverse, det) = inverse(&base).ok_or({
                let reason = FailureReason::Inverted { ratio: 0.0 };
                PointFailure { point: first + k, reason }
            })?;
            let map = to_cartesian(&(inverse * gradient));
            let mut directions = [[0.0; 6]; M];
            let share = self.shape.centre.1 / det;
            for (direction, mode) in directions.iter_mut().zip(&MODES) {
                let value = mode.value([xi, eta, zeta]) * share;
                *direction = through.map(|entry| value * entry);
            }
            let mut half = tensor::apply(&map, &natural(strain, zeta));
            for (direction, value) in directions[..THICKNESS_MODES].iter().zip(alpha) {
                (0..6).for_each(|i| half[i] += value * direction[i]);
            }
            let stretched = std::array::from_fn(|i| unit[i] + 2.0 * half[i]);
            if let Some(stretch) = stretch {
                directions[THICKNESS_MODES..].copy_from_slice(&stretch.directions(&stretched));
            }
            Ok(Layer { zeta, weight: det * quadrature, map, directions, stretched })
        };
        rule.iter().enumerate().map(layer).collect()
    }
}

/// The strain through the thickness, and `1`, with the stretch `U` over them: `Uᵀ e U` and `Uᵀ U`.
fn over(gradient: &Mat3, centre: &Mandel66) -> (Mandel, Mandel) {
    let rows = std::array::from_fn(|i| std::array::from_fn(|j| gradient[(j, i)]));
    let through = centre.map(|row| row[2]);
    (
        tensor::apply(&tensor::congruence(&rows), &through),
        tensor::from_matrix(&(gradient.transpose() * gradient)),
    )
}

/// One point of a column.
struct Layer<const M: usize> {
    zeta: f64,
    weight: f64,
    /// From natural to Cartesian strain, stretched.
    map: Mandel66,
    /// Cartesian strains of the modes.
    directions: [Mandel; M],
    /// Assumed right Cauchy-Green tensor.
    stretched: Mandel,
}

impl<const M: usize> Layer<M> {
    /// Adds the point to the sums of its column and element.
    fn add(
        &self,
        response: &PointResponse,
        stretch: Option<&Stretch<'_>>,
        wants_tangent: bool,
        totals: &mut Totals<M>,
        sums: &mut ModeSums<M>,
        out: &mut ElementMatrices,
    ) {
        let &Self { zeta, weight, ref map, ref directions, .. } = self;
        out.elastic_energy += weight * response.elastic_energy;
        out.plastic_work += weight * response.plastic_work;
        let stress = response.stress.map(|value| weight * value);
        let tangent = response.tangent.map(|row| row.map(|value| weight * value));
        let back = tensor::transpose(map);
        add_generalised(&tensor::apply(&back, &stress), zeta, &mut totals.stress);
        if wants_tangent {
            let natural_tangent = tensor::product(&tensor::product(&back, &tangent), map);
            add_generalised_stiffness(&natural_tangent, zeta, &mut totals.stiffness);
        }
        let tangent_transposed = tensor::transpose(&tangent);
        let work = stretch.map(|stretch| stretch.work(&stress));
        for (k, direction) in directions.iter().enumerate() {
            sums.residual[k] += tensor::dot(direction, &stress);
            let mut column = tensor::apply(&tangent, direction);
            let mut row = tensor::apply(&tangent_transposed, direction);
            for (l, other) in directions.iter().enumerate() {
                sums.stiffness[k][l] += tensor::dot(&row, other);
            }
            if let (Some(work), true) = (&work, k >= THICKNESS_MODES) {
                let work = &work[k - THICKNESS_MODES];
                for (l, other) in directions[..THICKNESS_MODES].iter().enumerate() {
                    let value = tensor::dot(work, other);
                    sums.stiffness[k][l] += value;
                    sums.stiffness[l][k] += value;
                }
                column.iter_mut().zip(work).for_each(|(x, w)| *x += w);
                row.iter_mut().zip(work).for_each(|(x, w)| *x += w);
            }
            add_generalised(&tensor::apply(&back, &column), zeta, &mut totals.left[k]);
            add_generalised(&tensor::apply(&back, &row), zeta, &mut totals.right[k]);
        }
        if let Some(stretch) = stretch {
            let second = stretch.second(&self.stretched, &stress);
            for (row, values) in sums.stiffness[THICKNESS_MODES..].iter_mut().zip(second) {
                row[THICKNESS_MODES..]
                    .iter_mut()
                    .zip(values)
                    .for_each(|(sum, value)| *sum += value);
            }
        }
    }
}
