//! Hourglass stabilisation against alternating tilt of thickness fibres under through-thickness pressure.
//!
//! An element that bends without locking takes its transverse shear from points where alternating tilt of the fibres
//! causes none: to the element this tilt is bending. A pressure `p` through the thickness `h` gains `½ p h θ²` per
//! area by a tilt `θ`, since the tilt shortens the fibres. Bending costs `½ E_t h³ θ² / (3 a²)` with elements of
//! length `a`. Once the sheet yields and `p > E_t h² / (3 a²)`, the mode is unstable. In a real sheet the transverse
//! shear prevents it.
//!
//! The element adds a stiffness to the strains `γ` of these hourglass patterns. The total stiffness of each pattern
//! is at least [`MIN_STIFFNESS_RATIO`] times the gain of the pressure. Nothing is added where the element is elastic
//! and the pressure is far below its modulus. The addition is small where the element yields but is pressed from one
//! side only, as on a die radius (docs/theory/element.md).
//!
//! `a_I` is the midpoint and `d_I` half of fibre `I`; `b_1 = ∂a/∂ξ` and `b_2 = ∂a/∂η` at the centre. `H` is one
//! fourth of the sum over the fibres with alternating signs.
//!
//! | pattern | `γ` |
//! |---|---|
//! | bending along ξ and along η | `b_1·∂d/∂ξ`, `b_2·∂d/∂η` |
//! | diagonal | `b_1·H d`, `b_2·H d` |
//! | twisting | `b_1·∂d/∂η`, `b_2·∂d/∂ξ` |
//!
//! The stresses of the patterns follow `τ = (P/P_0) τ_0 + s Δγ` from the last equilibrium; `P = -∫ S³³ dV` is the
//! gain of the pressure. A tilt that precedes the pressure causes no stress. A tilt under pressure is resisted in
//! proportion to it, and the stress vanishes with the pressure. The tangent treats `s` and `P` as constant.

use nalgebra::{Matrix6, Vector6};

use super::kernels::Row;
use super::{DOFS, ElementInput, ElementMatrices, Want, compatible};
use kanagata_geometry::Vec3;

/// One value for each pattern, and a symmetric matrix over the patterns.
type Strains = Vector6<f64>;
type Stiffness = Matrix6<f64>;

/// Number of hourglass patterns.
const PATTERNS: usize = 6;
/// Signs of the fibre differences `∂/∂ξ`, `∂/∂η`, `H`, by fibre.
const SIGNS: [[f64; 4]; 3] =
    [[-1.0, 1.0, 1.0, -1.0], [-1.0, -1.0, 1.0, 1.0], [1.0, -1.0, 1.0, -1.0]];
/// For each pattern: index of its base vector and of its signs.
const PATTERN_INDICES: [(usize, usize); PATTERNS] =
    [(0, 0), (1, 1), (0, 2), (1, 2), (0, 1), (1, 0)];

/// Minimum stiffness of a pattern, in addition to the gain of the pressure, over that gain. Below 1, fibres tilted by
/// friction continue to tilt. Above 1, through-thickness shear due to friction is resisted as well.
const MIN_STIFFNESS_RATIO: f64 = 1.0;
/// Gain of the pressure over the trace of the element stiffness below which no stabilisation is computed.
const GAIN_TOLERANCE_REL: f64 = 1e-6;

/// Number of stored values: `γ` and `τ` of the patterns, their added stiffness, the work of `τ` since the start
/// [N mm], and `P` [N/mm].
pub(crate) const RECORD_LEN: usize = WORK + 2;
const STRESS: usize = PATTERNS;
const STIFFNESS: usize = 2 * PATTERNS;
const WORK: usize = STIFFNESS + PATTERNS * PATTERNS;
const GAIN: usize = WORK + 1;

/// Base vectors and fibres of an element in the current configuration.
struct Fibres {
    /// `b_1, b_2`.
    base: [Vec3; 2],
    /// `∂d/∂ξ, ∂d/∂η, H d`.
    change: [Vec3; 3],
    /// Mean of the half fibres.
    mean: Vec3,
}

impl Fibres {
    fn new(input: &ElementInput<'_>) -> Self {
        let u = input.displacement;
        let at = |a: usize| input.nodes[a] + Vec3::new(u[3 * a], u[3 * a + 1], u[3 * a + 2]);
        let (mut base, mut change, mut mean) =
            ([Vec3::zeros(); 2], [Vec3::zeros(); 3], Vec3::zeros());
        for fibre in 0..4 {
            let (bottom, top) = (at(fibre), at(fibre + 4));
            let (middle, half) = (0.5 * (top + bottom), 0.5 * (top - bottom));
            mean += 0.25 * half;
            for (k, signs) in SIGNS.iter().enumerate() {
                change[k] += half * (0.25 * signs[fibre]);
                if k < 2 {
                    base[k] += middle * (0.25 * signs[fibre]);
                }
            }
        }
        Self { base, change, mean }
    }

