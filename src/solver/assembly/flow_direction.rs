//! Error of the stresses from the length of an increment.
//!
//! Backward Euler integration gives the stress at the end of an increment the direction of the plastic strain of the whole
//! increment. Where the direction of the flow turns, it lags behind by half an increment. In the next increment, of plastic
//! work `s · Δεp`, the deviatoric stress `s0` at its start then does less work than one in the direction of the flow, by
//! `|s0| |Δεp| (1 - cos θ)` with the angle `θ` between `s0` and `s`.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::body::Body;
use crate::material::{HistoryLayout, LogState};
use crate::numbers::tensor::{Mandel, dot};

/// Work of an increment and the part of it that is in error, both not negative [N mm].
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct WorkError {
    /// Work that the stresses at the start lack.
    pub lacking: f64,
    /// Dissipated work and change of the elastic energy, absolute values summed over the points.
    pub work: f64,
}

impl WorkError {
    /// Work that is `dissipated`, and `stored` in elastic strains. `products`: of the stress, or force, at the start with
    /// itself, of that at the end with itself, and of both.
    pub(crate) fn of(dissipated: f64, products: [f64; 3], stored: f64) -> Self {
        let [old, new, both] = products;
        let dissipated = dissipated.max(0.0);
        let share = if new > 0.0 { ((old * new).sqrt() - both).max(0.0) / new } else { 0.0 };
        Self { lacking: share * dissipated, work: dissipated + stored.abs() }
    }

    pub(crate) fn plus(self, other: Self) -> Self {
        Self { lacking: self.lacking + other.lacking, work: self.work + other.work }
    }

    /// `factor` times both.
    pub(crate) fn times(self, factor: f64) -> Self {
        Self { lacking: factor * self.lacking, work: factor * self.work }
    }

    /// Relative error; 0 without work.
    #[must_use]
    pub fn relative(self) -> f64 {
        if self.work > 0.0 { self.lacking / self.work } else { 0.0 }
    }
}

impl Body {
    /// Error of the increment from the last commit to the last evaluation; zero for a material without history.
    pub(crate) fn flow_direction_error(&self) -> WorkError {
        let Some(layout) = self.material.history_layout() else { return WorkError::default() };
        let (stride, len) = (self.stride(), self.material.state_len());
        let point_len = self.kind.point_count() * len;
        let shared = self.point_weights();
        let data = self.evaluation_data();
        let of_element = |element: usize| {
            let own = data.geometry[element].map(|point| point.weight);
            let volume: f64 = own.iter().sum();
            let weight =
                |point: usize| shared.as_ref().map_or(own[point % 8], |w| volume * w[point]);
            let at = element * stride..element * stride + point_len;
            let ends = data.committed[at.clone()].chunks_exact(len);
            let ends = ends.zip(data.trial[at].chunks_exact(len)).enumerate();
            ends.fold(WorkError::default(), |sum, (point, (old, new))| {
                let states = self.material.log_state(old).zip(self.material.log_state(new));
                let found = states.map(|(old, new)| point_error(&layout, &old, &new));
                sum.plus(found.unwrap_or_default().times(weight(point)))
            })
        };
        // Collected in order, so that the sum does not depend on the number of threads.
        let each: Vec<WorkError> =
            (0..self.mesh.elements.len()).into_par_iter().map(of_element).collect();
        each.into_iter().fold(WorkError::default(), WorkError::plus)
    }
}

/// Error at a point, per volume. The elastic law is isotropic.
fn point_error(layout: &HistoryLayout, old: &LogState, new: &LogState) -> WorkError {
    let shear = 0.5 * layout.stiffness[3][3];
    let bulk = layout.stiffness[0][0] - 4.0 / 3.0 * shear;
    let (old_dev, old_mean) = split(&old.stress);
    let (new_dev, new_mean) = split(&new.stress);
    let change = |k: usize| new.strain[k] - old.strain[k];
    let stretch: [f64; 6] = std::array::from_fn(change);
    let all = dot(&new.stress, &stretch);
    let dev: [f64; 6] = std::array::from_fn(|k| new_dev[k] - old_dev[k]);
    let elastic = dot(&new_dev, &dev) / (2.0 * shear) + new_mean * (new_mean - old_mean) / bulk;
    let energy = |dev: &Mandel, mean: f64| dot(dev, dev) / (4.0 * shear) + 0.5 * mean * mean / bulk;
    let stored = energy(&new_dev, new_mean) - energy(&old_dev, old_mean);
    let products =
        [(&old_dev, &old_dev), (&new_dev, &new_dev), (&old_dev, &new_dev)].map(|(a, b)| dot(a, b));
    WorkError::of(all - elastic, products, stored)
}

/// Deviator and mean of a tensor.
fn split(tensor: &Mandel) -> (Mandel, f64) {
    let mean = (tensor[0] + tensor[1] + tensor[2]) / 3.0;
    (std::array::from_fn(|k| if k < 3 { tensor[k] - mean } else { tensor[k] }), mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::card;

    /// A point whose stress turns by an angle while it flows with a known power.
    #[test]
    fn a_point_that_turns_lacks_the_share_of_its_power() {
        let steel = card::find("mild-steel-neto2012").unwrap();
        let (young, poisson) = (steel.young_mpa, steel.poisson);
        let law = steel.build(0.0).unwrap();
        let layout = law.history_layout().unwrap();
        let elastic = |stress: &Mandel| {
            let trace: f64 = stress[..3].iter().sum();
            let own =
                |k: usize| (1.0 + poisson) * stress[k] - if k < 3 { poisson * trace } else { 0.0 };
            std::array::from_fn(|k| own(k) / young)
        };
        let (norm, flow) = (60000.0_f64.sqrt(), 0.03);
        let first = [200.0, -100.0, -100.0, 0.0, 0.0, 0.0];
        for (angle, growth) in [(0.0_f64, 1.0), (0.4, 1.0), (0.4, 1.3), (2.0, 1.0)] {
            // Turned from the plane of the first deviator to a shear of the same norm; with a mean stress of 50 MPa.
            let deviator: Mandel = std::array::from_fn(|k| match k {
                0..3 => growth * first[k] * angle.cos(),
                3 => growth * norm * angle.sin(),
                _ => 0.0,
            });
            let new = std::array::from_fn(|k| deviator[k] + if k < 3 { 50.0 } else { 0.0 });
            let (before, after): (Mandel, Mandel) = (elastic(&first), elastic(&new));
            let strain = std::array::from_fn(|k| after[k] + deviator[k] * flow / (growth * norm));
            let old = LogState { strain: before, stress: first };
            let found = point_error(&layout, &old, &LogState { strain, stress: new });
            let stored = 0.5 * (dot(&new, &after) - dot(&first, &before));
            let (work, lacking) = (growth * norm * flow, norm * flow * (1.0 - angle.cos()));
            assert!((found.work - work - stored.abs()).abs() < 1e-9 * work, "{found:?}");
            assert!((found.lacking - lacking).abs() < 1e-9 * work, "{found:?}");
        }
    }
}
