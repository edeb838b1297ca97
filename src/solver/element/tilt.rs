//! Stiffness against fibres that tilt by turns under pressure through the thickness.
//!
//! An element that bends without locking takes its transverse shear from places where a fibre that leans to one side at one
//! end and to the other side at the other shears nothing: that is bending to it. Pressure `p` through the thickness gains
//! `½ p h θ²` an area by such a tilt `θ`, as it shortens the fibres; bending costs `½ E_t h³ θ² / (3 a²)` over elements of
//! length `a`, which is less once the sheet flows and `p > E_t h² / (3 a²)`. No sheet folds so: its shear forbids it. The
//! element adds to the strains `γ` of such patterns the stiffness that it lacks for each of them to cost [`MIN_STIFFNESS_RATIO`] times what
//! the pressure gains by it. It lacks none where it is elastic under pressures far below its modulus, and hardly any where
//! it flows but is pressed from one side, as where it is drawn over a radius (docs/theory/element.md).
//!
//! With `a_I` the middle and `d_I` half of fibre `I`, `b_1 = ∂a/∂ξ` and `b_2 = ∂a/∂η` at the centre and `H` a fourth of the sum
//! over the fibres with signs by turns:
//!
//! | pattern | `γ` |
//! |---|---|
//! | bending along ξ and along η | `b_1·∂d/∂ξ`, `b_2·∂d/∂η` |
//! | from corner to corner | `b_1·H d`, `b_2·H d` |
//! | twisting | `b_1·∂d/∂η`, `b_2·∂d/∂ξ` |
//!
//! Their stresses `τ = (P/P_0) τ_0 + s Δγ` go on from those of the last balance, `P = -∫ S³³ dV` being what the pressure gains:
//! a tilt that was there before pressure came is left alone, one that came with it is held in proportion to it, and nothing is
//! left once it has gone. The tangent is that of `s` and `P` as they are.

use nalgebra::{Matrix6, Vector6};

use super::kernels::Row;
use super::{DOFS, ElementInput, ElementMatrices, Want, compatible};
use crate::geometry::Vec3;

/// One number of each pattern, and a symmetric one of each pair.
type Strains = Vector6<f64>;
type Stiffness = Matrix6<f64>;

/// Patterns.
const PATTERNS: usize = 6;
/// Signs of a pattern, by fibre.
const SIGNS: [[f64; 4]; 3] =
    [[-1.0, 1.0, 1.0, -1.0], [-1.0, -1.0, 1.0, 1.0], [1.0, -1.0, 1.0, -1.0]];
/// Of each pattern: the base vector it goes along, and its signs.
const GOES: [(usize, usize); PATTERNS] = [(0, 0), (1, 1), (0, 2), (1, 2), (0, 1), (1, 0)];

/// What a pattern has to cost, besides what the pressure gains by it, over that. At less, fibres that friction tilts are driven
/// on; at more, layers that friction shears are held as well.
const MIN_STIFFNESS_RATIO: f64 = 1.0;
/// Gain over the element's stiffness from which it is looked at.
const GAIN_TOLERANCE_REL: f64 = 1e-6;

/// Stored values: `γ` and `τ` of the patterns, what is added to their stiffness; the work done against `τ` since the
/// beginning [N mm]; and `P` [N/mm].
pub(crate) const RECORD: usize = WORK + 2;
const STRESS: usize = PATTERNS;
const STIFFNESS: usize = 2 * PATTERNS;
const WORK: usize = STIFFNESS + PATTERNS * PATTERNS;
const GAIN: usize = WORK + 1;

/// An element's middle and fibres where they have moved to.
struct Fibres {
    /// `b_1, b_2`.
    base: [Vec3; 2],
    /// `∂d/∂ξ, ∂d/∂η, H d`.
    change: [Vec3; 3],
    /// Mean of the fibres.
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
        GOES.map(|(along, signs)| self.base[along].dot(&self.change[signs]))
    }

    /// Derivatives of the strains by the nodal displacements.
    fn derivatives(&self) -> [Row; PATTERNS] {
        GOES.map(|(along, signs)| {
            let (base, change) = (self.base[along], self.change[signs]);
            std::array::from_fn(|dof| {
                let (node, i) = (dof / 3, dof % 3);
                let side = if node < 4 { -1.0 } else { 1.0 };
                let (by_base, by_change) = (SIGNS[along][node % 4], SIGNS[signs][node % 4]);
                0.125 * (by_base * change[i] + side * by_change * base[i])
            })
        })
    }

    /// Adds force and tangent of patterns with this stress and stiffness.
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
                let value: f64 = (0..PATTERNS).map(|k| stress[k] * mixed(GOES[k])).sum();
                (0..3).for_each(|i| out.tangent[3 * a + i][3 * b + i] += value / 64.0);
            }
        }
    }

    /// Directions into which fibres tilt along ξ without shear along η, and the other way round.
    fn ways(&self) -> Option<[Vec3; 2]> {
        let [b1, b2] = self.base;
        Some([b2.cross(&self.mean).try_normalize(0.0)?, self.mean.cross(&b1).try_normalize(0.0)?])
    }
}

/// Displacements of the nodes in each pattern, fibres tilting by one into `ways`.
fn tilted(ways: &[Vec3; 2]) -> [Row; PATTERNS] {
    GOES.map(|(along, signs)| {
        std::array::from_fn(|dof| {
            let node = dof / 3;
            let side = if node < 4 { -1.0 } else { 1.0 };
            side * SIGNS[signs][node % 4] * ways[along][dof % 3]
        })
    })
}

