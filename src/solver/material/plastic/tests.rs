//! Properties of the plastic law in small and finite strain.

use super::super::yld2004::Yld2004;
use super::super::{card, log_strain};
use super::tension::tests::drawn;
use super::*;
use crate::material::law::Material;
use crate::numbers::tensor::Mandel;

pub(super) const ELASTIC: Elastic = Elastic { young: 210_000.0, poisson: 0.3 };
pub(super) const PAPER: Hill48 = Hill48 { f: 0.251, g: 0.297, h: 0.703, l: 1.5, m: 1.5, n: 1.29 };

pub(super) fn swift() -> Hardening {
    Hardening::Swift { k: 529.5, eps0: 0.00439, n: 0.268 }
}

pub(super) fn paper() -> Plastic {
    Plastic::new(ELASTIC, &PAPER, swift()).unwrap()
}

/// Hardening law with infinite slope at zero plastic strain.
fn ludwik() -> Plastic {
    let hardening = Hardening::Ludwik { sigma0: 120.0, k: 400.0, n: 0.5 };
    Plastic::new(ELASTIC, &PAPER, hardening).unwrap()
}

pub(super) fn kinematic() -> Plastic {
    let backstresses = vec![
        Backstress { modulus: 8000.0, recovery: 60.0 },
        Backstress { modulus: 300.0, recovery: 0.0 },
    ];
    paper().with_backstresses(backstresses).unwrap()
}

/// Law of the card, without and with backstresses.
pub(super) fn sheet(name: &str) -> [Plastic; 2] {
    let card = card::find(name).unwrap();
    let criterion = card.yield_function().unwrap().unwrap();
    let elastic = Elastic { young: card.young_mpa, poisson: card.poisson };
    let plain = Plastic::with_yield(elastic, criterion, card.hardening.unwrap()).unwrap();
    let backstresses = vec![
        Backstress { modulus: 4000.0, recovery: 60.0 },
        Backstress { modulus: 150.0, recovery: 0.0 },
    ];
    [plain.clone(), plain.with_backstresses(backstresses).unwrap()]
}

/// Sheets of every kind: quadratic, with Ludwik's hardening, Yld2004-18p, Hosford with a high and with a fractional
/// exponent.
pub(super) fn every_kind() -> Vec<Plastic> {
    let mut all = vec![paper(), kinematic(), ludwik()];
    all.extend(sheet("aa2090-t3-barlat2005"));
    all.extend(sheet("aa6111-t4-barlat2005"));
    for exponent in [6.5, 20.0] {
        let hosford = YieldFunction::Yld2004(Box::new(Yld2004::hosford(exponent).unwrap()));
        all.push(Plastic::with_yield(ELASTIC, hosford, swift()).unwrap());
    }
    all
}

pub(super) struct Random(pub(super) u64);

impl Random {
    /// Uniform in (-1, 1).
    pub(super) fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
    }

    pub(super) fn tensor(&mut self, size: f64) -> Mandel {
        std::array::from_fn(|_| size * self.next())
    }
}

pub(super) fn run(material: &Plastic, strain: &Mandel, old: &[f64]) -> (LogResponse, Vec<f64>) {
    let (mut new, mut out) = (vec![0.0; old.len()], LogResponse::zero());
    material.update(strain, old, &mut new, &mut out).unwrap();
    (out, new)
}

/// `σ̄(T - X) / σ_y(p) - 1`.
pub(super) fn consistency(material: &Plastic, stress: &Mandel, state: &[f64]) -> f64 {
    let mut relative = *stress;
    for backstress in state[BACKSTRESS..].chunks_exact(6) {
        (0..6).for_each(|i| relative[i] -= backstress[i]);
    }
    material.criterion.equivalent(&relative) / material.hardening.flow_stress(state[EQUIVALENT]).0
        - 1.0
}

