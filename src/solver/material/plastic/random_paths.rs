//! Random strain paths: consistency, tangent, frame indifference, no failure. `KANAGATA_PATHS=100000` runs that many
//! paths in total; the default is a few thousand.

use rayon::prelude::*;

use super::tests::{Random, consistency, every_kind, run};
use super::*;
use crate::material::law::Material;
use crate::numbers::tensor::Mandel;

/// Steps of a path.
const STEPS: usize = 4;

/// Largest errors and counts of a path.
#[derive(Debug, Clone, Copy, Default)]
struct PathErrors {
    plastic: usize,
    checked: usize,
    consistency: f64,
    tangent: f64,
    frame: f64,
}

impl PathErrors {
    fn and(self, other: Self) -> Self {
        Self {
            plastic: self.plastic + other.plastic,
            checked: self.checked + other.checked,
            consistency: self.consistency.max(other.consistency),
            tangent: self.tangent.max(other.tangent),
            frame: self.frame.max(other.frame),
        }
    }
}

/// Random paths with increments from 1e-4 to 1: no failure, and every plastic state on the yield surface (1e-10). The
/// tangent is the derivative of the stress if the perturbed points yield too (1e-6). The response is
/// frame-indifferent (1e-12 of the trial stress).
#[test]
fn random_paths_end_on_the_yield_surface_with_the_true_tangent_in_every_frame() {
    let kinds = every_kind();
    let wanted = std::env::var("KANAGATA_PATHS").ok().and_then(|text| text.parse().ok());
    let paths = wanted.unwrap_or(3200_usize).div_ceil(kinds.len());
    for (index, material) in kinds.iter().enumerate() {
        let walks: Vec<PathErrors> =
            (0..paths).into_par_iter().map(|path| walk(material, index, path)).collect();
        let errors = walks.into_iter().fold(PathErrors::default(), PathErrors::and);
        println!("kind {index}: {paths} paths, {errors:?}");
        let steps = STEPS * paths;
        // The shortest quarter of the increments stays elastic in a strong sheet.
        assert!(2 * errors.plastic > steps && 3 * errors.checked > steps, "{index}: {errors:?}");
    }
}

fn walk(material: &Plastic, index: usize, path: usize) -> PathErrors {
    let mut random = Random(11 + 1_000_003 * (path as u64 + 1) + index as u64);
    (0..8).for_each(|_| _ = random.next());
    let size = 10f64.powf(-4.0 * (path % 17) as f64 / 16.0);
    let mut strain = [0.0; 6];
    let mut state = vec![0.0; material.state_len()];
    let mut errors = PathErrors::default();
    for _ in 0..STEPS {
        let step = random.tensor(size);
        (0..6).for_each(|i| strain[i] += step[i]);
        let (out, new) = run(material, &strain, &state);
        let frame = frame_error(material, &mut random, &strain, &state, &out);
        assert!(frame < 1e-12, "{index}, path {path}: {frame:e} in another frame at size {size}");
        errors.frame = errors.frame.max(frame);
        if out.plastic {
            errors.plastic += 1;
            let error = consistency(material, &out.stress, &new).abs();
            assert!(
                error < 1e-10,
                "{index}, path {path}: {error:e} off the surface at size {size}"
            );
            errors.consistency = errors.consistency.max(error);
            let trace = new[0] + new[1] + new[2];
            assert!(trace.abs() < 1e-14 * (1.0 + size), "plastic volume change {trace:e}");
            assert!(new[EQUIVALENT] > state[EQUIVALENT] && new[WORK].is_finite());
            if let Some(error) = tangent_error(material, &strain, &state, &out, size) {
                assert!(error < 1e-6, "{index}, path {path}: tangent {error:e} at size {size}");
                errors.checked += 1;
                errors.tangent = errors.tangent.max(error);
            }
        }
        state = new;
    }
    errors
}