/// The stiffness that the element lacks, row by row, `gain` being `-∫ S³³ dV` [N/mm].
fn lacking(tangent: &[Row; DOFS], fibres: &Fibres, gain: f64) -> Stiffness {
    let diagonal: f64 = (0..DOFS).map(|dof| tangent[dof][dof].abs()).sum();
    let Some(ways) = fibres.ways().filter(|_| gain > GAIN_TOLERANCE_REL * diagonal) else {
        return Stiffness::zeros();
    };
    let patterns = tilted(&ways);
    let dot = |a: &Row, b: &Row| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let mut costs = Stiffness::zeros();
    for (k, pattern) in patterns.iter().enumerate() {
        let forces: Row = std::array::from_fn(|dof| dot(&tangent[dof], pattern));
        (0..PATTERNS).for_each(|l| costs[(l, k)] = dot(&patterns[l], &forces));
    }
    let least = MIN_STIFFNESS_RATIO * gain;
    let spare = 0.5 * (costs + costs.transpose()) - Stiffness::identity() * least;
    if spare.cholesky().is_some() {
        return Stiffness::zeros();
    }
    let eigen = spare.symmetric_eigen();
    let lacks = eigen.eigenvalues.map(|value| (-value).max(0.0));
    let lift =
        eigen.eigenvectors * Stiffness::from_diagonal(&lacks) * eigen.eigenvectors.transpose();
    // Strains of the patterns as they tilt by one.
    let lengths = GOES.map(|(along, _)| fibres.base[along].dot(&ways[along]));
    Stiffness::from_fn(|k, l| lift[(k, l)] / (lengths[k] * lengths[l]))
}

/// Adds to `out`, which holds the force and tangent of the element so far, what keeps its fibres from tilting by turns; `new`
/// is the record of the last evaluation and takes that of this one.
pub(crate) fn steady(input: &ElementInput<'_>, new: &mut [f64], out: &mut ElementMatrices) {
    let old = &input.old_record[input.old_record.len() - RECORD..];
    let fibres = Fibres::new(input);
    let gain = -out.through;
    if input.want == Want::ResidualAndTangent {
        let lacks = lacking(&out.tangent, &fibres, gain);
        new[STIFFNESS..WORK].copy_from_slice(lacks.as_slice());
    }
    let stiffness = Stiffness::from_column_slice(&new[STIFFNESS..WORK]);
    let strains = fibres.strains();
    let change = Strains::from_fn(|k, _| strains[k] - old[k]);
    let left = if old[GAIN] > 0.0 { (gain / old[GAIN]).max(0.0) } else { 0.0 };
    let before = Strains::from_column_slice(&old[STRESS..STIFFNESS]);
    let stress = before * left + stiffness * change;
    let work = old[WORK] + 0.5 * (before + stress).dot(&change);
    new[..STRESS].copy_from_slice(&strains);
    new[STRESS..STIFFNESS].copy_from_slice(stress.as_slice());
    (new[WORK], new[GAIN]) = (work, gain);
    out.artificial_work = work;
    if stress != Strains::zeros() || stiffness != Stiffness::zeros() {
        fibres.add(&stress, &stiffness, input.want, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Mat3;
    use crate::solver::element::{ElementKind, reference_points};
    use crate::solver::material::Material;
    use crate::solver::material::card;

    const SHELL: ElementKind = ElementKind::SolidShell { points: 5, membrane: true };

    /// A distorted element, 3 mm wide and 0.8 mm thick, of steel, and what it keeps.
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

        /// Moved by a gradient, and bent to a curvature along x [1/mm], its modes settled.
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
            &self.now[self.now.len() - RECORD..]
        }
    }

    fn pressed(by: f64) -> Mat3 {
        Mat3::from_diagonal(&Vec3::new(1.0 / (1.0 - by), 1.0, 1.0 - by))
    }

    #[test]
    fn a_pressed_element_holds_its_fibres() {
        for kind in [SHELL, ElementKind::Hex8Enhanced] {
            let mut element = Element::new(kind);
            let (u, out) = element.moved(&pressed(0.1), 0.01);
            let gain = element.record()[GAIN];
            assert!(gain > 0.0, "{kind:?}");
            let input = ElementInput {
                material: element.steel.as_ref(),
                nodes: &element.nodes,
                displacement: &u,
                old_state: &[],
                old_record: &[],
                want: Want::Residual,
            };
            let patterns = tilted(&Fibres::new(&input).ways().unwrap());
            let costs = Stiffness::from_fn(|k, l| {
                let forces =
                    out.tangent.map(|row| (0..DOFS).map(|i| row[i] * patterns[l][i]).sum());
                let forces: Row = forces;
                (0..DOFS).map(|i| patterns[k][i] * forces[i]).sum()
            });
            let least = costs.symmetric_eigenvalues().min();
            assert!(
                (least / gain - MIN_STIFFNESS_RATIO).abs() < 0.1 * MIN_STIFFNESS_RATIO,
                "{kind:?}: {}",
                least / gain
            );
        }
    }

    #[test]
    fn an_element_that_nothing_presses_is_as_it_was() {
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
            let at = element.now.len() - RECORD;
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
    fn strains_do_not_see_a_rotation_and_have_these_derivatives() {
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