/// Backstresses with recovery, strained in one step and in a thousand, then reversed likewise: the same flow, since
/// the flow direction is constant.
#[test]
fn recovery_is_exact_for_monotonic_flow() {
    let isotropic = Hill48 { f: 0.5, g: 0.5, h: 0.5, l: 1.5, m: 1.5, n: 1.5 };
    let law = Plastic::new(ELASTIC, &isotropic, swift()).unwrap();
    let hosford = YieldFunction::Yld2004(Box::new(Yld2004::hosford(6.5).unwrap()));
    let other = Plastic::with_yield(ELASTIC, hosford, swift()).unwrap();
    for material in [law, other] {
        let backstresses = vec![Backstress { modulus: 8000.0, recovery: 60.0 }];
        let material = material.with_backstresses(backstresses).unwrap();
        let strained = |steps: usize| {
            let mut state = vec![0.0; material.state_len()];
            let mut at = 0.0;
            for end in [0.08, -0.05] {
                let from = at;
                for k in 1..=steps {
                    at = from + (end - from) * k as f64 / steps as f64;
                    state = run(&material, &[at, -0.5 * at, -0.5 * at, 0.0, 0.0, 0.0], &state).1;
                }
            }
            [state[EQUIVALENT], state[BACKSTRESS]]
        };
        let (once, often) = (strained(1), strained(1000));
        for (once, often) in once.into_iter().zip(often) {
            assert!((once / often - 1.0).abs() < 1e-9, "{once} {often}");
        }
    }
}

/// For Hill's criterion the general return mapping agrees with the closed form, and the bracketed search with
/// Newton's method.
#[test]
fn general_mapping_of_a_quadratic_criterion_is_the_closed_form() {
    let mut random = Random(8);
    for material in [paper(), kinematic()] {
        for path in 0..300 {
            let size = 10f64.powf(-3.0 * f64::from(path % 17) / 16.0);
            let old =
                run(&material, &random.tensor(0.3 * size), &vec![0.0; material.state_len()]).1;
            let strain = random.tensor(size);
            let (out, new) = run(&material, &strain, &old);
            if !out.plastic {
                continue;
            }
            let trial = ELASTIC.stress(&std::array::from_fn(|i| strain[i] - old[i]));
            let step = general::General::new(&material, &trial, &old, None);
            for returned in [step.solve().unwrap(), step.solve_bracketed().unwrap()] {
                let p = new[EQUIVALENT] - old[EQUIVALENT];
                assert!((returned.increment - p).abs() < 1e-11 * (p + 1e-3));
                let tangent = step.tangent(&returned);
                for i in 0..6 {
                    let flow = new[STRAIN + i] - old[STRAIN + i];
                    assert!((returned.flow[i] - flow).abs() < 1e-11 * (p + 1e-3));
                    for j in 0..6 {
                        let error = (tangent[i][j] - out.tangent[i][j]).abs();
                        assert!(error < 1e-7 * 210_000.0, "{error:e}");
                    }
                }
            }
        }
    }
}

/// Complete chain: `dS/dE_GL` at finite strain, also with two and three equal or nearly equal stretches.
#[test]
fn finite_strain_tangent_is_the_derivative() {
    let mut random = Random(21);
    let material = paper();
    let mut cases: Vec<Mandel> = (0..60)
        .map(|_| {
            let c = random.tensor(0.35);
            std::array::from_fn(|i| c[i] + tensor::UNIT[i])
        })
        .collect();
    for gap in [0.0, 1e-12, 1e-9, 1e-6, 1e-3, 0.02, 0.06, 0.1] {
        cases.push([1.2, 1.2 + gap, 0.8, 0.0, 0.0, 0.0]);
        cases.push([1.2, 0.8, 0.8 - 0.3 * gap, gap, 0.0, 0.3 * gap]);
        cases.push([1.1 + gap, 1.1, 1.1 - gap, 0.5 * gap, 0.0, 0.2 * gap]);
    }
    let old = run(&material, &random.tensor(0.2), &[0.0; BACKSTRESS]).1;
    let mut new = vec![0.0; BACKSTRESS];
    for c in cases {
        let out = log_strain::update(&material, &c, &old, &mut new, true).unwrap();
        assert!(new[EQUIVALENT] > old[EQUIVALENT], "the case must flow");
        let scale = out.tangent.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
        let h = 1e-6;
        for column in 0..6 {
            let mut moved = c;
            moved[column] += 2.0 * h;
            let plus = log_strain::update(&material, &moved, &old, &mut new, false).unwrap();
            moved[column] = c[column] - 2.0 * h;
            let minus = log_strain::update(&material, &moved, &old, &mut new, false).unwrap();
            for row in 0..6 {
                let difference = (plus.stress[row] - minus.stress[row]) / (2.0 * h);
                let error = (difference - out.tangent[row][column]).abs() / scale;
                assert!(error < 1e-6, "{error:e} entry {row} {column} of {c:?}");
            }
        }
    }
}

