//! Transformation between the right Cauchy-Green tensor and logarithmic strain space (Miehe, Apel & Lambrecht 2002,
//! Comput. Methods Appl. Mech. Engrg. 191, 5383-5425).
//!
//! | symbol | meaning |
//! |---|---|
//! | `C` | right Cauchy-Green tensor, eigenvalues `λ_a`, eigenvectors the columns of `Q` |
//! | `E` | logarithmic strain `½ ln C` |
//! | `T`, `D` | stress and tangent of the law in logarithmic strain space [MPa] |
//! | `S` | second Piola-Kirchhoff stress, `S = T : 2 ∂E/∂C` [MPa] |
//!
//! With `f = ½ ln`, in the eigenframe of `C`: `dE_ab = f[λ_a, λ_b] dC_ab` and
//! `d²E_ab = 2 Σ_c f[λ_a, λ_c, λ_b] dC_ac dC_cb`, where `f[..]` are divided differences. Close eigenvalues use the
//! series of the divided difference, without perturbation and without special cases.
//!
//! Eight points are processed in parallel, one in each SIMD lane.

mod differences;

use pulp::{Arch, Simd, WithSimd};

use self::differences::Differences;
use super::eigen;
use super::law::{LogResponses, Material, MaterialError};
use crate::numbers::algebra::{congruence, multiply};
use crate::numbers::lanes::{Eight, Lane, POINTS};
use crate::numbers::tensor::{Mandel, Mandel66, PAIRS};

const ZERO: Eight = [0.0; POINTS];

/// Stress and tangent of eight points in SIMD lanes, conjugate to the Green-Lagrange strain.
#[derive(Debug, Clone)]
pub struct Responses {
    /// Second Piola-Kirchhoff stress [MPa] by Mandel component.
    pub stress: [Eight; 6],
    /// Tangent `dS/dE_GL` with respect to the Green-Lagrange strain [MPa]; unchanged if not requested.
    pub tangent: [[Eight; 6]; 6],
    /// Stored elastic energy per reference volume [N mm / mm³].
    pub elastic_energy: Eight,
    /// Plastic work per reference volume since the start [N mm / mm³].
    pub plastic_work: Eight,
}

impl Responses {
    /// All zero.
    #[must_use]
    pub fn zero() -> Self {
        Self {
            stress: [ZERO; 6],
            tangent: [[ZERO; 6]; 6],
            elastic_energy: ZERO,
            plastic_work: ZERO,
        }
    }
}

/// Stress and tangent at one point.
#[derive(Debug, Clone, Copy)]
pub struct PointResponse {
    /// Second Piola-Kirchhoff stress [MPa].
    pub stress: Mandel,
    /// Tangent `dS/dE_GL` with respect to the Green-Lagrange strain [MPa].
    pub tangent: Mandel66,
    /// Stored elastic energy per reference volume [N mm / mm³].
    pub elastic_energy: f64,
    /// Plastic work per reference volume since the start [N mm / mm³].
    pub plastic_work: f64,
}

impl Responses {
    /// Response at one of the points.
    #[must_use]
    pub fn at(&self, point: usize) -> PointResponse {
        PointResponse {
            stress: self.stress.map(|of| of[point]),
            tangent: self.tangent.map(|row| row.map(|of| of[point])),
            elastic_energy: self.elastic_energy[point],
            plastic_work: self.plastic_work[point],
        }
    }
}

/// Updates one point at the right Cauchy-Green tensor `c`; without `want_tangent` the tangent is zero.
///
/// # Errors
/// [`MaterialError::Collapsed`] unless `c` is positive definite and finite, and the errors of the law.
pub fn update(
    material: &dyn Material,
    c: &Mandel,
    old: &[f64],
    new: &mut [f64],
    want_tangent: bool,
) -> Result<PointResponse, MaterialError> {
    let c = c.map(|value| [value; POINTS]);
    let mut all = Responses::zero();
    update_points(material, &c, 1, (old, new), want_tangent, &mut all).map_err(|(_, e)| e)?;
    Ok(all.at(0))
}

/// Updates `count` points (at most eight, in the lanes of `c`) with contiguous histories in `old` and `new`; without
/// `want_tangent` the tangents are unchanged.
///
/// # Errors
/// As [`update`], with the index of the first point that failed.
pub fn update_points(
    material: &dyn Material,
    c: &[Eight; 6],
    count: usize,
    (old, new): (&[f64], &mut [f64]),
    want_tangent: bool,
    out: &mut Responses,
) -> Result<(), (usize, MaterialError)> {
    Arch::new().dispatch(Update { material, c, count, old, new, want_tangent, out })
}

struct Update<'a> {
    material: &'a dyn Material,
    c: &'a [Eight; 6],
    count: usize,
    old: &'a [f64],
    new: &'a mut [f64],
    want_tangent: bool,
    out: &'a mut Responses,
}

