//! Element means of plastic strain and stress for output.

use rayon::prelude::*;

use super::body::Body;
use crate::material::PointState;

/// Plastic strain and stress of an element.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ElementState {
    /// Volume-weighted means over the points.
    pub mean: PointState,
    /// Largest equivalent plastic strain of a point.
    pub largest_plastic_strain: f64,
    /// Mean equivalent plastic strain of the four points nearest to the lower face, and to the upper face.
    pub face_plastic_strain: [f64; 2],
}

impl Body {
    /// State of every element at the last commit; `None` for a material without history.
    #[must_use]
    pub fn element_states(&self) -> Option<Vec<ElementState>> {
        let len = self.material.state_len();
        self.material.history_layout()?;
        let weights = self.point_weights();
        let outermost = self.kind.outermost_points();
        let state = |(element, history): (usize, &[f64])| {
            let points = history[..self.kind.point_count() * len].chunks_exact(len);
            let points = points.map(|point| self.material.point_state(point));
            match &weights {
                Some(weights) => weighted_mean(points.zip(weights.iter().copied()), &outermost),
                None => {
                    let own =
                        self.evaluation_data().geometry[element].iter().map(|point| point.weight);
                    weighted_mean(points.zip(own), &outermost)
                }
            }
        };
        self.evaluation_data()
            .committed
            .par_chunks_exact(self.stride())
            .enumerate()
            .map(state)
            .collect()
    }
}

/// Weighted means of the points, with the indices of those nearest to the faces.
fn weighted_mean(
    points: impl Iterator<Item = (Option<PointState>, f64)>,
    outermost: &[[usize; 4]; 2],
) -> Option<ElementState> {
    let (mut out, mut weight_sum) = (ElementState::default(), 0.0);
    let mut face_weights = [0.0; 2];
    for (index, (point, weight)) in points.enumerate() {
        let point = point?;
        for face in (0..2).filter(|face| outermost[*face].contains(&index)) {
            face_weights[face] += weight;
            out.face_plastic_strain[face] += weight * point.plastic_strain;
        }
        weight_sum += weight;
        out.mean.plastic_strain += weight * point.plastic_strain;
        out.mean.equivalent_stress += weight * point.equivalent_stress;
        out.mean.pressure += weight * point.pressure;
        out.largest_plastic_strain = out.largest_plastic_strain.max(point.plastic_strain);
    }
    out.face_plastic_strain.iter_mut().zip(face_weights).for_each(|(sum, all)| *sum /= all);
    let PointState { plastic_strain, equivalent_stress, pressure } = &mut out.mean;
    [plastic_strain, equivalent_stress, pressure].into_iter().for_each(|sum| *sum /= weight_sum);
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::evaluation::Evaluation;
    use crate::element::{ElementKind, Want};
    use crate::material::card;
    use crate::sheet::hex_mesh::rectangle;

    /// One element of steel with its rolling direction at `angle`, strained in `steps`; `curvature` along x [1/mm].
    fn strained(kind: ElementKind, angle: f64, curvature: f64, steps: [f64; 3]) -> ElementState {
        let steel = card::find("mild-steel-neto2012").unwrap().build(angle).unwrap();
        let mut body = Body::new(rectangle(2.0, 2.0, 0.8, 1, 1, 1), kind, steel).unwrap();
        let mut out = Evaluation::default();
        for share in steps {
            let moved = |x: &kanagata_geometry::Vec3| {
                let bend = curvature * (x.z - 0.4) * (x.x - 1.0);
                [share * (0.1 * x.x + bend), -0.04 * share * x.y, -0.05 * share * x.z]
            };
            let u: Vec<f64> = body.mesh().nodes.iter().flat_map(moved).collect();
            body.evaluate(&u, Want::Residual, &mut out).unwrap();
            body.commit();
        }
        body.element_states().unwrap()[0]
    }

    #[test]
    fn a_point_that_flows_is_on_its_yield_surface_whatever_its_axes() {
        let flow = |p: f64| 529.5 * (0.00439_f64 + p).powf(0.268);
        let shell = ElementKind::SolidShell { points: 5, membrane: true };
        for kind in [ElementKind::Hex8, shell] {
            for angle in [0.0, 0.4] {
                let ElementState { mean, largest_plastic_strain, face_plastic_strain } =
                    strained(kind, angle, 0.0, [0.3, 0.7, 1.0]);
                assert!(mean.plastic_strain > 0.08, "{mean:?}");
                for p in [largest_plastic_strain, face_plastic_strain[0], face_plastic_strain[1]] {
                    assert!((p - mean.plastic_strain).abs() < 1e-12);
                }
                let expected = flow(mean.plastic_strain);
                assert!((mean.equivalent_stress - expected).abs() < 1e-9 * expected, "{mean:?}");
            }
        }
    }

    #[test]
    fn points_of_a_bent_element_differ_and_its_mean_lies_between() {
        let shell = ElementKind::SolidShell { points: 5, membrane: true };
        let straight = strained(shell, 0.0, 0.0, [0.3, 0.7, 1.0]);
        let bent = strained(shell, 0.0, 0.1, [0.3, 0.7, 1.0]);
        assert!(bent.largest_plastic_strain > bent.mean.plastic_strain + 0.02, "{bent:?}");
        let [lower, upper] = bent.face_plastic_strain;
        assert!(lower < bent.mean.plastic_strain - 0.02 && upper > bent.mean.plastic_strain + 0.02);
        assert!((upper - bent.largest_plastic_strain).abs() < 1e-3, "{bent:?}");
        let off = bent.mean.plastic_strain - straight.mean.plastic_strain;
        assert!(off.abs() < 5e-3, "{off}");
    }

    #[test]
    fn elastic_sheets_keep_no_state() {
        let elastic = crate::material::elastic::Elastic { young: 2e5, poisson: 0.3 };
        let mesh = rectangle(2.0, 2.0, 0.8, 1, 1, 1);
        let body = Body::new(mesh, ElementKind::Hex8, std::sync::Arc::new(elastic)).unwrap();
        assert_eq!(body.element_states(), None);
    }
}