/// A common rotation of body, material axes and history rotates the stress and changes nothing else.
#[test]
fn response_is_indifferent_to_the_frame() {
    let mut random = Random(3);
    let aluminium = sheet("aa2090-t3-barlat2005")[0].clone();
    for path in 0..600 {
        let material = if path % 2 == 0 { paper() } else { aluminium.clone() };
        let turn = nalgebra::Rotation3::from_euler_angles(
            random.next() * 3.0,
            random.next() * 1.5,
            random.next() * 3.0,
        );
        let q = turn.matrix();
        let rows = std::array::from_fn(|i| std::array::from_fn(|j| q[(i, j)]));
        let map = tensor::congruence(&rows);
        let turned = material.clone().with_axes(q);
        let part = random.tensor(0.3);
        let c: Mandel = std::array::from_fn(|i| part[i] + tensor::UNIT[i]);
        let (mut new, mut new_turned) = ([0.0; BACKSTRESS], [0.0; BACKSTRESS]);
        let plain = log_strain::update(&material, &c, &[0.0; BACKSTRESS], &mut new, true).unwrap();
        let other = log_strain::update(
            &turned,
            &tensor::apply(&map, &c),
            &[0.0; BACKSTRESS],
            &mut new_turned,
            true,
        )
        .unwrap();
        let expected = tensor::apply(&map, &plain.stress);
        let size = tensor::dot(&expected, &expected).sqrt();
        let stiffness = material.elastic.young;
        for i in 0..6 {
            assert!((expected[i] - other.stress[i]).abs() < 1e-12 * size.max(stiffness * 0.3));
        }
        assert!((new[EQUIVALENT] - new_turned[EQUIVALENT]).abs() < 1e-12);
    }
}

#[test]
fn unloading_is_elastic_and_an_update_is_pure() {
    let material = kinematic();
    let strain = [0.05, -0.02, -0.03, 0.01, 0.0, 0.02];
    let (out, state) = run(&material, &strain, &vec![0.0; material.state_len()]);
    let (again, same) = run(&material, &strain, &state);
    assert!(!again.plastic && same == state);
    (0..6).for_each(|i| assert!((again.stress[i] - out.stress[i]).abs() < 1e-9));
    let relaxed: Mandel = std::array::from_fn(|i| strain[i] - 1e-4 * out.stress[i] / 300.0);
    let (back, mut kept) = run(&material, &relaxed, &state);
    assert_eq!(kept[LOG_STRAIN..BACKSTRESS], relaxed);
    kept[LOG_STRAIN..BACKSTRESS].copy_from_slice(&strain);
    assert!(!back.plastic && kept == state);
    let expected = ELASTIC.stress(&std::array::from_fn(|i| relaxed[i] - state[i]));
    (0..6).for_each(|i| assert!((back.stress[i] - expected[i]).abs() < 1e-12));
}

/// Tension at `angle` to the rolling direction to axial strain `axial`, in one step.
fn tension(material: &Plastic, axial: f64, angle: f64) -> (f64, Vec<f64>, Mandel) {
    let (s, c) = angle.sin_cos();
    let turned = material.clone().with_axes(&Mat3::new(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0));
    let strain = [axial, -0.5 * axial, -0.5 * axial, 0.0, 0.0, 0.0];
    drawn(&turned, &strain, &vec![0.0; material.state_len()])
}

#[test]
fn uniaxial_tension_is_the_swift_curve() {
    for axial in [0.002, 0.05, 0.3] {
        let (stress, state, _) = tension(&paper(), axial, 0.0);
        let p = axial - stress / ELASTIC.young;
        assert!((state[EQUIVALENT] - p).abs() < 1e-13, "{} {p}", state[EQUIVALENT]);
        assert!((stress / swift().flow_stress(p).0 - 1.0).abs() < 1e-11);
    }
}