impl WithSimd for Update<'_> {
    type Output = Result<(), (usize, MaterialError)>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { material, c, count, old, new, want_tangent, out } = self;
        update_lanes(simd, material, c, count, (old, new), want_tangent, out)
    }
}

/// [`update_points`] for one SIMD instruction set.
#[inline(always)]
pub(crate) fn update_lanes<S: Simd>(
    simd: S,
    material: &dyn Material,
    c: &[Eight; 6],
    count: usize,
    (old, new): (&[f64], &mut [f64]),
    want_tangent: bool,
    out: &mut Responses,
) -> Result<(), (usize, MaterialError)> {
    let (values, vectors) = eigenframes(simd, c, count);
    let logs = half_logs(&values, count)?;
    let (strains, to_global) = log_strains(simd, &vectors, &logs, count);
    let mut laws = LogResponses::zero();
    material.update_points(&strains, count, (old, new), &mut laws)?;
    (out.elastic_energy, out.plastic_work) = (laws.elastic_energy, laws.plastic_work);
    let at = Frame { values: &values, logs: &logs, to_global: &to_global };
    for first in Lane::<S>::groups_of(count) {
        at.store_green_lagrange(simd, first, &laws, want_tangent, out);
    }
    Ok(())
}

/// Eigenvalues of `C` and its eigenvectors `Q` by row and column.
#[inline(always)]
fn eigenframes<S: Simd>(simd: S, c: &[Eight; 6], count: usize) -> ([Eight; 3], [[Eight; 3]; 3]) {
    let (mut values, mut vectors) = ([ZERO; 3], [[ZERO; 3]; 3]);
    for first in Lane::<S>::groups_of(count) {
        let (l, q) = eigen::eigen(simd, Lane::load_all(simd, c, first));
        for a in 0..3 {
            l[a].store(&mut values[a], first);
            for i in 0..3 {
                q[i][a].store(&mut vectors[i][a], first);
            }
        }
    }
    (values, vectors)
}

/// `½ ln` of the eigenvalues.
///
/// # Errors
/// [`MaterialError::Collapsed`] at the first point with an eigenvalue that is not positive and finite.
#[inline(always)]
fn half_logs(values: &[Eight; 3], count: usize) -> Result<[Eight; 3], (usize, MaterialError)> {
    let mut logs = [ZERO; 3];
    for point in 0..count {
        for a in 0..3 {
            let value = values[a][point];
            if !(value > 0.0 && value.is_finite()) {
                return Err((point, MaterialError::Collapsed { value }));
            }
            logs[a][point] = 0.5 * value.ln();
        }
    }
    Ok(logs)
}

/// Logarithmic strains, and the maps of tensors from the eigenframes to the global axes.
#[inline(always)]
fn log_strains<S: Simd>(
    simd: S,
    [x, y, z]: &[[Eight; 3]; 3],
    logs: &[Eight; 3],
    count: usize,
) -> ([Eight; 6], [[Eight; 6]; 6]) {
    let mut strains = [ZERO; 6];
    let mut to_global = [[ZERO; 6]; 6];
    for first in Lane::<S>::groups_of(count) {
        let q = [
            Lane::load_all(simd, x, first),
            Lane::load_all(simd, y, first),
            Lane::load_all(simd, z, first),
        ];
        let log = Lane::load_all(simd, logs, first);
        let map = congruence(simd, &q);
        for row in 0..6 {
            let [x, y, z, ..] = map[row];
            z.mul_add(log[2], y.mul_add(log[1], x * log[0])).store(&mut strains[row], first);
            for column in 0..6 {
                map[row][column].store(&mut to_global[row][column], first);
            }
        }
    }
    (strains, to_global)
}

/// Eigenframes of `C`.
struct Frame<'a> {
    values: &'a [Eight; 3],
    /// Half the logarithms of the values.
    logs: &'a [Eight; 3],
    to_global: &'a [[Eight; 6]; 6],
}

impl Frame<'_> {
    /// Stress and tangent with respect to the Green-Lagrange strain from those in logarithmic strain space:
    /// `S = P T` with `P = R diag(2 f[a,b]) Rᵀ`, its derivative `P D P` and the second-order term.
    #[inline(always)]
    fn store_green_lagrange<S: Simd>(
        &self,
        simd: S,
        first: usize,
        laws: &LogResponses,
        want_tangent: bool,
        out: &mut Responses,
    ) {
        let values = Lane::load_all(simd, self.values, first);
        let differences = Differences::new(simd, values, Lane::load_all(simd, self.logs, first));
        let maps = FrameMaps::new(simd, self.to_global, first);
        let stress = Lane::load_all(simd, &laws.stress, first);
        // T in the eigenframe is kept for the second-order term.
        let (mut t, mut s) = (stress, stress);
        for i in 0..6 {
            t[i] = Lane::dot(&maps.to_eigenframe[i], &stress);
            s[i] = differences.first[i] * t[i];
        }
        for (row, out) in maps.map.iter().zip(&mut out.stress) {
            Lane::dot(row, &s).store(out, first);
        }
        if want_tangent {
            maps.store_tangent(simd, first, (&differences, &t), &laws.tangent, &mut out.tangent);
        }
    }
}

