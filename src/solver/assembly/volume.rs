//! Volume balance of the sheet (nodal volume against elastic volume strain), and check for inverted elements.

use rayon::prelude::*;

use super::body::Body;
use super::evaluation::ElementFailure;
use crate::element::{FailureReason, PointGeometry};
use crate::material::HistoryLayout;

impl Body {
    /// Volume error as a fraction of the undeformed volume. Plastic flow is isochoric, so an element at
    /// `displacement` has the volume `∫ exp tr(E - Ep) dV` with the elastic strains of the last commit. Absolute
    /// differences are summed over the elements. `None` for a material that stores no strains.
    #[must_use]
    pub fn volume_balance(&self, displacement: &[f64]) -> Option<f64> {
        let history_layout = self.material.history_layout()?;
        let (stride, len) = (self.stride(), self.material.state_len());
        let point_len = self.kind.point_count() * len;
        let weights = self.point_weights();
        let volume_error = |element: usize| {
            let points = &self.evaluation_data().geometry[element];
            let states =
                &self.evaluation_data().committed[element * stride..element * stride + point_len];
            let undeformed: f64 = points.iter().map(|point| point.weight).sum();
            let elastic: f64 = match &weights {
                Some(weights) => undeformed * elastic_ratio(states, len, &history_layout, weights),
                None => {
                    let undeformed = points.each_ref().map(|point| point.weight);
                    elastic_ratio(states, len, &history_layout, &undeformed)
                }
            };
            [(self.current_volume(element, displacement) - elastic).abs(), undeformed]
        };
        // Collected in order, so that the sum does not depend on the number of threads.
        let each: Vec<[f64; 2]> =
            (0..self.mesh.elements.len()).into_par_iter().map(volume_error).collect();
        let [volume_error, all] =
            each.iter().fold([0.0; 2], |[a, b], [volume_error, all]| [a + volume_error, b + all]);
        Some(volume_error / all)
    }

    /// Checks that every element has a positive volume over each of its four in-plane Gauss points. Strains of a
    /// solid-shell are computed from lengths and do not detect an inverted element.
    ///
    /// # Errors
    /// [`FailureReason::Inverted`] for the lowest-numbered inverted element.
    pub fn not_inside_out(&self, displacement: &[f64]) -> Result<(), ElementFailure> {
        let smallest_ratio = |element: usize| {
            let (points, moved) =
                (&self.evaluation_data().geometry[element], self.moved(element, displacement));
            let over = |place: usize| {
                let pair = [&points[place], &points[place + 4]];
                let [volume, undeformed] =
                    pair.iter().fold([0.0; 2], |[volume, undeformed], point| {
                        [
                            volume + point.weight * volume_ratio(point, &moved),
                            undeformed + point.weight,
                        ]
                    });
                (place, volume / undeformed)
            };
            (0..4).map(over).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default()
        };
        let elements = (0..self.mesh.elements.len()).into_par_iter();
        let inverted =
            elements.map(|k| (k, smallest_ratio(k))).find_first(|(_, (_, ratio))| *ratio <= 0.0);
        inverted.map_or(Ok(()), |(element, (point, ratio))| {
            Err(ElementFailure { element, point, reason: FailureReason::Inverted { ratio } })
        })
    }

    /// Volume fractions of the points of an element; `None` if its Gauss points define them.
    pub(super) fn point_weights(&self) -> Option<Vec<f64>> {
        let layers = self.kind.point_count() / 4;
        let weight_sum: f64 = self.thickness_rule.iter().map(|(_, weight)| weight).sum();
        (!self.thickness_rule.is_empty()).then(|| {
            let rule = self.thickness_rule.iter().map(|(_, weight)| weight / (4.0 * weight_sum));
            rule.cycle().take(4 * layers).collect()
        })
    }

    /// Current volume of an element at `displacement` [mm³].
    fn current_volume(&self, element: usize, displacement: &[f64]) -> f64 {
        let moved = self.moved(element, displacement);
        self.evaluation_data().geometry[element]
            .iter()
            .map(|point| point.weight * volume_ratio(point, &moved))
            .sum()
    }

    /// Nodal displacements of an element [mm].
    fn moved(&self, element: usize, displacement: &[f64]) -> [[f64; 3]; 8] {
        self.mesh.elements[element].map(|node| {
            let at = 3 * node as usize;
            [displacement[at], displacement[at + 1], displacement[at + 2]]
        })
    }
}

/// `det F` at a point.
fn volume_ratio(point: &PointGeometry, moved: &[[f64; 3]; 8]) -> f64 {
    let mut f = kanagata_geometry::Mat3::identity();
    for (a, u) in moved.iter().enumerate() {
        for (i, u) in u.iter().enumerate() {
            for (j, gradient) in point.gradient.iter().enumerate() {
                f[(i, j)] += u * gradient[a];
            }
        }
    }
    f.determinant()
}

