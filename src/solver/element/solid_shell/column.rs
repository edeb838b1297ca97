//! The points of a solid-shell above one point of its mid surface.

use super::{
    GENERALISED, InPlane, MODES, Pairs, Plane, Shape, add_generalised, add_generalised_stiffness,
    natural, products, to_cartesian,
};
use crate::solver::element::modes::ModeSums;
use crate::solver::element::{ElementInput, ElementMatrices, FailureReason, PointFailure, Want};
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
    pub current: &'a Pairs,
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
        let at = |pairs: &Pairs| products(pairs, self.in_plane, xi, eta);
        let (before, now) = (at(self.shape.pairs), at(self.current));
        let strain: [f64; GENERALISED] = std::array::from_fn(|i| now[i] - before[i]);
        let mut totals = Totals {
            stress: [0.0; GENERALISED],
            stiffness: [[0.0; GENERALISED]; GENERALISED],
            left: [[0.0; GENERALISED]; M],
            right: [[0.0; GENERALISED]; M],
        };
        let first = self.index * rule.len();
        for (chunk, rule) in rule.chunks(POINTS).enumerate() {
            let first = first + chunk * POINTS;
            let layers = self.layers::<M>(&strain, alpha, rule, first)?;
            let mut c = [[1.0; POINTS]; 6];
            for (k, layer) in layers.iter().enumerate() {
                (0..6).for_each(|i| c[i][k] = layer.stretch[i]);
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
                layer.add(&answers.at(k), wants_tangent, &mut totals, sums, out);
            }
        }
        Ok(totals)
    }

    /// The points `first` and on, at the places `rule` through the thickness.
    fn layers<const M: usize>(
        &self,
        strain: &[f64; GENERALISED],
        alpha: &[f64; M],
        rule: &[(f64, f64)],
        first: usize,
    ) -> Result<Vec<Layer<M>>, PointFailure> {
        let (xi, eta) = (self.xi, self.eta);
        let plane = Plane::at(xi, eta);
        let layer = |(k, &(zeta, quadrature)): (usize, &(f64, f64))| {
            let (map, det) = to_cartesian(self.shape.pairs, &plane, zeta).ok_or({
                let reason = FailureReason::Inverted { ratio: 0.0 };
                PointFailure { point: first + k, reason }
            })?;
            let directions = mode_strains::<M>(self.shape.centre, det, [xi, eta, zeta]);
            let mut assumed = tensor::apply(&map, &natural(strain, zeta));
            for (direction, value) in directions.iter().zip(alpha) {
                (0..6).for_each(|i| assumed[i] += value * direction[i]);
            }
            let stretch = std::array::from_fn(|i| tensor::UNIT[i] + 2.0 * assumed[i]);
            Ok(Layer { zeta, weight: det * quadrature, map, directions, stretch })
        };
        rule.iter().enumerate().map(layer).collect()
    }
}

/// One point of a column.
struct Layer<const M: usize> {
    zeta: f64,
    weight: f64,
    /// From natural to Cartesian strain.
    map: Mandel66,
    /// Cartesian strains of the modes.
    directions: [Mandel; M],
    /// Assumed right Cauchy-Green tensor.
    stretch: Mandel,
}

impl<const M: usize> Layer<M> {
    /// Adds the point to the sums of its column and element.
    fn add(
        &self,
        response: &PointResponse,
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
        for (k, direction) in directions.iter().enumerate() {
            sums.residual[k] += tensor::dot(direction, &stress);
            let column = tensor::apply(&tangent, direction);
            let row = tensor::apply(&tangent_transposed, direction);
            for (l, other) in directions.iter().enumerate() {
                sums.stiffness[k][l] += tensor::dot(&row, other);
            }
            add_generalised(&tensor::apply(&back, &column), zeta, &mut totals.left[k]);
            add_generalised(&tensor::apply(&back, &row), zeta, &mut totals.right[k]);
        }
    }
}

/// Cartesian strains `(j0/j) T0 M` of the modes at a point.
fn mode_strains<const M: usize>(centre: &(Mandel66, f64), det: f64, xi: [f64; 3]) -> [Mandel; M] {
    let (map, centre_det) = centre;
    std::array::from_fn(|k| {
        let mode = &MODES[k];
        let value = mode.value(xi) * centre_det / det;
        std::array::from_fn(|i| value * map[i][mode.column])
    })
}