    fn strains(&self) -> [f64; PATTERNS] {
        PATTERN_INDICES.map(|(along, signs)| self.base[along].dot(&self.change[signs]))
    }

    /// Derivatives of the strains with respect to the nodal displacements.
    fn derivatives(&self) -> [Row; PATTERNS] {
        PATTERN_INDICES.map(|(along, signs)| {
            let (base, change) = (self.base[along], self.change[signs]);
            std::array::from_fn(|dof| {
                let (node, i) = (dof / 3, dof % 3);
                let side = if node < 4 { -1.0 } else { 1.0 };
                let (by_base, by_change) = (SIGNS[along][node % 4], SIGNS[signs][node % 4]);
                0.125 * (by_base * change[i] + side * by_change * base[i])
            })
        })
    }

    /// Adds force and tangent of patterns with the given stress and stiffness.
    fn add(&self, stress: &Strains, stiffness: &Stiffness, want: Want, out: &mut ElementMatrices) {
        let rows = self.derivatives();
        for (row, stress) in rows.iter().zip(stress.iter()) {
            out.force.iter_mut().zip(row).for_each(|(sum, rate)| *sum += stress * rate);
        }
        if want == Want::Residual {
            return;
        }
        let stiffness: [[f64; PATTERNS]; PATTERNS] = (*stiffness).into();
        compatible::add_congruence(&rows, &stiffness, &mut out.tangent);
        let side = |node: usize| if node < 4 { -1.0 } else { 1.0 };
        for a in 0..8 {
            for b in 0..8 {
                let mixed = |(along, signs): (usize, usize)| {
                    let one = SIGNS[along][a % 4] * side(b) * SIGNS[signs][b % 4];
                    one + side(a) * SIGNS[signs][a % 4] * SIGNS[along][b % 4]
                };
                let value: f64 = (0..PATTERNS).map(|k| stress[k] * mixed(PATTERN_INDICES[k])).sum();
                (0..3).for_each(|i| out.tangent[3 * a + i][3 * b + i] += value / 64.0);
            }
        }
    }

    /// Directions in which fibres tilt along ξ without shear along η, and vice versa. `None` for degenerate fibres.
    fn tilt_directions(&self) -> Option<[Vec3; 2]> {
        let [b1, b2] = self.base;
        Some([b2.cross(&self.mean).try_normalize(0.0)?, self.mean.cross(&b1).try_normalize(0.0)?])
    }
}

/// Nodal displacements of each pattern at unit tilt along `directions`.
fn pattern_displacements(tilt_directions: &[Vec3; 2]) -> [Row; PATTERNS] {
    PATTERN_INDICES.map(|(along, signs)| {
        std::array::from_fn(|dof| {
            let node = dof / 3;
            let side = if node < 4 { -1.0 } else { 1.0 };
            side * SIGNS[signs][node % 4] * tilt_directions[along][dof % 3]
        })
    })
}

/// Added stiffness of the patterns [N/mm] that raises each eigenvalue to the minimum; `pressure_gain` is `-∫ S³³ dV` [N/mm].
fn missing_stiffness(tangent: &[Row; DOFS], fibres: &Fibres, pressure_gain: f64) -> Stiffness {
    let diagonal: f64 = (0..DOFS).map(|dof| tangent[dof][dof].abs()).sum();
    let Some(tilt_directions) =
        fibres.tilt_directions().filter(|_| pressure_gain > GAIN_TOLERANCE_REL * diagonal)
    else {
        return Stiffness::zeros();
    };
    let patterns = pattern_displacements(&tilt_directions);
    let dot = |a: &Row, b: &Row| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let mut costs = Stiffness::zeros();
    for (k, pattern) in patterns.iter().enumerate() {
        let forces: Row = std::array::from_fn(|dof| dot(&tangent[dof], pattern));
        (0..PATTERNS).for_each(|l| costs[(l, k)] = dot(&patterns[l], &forces));
    }
    let minimum = MIN_STIFFNESS_RATIO * pressure_gain;
    let surplus = 0.5 * (costs + costs.transpose()) - Stiffness::identity() * minimum;
    if surplus.cholesky().is_some() {
        return Stiffness::zeros();
    }
    let eigen = surplus.symmetric_eigen();
    let missing = eigen.eigenvalues.map(|value| (-value).max(0.0));
    let added =
        eigen.eigenvectors * Stiffness::from_diagonal(&missing) * eigen.eigenvectors.transpose();
    // Strains of the patterns at unit tilt.
    let lengths = PATTERN_INDICES.map(|(along, _)| fibres.base[along].dot(&tilt_directions[along]));
    Stiffness::from_fn(|k, l| added[(k, l)] / (lengths[k] * lengths[l]))
}