/// r values and yield ratios of the paper's Table 1 against the closed forms (BENCHMARKS 2).
#[test]
fn r_values_and_yield_ratios_of_the_paper() {
    let quarter = std::f64::consts::FRAC_PI_4;
    for (angle, published_r, published_ratio) in
        [(0.0, 2.367, 1.0), (quarter, 1.854, 1.1308), (2.0 * quarter, 2.801, 1.0238)]
    {
        let (stress, state, _) = tension(&paper(), 0.08, angle);
        // Plastic strain is kept in material axes; the width direction lies at angle + 90 degrees.
        let (s, c) = (angle + 2.0 * quarter).sin_cos();
        let width = c * c * state[0] + s * s * state[1] + 2.0_f64.sqrt() * s * c * state[3];
        let r = width / state[2];
        assert!((r - PAPER.r_value(angle)).abs() < 1e-6, "{r}");
        assert!((r - published_r).abs() < 5e-4);
        let ratio = stress / swift().flow_stress(state[EQUIVALENT]).0;
        assert!((ratio - PAPER.yield_ratio(angle)).abs() < 1e-6, "{ratio}");
        assert!((ratio - published_ratio).abs() < 5e-5);
    }
}

/// Tension of the law reproduces the anisotropy of its yield function: AA2090-T3 (Barlat et al. 2005).
#[test]
fn tension_of_aa2090_t3_has_the_r_values_of_its_yield_function() {
    let [material, _] = sheet("aa2090-t3-barlat2005");
    for k in 0..7 {
        let angle = (15.0 * f64::from(k)).to_radians();
        let (stress, state, _) = tension(&material, 0.05, angle);
        let (s, c) = (angle + std::f64::consts::FRAC_PI_2).sin_cos();
        let width = c * c * state[0] + s * s * state[1] + 2.0_f64.sqrt() * s * c * state[3];
        assert!((width / state[2] - material.criterion.r_value(angle)).abs() < 1e-6);
        let ratio = stress / material.hardening.flow_stress(state[EQUIVALENT]).0;
        assert!((ratio - material.criterion.yield_ratio(angle)).abs() < 1e-6);
    }
}

#[test]
fn collapsed_points_are_a_typed_error() {
    let mut new = [0.0; BACKSTRESS];
    for c in [[-0.1, 1.0, 1.0, 0.0, 0.0, 0.0], [f64::NAN, 1.0, 1.0, 0.0, 0.0, 0.0]] {
        let error =
            log_strain::update(&paper(), &c, &[0.0; BACKSTRESS], &mut new, true).unwrap_err();
        assert!(matches!(error, MaterialError::Collapsed { .. }));
    }
}

/// One shear backstress under Prager's law: a cycle returns `σ = X ± σ_y` exactly.
#[test]
fn linear_kinematic_hardening_shows_the_bauschinger_effect() {
    let flat = Hardening::Table { strain: vec![0.0], stress: vec![200.0] };
    let material = Plastic::new(ELASTIC, &Hill48::MISES, flat)
        .unwrap()
        .with_backstresses(vec![Backstress { modulus: 3000.0, recovery: 0.0 }])
        .unwrap();
    let shear = |value: f64| [0.0, 0.0, 0.0, value, 0.0, 0.0];
    let (out, state) = run(&material, &shear(0.05), &[0.0; BACKSTRESS + 6]);
    let back = state[BACKSTRESS + 3];
    let radius = 200.0 * (2.0_f64 / 3.0).sqrt();
    assert!((out.stress[3] - back - radius).abs() < 1e-9);
    assert!((back - 2000.0 * state[3]).abs() < 1e-9);
    let (out, state) = run(&material, &shear(0.03), &state);
    assert!((out.stress[3] - state[BACKSTRESS + 3] + radius).abs() < 1e-9);
}

/// The error of the work by the trapezoidal rule decreases with the square of the step, wherever in a step a point
/// begins to yield.
#[test]
fn work_is_accounted_for_to_second_order_in_the_steps() {
    let way = [0.08, -0.03, -0.05, 0.02, 0.01, -0.015];
    for material in every_kind() {
        let open = |steps: usize| {
            let mut state = vec![0.0; material.state_len()];
            let (mut work, mut stress, mut elastic) = (0.0, [0.0; 6], 0.0);
            for step in 1..=steps {
                let strain = way.map(|e| e * step as f64 / steps as f64);
                let (out, new) = run(&material, &strain, &state);
                let mean: Mandel = std::array::from_fn(|i| 0.5 * (stress[i] + out.stress[i]));
                work += tensor::dot(&mean, &way) / steps as f64;
                (state, stress, elastic) = (new, out.stress, out.elastic_energy);
            }
            (elastic + state[WORK]) / work - 1.0
        };
        let [few, more] = [20, 320].map(open);
        assert!(few.abs() < 0.02 && more.abs() < few.abs() / 64.0, "{few:e} {more:e}");
    }
}
