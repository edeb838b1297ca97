//! Points in lanes against single points and against the general return mapping.

use super::tests::{Random, every_kind};
use super::*;
use crate::material::law::Material;
use crate::numbers::lanes::POINTS;

/// Compares the plastic strain and the tangent of a point with those of the general return mapping.
fn is_general(
    material: &Plastic,
    strain: &[f64; 6],
    start: &[f64],
    (end, response): (&[f64], &LogResponse),
    size: f64,
) {
    let elastic = std::array::from_fn(|i| strain[i] - start[STRAIN + i]);
    let trial = material.elastic.stress(&elastic);
    let step = general::General::new(material, &trial, start, None);
    let careful = step.solve().unwrap();
    let off = end[EQUIVALENT] - start[EQUIVALENT] - careful.increment;
    assert!(off.abs() < 1e-10 * size, "{off}");
    let tangent = step.tangent(&careful);
    for (a, b) in response.tangent.as_flattened().iter().zip(tangent.as_flattened()) {
        assert!((a - b).abs() < 1e-6 * material.elastic.young, "{a} {b}");
    }
}

/// Eight points of one material (elastic, slightly plastic, far beyond yielding) with different histories. Yielding
/// points agree with the general return mapping.
#[test]
fn points_in_lanes_agree_with_single_points() {
    let mut random = Random(7);
    for material in every_kind() {
        let len = material.state_len();
        for size in [1e-3, 1e-2, 0.3] {
            let mut old = vec![0.0; POINTS * len];
            let mut strains = [[0.0; POINTS]; 6];
            for _ in 0..2 {
                for point in 0..POINTS {
                    let scale = size * random.next().abs();
                    strains.iter_mut().for_each(|of| of[point] += scale * random.next());
                }
                let (mut new, mut out) = (old.clone(), LogResponses::zero());
                material.update_points(&strains, POINTS, (&old, &mut new), &mut out).unwrap();
                for point in 0..POINTS {
                    let range = point * len..(point + 1) * len;
                    let (start, end) = (&old[range.clone()], &new[range]);
                    let (mut alone, mut response) = (start.to_vec(), LogResponse::zero());
                    let strain = strains.map(|of| of[point]);
                    material.update(&strain, start, &mut alone, &mut response).unwrap();
                    assert_eq!(alone, end);
                    assert_eq!(response.tangent, out.point(point).tangent);
                    if response.plastic {
                        is_general(&material, &strain, start, (&alone, &response), size);
                    }
                }
                old = new;
            }
        }
    }
}