/// Adds force, tangent and work of the hourglass stabilisation to `out`, which holds those of the element. `new` is
/// the record of the previous evaluation on entry and of this one on return.
pub(crate) fn stabilise(input: &ElementInput<'_>, new: &mut [f64], out: &mut ElementMatrices) {
    let old = &input.old_record[input.old_record.len() - RECORD_LEN..];
    let fibres = Fibres::new(input);
    let pressure_gain = -out.thickness_force;
    if input.want == Want::ResidualAndTangent {
        let missing = missing_stiffness(&out.tangent, &fibres, pressure_gain);
        new[STIFFNESS..WORK].copy_from_slice(missing.as_slice());
    }
    let stiffness = Stiffness::from_column_slice(&new[STIFFNESS..WORK]);
    let strains = fibres.strains();
    let change = Strains::from_fn(|k, _| strains[k] - old[k]);
    let pressure_ratio = if old[GAIN] > 0.0 { (pressure_gain / old[GAIN]).max(0.0) } else { 0.0 };
    let before = Strains::from_column_slice(&old[STRESS..STIFFNESS]);
    let stress = before * pressure_ratio + stiffness * change;
    let work = old[WORK] + 0.5 * (before + stress).dot(&change);
    new[..STRESS].copy_from_slice(&strains);
    new[STRESS..STIFFNESS].copy_from_slice(stress.as_slice());
    (new[WORK], new[GAIN]) = (work, pressure_gain);
    out.artificial_work = work;
    if stress != Strains::zeros() || stiffness != Stiffness::zeros() {
        fibres.add(&stress, &stiffness, input.want, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::{ElementKind, reference_points};
    use crate::material::Material;
    use crate::material::card;
    use kanagata_geometry::Mat3;

    const SHELL: ElementKind = ElementKind::SolidShell { points: 5, membrane: true };

    /// A distorted element of steel, 3 mm wide and 0.8 mm thick, with its state.
    struct Element {
        kind: ElementKind,
        nodes: [Vec3; 8],
        steel: std::sync::Arc<dyn Material>,
        before: Vec<f64>,
        now: Vec<f64>,
    }

    impl Element {
        fn new(kind: ElementKind) -> Self {
            let corners = [[-1.5, -1.4], [1.6, -1.5], [1.4, 1.5], [-1.5, 1.6]];
            let nodes = std::array::from_fn(|a| {
                let [x, y] = corners[a % 4];
                Vec3::new(x, y, if a < 4 { -0.4 } else { 0.4 + 0.02 * x })
            });
            let steel = card::find("mild-steel-neto2012").unwrap().build(0.0).unwrap();
            let len = steel.state_len();
            let mut before = vec![0.0; kind.point_count() * len + kind.record_len()];
            let points = before[..kind.point_count() * len].chunks_exact_mut(len);
            points.for_each(|point| steel.initial_state(point));
            Self { kind, nodes, steel, now: before.clone(), before }
        }

        fn evaluate(&mut self, displacement: &[f64; DOFS], want: Want) -> ElementMatrices {
            let at = self.kind.point_count() * self.steel.state_len();
            let (old_state, old_record) = self.before.split_at(at);
            let (nodes, material) = (&self.nodes, self.steel.as_ref());
            let input = ElementInput { material, nodes, displacement, old_state, old_record, want };
            let geometry = (&reference_points(nodes).unwrap(), &self.kind.thickness_rule()[..]);
            let mut out = ElementMatrices::zero();
            let history = self.now.split_at_mut(at);
            self.kind.evaluate(&input, geometry, history, &mut out).unwrap();
            out
        }

        /// Displaced by a deformation gradient and bent to a curvature along x [1/mm], modes converged.
        fn moved(&mut self, gradient: &Mat3, curvature: f64) -> ([f64; DOFS], ElementMatrices) {
            let u: [f64; DOFS] = std::array::from_fn(|dof| {
                let x = self.nodes[dof / 3];
                (gradient * x - x)[dof % 3] + if dof % 3 == 0 { curvature * x.x * x.z } else { 0.0 }
            });
            let mut out = ElementMatrices::zero();
            (0..7).for_each(|_| out = self.evaluate(&u, Want::ResidualAndTangent));
            (u, out)
        }

        fn record(&self) -> &[f64] {
            &self.now[self.now.len() - RECORD_LEN..]
        }
    }

    fn pressed(by: f64) -> Mat3 {
        Mat3::from_diagonal(&Vec3::new(1.0 / (1.0 - by), 1.0, 1.0 - by))
    }

    #[test]
    fn a_pressed_element_is_stabilised() {
        for kind in [SHELL, ElementKind::Hex8Enhanced] {
            let mut element = Element::new(kind);
            let (u, out) = element.moved(&pressed(0.1), 0.01);
            let pressure_gain = element.record()[GAIN];
            assert!(pressure_gain > 0.0, "{kind:?}");
            let input = ElementInput {
                material: element.steel.as_ref(),
                nodes: &element.nodes,
                displacement: &u,
                old_state: &[],
                old_record: &[],
                want: Want::Residual,
            };
            let patterns = pattern_displacements(&Fibres::new(&input).tilt_directions().unwrap());
            let costs = Stiffness::from_fn(|k, l| {
                let forces =
                    out.tangent.map(|row| (0..DOFS).map(|i| row[i] * patterns[l][i]).sum());
                let forces: Row = forces;
                (0..DOFS).map(|i| patterns[k][i] * forces[i]).sum()
            });
            let minimum = costs.symmetric_eigenvalues().min();
            assert!(
                (minimum / pressure_gain - MIN_STIFFNESS_RATIO).abs() < 0.1 * MIN_STIFFNESS_RATIO,
                "{kind:?}: {}",
                minimum / pressure_gain
            );
        }
    }

    #[test]
    fn an_element_without_pressure_is_not_stabilised() {
        let stretched = Mat3::from_diagonal(&Vec3::new(1.1, 0.96, 0.95));
        let bent = Mat3::from_diagonal(&Vec3::new(1.02, 1.0, 0.98));
        for (kind, gradient, curvature) in [
            (SHELL, stretched, 0.0),
            (SHELL, Mat3::identity(), 0.05),
            (SHELL, bent, 0.05),
            (ElementKind::Hex8Enhanced, stretched, 0.0),
            // Elastic.
            (SHELL, pressed(0.0005), 0.0),
            (ElementKind::Hex8Enhanced, pressed(0.0005), 0.0),
        ] {
            let mut element = Element::new(kind);
            element.moved(&gradient, curvature);
            assert!(element.record()[STRESS..WORK].iter().all(|&value| value == 0.0), "{kind:?}");
        }
    }

    #[test]
    fn the_tangent_is_the_derivative_of_the_force() {
        for kind in [SHELL, ElementKind::Hex8Enhanced] {
            let mut element = Element::new(kind);
            element.moved(&pressed(0.1), 0.0);
            element.before.clone_from(&element.now);
            let at = element.now.len() - RECORD_LEN;
            element.before[at + STRESS..at + STIFFNESS].fill(0.0);
            let (u, out) = element.moved(&pressed(0.12), 0.02);
            assert!(element.record()[STRESS] != 0.0);
            let largest = out.tangent.as_flattened().iter().fold(0.0, |m: f64, k| m.max(k.abs()));
            let step = 1e-6;
            for dof in 0..DOFS {
                let mut force = |by: f64| {
                    let mut moved = u;
                    moved[dof] += by;
                    element.evaluate(&moved, Want::Residual).force
                };
                let (more, less) = (force(step), force(-step));
                for row in 0..DOFS {
                    let difference = (more[row] - less[row]) / (2.0 * step);
                    let off = (difference - out.tangent[row][dof]).abs() / largest;
                    assert!(off < 2e-5, "{kind:?} {row} {dof}: {off}");
                }
            }
        }
    }

    #[test]
    fn strains_are_rotation_invariant_with_exact_derivatives() {
        let element = Element::new(SHELL);
        let fibres = |u: &[f64; DOFS]| {
            Fibres::new(&ElementInput {
                material: element.steel.as_ref(),
                nodes: &element.nodes,
                displacement: u,
                old_state: &[],
                old_record: &[],
                want: Want::Residual,
            })
        };
        let turn = nalgebra::Rotation3::from_euler_angles(0.4, -1.1, 2.0);
        let bent: [f64; DOFS] = std::array::from_fn(|dof| 0.1 * (1.0 + 7.3 * dof as f64).sin());
        let turned: [f64; DOFS] = std::array::from_fn(|dof| {
            let (x, at) = (element.nodes[dof / 3], dof / 3 * 3);
            let moved = x + Vec3::new(bent[at], bent[at + 1], bent[at + 2]);
            (turn * moved - x)[dof % 3]
        });
        let pairs = fibres(&bent).strains().into_iter().zip(fibres(&turned).strains());
        pairs.for_each(|(a, b)| assert!((a - b).abs() < 1e-14));
        let rows = fibres(&bent).derivatives();
        for dof in 0..DOFS {
            let at = |by: f64| {
                let mut moved = bent;
                moved[dof] += by;
                fibres(&moved).strains()
            };
            let (more, less) = (at(0.5), at(-0.5));
            (0..PATTERNS).for_each(|k| assert!((more[k] - less[k] - rows[k][dof]).abs() < 1e-14));
        }
    }
}