/// Largest change of the stress under a common rotation of body and material axes, over the trial stress.
fn frame_error(
    material: &Plastic,
    random: &mut Random,
    strain: &Mandel,
    old: &[f64],
    out: &LogResponse,
) -> f64 {
    let mut angle = || std::f64::consts::PI * random.next();
    let turn = nalgebra::Rotation3::from_euler_angles(angle(), angle(), angle());
    let q = turn.matrix();
    let rows = std::array::from_fn(|i| std::array::from_fn(|j| q[(i, j)]));
    let map = tensor::congruence(&rows);
    let turned = material.clone().with_axes(q);
    let (other, _) = run(&turned, &tensor::apply(&map, strain), old);
    let expected = tensor::apply(&map, &out.stress);
    let trial = material.elastic.stress(&std::array::from_fn(|i| strain[i] - old[STRAIN + i]));
    let gap = (0..6).map(|i| (expected[i] - other.stress[i]).abs()).fold(0.0, f64::max);
    gap / tensor::dot(&trial, &trial).sqrt()
}

/// Largest difference between the tangent and difference quotients of the stress, relative to the largest entry of
/// the tangent; `None` if a perturbed point is elastic.
fn tangent_error(
    material: &Plastic,
    strain: &Mandel,
    old: &[f64],
    out: &LogResponse,
    size: f64,
) -> Option<f64> {
    let scale = out.tangent.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
    let quotient = |column: usize, h: f64| -> Option<Mandel> {
        let mut moved = *strain;
        moved[column] += h;
        let plus = run(material, &moved, old).0;
        moved[column] = strain[column] - h;
        let minus = run(material, &moved, old).0;
        (plus.plastic && minus.plastic)
            .then(|| std::array::from_fn(|i| (plus.stress[i] - minus.stress[i]) / (2.0 * h)))
    };
    let mut worst = 0.0_f64;
    for column in 0..6 {
        let slope = derivative(|h| quotient(column, h), 1e-4 * size, 1e-7 * scale)?;
        for row in 0..6 {
            worst = worst.max((slope[row] - out.tangent[row][column]).abs() / scale);
        }
    }
    Some(worst)
}

/// Limit of a central difference quotient by Richardson extrapolation over three steps. The steps shrink until the
/// last two extrapolations agree to `enough`; otherwise the best pair is returned.
fn derivative(quotient: impl Fn(f64) -> Option<Mandel>, first: f64, enough: f64) -> Option<Mandel> {
    let extrapolate = |wide: &Mandel, narrow: &Mandel, by: f64| -> Mandel {
        std::array::from_fn(|i| (by * narrow[i] - wide[i]) / (by - 1.0))
    };
    let mut best: Option<(f64, Mandel)> = None;
    let mut h = first;
    for _ in 0..6 {
        let [a, b, c] = [quotient(h)?, quotient(0.5 * h)?, quotient(0.25 * h)?];
        let (ab, bc) = (extrapolate(&a, &b, 4.0), extrapolate(&b, &c, 4.0));
        let error = (0..6).map(|i| (ab[i] - bc[i]).abs()).fold(0.0, f64::max);
        if best.is_none_or(|(least, _)| error < least) {
            best = Some((error, extrapolate(&ab, &bc, 16.0)));
        }
        if error < enough {
            break;
        }
        h *= 0.2;
    }
    best.map(|(_, slope)| slope)
}

/// A strain that is not a number is a failure of every law, and no elastic state.
#[test]
fn a_strain_of_nan_fails() {
    for (index, material) in every_kind().iter().enumerate() {
        let old = vec![0.0; material.state_len()];
        let (mut new, mut out) = (old.clone(), LogResponse::zero());
        for place in 0..6 {
            let mut strain = [1e-4; 6];
            strain[place] = f64::NAN;
            let found = material.update(&strain, &old, &mut new, &mut out);
            let failed = matches!(found, Err(MaterialError::ReturnMapping { .. }));
            assert!(failed, "{index}, component {place}: {found:?}");
        }
    }
}