/// `Σ w exp tr(E - Ep)` over the points of an element with contiguous histories of `len` values.
fn elastic_ratio(
    states: &[f64],
    len: usize,
    history_layout: &HistoryLayout,
    weights: &[f64],
) -> f64 {
    let trace = |state: &[f64], at: usize| state[at..at + 3].iter().sum::<f64>();
    let ratio = |state: &[f64]| {
        (trace(state, history_layout.strain) - trace(state, history_layout.plastic)).exp()
    };
    states.chunks_exact(len).zip(weights).map(|(state, weight)| weight * ratio(state)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::evaluation::Evaluation;
    use crate::element::{ElementKind, Want};
    use crate::material::card;
    use crate::sheet::hex_mesh::rectangle;

    /// Volume error of a sheet of 3 x 3 elements, elongated by 10 % along x with the given `width` and `thickness`
    /// strains, and sheared non-uniformly.
    fn balance(kind: ElementKind, card_name: &str, [width, thickness]: [f64; 2]) -> f64 {
        let steel = card::find(card_name).unwrap().build(0.3).unwrap();
        let mut body = Body::new(rectangle(6.0, 6.0, 0.8, 3, 3, 1), kind, steel).unwrap();
        let mut out = Evaluation::default();
        let mut found = body.volume_balance(&vec![0.0; 3 * body.mesh().nodes.len()]).unwrap();
        assert!(found < 1e-15, "{kind:?}: {found} at rest");
        for step in 1..=5 {
            let share = f64::from(step) / 5.0;
            let moved = |x: &kanagata_geometry::Vec3| {
                let bend = 0.004 * x.x * x.y;
                [share * (0.1 * x.x + bend), share * width * x.y, share * thickness * x.z]
            };
            let u: Vec<f64> = body.mesh().nodes.iter().flat_map(moved).collect();
            body.evaluate(&u, Want::Residual, &mut out).unwrap();
            body.commit();
            found = body.volume_balance(&u).unwrap();
        }
        found
    }

    #[test]
    fn an_element_whose_corner_is_drawn_across_it_is_inside_out() {
        let steel = card::find("mild-steel-neto2012").unwrap().build(0.3).unwrap();
        let shell = ElementKind::SolidShell { points: 5, membrane: true };
        let body = Body::new(rectangle(6.0, 6.0, 0.8, 3, 3, 1), shell, steel).unwrap();
        let drawn = |share: f64| -> Vec<f64> {
            // Both nodes at the corner of the blank move towards the opposite corner of the element.
            let moved = |x: &kanagata_geometry::Vec3| {
                let corner = f64::from(x.x > 5.9 && x.y > 5.9);
                [-2.0 * share * corner, -2.0 * share * corner, 0.0]
            };
            body.mesh().nodes.iter().flat_map(moved).collect()
        };
        // At a Gauss point det J of this plane is 1 - 1.577 share.
        assert_eq!(body.not_inside_out(&drawn(0.63)), Ok(()));
        let failure = body.not_inside_out(&drawn(0.64)).unwrap_err();
        assert_eq!(failure.element, 8);
        let FailureReason::Inverted { ratio } = failure.reason else { panic!("{failure}") };
        assert!((ratio + 0.0094).abs() < 1e-3, "{ratio}");
        // Inverted as a whole.
        let over: Vec<f64> =
            body.mesh().nodes.iter().flat_map(|x| [0.0, 0.0, -2.0 * x.z]).collect();
        assert_eq!(body.not_inside_out(&over).unwrap_err().element, 0);
    }

    #[test]
    fn plastic_flow_keeps_the_volume_of_elements_with_mean_dilatation() {
        // The second element is compressed by 3 % of its volume, elastically.
        for way in [[-0.045, -0.05], [-0.045, -0.08]] {
            for card in ["mild-steel-neto2012", "aa2090-t3-barlat2005"] {
                let volume_error = balance(ElementKind::Hex8, card, way);
                assert!(volume_error < 1e-13, "{card} {way:?}: {volume_error}");
            }
        }
    }

    #[test]
    fn assumed_strains_balance_the_volume_as_well_as_they_fit_the_nodes() {
        let shell = ElementKind::SolidShell { points: 5, membrane: true };
        for kind in [ElementKind::Hex8Enhanced, shell] {
            let volume_error = balance(kind, "mild-steel-neto2012", [-0.045, -0.05]);
            assert!(volume_error < 5e-3, "{kind:?}: {volume_error}");
        }
    }
}