/// Maps of tensors from the eigenframes to the global axes, in SIMD lanes, and their transposes.
struct FrameMaps<S: Simd> {
    map: [[Lane<S>; 6]; 6],
    to_eigenframe: [[Lane<S>; 6]; 6],
}

impl<S: Simd> FrameMaps<S> {
    #[inline(always)]
    fn new(simd: S, to_global: &[[Eight; 6]; 6], first: usize) -> Self {
        let zero = Lane::splat(simd, 0.0);
        let (mut map, mut to_eigenframe) = ([[zero; 6]; 6], [[zero; 6]; 6]);
        for i in 0..6 {
            map[i] = Lane::load_all(simd, &to_global[i], first);
            for k in 0..6 {
                to_eigenframe[k][i] = map[i][k];
            }
        }
        Self { map, to_eigenframe }
    }

    /// `P D P` plus the second-order term for the points of the SIMD group at `first`; `t` is their `T` in the
    /// eigenframe.
    #[inline(always)]
    fn store_tangent(
        &self,
        simd: S,
        first: usize,
        (differences, t): (&Differences<S>, &[Lane<S>; 6]),
        law: &[[Eight; 6]; 6],
        out: &mut [[Eight; 6]; 6],
    ) {
        let zero = Lane::splat(simd, 0.0);
        let mut rotated = [[zero; 6]; 6];
        for (row, from) in rotated.iter_mut().zip(law) {
            *row = multiply(&Lane::load_all(simd, from, first), &self.map);
        }
        let mut eigen_tangent = [[zero; 6]; 6];
        for (i, row) in eigen_tangent.iter_mut().enumerate() {
            *row = multiply(&self.to_eigenframe[i], &rotated);
            for (value, factor) in row.iter_mut().zip(differences.first) {
                *value = *value * (differences.first[i] * factor);
            }
        }
        add_second_order(&mut eigen_tangent, differences, t);
        for (row, rotated) in eigen_tangent.iter().zip(&mut rotated) {
            *rotated = multiply(row, &self.to_eigenframe);
        }
        for (row, out) in self.map.iter().zip(out) {
            for (value, out) in multiply(row, &rotated).into_iter().zip(out) {
                value.store(out, first);
            }
        }
    }
}

/// Adds `4 T : ∂²E/∂C²`, everything in the eigenframe.
///
/// For unit Mandel directions `I = (a,b)`, `J = (c,d)` the bilinear form is
/// `Σ_pqr T_pr f[p,q,r] (H_pq G_qr + G_pq H_qr)`.
#[inline(always)]
fn add_second_order<S: Simd>(
    tangent: &mut [[Lane<S>; 6]; 6],
    differences: &Differences<S>,
    t: &[Lane<S>; 6],
) {
    let Differences { twice, distinct, .. } = differences;
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let [t01, t12, t20] = [t[3] * half, t[4] * half, t[5] * half];
    let t = [[t[0], t01, t20], [t01, t[1], t12], [t20, t12, t[2]]];
    // Diagonal-diagonal: H = e_a e_a, only I = J contributes: 2 f[a,a,a] T_aa.
    for a in 0..3 {
        tangent[a][a] = tangent[a][a] + twice[a][a] * t[a][a] * 8.0;
    }
    for shear in 3..6 {
        let (a, b) = PAIRS[shear];
        // Diagonal c with shear (a, b), nonzero only for c in {a, b}: √2 T_ab f[c,c,other].
        for (c, other) in [(a, b), (b, a)] {
            let value = twice[c][other] * t[a][b] * (4.0 * std::f64::consts::SQRT_2);
            tangent[c][shear] = tangent[c][shear] + value;
            tangent[shear][c] = tangent[shear][c] + value;
        }
        // Shear with itself: T_aa f[a,b,a] + T_bb f[b,a,b].
        let value = (t[a][a] * twice[a][b] + t[b][b] * twice[b][a]) * 4.0;
        tangent[shear][shear] = tangent[shear][shear] + value;
    }
    // Two different shears share one index q: T_pr f[p,q,r].
    for (i, j, p, r) in [(3, 4, 0, 2), (4, 5, 1, 0), (3, 5, 1, 2)] {
        let value = t[p][r] * *distinct * 4.0;
        tangent[i][j] = tangent[i][j] + value;
        tangent[j][i] = tangent[j][i] + value;
    }
}
